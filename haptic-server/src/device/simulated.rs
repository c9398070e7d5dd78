//! A haptic device that does not exist: a stylus with friction, held by a hand, measured by encoders.
//!
//! Each tick runs the mechanics of [`StylusState`] in sub-steps of 50 µs (20 per millisecond) from the
//! last scheduled time to this one, under the force commanded last, with the hand's wish going evenly from its
//! last to its new place; then the encoders measure ([`encoder`]) and the velocity filter follows. The
//! limits 3.3 N, 0.88 N and 500 N/m are the Omni's figures; mass, friction and hand are model parameters.
//! SI units, scene frame; the result depends on scheduled times only, and samples are stamped with them; no heap in
//! `sample` and `command`.
//! Deliberately absent: joint limits, motor temperature, failures.

use crate::device::frame::SceneFromDevice;
use crate::device::stylus::{StylusParams, StylusState};
use crate::device::velocity_filter::{DEFAULT_CUTOFF_HZ, VelocityFilter};
use crate::device::{
    Device, DeviceCommand, DeviceLimits, DeviceSample, HandView, PulledDevice, SampleQuality, ServoRoom, TickTime,
    encoder, omni, run_pulled,
};
use crate::hand::{Hand, HandTarget};
use sim_core::vector::Vec3;

/// Length of a sub-step, nanoseconds (20 in a tick of 1 kHz).
const SUBSTEP_NS: u64 = 50_000;
/// Sub-steps in one tick at most: after a longer stall the model's time stands still instead of jumping.
const MAX_SUBSTEPS: u64 = 400;
/// Gimbal angles of the stylus as the hand holds it: tip down and forward, radians.
const HELD_GIMBAL_RAD: [f64; 3] = [0.0, 0.8, 0.0];

/// What the simulated device is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedDeviceParams {
    /// Mass, friction and grip (model parameters).
    pub stylus: StylusParams,
    /// What the device can do (device facts).
    pub limits: DeviceLimits,
    /// Corner of the velocity filter, hertz.
    pub velocity_cutoff_hz: f64,
}

impl Default for SimulatedDeviceParams {
    fn default() -> Self {
        Self { stylus: StylusParams::default(), limits: DeviceLimits::OMNI, velocity_cutoff_hz: DEFAULT_CUTOFF_HZ }
    }
}

/// Stylus, friction, encoders and the hand that holds it.
pub struct SimulatedDevice {
    name: &'static str,
    params: SimulatedDeviceParams,
    frame: SceneFromDevice,
    hand: Box<dyn Hand>,
    filter: VelocityFilter,
    stylus: StylusState,
    force_n: Vec3,
    wish: HandTarget,
    /// Scheduled time up to which the model has run, and its own time, nanoseconds.
    clock: Option<Clock>,
    sample: DeviceSample,
}

#[derive(Clone, Copy)]
struct Clock {
    scheduled_ns: u64,
    model_ns: u64,
}

impl SimulatedDevice {
    /// A device at rest; the first tick puts the stylus where the hand wants it.
    #[must_use]
    pub fn new(params: SimulatedDeviceParams, frame: SceneFromDevice, hand: Box<dyn Hand>) -> Self {
        let start_m = frame.translation_m();
        Self {
            name: "simulated",
            params,
            frame,
            hand,
            filter: VelocityFilter::new(params.velocity_cutoff_hz),
            stylus: StylusState { position_m: start_m, velocity_m_per_s: Vec3::zeros() },
            force_n: Vec3::zeros(),
            wish: HandTarget { position_m: start_m, buttons: 0 },
            clock: None,
            sample: DeviceSample::resting(start_m),
        }
    }

    /// The same device under another name in reports: that of its hand.
    #[must_use]
    pub fn named(self, name: &'static str) -> Self {
        Self { name, ..self }
    }

    /// True motion of the stylus (not what the encoders say), scene frame.
    #[must_use]
    pub fn true_state(&self) -> StylusState {
        self.stylus
    }

    /// Asks the hand; a wish that is not finite is ignored.
    fn ask(&mut self, model_ns: u64, view: &HandView) -> HandTarget {
        let wish = self.hand.target(model_ns as f64 * 1e-9, view);
        if wish.position_m.iter().all(|c| c.is_finite()) { wish } else { self.wish }
    }

