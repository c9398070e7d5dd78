//! What the hand feels of a point it holds and of a line it pulls, against closed forms.

use crate::rig::{Grip, Rig, TISSUE_N_PER_M, ZERO_N};
use haptic_server::servo::events::EventKind;
use protocol::tissue_port::HANDLE_HELD;
use sim_core::vector::Vec3;

/// Kvc and k_line of the defaults, newtons per metre.
const COUPLING_N_PER_M: f64 = 400.0;
/// A settled force against its closed form: the dynamics have decayed to this, newtons.
const SETTLED_N: f64 = 1e-6;

#[test]
fn taking_a_point_makes_no_force() {
    let mut rig = Rig::active();
    rig.grip = Grip::Held;
    rig.epoch += 1;
    let events = rig.run(100);
    assert!(events.contains(&EventKind::HandleChanged { handle: 0, mode: HANDLE_HELD, pair: 0 }));
    assert!(rig.last_force.norm() < ZERO_N, "{}", rig.last_force);
    // The stylus is 20 mm above the point; the point stays where the tissue has it.
    assert!((rig.servo.state().handles[0].position_m[0] - 0.004).abs() < 1e-9);
}

#[test]
fn a_held_point_feels_like_coupling_and_tissue_in_series() {
    let mut rig = Rig::active();
    rig.grip = Grip::Held;
    rig.run(20);
    rig.move_stylus(Vec3::new(0.003, 0.0, 0.0), 100);
    rig.run(500);
    let series = COUPLING_N_PER_M * TISSUE_N_PER_M / (COUPLING_N_PER_M + TISSUE_N_PER_M);
    let force = rig.last_force;
    assert!((force - Vec3::new(-0.003 * series, 0.0, 0.0)).norm() < SETTLED_N, "{force}");
    let node = rig.servo.state().handles[0].position_m[0] - 0.004;
    assert!((node - 0.003 * COUPLING_N_PER_M / (COUPLING_N_PER_M + TISSUE_N_PER_M)).abs() < 1e-8);
}

#[test]
fn a_pulled_line_is_in_balance_with_both_points_and_the_hand() {
    let mut rig = Rig::active();
    rig.grip = Grip::Pulled;
    rig.run(20);
    // Straight up above the right point: L₀ = 28 mm is the length at capture.
    rig.move_stylus(Vec3::new(0.0, 0.0, 0.006), 100);
    rig.run(1_000);
    let state = rig.servo.state();
    let [right, left] = [0, 1].map(|h| Vec3::from(state.handles[h].position_m));
    let stylus = rig.sample.position_m;
    let length = (stylus - right).norm() + (right - left).norm();
    let tension = COUPLING_N_PER_M * (length - 0.028);
    assert!(tension > 0.3, "{tension}");
    assert!((state.handles[0].line_tension_n - tension).abs() < SETTLED_N);
    assert!((rig.last_force.norm() - tension).abs() < SETTLED_N);
    // The hand is drawn back along the line.
    assert!((rig.last_force.normalize() - (right - stylus).normalize()).norm() < 1e-6);
    // Each point is in balance: tissue against hand and link.
    let to_stylus = (stylus - right).normalize();
    let to_left = (left - right).normalize();
    let on_right = (to_stylus + to_left) * tension - (right - Vec3::new(0.004, 0.0, 0.0)) * TISSUE_N_PER_M;
    let on_left = -to_left * tension - (left - Vec3::new(-0.004, 0.0, 0.0)) * TISSUE_N_PER_M;
    assert!(on_right.norm() < SETTLED_N && on_left.norm() < SETTLED_N, "{on_right} {on_left}");
    // The pull closes the wound.
    assert!((right - left).norm() < 0.008);
}

#[test]
fn taking_the_line_makes_no_tension_though_the_stylus_went_on() {
    let mut rig = Rig::active();
    // 6 mm farther than where the solver saw the hand take the line: 2.4 N at once if L₀ came from there.
    rig.move_stylus(Vec3::new(0.0, 0.0, 0.006), 100);
    rig.grip = Grip::Pulled;
    rig.epoch += 1;
    rig.run(200);
    assert!(rig.last_force.norm() < ZERO_N, "{}", rig.last_force);
    rig.move_stylus(Vec3::new(0.0, 0.0, 0.003), 100);
    assert!(rig.servo.state().handles[0].line_tension_n > 0.1);
}

#[test]
fn a_slack_line_pulls_nothing() {
    let mut rig = Rig::active();
    rig.grip = Grip::Pulled;
    rig.run(20);
    rig.move_stylus(Vec3::new(0.0, 0.0, -0.005), 100);
    rig.run(200);
    assert!(rig.last_force.norm() < ZERO_N);
    assert_eq!(rig.servo.state().handles[0].line_tension_n, 0.0);
}

#[test]
fn a_new_epoch_keeps_the_point_and_its_force() {
    let mut rig = Rig::holding();
    let (force, node) = (rig.last_force, rig.servo.state().handles[0].position_m);
    rig.epoch += 1;
    for _ in 0..50 {
        rig.run(1);
        assert!((rig.last_force - force).norm() < 1e-3);
    }
    assert!((Vec3::from(rig.servo.state().handles[0].position_m) - Vec3::from(node)).norm() < 1e-6);
}

#[test]
fn letting_go_releases_the_force() {
    let mut rig = Rig::holding();
    rig.grip = Grip::Free;
    rig.run(30);
    assert_eq!(rig.last_force, Vec3::zeros());
}
