//! A haptic device that does not exist: 45 g of stylus with friction, held by a hand, measured by encoders.
//!
//! Sub-steps of 50 µs, implicit in damper, spring and friction, so that no step length and no friction
//! can create energy: `(m + h b + h² k) v⁺ = m v + h (k (x_t + h v_t − x) + b_h v_t + F) − h f_c d`, where d is the
//! direction of v⁺, or whatever |d| ≤ 1 holds the stylus still (Coulomb friction with true sticking, solved
//! exactly). m = stylus + hand, b = viscous + hand damper, k = hand spring, F = the commanded force, at most the
//! device's peak. Forces 3.3 N and 0.88 N are the Omni's figures; mass, friction and hand are model
//! parameters. SI units, scene frame; no clock, no randomness, no heap in `sample` and `command`.
//! Deliberately absent: direction-dependent inertia, gravity, motor temperature.

use crate::device::frame::SceneFromDevice;
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

/// How a hand holds the stylus: mass, damper and spring between stylus and wish (model parameters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandImpedance {
    /// Mass that moves with the stylus, kilograms.
    pub mass_kg: f64,
    /// Damping against the wished motion, newton seconds per metre.
    pub damping_n_s_per_m: f64,
    /// Stiffness towards the wished position, newtons per metre.
    pub stiffness_n_per_m: f64,
}

/// What the simulated device is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedDeviceParams {
    /// Apparent mass at the stylus, kilograms (model parameter, from the data sheet's 45 g).
    pub stylus_mass_kg: f64,
    /// Coulomb friction when driven back, newtons (model parameter, quoted 0.26 N).
    pub coulomb_friction_n: f64,
    /// Viscous friction, newton seconds per metre (model parameter).
    pub viscous_friction_n_s_per_m: f64,
    /// What the device can do (device facts: 3.3 N, 0.88 N, 500 N/m).
    pub limits: DeviceLimits,
    /// Corner of the velocity filter, hertz.
    pub velocity_cutoff_hz: f64,
    /// The hand's grip; `None`: nobody holds the stylus.
    pub grip: Option<HandImpedance>,
}

impl Default for SimulatedDeviceParams {
    fn default() -> Self {
        Self {
            stylus_mass_kg: 0.045,
            coulomb_friction_n: 0.26,
            viscous_friction_n_s_per_m: 0.75,
            limits: DeviceLimits::OMNI,
            velocity_cutoff_hz: DEFAULT_CUTOFF_HZ,
            grip: Some(HandImpedance { mass_kg: 0.1, damping_n_s_per_m: 4.0, stiffness_n_per_m: 300.0 }),
        }
    }
}

/// Stylus, friction, encoders and the hand that holds it.
pub struct SimulatedDevice {
    params: SimulatedDeviceParams,
    frame: SceneFromDevice,
    hand: Box<dyn Hand>,
    filter: VelocityFilter,
    position_m: Vec3,
    velocity_m_per_s: Vec3,
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
            params,
            frame,
            hand,
            filter: VelocityFilter::new(params.velocity_cutoff_hz),
            position_m: start_m,
            velocity_m_per_s: Vec3::zeros(),
            force_n: Vec3::zeros(),
            wish: HandTarget { position_m: start_m, buttons: 0 },
            clock: None,
            sample: DeviceSample::resting(start_m),
        }
    }

    /// True stylus position (not the encoders'), metres, scene frame.
    #[must_use]
    pub fn true_position_m(&self) -> Vec3 {
        self.position_m
    }

    /// True stylus velocity, metres per second, scene frame.
    #[must_use]
    pub fn true_velocity_m_per_s(&self) -> Vec3 {
        self.velocity_m_per_s
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
            self.position_m = self.wish.position_m;
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
        for i in 0..count {
            self.substep(from + (self.wish.position_m - from) * (i as f64 / count as f64), wish_velocity);
        }
        elapsed_s
    }

    /// One implicit sub-step with exact Coulomb friction; the wish is where it was at the start of it.
    fn substep(&mut self, wish_m: Vec3, wish_velocity: Vec3) {
        let h = SUBSTEP_NS as f64 * 1e-9;
        let p = &self.params;
        let grip = p.grip.unwrap_or(HandImpedance { mass_kg: 0.0, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0 });
        let mass = p.stylus_mass_kg + grip.mass_kg;
        let force = (wish_m + wish_velocity * h - self.position_m) * grip.stiffness_n_per_m
            + wish_velocity * grip.damping_n_s_per_m
            + self.force_n;
        let resistance =
            mass + h * (p.viscous_friction_n_s_per_m + grip.damping_n_s_per_m) + h * h * grip.stiffness_n_per_m;
        let impulse = self.velocity_m_per_s * mass + force * h;
        let friction = h * p.coulomb_friction_n;
        let size = impulse.norm();
        self.velocity_m_per_s =
            if size <= friction { Vec3::zeros() } else { impulse * ((1.0 - friction / size) / resistance) };
        self.position_m += self.velocity_m_per_s * h;
    }
}

impl PulledDevice for SimulatedDevice {
    fn sample(&mut self, time: TickTime, view: &HandView) -> DeviceSample {
        let first = self.clock.is_none();
        let elapsed_s = self.advance(time.scheduled_ns, view);
        if elapsed_s == 0.0 && !first {
            self.sample = DeviceSample { time_ns: time.now_ns, quality: SampleQuality::Stale, ..self.sample };
            return self.sample;
        }
        let measured = encoder::measure(self.frame.inverse_point(self.position_m));
        let position_m = self.frame.point(measured.position_m);
        self.sample = DeviceSample {
            time_ns: time.now_ns,
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
        "simulated"
    }

    fn limits(&self) -> DeviceLimits {
        self.params.limits
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        run_pulled(self, room);
    }
}
