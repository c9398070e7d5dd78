//! The servo under samples and clocks that cannot be: NaN, denormals, 100 m/s, a kilometre away, pauses, clocks that step
//! back or wrap.
//!
//! "Untouched" means to the bit: beside the disturbed session runs its twin, whose samples are what the gate must make of
//! the bad ones.

use super::rig::{MS, SessionRig, params, small_skin};
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
    ("NaN, infinite and 1e308 samples with nothing in the hand", bad_samples_idle),
    ("three NaN samples while a point is held", bad_samples_bridged),
    ("NaN samples for good while a point is held", bad_samples_for_good),
    ("denormal samples", denormal_samples),
    ("stylus at 100 m/s", || flying_stylus(Vec3::x() * 0.1, Vec3::x() * 100.0)),
    ("stylus at 1e6 mm", || flying_stylus(Vec3::x() * 1e3, Vec3::zeros())),
    ("restart after a pause of 10 s", pause),
    ("clock steps back by 1 s without a solver", clock_back_alone),
    ("clock steps back by 1 s, the solver goes on", clock_back_with_solver),
    ("clock wraps at u64", clock_wrap),
    ("clock jumps to the end of u64", clock_jump),
    ("button released after the clock stepped back", button_after_step_back),
    ("first sample at 1e308 m", first_sample_far_out),
    ("a tick of NaN, negative and infinite length", bad_ticks),
    ("port sequence wraps at u64", sequence_wrap),
];

/// Samples that no device may give.
fn bad_sample(kind: u64, good: DeviceSample) -> DeviceSample {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308][(kind % 4) as usize];
    match kind % 3 {
        0 => DeviceSample { position_m: Vec3::new(bad, 0.0, 0.0), ..good },
        1 => DeviceSample { velocity_m_per_s: Vec3::new(0.0, bad, 0.0), ..good },
        _ => DeviceSample { position_m: Vec3::repeat(bad), velocity_m_per_s: Vec3::repeat(bad), ..good },
    }
}

fn loaded_rig() -> SessionRig {
    SessionRig::new(&small_skin()).expect("the small skin scene loads")
}

fn finish(outcome: Outcome, rig: &SessionRig) -> Outcome {
    outcome.require(rig.findings.breach.is_none(), rig.findings.breach.as_deref().unwrap_or(""))
}

fn differing(a: &SessionRig, b: &SessionRig) -> f64 {
    a.tissue_bits().iter().zip(&b.tissue_bits()).filter(|(a, b)| a != b).count() as f64
}

fn bad_samples_idle() -> Outcome {
    let (mut rig, mut twin) = (loaded_rig(), loaded_rig());
    rig.activate();
    twin.activate();
    let good = rig.sample;
    for kind in 0..200 {
        rig.sample = bad_sample(kind, good);
        rig.tick();
        twin.tick();
    }
    let note = format!("tissue numbers that differ from an undisturbed session; then mode {}", rig.servo.mode().name());
    finish(Outcome::measured(Ending::Clamped, note, differing(&rig, &twin), 0.0, "numbers"), &rig)
        .require(rig.servo.mode() == Mode::Fault && rig.force_n == Vec3::zeros(), "latched at zero force")
}

/// A session that holds a point pulled 4 mm aside.
fn holding() -> SessionRig {
    let mut rig = loaded_rig();
    rig.hold_left();
    rig.pull(Vec3::new(-0.004, 0.0, 0.0), 100);
    rig.run(100);
    rig
}

fn bad_samples_bridged() -> Outcome {
    let (mut rig, mut twin) = (holding(), holding());
    let good = rig.sample;
    for kind in 0..3 {
        rig.sample = bad_sample(kind, good);
        rig.tick();
        twin.tick();
    }
    rig.sample = good;
    rig.run(100);
    twin.run(100);
    let note = "numbers of the tissue that differ from a session whose samples stood still";
    finish(Outcome::measured(Ending::Clamped, note, differing(&rig, &twin), 0.0, "numbers"), &rig)
        .require(rig.force_n == twin.force_n && rig.force_n.norm() > 0.3, "the same force goes on")
}