    /// Runs the model to the scheduled time; returns the time it ran, seconds.
    fn advance(&mut self, scheduled_ns: u64, view: &HandView) -> f64 {
        let Some(clock) = self.clock else {
            self.clock = Some(Clock { scheduled_ns, model_ns: 0 });
            self.wish = self.ask(0, view);
            self.stylus.position_m = self.wish.position_m;
            return 0.0;
        };
        let due = scheduled_ns.saturating_sub(clock.scheduled_ns) / SUBSTEP_NS;
        let count = due.min(MAX_SUBSTEPS);
        if count == 0 {
            return 0.0;
        }
        let model_ns = clock.model_ns + count * SUBSTEP_NS;
        self.clock = Some(Clock { scheduled_ns: clock.scheduled_ns + due * SUBSTEP_NS, model_ns });
        let from = self.wish.position_m;
        self.wish = self.ask(model_ns, view);
        let elapsed_s = (count * SUBSTEP_NS) as f64 * 1e-9;
        let wish_velocity = (self.wish.position_m - from) / elapsed_s;
        let substep_s = SUBSTEP_NS as f64 * 1e-9;
        for i in 0..count {
            let wish_m = from + (self.wish.position_m - from) * (i as f64 / count as f64);
            self.stylus.step(&self.params.stylus, wish_m, wish_velocity, self.force_n, substep_s);
        }
        elapsed_s
    }
}

impl PulledDevice for SimulatedDevice {
    fn sample(&mut self, time: TickTime, view: &HandView) -> DeviceSample {
        let first = self.clock.is_none();
        let elapsed_s = self.advance(time.scheduled_ns, view);
        if elapsed_s == 0.0 && !first {
            self.sample = DeviceSample { time_ns: time.scheduled_ns, quality: SampleQuality::Stale, ..self.sample };
            return self.sample;
        }
        let measured = encoder::measure(self.frame.inverse_point(self.stylus.position_m));
        let position_m = self.frame.point(measured.position_m);
        self.sample = DeviceSample {
            time_ns: time.scheduled_ns,
            position_m,
            velocity_m_per_s: self.filter.update(position_m, elapsed_s),
            orientation: self.frame.orientation(&omni::stylus_rotation(measured.joints, Vec3::from(HELD_GIMBAL_RAD))),
            buttons: self.wish.buttons,
            quality: SampleQuality::Fresh,
        };
        self.sample
    }

    fn command(&mut self, command: DeviceCommand) {
        self.force_n = self.params.limits.saturate(command.force_n);
    }
}

impl Device for SimulatedDevice {
    fn name(&self) -> &str {
        self.name
    }

