//! What the hand feels when the solver is late, stands still, dies, and comes back.

use crate::rig::{Grip, Rig, Solver, ZERO_N};
use haptic_server::servo::events::EventKind;
use haptic_server::servo::ladder::Rung;
use haptic_server::servo::state_machine::Mode;
use sim_core::vector::Vec3;

/// Ticks until the force was zero and the mode Monitor, beginning now.
fn ticks_to_zero(rig: &mut Rig) -> u64 {
    (1..2_000)
        .find(|_| {
            rig.run(1);
            rig.last_force.norm() < ZERO_N && rig.servo.mode() == Mode::Monitor
        })
        .expect("the force goes to zero")
}

#[test]
fn after_a_known_death_the_force_is_zero_within_120_ms() {
    for grip in [Grip::Held, Grip::Pulled] {
        let mut rig = Rig::holding();
        rig.grip = grip;
        rig.run(10);
        rig.move_stylus(Vec3::new(0.0, 0.0, 0.008), 80);
        assert!(rig.last_force.norm() > 0.5, "{grip:?} {}", rig.last_force);
        rig.solver = Solver::Stands;
        // The supervisor's pipe tells it at once; the decay is 100 ms, filter and slew add a few ticks.
        rig.orders.solver_deaths += 1;
        let ticks = ticks_to_zero(&mut rig);
        assert!(ticks <= 120, "{ticks} ms");
    }
}

#[test]
fn a_solver_that_only_stops_is_followed_down_the_ladder() {
    let mut rig = Rig::holding();
    while rig.servo.state().port_age_ns != 0 {
        rig.run(1);
    }
    rig.solver = Solver::Stands;
    let mut rungs = Vec::new();
    for ms in 1..=400 {
        for event in rig.run(1) {
            if let EventKind::RungChanged { to, .. } = event {
                rungs.push((ms, to));
            }
        }
        if ms == 249 {
            // Standing still with a still hand: the coupling's force is held.
            assert!(rig.last_force.norm() > 0.7);
        }
    }
    assert_eq!(rungs, [(11, Rung::OneRing), (51, Rung::Frozen), (251, Rung::Decay), (351, Rung::None)]);
    assert!(rig.last_force.norm() < ZERO_N);
    assert_eq!(rig.servo.mode(), Mode::Monitor);
    assert_eq!(rig.servo.state().missed, 0);
}

#[test]
fn coming_back_passes_the_ramp() {
    let mut rig = Rig::holding();
    rig.solver = Solver::Stands;
    ticks_to_zero(&mut rig);
    rig.run(500);
    rig.solver = Solver::Runs;
    rig.epoch += 1;
    rig.grip = Grip::Free;
    let events = rig.run(2_300);
    let modes: Vec<_> = events
        .iter()
        .filter_map(|e| if let EventKind::ModeChanged { to, .. } = e { Some(*to) } else { None })
        .collect();
    assert_eq!(modes, [Mode::Armed, Mode::Ramp, Mode::Active]);
}

#[test]
fn a_return_in_mid_decay_does_not_bring_the_force_back() {
    let mut rig = Rig::holding();
    rig.orders.solver_deaths += 1;
    // The solver goes on publishing: it was restarted at once.
    let mut last = rig.last_force.norm();
    for _ in 0..110 {
        rig.run(1);
        assert!(rig.last_force.norm() <= last + 1e-9);
        last = rig.last_force.norm();
    }
    rig.run(10);
    assert!(rig.last_force.norm() < ZERO_N);
    // The grip slipped while the hand was given no force: it comes back by the ramp, and pulls at nothing.
    rig.run(1_000);
    assert_eq!(rig.servo.mode(), Mode::Ramp);
    assert!(rig.last_force.norm() < ZERO_N, "{}", rig.last_force);
}

#[test]
fn a_slow_solver_costs_no_energy_to_the_hand() {
    // Ports every 50 ms while the hand moves back and forth at 2 Hz: the hand must not gain.
    let mut rig = Rig::holding();
    let start = rig.servo.state().energy_to_hand_j;
    let middle = rig.sample.position_m;
    rig.solver_ticks = 50;
    for tick in 0..4_000_u32 {
        let phase = f64::from(tick) * 1e-3 * 2.0 * std::f64::consts::TAU;
        rig.sample.position_m = middle + Vec3::new(0.0, 0.003 * phase.sin(), 0.0);
        rig.sample.velocity_m_per_s = Vec3::new(0.0, 0.003 * 2.0 * std::f64::consts::TAU * phase.cos(), 0.0);
        rig.run(1);
    }
    let given = rig.servo.state().energy_to_hand_j - start;
    // 2 mJ is the bound that every trace has to keep.
    assert!(given < 2e-3, "{given} J given to the hand");
    assert_eq!(rig.servo.mode(), Mode::Active);
}
