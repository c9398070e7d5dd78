//! The ramp weakens the coupling, not what the hand is told of it: the tissue is pulled by what the hand feels.

use crate::rig::{Grip, Rig, TISSUE_N_PER_M};
use haptic_server::servo::state_machine::Mode;
use sim_core::vector::Vec3;

/// Kvc and k_line of the defaults, newtons per metre.
const COUPLING_N_PER_M: f64 = 400.0;
/// Rounding of a sum of forces of some newtons.
const ROUNDING_N: f64 = 1e-12;
/// The low-pass (400 Hz) follows 0.4 ms behind; these hands change the force by less than 30 N/s.
const FILTER_N: f64 = 0.012;
/// Drag and damping of a point that follows a slow hand, newtons.
const QUASI_STATIC_N: f64 = 0.02;

/// A servo at the start of its ramp that holds or pulls a point.
fn ramping(grip: Grip) -> Rig {
    let mut rig = Rig::new();
    rig.grip = grip;
    while rig.servo.mode() != Mode::Ramp {
        rig.run(1);
    }
    rig
}

#[test]
fn at_every_tick_of_the_ramp_the_points_are_pulled_by_what_the_hand_feels() {
    for (grip, way_m) in [(Grip::Held, Vec3::new(0.005, 0.0, 0.0)), (Grip::Pulled, Vec3::new(0.0, 0.0, 0.008))] {
        let mut rig = ramping(grip);
        let mut strongest = 0.0_f64;
        while rig.servo.mode() == Mode::Ramp {
            // Out within the first fifth of a second, then still.
            if strongest == 0.0 {
                rig.move_stylus(way_m, 200);
            }
            rig.run(1);
            let state = rig.servo.state();
            let on_points: Vec3 = state.handles.iter().map(|h| Vec3::from(h.applied_force_n)).sum();
            let wanted = Vec3::from(state.devices[0].unclipped_force_n);
            assert!((on_points + wanted).norm() < ROUNDING_N, "{grip:?}: {on_points} on the points, {wanted} wanted");
            assert!((rig.last_force - wanted).norm() < FILTER_N, "{grip:?}: {} sent, {wanted} wanted", rig.last_force);
            strongest = strongest.max(wanted.norm());
        }
        assert!(strongest > 0.7, "{grip:?}: the pull never became more than {strongest} N");
    }
}

#[test]
fn half_way_the_tissue_feels_half_the_coupling() {
    let mut rig = ramping(Grip::Held);
    rig.move_stylus(Vec3::new(0.003, 0.0, 0.0), 100);
    rig.run(900);
    let half = 0.5 * COUPLING_N_PER_M;
    let expected = 0.003 * half * TISSUE_N_PER_M / (half + TISSUE_N_PER_M);
    let force = rig.last_force;
    assert!((force - Vec3::new(-expected, 0.0, 0.0)).norm() < QUASI_STATIC_N, "{force}, expected {expected}");
    let node_m = rig.servo.state().handles[0].position_m[0] - 0.004;
    assert!((node_m * TISSUE_N_PER_M - expected).abs() < QUASI_STATIC_N, "{node_m} m");
}

#[test]
fn a_hand_that_moves_through_the_ramp_gains_no_more_than_one_stretch() {
    const WAY_M: f64 = 0.005;
    let mut rig = ramping(Grip::Held);
    let (start, middle) = (rig.servo.state().energy_to_hand_j, rig.sample.position_m);
    let mut tick = 0_u32;
    while rig.servo.mode() == Mode::Ramp {
        tick += 1;
        let phase = f64::from(tick) * 1e-3 * 2.0 * std::f64::consts::TAU;
        rig.sample.position_m = middle + Vec3::new(0.0, WAY_M * phase.sin(), 0.0);
        rig.sample.velocity_m_per_s = Vec3::new(0.0, WAY_M * 2.0 * std::f64::consts::TAU * phase.cos(), 0.0);
        rig.run(1);
    }
    // Each way back is against a stiffer spring than the way out; the differences add up to the whole spring at most.
    let stretch_j = 0.5 * COUPLING_N_PER_M * TISSUE_N_PER_M / (COUPLING_N_PER_M + TISSUE_N_PER_M) * WAY_M * WAY_M;
    let given = rig.servo.state().energy_to_hand_j - start;
    assert!(given < stretch_j, "{given} J given to the hand, one stretch is {stretch_j} J");
}
