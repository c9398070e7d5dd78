//! The force stays finite, within the peak and within the slew, whatever device and solver say.

use crate::rig::{Grip, MS, OMNI, Rig, port};
use haptic_server::device::{DeviceSample, SampleQuality, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::tick::{Orders, TickInput};
use proptest::prelude::*;
use protocol::tissue_port::TissuePort;
use protocol::wire::Message;
use sim_core::vector::Vec3;

/// Slew limit of the defaults, newtons per second.
const SLEW_N_PER_S: f64 = 500.0;
/// One rounding of each of the two forces that are subtracted.
const ROUNDING_N: f64 = 4.0 * f64::EPSILON * 3.3;

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -0.05..0.05f64,
        1 => -1e6..1e6f64,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(1e308),
        1 => Just(5e-324),
    ]
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(number())
}

prop_compose! {
    fn sample()(position in vector(), velocity in vector(), turn in number(), buttons in any::<u32>(), kind in 0..12u32)
        -> DeviceSample {
        let quality = match kind { 0 => SampleQuality::Lost, 1 | 2 => SampleQuality::Stale, _ => SampleQuality::Fresh };
        let calm = kind > 5;
        DeviceSample {
            time_ns: 0,
            position_m: if calm { Vec3::from(position).map(|p| p.clamp(-0.002, 0.002)) } else { Vec3::from(position) },
            velocity_m_per_s: if calm { Vec3::zeros() } else { Vec3::from(velocity) },
            orientation: [0.0, 0.0, if calm { 0.0 } else { turn }, 1.0],
            buttons,
            quality,
        }
    }
}

prop_compose! {
    /// A port whose header is in order but whose numbers may be anything.
    fn rough_port()(
        kind in 0..3u32, epoch in 0..4u32, position in vector(), force in vector(), stiffness in prop::array::uniform6(number()),
        scale in -1e4..1e4f64, mass in number(), rest in number(), offset_ms in 0..400u64,
    ) -> (TissuePort, u64) {
        let grip = [Grip::Free, Grip::Held, Grip::Pulled][kind as usize];
        let mut rough = port(grip, epoch, 1, 1);
        rough.line_rest_length_m = rest;
        for handle in &mut rough.handles[..2] {
            handle.position_m = position;
            handle.force_n = force;
            handle.stiffness_n_per_m = stiffness.map(|s| s * scale);
            handle.mass_kg = if mass.is_finite() { mass.abs() } else { 0.002 };
        }
        (rough, offset_ms)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn garbage_never_breaks_the_bounds(
        steps in prop::collection::vec((sample(), proptest::option::of(rough_port()), 0..30u64, 0..20u32), 1..200)
    ) {
        let mut rig = Rig::holding();
        let mut rearms = 0;
        let (mut sequence, mut before) = (10_000, rig.last_force);
        for (sample, rough, gap, luck) in steps {
            let missed = if luck == 0 { gap } else { 0 };
            rig.now_ns += (missed + 1) * MS;
            rearms += u32::from(luck == 1);
            let new_port = rough.map(|(mut port, age_ms)| {
                sequence += 1;
                port.publish_ns = rig.now_ns.saturating_sub(if luck < 15 { 0 } else { age_ms * MS });
                port.stamp(sequence, port.publish_ns);
                port
            });
            let dt_s = (missed + 1) as f64 * 1e-3;
            let input = TickInput {
                time: TickTime { scheduled_ns: rig.now_ns, now_ns: rig.now_ns, dt_s },
                sample: &sample,
                new_port: new_port.as_ref(),
                orders: Orders { rearms, solver_deaths: u32::from(luck == 2), ..Orders::default() },
                wakefulness: if luck == 3 { Wakefulness::Suspended } else { Wakefulness::Awake },
            };
            let force = rig.servo.tick(&input).command.force_n;
            prop_assert!(force.iter().all(|f| f.is_finite()));
            prop_assert!(force.norm() <= OMNI.peak_force_n);
            prop_assert!((force - before).norm() <= SLEW_N_PER_S * dt_s + ROUNDING_N);
            // Whatever came in: what goes out on the wire can be read.
            prop_assert_eq!(rig.servo.state().validate(), Ok(()));
            before = force;
        }
    }
}
