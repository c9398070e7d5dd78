//! A servo on a virtual clock: one millisecond per tick, samples and ports made by hand.

use haptic_server::device::{DeviceLimits, DeviceSample, SampleQuality, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::events::EventKind;
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::tick::{Orders, Rights, Servo, TickInput, TickOutput};
use protocol::tissue_port::{HANDLE_FREE, HANDLE_HELD, HANDLE_LINKED, HANDLE_PULLED, HandlePort, TissuePort};
use protocol::wire::{Field, Message};
use sim_core::vector::Vec3;

pub(crate) const MS: u64 = 1_000_000;
/// Tissue stiffness of the ports, N/m.
pub(crate) const TISSUE_N_PER_M: f64 = 300.0;
/// What counts as no force, newtons: a thousandth of what a finger notices.
pub(crate) const ZERO_N: f64 = 1e-4;

pub(crate) const OMNI: DeviceLimits = DeviceLimits::OMNI;

/// Which handles the solver offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grip {
    Free,
    Held,
    Pulled,
}

/// Whether the solver publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Solver {
    Runs,
    Stands,
}

pub(crate) struct Rig {
    pub(crate) servo: Servo,
    pub(crate) now_ns: u64,
    pub(crate) sample: DeviceSample,
    pub(crate) grip: Grip,
    pub(crate) solver: Solver,
    /// Solver period, ticks.
    pub(crate) solver_ticks: u64,
    pub(crate) orders: Orders,
    pub(crate) epoch: u32,
    pub(crate) wakefulness: Wakefulness,
    sequence: u64,
    pub(crate) last_force: Vec3,
}

pub(crate) fn params() -> ServoParams {
    ServoParams::new(&ServoConfig::default(), &OMNI).expect("defaults are valid")
}

fn handle(mode: u32, x_m: f64) -> HandlePort {
    let k = TISSUE_N_PER_M;
    HandlePort {
        position_m: [x_m, 0.0, 0.0],
        stiffness_n_per_m: [k, 0.0, 0.0, k, 0.0, k],
        one_ring_n_per_m: [3.0 * k, 0.0, 0.0, 3.0 * k, 0.0, 3.0 * k],
        trust_radius_m: 0.02,
        mass_kg: 0.002,
        drag_n_s_per_m: 0.5,
        mode,
        ..HandlePort::EMPTY
    }
}

/// A port as a well-behaved solver publishes it; the pulled pair stands at ±4 mm.
pub(crate) fn port(grip: Grip, epoch: u32, sequence: u64, publish_ns: u64) -> TissuePort {
    let mut port = TissuePort::EMPTY;
    port.epoch = epoch;
    port.publish_ns = publish_ns;
    port.valid_ns = publish_ns;
    port.line_rest_length_m = 0.028;
    port.pair_count = 4;
    port.gap_m = 0.008;
    let (near, partner) = match grip {
        Grip::Free => (HANDLE_FREE, HANDLE_FREE),
        Grip::Held => (HANDLE_HELD, HANDLE_FREE),
        Grip::Pulled => (HANDLE_PULLED, HANDLE_LINKED),
    };
    port.handles[0] = handle(near, 0.004);
    port.handles[1] = handle(partner, -0.004);
    port.handle_count = 2;
    port.stamp(sequence, publish_ns);
    port
}

impl Rig {
    pub(crate) fn new() -> Self {
        Self {
            servo: Servo::new(&params(), Rights::Full),
            now_ns: 1_000 * MS,
            sample: DeviceSample {
                time_ns: 0,
                position_m: Vec3::new(0.004, 0.0, 0.02),
                velocity_m_per_s: Vec3::zeros(),
                orientation: [0.0, 0.0, 0.0, 1.0],
                buttons: 0,
                quality: SampleQuality::Fresh,
            },
            grip: Grip::Free,
            solver: Solver::Runs,
            solver_ticks: 5,
            orders: Orders::default(),
            epoch: 1,
            wakefulness: Wakefulness::Awake,
            sequence: 0,
            last_force: Vec3::zeros(),
        }
    }

    /// The port that the solver publishes just before the coming tick, if it does.
    pub(crate) fn next_port(&mut self) -> Option<TissuePort> {
        let is_due = self.solver == Solver::Runs && (self.now_ns / MS).is_multiple_of(self.solver_ticks);
        is_due.then(|| {
            self.sequence += 1;
            port(self.grip, self.epoch, self.sequence, self.now_ns)
        })
    }

    /// One tick, `missed` ticks after the one before it.
    pub(crate) fn tick_after(&mut self, missed: u64) -> TickOutput {
        self.now_ns += (missed + 1) * MS;
        let new_port = self.next_port();
        self.sample.time_ns = self.now_ns;
        let time = TickTime { scheduled_ns: self.now_ns, now_ns: self.now_ns, dt_s: (missed + 1) as f64 * 1e-3 };
        let input = TickInput {
            time,
            sample: &self.sample,
            new_port: new_port.as_ref(),
            orders: self.orders,
            wakefulness: self.wakefulness,
        };
        let output = self.servo.tick(&input);
        self.last_force = output.command.force_n;
        output
    }

    pub(crate) fn tick(&mut self) -> TickOutput {
        self.tick_after(0)
    }

    /// `ticks` ticks, each checked against slew and peak; the events are kept.
    pub(crate) fn run(&mut self, ticks: u64) -> Vec<EventKind> {
        let mut events = Vec::new();
        for _ in 0..ticks {
            let before = self.last_force;
            let output = self.tick();
            assert!((self.last_force - before).norm() <= 0.5 + 1e-12, "slew at tick {}", self.servo.state().ticks);
            assert!(self.last_force.norm() <= OMNI.peak_force_n);
            events.extend(output.events.as_slice().iter().map(|e| e.kind));
        }
        events
    }

    /// Moves the stylus by `by_m` over `ticks`.
    pub(crate) fn move_stylus(&mut self, by_m: Vec3, ticks: u64) -> Vec<EventKind> {
        let mut events = Vec::new();
        self.sample.velocity_m_per_s = by_m / (ticks as f64 * 1e-3);
        for _ in 0..ticks {
            self.sample.position_m += by_m / ticks as f64;
            events.append(&mut self.run(1));
        }
        self.sample.velocity_m_per_s = Vec3::zeros();
        events
    }

    /// A rig that renders at full force, nothing in the hand.
    pub(crate) fn active() -> Self {
        let mut rig = Self::new();
        rig.run(2_300);
        assert_eq!(rig.servo.mode(), Mode::Active);
        rig
    }

    /// A rig that renders a held point, pulled 5 mm to the side: a bit less than 1 N.
    pub(crate) fn holding() -> Self {
        let mut rig = Self::active();
        rig.grip = Grip::Held;
        rig.epoch += 1;
        rig.run(20);
        rig.move_stylus(Vec3::new(0.0, 0.005, 0.0), 50);
        rig.run(200);
        assert!(rig.last_force.norm() > 0.7, "{}", rig.last_force);
        rig
    }
}
