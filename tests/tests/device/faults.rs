//! Every error code and every fault, met while the hand holds about 1.7 N: reaction, time to zero force, what is told.
//!
//! Times are ticks of a millisecond: from the tick in which the library shows the fault to the first frame whose force
//! is zero, as the driver set it and as the motors gave it. The table is printed (`--nocapture`).

use crate::rig::{LIMIT, NO_STALL, PLACE_MM, Rig, ZERO_N};
use haptic_server::device::openhaptics::KeeperParams;
use haptic_server::device::openhaptics::ffi::Hd;
use haptic_server::device::openhaptics::severity::{self, Reaction};
use haptic_server::servo::state_machine::{Mode, ServoFault};
use sim_core::vector::Vec3;
use std::time::Duration;
use suture_tests::processes::wait_for;
use virtual_omni::{Calibration, Fault, Setup, WATCHDOG_S, codes, control, functions};

/// A force that is held.
const HELD_N: f64 = 1.0;
/// Whoever loses the device is asked again after this many milliseconds at the latest.
const BACK_MS: u32 = 4_000;

/// What became of the force.
struct Outcome {
    asked_zero_ms: Option<usize>,
    arrived_zero_ms: Option<usize>,
    told: Vec<String>,
}

/// Does a fault and watches for `ticks`.
fn after(rig: &Rig, fault: Fault, ticks: u32) -> Outcome {
    let _before = control::take_rows();
    let _told = rig.told();
    control::inject(0, fault);
    rig.step(ticks);
    let rows = control::take_rows();
    let first_zero =
        |force: fn(&virtual_omni::FrameRow) -> Vec3| rows.iter().position(|row| force(row).norm() < ZERO_N);
    Outcome {
        asked_zero_ms: first_zero(|row| row.asked_n),
        arrived_zero_ms: first_zero(|row| row.arrived_n),
        told: rig.told(),
    }
}

fn line(fault: &str, reaction: &str, outcome: &Outcome, end: &str) {
    let ms = |t: Option<usize>| t.map_or_else(|| "–".to_owned(), |t| t.to_string());
    let told = outcome.told.iter().filter(|t| !t.contains('→')).cloned().collect::<Vec<_>>().join("; ");
    println!(
        "| {fault} | {reaction} | {} | {} | {end} | {told} |",
        ms(outcome.asked_zero_ms),
        ms(outcome.arrived_zero_ms)
    );
}

/// Lets go, re-arms, and holds again: the way back that every latched fault has.
fn assert_the_way_back(rig: &Rig) {
    rig.let_go();
    rig.step(200);
    assert_eq!(rig.mode(), Mode::Fault, "a latched fault does not go by itself");
    rig.rearm();
    rig.move_to(Vec3::from(PLACE_MM));
    rig.step(BACK_MS);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    rig.pull();
}

#[test]
fn every_error_code_has_its_reaction() {
    println!("| error | reaction | force set to zero (ms) | force gone (ms) | servo | told |");
    for row in severity::TABLE {
        let rig = Rig::holding();
        let name = format!("{:#06x}", row.code);
        if row.reaction == Reaction::Cool {
            // The library complains of motors that are warm.
            control::inject(0, Fault::Warm(0.8));
        }
        let outcome = after(&rig, Fault::Error(row.code), 900);
        let told = outcome.told.iter().filter(|t| t.contains(row.meaning)).count();
        assert_eq!(told, 1, "{name}: {:?}", outcome.told);
        let zero = outcome.asked_zero_ms;
        match row.reaction {
            Reaction::Note => {
                assert_eq!((zero, rig.mode()), (None, Mode::Active), "{name}");
                assert!(rig.arrived_n() > HELD_N);
                line(&name, "note", &outcome, "active");
            }
            Reaction::Cool => {
                assert!(zero.is_some_and(|ms| ms < 900) && rig.mode() == Mode::Active, "{name}: {zero:?}");
                line(&name, "cool", &outcome, "active, no force until cool");
                control::inject(0, Fault::Warm(0.3));
                // From a thousandth of a newton at 0.1 % per tick: 8.1 s to the peak.
                rig.step(2 * BACK_MS);
                assert!(rig.arrived_n() > HELD_N, "the force comes back along the limit: {}", rig.arrived_n());
            }
            Reaction::Trip => {
                assert_eq!((zero, rig.mode()), (Some(0), Mode::Fault), "{name}");
                assert_eq!(ServoFault::from_code(rig.state().fault), Some(ServoFault::DeviceTripped));
                line(&name, "trip", &outcome, "fault, latched");
                assert_the_way_back(&rig);
            }
            Reaction::Lose => {
                assert_eq!(zero, Some(0), "{name}");
                let lost = wait_for(LIMIT, || (rig.mode() == Mode::Fault).then_some(()));
                assert!(lost.is_some(), "{name}");
                assert_eq!(ServoFault::from_code(rig.state().fault), Some(ServoFault::DeviceLost));
                line(&name, "lose", &outcome, "fault, latched; reopened");
                rig.wait_for_the_return();
                assert_the_way_back(&rig);
            }
        }
    }
}