fn bad_samples_for_good() -> Outcome {
    let mut rig = holding();
    let held_n = rig.force_n.norm();
    let good = rig.sample;
    let mut ticks = 0;
    while (ticks == 0 || rig.force_n != Vec3::zeros()) && ticks < 1_000 {
        rig.sample = bad_sample(ticks, good);
        rig.tick();
        ticks += 1;
    }
    for kind in 0..100 {
        rig.sample = bad_sample(kind, good);
        rig.tick();
    }
    let note = format!("{held_n:.2} N held; ticks to exactly zero, fault latched");
    finish(Outcome::measured(Ending::Clamped, note, ticks as f64, 40.0, "ticks"), &rig)
        .require(rig.servo.mode() == Mode::Fault && rig.force_n == Vec3::zeros(), "latched at zero force")
        .require(held_n > 0.3, "a force was there to lose")
}

fn denormal_samples() -> Outcome {
    let (mut rig, mut twin) = (holding(), holding());
    let tiny = f64::from_bits(1);
    for tick in 0..200_u64 {
        rig.sample.velocity_m_per_s = Vec3::repeat(if tick % 2 == 0 { tiny } else { -tiny });
        rig.tick();
        twin.tick();
    }
    let off = (rig.force_n - twin.force_n).norm();
    finish(Outcome::measured(Ending::Correct, "force against samples with true zeros", off, 1e-12, "N"), &rig)
}

fn flying_stylus(per_tick_m: Vec3, velocity: Vec3) -> Outcome {
    let mut rig = holding();
    let held_n = rig.force_n.norm();
    let start = rig.sample.position_m;
    let mut ticks = 0;
    while (ticks == 0 || rig.force_n != Vec3::zeros()) && ticks < 1_000 {
        ticks += 1;
        rig.sample.position_m = start + per_tick_m * ticks as f64;
        rig.sample.velocity_m_per_s = velocity;
        rig.tick();
    }
    let note = format!("{held_n:.2} N held; samples refused, ticks to exactly zero, mode {}", rig.servo.mode().name());
    finish(Outcome::measured(Ending::Clamped, note, ticks as f64, 40.0, "ticks"), &rig)
        .require(rig.servo.mode() == Mode::Fault, "a fault is latched")
}

/// The machine stood still for 10 s: one long tick, no burst of forces, no stale port taken for new.
fn pause() -> Outcome {
    let mut rig = holding();
    let steps = rig.session.procedure().total_steps();
    let before = rig.force_n;
    rig.now_ns += 10_000 * MS;
    let late = rig.servo_only_tick(10.001);
    let jump = (late - before).norm();
    let mode = rig.servo.mode();
    let mut zero = 0;
    while rig.force_n != Vec3::zeros() && zero < 1_000 {
        rig.now_ns += MS;
        rig.servo_only_tick(1e-3);
        zero += 1;
    }
    let missed = rig.servo.state().missed;
    let note = format!(
        "force step of the late tick; {missed} ticks counted missed, mode {}, zero after {zero} ticks",
        mode.name()
    );
    // The slew counts two periods at most.
    finish(Outcome::measured(Ending::Clamped, note, jump, 1.0 + 1e-9, "N"), &rig)
        .require(mode == Mode::Fault && missed >= 9_999, "counted and latched, not caught up")
        .require(rig.session.procedure().total_steps() == steps, "no burst of solver steps")
        .require(zero < 40, "the force is gone within 40 ticks")
}

/// After the step back the port in use is of unknown age: its force must fade, whatever the clock says.
fn clock_back_alone() -> Outcome {
    let mut rig = holding();
    let held_n = rig.force_n.norm();
    rig.now_ns -= 1_000 * MS;
    let mut ticks = 0;
    while rig.force_n != Vec3::zeros() && ticks < 20_000 {
        rig.now_ns += MS;
        rig.servo_only_tick(1e-3);
        ticks += 1;
    }
    let note = format!("{held_n:.2} N held; ticks until the force was zero without a new port");
    // The ladder's 250 ms and 100 ms of decay.
    finish(Outcome::measured(Ending::Clamped, note, ticks as f64, 400.0, "ticks"), &rig)
        .require(held_n > 0.3, "a force was there to lose")
}

/// A solver that goes on by the new clock must be heard again, through the ramp.
fn clock_back_with_solver() -> Outcome {
    let mut rig = holding();
    rig.now_ns -= 1_000 * MS;
    rig.rewind_solver();
    let mut ticks = 0;
    let mut lost = false;
    while ticks < 20_000 {
        rig.tick();
        ticks += 1;
        lost |= rig.servo.mode() != Mode::Active;
        if lost && rig.servo.mode() == Mode::Active {
            break;
        }
    }
    let note = "ticks until the servo renders again by ports of the new clock";
    finish(Outcome::measured(Ending::Clamped, note, ticks as f64, 1_000.0, "ticks"), &rig)
        .require(lost, "it came back through Monitor and Ramp")
}

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
