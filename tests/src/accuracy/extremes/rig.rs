//! A whole session on a virtual clock for the extreme cases: servo and solver as in lockstep, the samples made by hand.
//!
//! Every tick the force is checked (finite, at most the peak, within the slew of the one before) and `servo_state` must be
//! readable; every step the port, the wound report and the frame. The first breach is kept in words. One millisecond per
//! tick; arming waits and ramps are cut to their least, since they are not what is tested here.

use haptic_server::device::{DeviceLimits, DeviceSample, SampleQuality, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::tick::{Orders, Rights, Servo, TickInput, TickOutput};
use haptic_server::solver::session::SolverSession;
use protocol::scene_frame::FrameNode;
use protocol::tissue_port::TissuePort;
use protocol::wire::Message;
use sim_core::scene::build::SceneError;
use sim_core::scene::config::{SceneConfig, TissueConfig};
use sim_core::scene::presets;
use sim_core::scene::procedure::SceneSource;
use sim_core::vector::Vec3;

/// Nanoseconds of a millisecond.
pub const MS: u64 = 1_000_000;
/// Peak of an Omni, newtons.
pub const PEAK_N: f64 = 3.3;
/// Slew of the defaults, newtons per tick; the last digits are rounding of a subtraction.
pub const SLEW_N: f64 = 0.5 + 1e-12;
/// Speed at which the scripted hand goes from place to place, metres per tick.
const STROLL_M: f64 = 2e-4;

/// A small skin scene: 24 × 24 mm, a slit of 16 mm, two pairs, every stage present.
#[must_use]
pub fn small_skin() -> SceneConfig {
    let mut config = presets::skin();
    config.tissue = TissueConfig::Utsm { width_mm: 24.0, length_mm: 24.0, spacing_mm: 2.0, pre_strain: 0.05 };
    config.wound.length_mm = 16.0;
    config.wound.gap_mm = 2.0;
    config.suture.pairs = 2;
    config
}

/// What came of the checks of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// First breach, in words.
    pub breach: Option<String>,
    /// Largest force given to the device, newtons.
    pub peak_n: f64,
    /// Largest change of the force in one tick, newtons.
    pub slew_n: f64,
    /// Node moves cut, handles cut, values contained.
    pub cut: u64,
    /// `CLIP_…` bits seen.
    pub clips: u32,
}

/// Servo and solver of one session.
pub struct SessionRig {
    /// Servo.
    pub servo: Servo,
    /// Solver.
    pub session: SolverSession,
    /// What the device will report in the next tick.
    pub sample: DeviceSample,
    /// Orders to the servo.
    pub orders: Orders,
    /// Findings so far.
    pub findings: Findings,
    /// The virtual clock.
    pub now_ns: u64,
    /// Force of the last tick.
    pub force_n: Vec3,
    next_step_ns: u64,
    sequence: u64,
    pending: Option<TissuePort>,
    nodes: Vec<FrameNode>,
}

/// Servo constants of the rig.
///
/// # Panics
/// When the constants are refused.
#[must_use]
pub fn params() -> ServoParams {
    let mut config = ServoConfig::default();
    config.rhythm.arm_wait_s = 0.0;
    config.rhythm.ramp_s = 0.01;
    ServoParams::new(&config, &DeviceLimits::OMNI).expect("the rig's constants are valid")
}

impl SessionRig {
    /// Loads a scene; the stylus stands 30 mm above the wound.
    ///
    /// # Errors
    /// [`SceneError`] as the scene has it.
    pub fn new(config: &SceneConfig) -> Result<Self, SceneError> {
        let session = SolverSession::new(&[SceneSource { config: config.clone(), mesh: None }])?;
        let mut sample = DeviceSample::resting(Vec3::new(0.0, 0.0, 0.03));
        sample.quality = SampleQuality::Fresh;
        Ok(Self {
            servo: Servo::new(&params(), Rights::Full),
            session,
            sample,
            orders: Orders::default(),
            findings: Findings::default(),
            now_ns: 1_000 * MS,
            force_n: Vec3::zeros(),
            next_step_ns: 1_000 * MS,
            sequence: 0,
            pending: None,
            nodes: Vec::new(),
        })
    }

    fn breach(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds && self.findings.breach.is_none() {
            self.findings.breach = Some(what());
        }
    }

    /// Solver steps that are due; their port arrives with the next tick.
    pub fn step_solver(&mut self) {
        while self.next_step_ns <= self.now_ns {
            let state = *self.servo.state();
            self.session.step((state.ticks > 0).then_some(&state), None, self.now_ns);
            self.sequence += 1;
            let mut port = *self.session.port();
            port.publish_ns = self.now_ns;
            port.stamp(self.sequence, self.now_ns);
            let mut report = *self.session.report();
            report.stamp(self.sequence, self.now_ns);
            let (port_says, report_says) = (port.validate(), report.validate());
            self.breach(port_says.is_ok(), || format!("port: {port_says:?}"));
            self.breach(report_says.is_ok(), || format!("report: {report_says:?}"));
            let mut nodes = std::mem::take(&mut self.nodes);
            let frame = self.session.frame(&mut nodes);
            let sound = nodes.iter().all(|n| n.position_m.iter().chain([&n.attachment_force_n]).all(|x| x.is_finite()));
            self.nodes = nodes;
            self.breach(sound && frame.sim_time_s.is_finite(), || {
                "a frame holds a number that is not finite".to_owned()
            });
            let last = self.session.procedure().scene().last_report();
            self.findings.cut += u64::from(last.saturated) + u64::from(last.handles_cut) + u64::from(last.contained);
            self.pending = Some(port);
            self.next_step_ns += (self.session.period_s() * 1e9).round() as u64;
        }
    }