    fn limits(&self) -> DeviceLimits {
        self.params.limits
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        run_pulled(self, room);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Largest error of a measured position: half a count of each joint.
    const ENCODER_M: f64 = 8e-5;

    struct Still(Vec3);

    impl Hand for Still {
        fn target(&mut self, _time_s: f64, _view: &HandView) -> HandTarget {
            HandTarget { position_m: self.0, buttons: 0 }
        }
    }

    fn device(params: SimulatedDeviceParams, wish_m: Vec3) -> SimulatedDevice {
        let mut device =
            SimulatedDevice::new(params, SceneFromDevice::workspace_at(Vec3::zeros()), Box::new(Still(wish_m)));
        device.sample(at(0), &HandView::unseen());
        device
    }

    fn at(tick: u64) -> TickTime {
        TickTime { scheduled_ns: tick * 1_000_000, now_ns: tick * 1_000_000, dt_s: 1e-3 }
    }

    /// Where the stylus comes to rest when the hand wants to be 8 mm deep in a wall of 500 N/m at x = 0.
    fn rest_against_wall(params: SimulatedDeviceParams) -> f64 {
        let mut device = device(params, Vec3::new(-0.008, 0.0, 0.0));
        device.stylus.position_m = Vec3::new(0.01, 0.0, 0.0);
        for tick in 1..3000 {
            let x = device.sample(at(tick), &HandView::unseen()).position_m.x;
            device.command(DeviceCommand { force_n: Vec3::new(500.0 * (-x).max(0.0), 0.0, 0.0) });
        }
        device.true_state().position_m.x
    }

    #[test]
    fn the_hand_rests_on_a_spring_wall_where_statics_puts_it() {
        let expected_m = -300.0 * 0.008 / (300.0 + 500.0);
        let stylus = StylusParams { coulomb_friction_n: 0.0, ..StylusParams::default() };
        let smooth = rest_against_wall(SimulatedDeviceParams { stylus, ..SimulatedDeviceParams::default() });
        assert!((smooth - expected_m).abs() < ENCODER_M, "{smooth} against {expected_m}");
        let band_m = 0.26 / (300.0 + 500.0);
        let rough = rest_against_wall(SimulatedDeviceParams::default());
        assert!((rough - expected_m).abs() < band_m + ENCODER_M, "{rough} outside the friction band");
    }

    struct Steady;

    impl Hand for Steady {
        fn target(&mut self, time_s: f64, _view: &HandView) -> HandTarget {
            HandTarget { position_m: Vec3::new(0.04 * time_s, 0.0, 0.0), buttons: 0 }
        }
    }

    #[test]
    fn a_steady_hand_is_followed_without_lag_between_ticks_too() {
        let stylus =
            StylusParams { coulomb_friction_n: 0.0, viscous_friction_n_s_per_m: 0.0, ..StylusParams::default() };
        let params = SimulatedDeviceParams { stylus, ..SimulatedDeviceParams::default() };
        let frame = SceneFromDevice::workspace_at(Vec3::zeros());
        let mut device = SimulatedDevice::new(params, frame, Box::new(Steady));
        for tick in 0..=1000 {
            device.sample(at(tick), &HandView::unseen());
        }
        // One second is fourteen time constants of the slowest mode (0.145 kg, 4 N·s/m, 300 N/m).
        let state = device.true_state();
        assert!((state.position_m.x - 0.04).abs() < 1e-8, "{}", state.position_m.x);
        assert!((state.velocity_m_per_s.x - 0.04).abs() < 1e-7, "{}", state.velocity_m_per_s.x);
    }

    #[test]
    fn the_motors_saturate_at_the_peak_and_ignore_what_is_not_finite() {
        let mut device = device(SimulatedDeviceParams::default(), Vec3::zeros());
        device.command(DeviceCommand { force_n: Vec3::new(30.0, 40.0, 0.0) });
        assert!((device.force_n - Vec3::new(1.98, 2.64, 0.0)).amax() < 1e-12);
        device.command(DeviceCommand { force_n: Vec3::new(f64::NAN, 0.0, 0.0) });
        assert_eq!(device.force_n, Vec3::zeros());
    }

    #[test]
    fn late_ticks_change_nothing_and_a_stall_stops_the_model() {
        let start = Vec3::new(0.02, 0.01, 0.0);
        let run = |ticks: &[u64]| {
            let mut device = device(SimulatedDeviceParams::default(), Vec3::zeros());
            device.stylus.position_m = start;
            for &tick in ticks {
                device.sample(at(tick), &HandView::unseen());
            }
            device.true_state().position_m
        };
        assert_eq!(run(&[1, 2, 3, 4, 5, 6]), run(&[1, 4, 6]), "a missed tick is made up by sub-steps");
        assert_eq!(run(&[20]), run(&[5_000_000]), "a stall runs 20 ms at most");
        let mut device = device(SimulatedDeviceParams::default(), Vec3::zeros());
        assert_eq!(device.sample(at(1), &HandView::unseen()).quality, SampleQuality::Fresh);
        assert_eq!(device.sample(at(1), &HandView::unseen()).quality, SampleQuality::Stale);
    }

    proptest! {
        #[test]
        fn the_measured_position_is_the_true_one_within_half_counts(x in -0.07..0.07, y in -0.03..0.03, z in -0.05..0.05) {
            let mut device = device(SimulatedDeviceParams::default(), Vec3::new(x, y, z));
            let sample = device.sample(at(1), &HandView::unseen());
            prop_assert!((sample.position_m - device.true_state().position_m).norm() < 2.0 * ENCODER_M);
        }
    }
}
