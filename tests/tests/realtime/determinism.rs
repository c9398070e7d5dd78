//! Equal inputs give equal bits.

use crate::rig::{Grip, Rig, Solver};
use protocol::servo_state::ServoState;
use sim_core::vector::Vec3;

/// Every number that the servo says, as bits.
fn bits(state: &ServoState) -> Vec<u64> {
    let device = &state.devices[0];
    let numbers = [device.position_m, device.velocity_m_per_s, device.force_n, device.unclipped_force_n].concat();
    let handles = state.handles.iter().flat_map(|h| {
        [h.position_m, h.velocity_m_per_s, h.applied_force_n].concat().into_iter().chain([h.line_tension_n])
    });
    let counts =
        [state.ticks, state.port_sequence, state.port_age_ns, u64::from(state.mode), u64::from(state.port_rung)];
    numbers.into_iter().chain(handles).chain([state.energy_to_hand_j]).map(f64::to_bits).chain(counts).collect()
}

/// A run with an irregular hand, a stall of the solver and both grips.
fn run() -> Vec<Vec<u64>> {
    let mut rig = Rig::active();
    let mut noise = 1_u64;
    let mut said = Vec::new();
    for tick in 0..3_000_u64 {
        // Knuth's MMIX generator: the same irregular path each time.
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let step = ((noise >> 33) % 201) as f64 - 100.0;
        rig.sample.position_m += Vec3::new(0.0, step * 1e-6, (tick % 7) as f64 * 1e-7);
        match tick {
            100 => rig.grip = Grip::Held,
            1_200 => rig.grip = Grip::Pulled,
            1_800 => rig.solver = Solver::Stands,
            1_950 => rig.solver = Solver::Runs,
            _ => {}
        }
        rig.tick();
        said.push(bits(rig.servo.state()));
    }
    said
}

#[test]
fn two_runs_say_the_same_bits() {
    let (first, second) = (run(), run());
    assert!(first.iter().any(|bits| bits[6] != 0), "a force was rendered");
    assert_eq!(first, second);
}