    /// One tick of a millisecond.
    pub fn tick(&mut self) -> TickOutput {
        self.now_ns += MS;
        let port = self.pending.take();
        self.sample.time_ns = self.now_ns;
        let input = TickInput {
            time: TickTime { scheduled_ns: self.now_ns, now_ns: self.now_ns, dt_s: 1e-3 },
            sample: &self.sample,
            new_port: port.as_ref(),
            orders: self.orders,
            wakefulness: Wakefulness::Awake,
        };
        let output = self.servo.tick(&input);
        let force = output.command.force_n;
        let slew = (force - self.force_n).norm();
        self.breach(force.iter().all(|f| f.is_finite()), || format!("command {force:?} is not finite"));
        self.breach(force.norm() <= PEAK_N, || format!("command of {} N is above the peak", force.norm()));
        self.breach(slew <= SLEW_N, || format!("the command changed by {slew} N in one tick"));
        let state = self.servo.state().validate();
        self.breach(state.is_ok(), || format!("servo_state: {state:?}"));
        self.findings.peak_n = self.findings.peak_n.max(force.norm());
        self.findings.slew_n = self.findings.slew_n.max(slew);
        self.findings.clips |= output.clips;
        self.force_n = force;
        self.step_solver();
        output
    }

    /// A tick of the servo alone, by the clock as it stands: the solver is not there.
    pub fn servo_only_tick(&mut self, dt_s: f64) -> Vec3 {
        let input = TickInput {
            time: TickTime { scheduled_ns: self.now_ns, now_ns: self.now_ns, dt_s },
            sample: &self.sample,
            new_port: None,
            orders: self.orders,
            wakefulness: Wakefulness::Awake,
        };
        self.force_n = self.servo.tick(&input).command.force_n;
        let state = self.servo.state().validate();
        self.breach(state.is_ok(), || format!("servo_state: {state:?}"));
        self.force_n
    }

    /// The solver goes on from the clock as it stands.
    pub fn rewind_solver(&mut self) {
        self.next_step_ns = self.now_ns;
        self.pending = None;
    }

    /// `ticks` ticks.
    pub fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Runs until the servo renders at full force, at most a second.
    pub fn activate(&mut self) {
        for _ in 0..1_000 {
            if self.servo.mode() == Mode::Active {
                return;
            }
            self.tick();
        }
        let mode = self.servo.mode();
        self.breach(false, || format!("the servo did not become active within a second, it is in {mode:?}"));
    }

    /// Strolls to a place.
    pub fn go_to(&mut self, place_m: Vec3) {
        while self.sample.position_m != place_m {
            let way = place_m - self.sample.position_m;
            let step = if way.norm() <= STROLL_M { way } else { way.normalize() * STROLL_M };
            self.sample.position_m += step;
            if way.norm() <= STROLL_M {
                self.sample.position_m = place_m;
            }
            self.tick();
        }
    }

    /// Presses the front button, or lets it go, and waits for the contact's lock-out.
    pub fn button(&mut self, bits: u32) {
        self.sample.buttons = bits;
        self.run(30);
    }

    /// Becomes active, goes to the left point of the first pair and takes it.
    pub fn hold_left(&mut self) {
        self.activate();
        let left = self.session.procedure().scene().places()[0].left_m;
        self.go_to(left);
        self.button(1);
        let held = self.servo.state().handles[0].mode;
        self.breach(held == protocol::tissue_port::HANDLE_HELD, || {
            format!("the left point was not taken (mode {held})")
        });
    }

    /// From a held left point on: lets it go and takes the line at the right point.
    pub fn take_line(&mut self) {
        self.button(0);
        let right = self.session.procedure().scene().places()[0].right_m;
        self.go_to(right);
        self.button(1);
        let pulled = self.servo.state().handles[0].mode;
        self.breach(pulled == protocol::tissue_port::HANDLE_PULLED, || {
            format!("the line was not taken (mode {pulled})")
        });
    }

    /// Moves the stylus by `by_m` over `ticks`.
    pub fn pull(&mut self, by_m: Vec3, ticks: u64) {
        self.sample.velocity_m_per_s = by_m / (ticks as f64 * 1e-3);
        for _ in 0..ticks {
            self.sample.position_m += by_m / ticks as f64;
            self.tick();
        }
        self.sample.velocity_m_per_s = Vec3::zeros();
    }

    /// Positions and velocities of the tissue as bits.
    #[must_use]
    pub fn tissue_bits(&self) -> Vec<u64> {
        let state = self.session.procedure().scene().solver().state();
        state.position_m.iter().chain(&state.velocity_m_per_s).flat_map(Vec3::iter).map(|x| x.to_bits()).collect()
    }
}
