//! The servo of a session under samples and clocks that cannot be: NaN, denormals, 100 m/s, a kilometre away, pauses, clocks
//! that step back. A servo alone, at the ends of its numbers: `servo_alone.rs`.
//!
//! "Untouched" means to the bit: beside the disturbed session runs its twin, whose samples are what the gate must make of
//! the bad ones.

use super::rig::{MS, SessionRig, small_skin};
use super::{Ending, Named, Outcome};
use haptic_server::device::DeviceSample;
use haptic_server::servo::state_machine::Mode;
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
