//! A servo alone, without tissue, at the ends of its numbers: clocks and sequences that wrap at u64, a clock that jumps, ticks
//! of impossible length, a first sample out of all bounds.
//!
//! It holds one point against a port of 300 N/m that comes with every tick. Deliberately absent: a solver; the servo of a
//! session is in `servo.rs`.

use super::rig::{MS, params};
use super::{Ending, Named, Outcome};
use haptic_server::device::{DeviceSample, SampleQuality, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::tick::{Orders, Rights, Servo, TickInput};
use protocol::tissue_port::{HANDLE_HELD, HandlePort, TissuePort};
use protocol::wire::{Field, Message};
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("clock wraps at u64", clock_wrap),
    ("clock jumps to the end of u64", clock_jump),
    ("button released after the clock stepped back", button_after_step_back),
    ("first sample at 1e308 m", first_sample_far_out),
    ("a tick of NaN, negative and infinite length", bad_ticks),
    ("port sequence wraps at u64", sequence_wrap),
];

/// A servo alone that holds one point, its clock at `start_ns`.
struct Bare {
    servo: Servo,
    now_ns: u64,
    sample: DeviceSample,
    sequence: u64,
    force_n: Vec3,
    worst_slew_n: f64,
    sound: bool,
}

impl Bare {
    fn new(start_ns: u64, sequence: u64) -> Self {
        let mut sample = DeviceSample::resting(Vec3::new(0.0, 0.0, 0.01));
        sample.quality = SampleQuality::Fresh;
        let servo = Servo::new(&params(), Rights::Full);
        Self { servo, now_ns: start_ns, sample, sequence, force_n: Vec3::zeros(), worst_slew_n: 0.0, sound: true }
    }

    fn tick(&mut self, dt_s: f64) {
        self.now_ns = self.now_ns.wrapping_add(MS);
        let mut port = TissuePort::EMPTY;
        (port.epoch, port.handle_count) = (1, 1);
        (port.valid_ns, port.publish_ns) = (self.now_ns, self.now_ns);
        let k = 300.0;
        port.handles[0] = HandlePort {
            stiffness_n_per_m: [k, 0.0, 0.0, k, 0.0, k],
            one_ring_n_per_m: [k, 0.0, 0.0, k, 0.0, k],
            trust_radius_m: 0.02,
            mass_kg: 0.002,
            drag_n_s_per_m: 0.5,
            mode: HANDLE_HELD,
            ..HandlePort::EMPTY
        };
        self.sequence = self.sequence.wrapping_add(1);
        port.stamp(self.sequence, self.now_ns);
        let input = TickInput {
            time: TickTime { scheduled_ns: self.now_ns, now_ns: self.now_ns, dt_s },
            sample: &self.sample,
            new_port: Some(&port),
            orders: Orders::default(),
            wakefulness: Wakefulness::Awake,
        };
        let force = self.servo.tick(&input).command.force_n;
        self.worst_slew_n = self.worst_slew_n.max((force - self.force_n).norm());
        self.sound &= force.iter().all(|f| f.is_finite()) && self.servo.state().validate().is_ok();
        self.force_n = force;
    }

    /// Becomes active and pulls the point 4 mm.
    fn pull(&mut self) {
        (0..200).for_each(|_| self.tick(1e-3));
        for _ in 0..100 {
            self.sample.position_m.x += 4e-5;
            self.tick(1e-3);
        }
        (0..500).for_each(|_| self.tick(1e-3));
    }
}

fn clock_wrap() -> Outcome {
    let mut bare = Bare::new(u64::MAX - 850 * MS, 0);
    bare.pull();
    let held_n = bare.force_n.norm();
    let mut back = 0;
    let mut lost = false;
    for tick in 0..3_000 {
        bare.tick(1e-3);
        lost |= bare.servo.mode() != Mode::Active;
        if lost && back == 0 && bare.servo.mode() == Mode::Active {
            back = tick;
        }
    }
    let note = format!(
        "{held_n:.2} N held at the wrap; largest force step of a tick. Active again after {back} ticks, mode {}",
        bare.servo.mode().name()
    );
    Outcome::measured(Ending::Clamped, note, bare.worst_slew_n, 0.5 + 1e-9, "N")
        .require(bare.sound, "every force and state is finite")
        .require(lost && bare.servo.mode() == Mode::Active, "it lost its ports, and renders again through the ramp")
}

fn clock_jump() -> Outcome {
    let mut bare = Bare::new(1_000 * MS, 0);
    bare.pull();
    bare.now_ns = u64::MAX - 2 * MS;
    bare.tick(1e10);
    bare.tick(1e-3);
    let missed = bare.servo.state().missed;
    let note = format!("{missed} ticks counted missed, mode {}; largest force step", bare.servo.mode().name());
    // The slew counts two periods at most.
    Outcome::measured(Ending::Clamped, note, bare.worst_slew_n, 1.0 + 1e-9, "N")
        .require(bare.sound && bare.servo.mode() == Mode::Fault, "finite and latched")
}

fn button_after_step_back() -> Outcome {
    let mut bare = Bare::new(5_000 * MS, 0);
    (0..100).for_each(|_| bare.tick(1e-3));
    bare.sample.buttons = 1;
    (0..50).for_each(|_| bare.tick(1e-3));
    bare.now_ns -= 4_000 * MS;
    bare.sample.buttons = 0;
    let mut ticks = 0;
    while bare.servo.state().devices[0].release_count[0] == 0 && ticks < 10_000 {
        bare.tick(1e-3);
        ticks += 1;
    }
    Outcome::measured(Ending::Correct, "ticks until the release is seen", f64::from(ticks), 100.0, "ticks")
        .require(bare.servo.state().devices[0].press_count[0] == 1, "one press was seen")
}

fn first_sample_far_out() -> Outcome {
    let mut bare = Bare::new(1_000 * MS, 0);
    bare.sample.position_m = Vec3::new(1e308, -1e308, 1e308);
    (0..100).for_each(|_| bare.tick(1e-3));
    let peak = bare.force_n.norm();
    let far = bare.servo.state().devices[0].position_m.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let note = format!("mode {}; farthest coordinate told to others", bare.servo.mode().name());
    Outcome::measured(Ending::Refused, note, far, 100.0, "m").require(bare.sound && peak == 0.0, "finite, no force")
}

fn bad_ticks() -> Outcome {
    let mut bare = Bare::new(1_000 * MS, 0);
    bare.pull();
    let held = bare.force_n;
    for dt_s in [f64::NAN, -1.0, f64::INFINITY, 0.0, -0.0, 1e300] {
        bare.tick(dt_s);
    }
    (0..200).for_each(|_| bare.tick(1e-3));
    let off = (bare.force_n - held).norm() / held.norm();
    let note = "force 0.2 s after six such ticks against the one before";
    Outcome::measured(Ending::Clamped, note, off, 1e-3, "relative difference")
        .require(bare.sound && bare.worst_slew_n <= 1.0 + 1e-9, "finite, within the slew of two periods")
        .require(held.norm() > 0.3, "a force was held")
}

fn sequence_wrap() -> Outcome {
    let mut bare = Bare::new(1_000 * MS, u64::MAX - 850);
    bare.pull();
    let held = bare.force_n;
    (0..200).for_each(|_| bare.tick(1e-3));
    let off = (bare.force_n - held).norm() / held.norm();
    Outcome::measured(Ending::Correct, "force held over the wrap", off, 1e-2, "relative difference")
        .require(bare.servo.mode() == Mode::Active && bare.sound, "no port is lost")
        .require(bare.servo.state().port_sequence < 1_000, "the newest port is in use")
}