#[test]
fn twenty_notes_in_a_row_are_a_trip() {
    let rig = Rig::holding();
    for _ in 0..25 {
        control::inject(0, Fault::Error(0x0101));
        rig.step(1);
    }
    assert_eq!((rig.mode(), rig.arrived_n()), (Mode::Fault, 0.0));
}

#[test]
fn an_unplugged_device_is_lost_found_again_and_re_armed_by_hand_only() {
    let rig = Rig::holding();
    let outcome = after(&rig, Fault::Unplug, 5);
    assert_eq!((outcome.asked_zero_ms, outcome.arrived_zero_ms), (Some(0), Some(0)));
    let mut told = outcome.told.clone();
    let refused = wait_for(LIMIT, || {
        told.extend(rig.told());
        told.iter().any(|t| t.contains("cannot be opened again yet")).then_some(())
    });
    assert!(refused.is_some(), "{told:?}");
    line("unplugged", "lose", &outcome, "fault, latched");
    control::inject(0, Fault::Replug);
    rig.wait_for_the_return();
    assert_the_way_back(&rig);
}

#[test]
fn a_library_that_falls_silent_is_taken_for_lost() {
    let params = KeeperParams { stall_limit: Duration::from_millis(100), ..NO_STALL };
    // The keeper's patience with a scheduler that starts is longer; the ticks that arm the servo come at once.
    let rig = Rig::start(&Setup::default(), None, params).hold();
    let told = rig.told();
    // Nobody steps: the callback is not called.
    let lost = wait_for(LIMIT, || (rig.mode() == Mode::Fault).then_some(()));
    assert!(lost.is_some(), "{told:?}");
    control::stall((WATCHDOG_S * 1e3) as u32 + 2);
    assert_eq!(rig.arrived_n(), 0.0, "the device's own watchdog");
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("has not called for")), "{told:?}");
    let outcome = Outcome { asked_zero_ms: None, arrived_zero_ms: Some((WATCHDOG_S * 1e3) as usize), told };
    line("silent library", "lose", &outcome, "fault, latched; started again");
}

#[test]
fn a_lost_calibration_takes_the_force_and_the_inkwell_brings_it_back_without_a_jump() {
    let rig = Rig::holding();
    let outcome = after(&rig, Fault::Uncalibrate, 120);
    assert!(
        outcome.asked_zero_ms.is_some_and(|ms| ms <= 101),
        "asked for once in 100 ticks: {:?}",
        outcome.asked_zero_ms
    );
    assert_eq!((rig.mode(), rig.state().fault), (Mode::Monitor, 0));
    line("calibration lost", "no force", &outcome, "monitor");
    rig.let_go();
    rig.step(500);
    assert_eq!(rig.arrived_n(), 0.0);
    // Its encoders have slipped: the calibration will move the position.
    control::inject(0, Fault::Jump(20.0));
    rig.dock();
    rig.step(300);
    assert_eq!(rig.state().fault, 0, "the jump of the calibration is none to the servo: {:?}", rig.told());
    rig.move_to(Vec3::from(PLACE_MM));
    rig.step(2_500);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    rig.pull();
}

#[test]
fn warm_motors_get_less_before_the_library_complains() {
    let rig = Rig::holding();
    let before = rig.arrived_n();
    let outcome = after(&rig, Fault::Warm(0.75), 1_600);
    let now = rig.arrived_n();
    assert!(before > 1.2 && now < 0.9 && now > 0.7, "from {before} to {now} N: the continuous force is 0.88 N");
    assert_eq!((rig.mode(), rig.state().fault), (Mode::Active, 0));
    assert!(outcome.told.iter().any(|t| t.contains("getting warm")), "{:?}", outcome.told);
    line("motors at 0.75", "force to 0.88 N", &outcome, "active");
    let outcome = after(&rig, Fault::Warm(0.99), 3);
    assert!(rig.arrived_n() < 0.4, "{}", rig.arrived_n());
    line("motors at 0.99", "force to a tenth", &outcome, "active");
}

#[test]
fn a_button_that_is_stuck_at_the_start_presses_nothing() {
    let alone_setup = Setup::default();
    let rig = Rig::start(&alone_setup, None, NO_STALL);
    control::inject(0, Fault::Buttons(3));
    control::lead(0, Vec3::from(PLACE_MM));
    rig.step(3_000);
    let device = rig.state().devices[0];
    assert_eq!((device.buttons, device.press_count), (0, [0, 0]));
    control::inject(0, Fault::Buttons(0));
    rig.step(20);
    control::press(0, 1);
    rig.step(20);
    assert_eq!(rig.state().devices[0].press_count, [1, 0], "after a release it counts");
}

#[test]
fn a_position_that_jumps_is_never_a_blow() {
    // The device's own speed limit sees the jump in the frame in which it happens; without it the servo's gate decides.
    for (limit, fault) in [
        (codes::ONE_FRAME_LIMIT, ServoFault::DeviceTripped),
        (codes::SOFTWARE_VELOCITY_LIMIT, ServoFault::SamplesImplausible),
    ] {
        let rig = Rig::holding();
        let hd = Hd::new(functions());
        hd.make_current(0);
        hd.disable(limit);
        let _before = control::take_rows();
        let _told = rig.told();
        control::inject(0, Fault::Jump(20.0));
        rig.step(60);
        assert_eq!(ServoFault::from_code(rig.state().fault), Some(fault), "{:?}", rig.told());
        let rows = control::take_rows();
        let zero = rows.iter().position(|row| row.asked_n.norm() < ZERO_N);
        assert!(zero.is_some_and(|ms| ms <= 20), "{zero:?}");
        for pair in rows.windows(2) {
            // Slew limit 500 N/s, and a motors' switch-off is the only step beyond it.
            let change = (pair[1].asked_n - pair[0].asked_n).norm();
            assert!(change <= 0.5 + 1e-9 || pair[1].asked_n.norm() < ZERO_N, "{change} N in a tick");
        }
        let outcome = Outcome { asked_zero_ms: zero, arrived_zero_ms: None, told: rig.told() };
        line("position jumps 20 mm", "trip or fault", &outcome, &fault.to_string());
    }
}

#[test]
fn garbage_is_bridged_for_three_frames_and_then_a_fault() {
    let rig = Rig::holding();
    let outcome = after(&rig, Fault::Garbage(3), 50);
    assert_eq!((outcome.asked_zero_ms, rig.mode()), (None, Mode::Active));
    line("3 frames of garbage", "bridged", &outcome, "active");
    let outcome = after(&rig, Fault::Garbage(4), 50);
    assert_eq!(ServoFault::from_code(rig.state().fault), Some(ServoFault::SamplesImplausible));
    assert!(outcome.asked_zero_ms.is_some_and(|ms| ms <= 20), "{:?}", outcome.asked_zero_ms);
    line("4 frames of garbage", "fault", &outcome, "fault, latched");
}

#[test]
fn a_pose_that_stands_still_keeps_a_force_that_stands_still() {
    let rig = Rig::holding();
    let before = rig.arrived_n();
    let outcome = after(&rig, Fault::Freeze(500), 600);
    assert!((rig.arrived_n() - before).abs() < 0.02, "from {before} to {}", rig.arrived_n());
    line("pose frozen for 500 ms", "none: a still hand looks the same", &outcome, "active");
}

#[test]
fn a_device_that_was_never_calibrated_gets_no_force() {
    let rig = Rig::start(&Setup { calibration: Calibration::Missing, ..Setup::default() }, None, NO_STALL);
    control::lead(0, Vec3::from(PLACE_MM));
    rig.step(5_000);
    assert_eq!((rig.mode(), rig.state().fault, rig.arrived_n()), (Mode::Init, 0, 0.0));
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("put the stylus into the inkwell")), "{told:?}");
}
