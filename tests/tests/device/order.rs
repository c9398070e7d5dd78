//! The order of things: opening, limits, two devices, the stop; and what is refused before anything moves.

use crate::alone;
use crate::rig::{NO_STALL, PLACE_MM, Rig};
use haptic_server::device::DeviceLimits;
use haptic_server::device::frame::SceneFromDevice;
use haptic_server::device::openhaptics::ffi::Hd;
use haptic_server::device::openhaptics::{OpenError, OpenHaptics};
use haptic_server::servo::state_machine::Mode;
use sim_core::vector::Vec3;
use virtual_omni::{Fault, Setup, control, functions};

fn opened(names: Option<&str>) -> Result<OpenHaptics, OpenError> {
    OpenHaptics::with(Hd::new(functions()), names, NO_STALL, SceneFromDevice::workspace_at(Vec3::zeros()))
}

#[test]
fn limits_are_read_from_the_device_and_forces_are_off() {
    let _alone = alone();
    control::reset(&Setup::default());
    let device = opened(None).expect("the virtual device opens");
    assert_eq!(haptic_server::device::Device::limits(&device), DeviceLimits::OMNI);
    assert!(device.description().contains("PHANTOM Omni"), "{}", device.description());
    assert_eq!((control::is_open(0), control::arrived_n(0)), (true, Vec3::zeros()));
    drop(device);
    assert!(!control::is_open(0), "a device that never ran is closed, too");
}

#[test]
fn a_device_that_cannot_be_opened_is_named_with_the_cause_and_no_other_stays_open() {
    let _alone = alone();
    control::reset(&Setup::default());
    control::inject(1, Fault::Lock);
    let error = opened(Some("Default Device+Left Device")).err().expect("the second is locked");
    let text = error.to_string();
    assert!(text.contains("Left Device") && text.contains("0x0303") && text.contains("unplug it"), "{text}");
    assert!(!control::is_open(0), "the first was closed again");
    let text = opened(Some("nobody")).err().expect("there is none").to_string();
    assert!(text.contains("nobody") && text.contains("0x0300"), "{text}");
}

#[test]
fn two_devices_feel_each_their_own_point() {
    let rig = Rig::start(&Setup::default(), Some("Default Device+Left Device"), NO_STALL);
    let place = Vec3::new(-30.0, 10.0, 5.0);
    control::lead(1, place);
    let rig = rig.hold();
    control::press(1, 2);
    rig.step(10);
    let state = rig.state();
    assert_eq!((state.devices[0].present, state.devices[1].present), (1, 1));
    // Scene frame: x right, y away, z up, and the workspace 20 mm above the wound. Encoder steps below 0.1 mm.
    let second = Vec3::from(state.devices[1].position_m) * 1e3;
    assert!((second - Vec3::new(-30.0, -5.0, 30.0)).amax() < 0.1, "{second}");
    assert_eq!((state.devices[1].press_count, state.devices[0].press_count), ([0, 1], [0, 0]));
    assert_eq!((control::arrived_n(1), state.devices[1].force_n), (Vec3::zeros(), [0.0; 3]));
    let first_n = control::arrived_n(0);
    assert!(first_n.norm() > 1.0);

    rig.hold_second();
    rig.step(20);
    assert!(control::arrived_n(1).norm() < 0.1, "taking a point makes no force");
    for step in 1..=50 {
        control::lead(1, place + Vec3::new(0.0, 0.0, -0.1 * f64::from(step)));
        rig.step(1);
    }
    rig.step(200);
    // Series of Kvc = 400 N/m and the point's 300 N/m over 5 mm, against the pull, on the device's z axis.
    let expected = 5e-3 / (1.0 / 400.0 + 1.0 / 300.0);
    let second_n = control::arrived_n(1);
    assert!((second_n - Vec3::new(0.0, 0.0, expected)).amax() < 0.05 * expected, "{second_n}, not {expected}");
    assert!((control::arrived_n(0) - first_n).norm() < 0.02, "the first feels nothing of it");
    let state = rig.state();
    assert_eq!((state.handle_count, state.handles[2].mode), (4, 1));
}

#[test]
fn a_fault_of_the_second_device_is_latched_for_both_and_a_stop_still_ends() {
    let mut rig = Rig::start(&Setup::default(), Some("Default Device+Left Device"), NO_STALL);
    let place = Vec3::new(-30.0, 10.0, 5.0);
    control::lead(1, place);
    rig = rig.hold();
    rig.hold_second();
    rig.step(20);
    for step in 1..=50 {
        control::lead(1, place + Vec3::new(0.0, 0.0, -0.1 * f64::from(step)));
        rig.step(1);
    }
    // An error that trips the second device: both are without force, until the operator re-arms.
    control::inject(1, Fault::Error(0x0202));
    rig.step(60);
    assert_eq!((rig.mode(), control::arrived_n(0), control::arrived_n(1)), (Mode::Fault, Vec3::zeros(), Vec3::zeros()));
    rig.rearm();
    rig.step(2_700);
    assert_eq!((rig.mode(), rig.state().devices[1].present), (Mode::Active, 1), "{:?}", rig.told());
    for step in 1..=50 {
        control::lead(1, place + Vec3::new(0.0, 0.0, -5.0 - 0.1 * f64::from(step)));
        rig.step(1);
    }
    assert!(control::arrived_n(1).norm() > 0.3, "{}", control::arrived_n(1));
    // Its cable is pulled while it holds: the servo hears of it, and a stop ends.
    control::inject(1, Fault::Unplug);
    rig.step(5);
    rig.wait_until_lost();
    assert_eq!((rig.mode(), rig.state().devices[1].present), (Mode::Fault, 0));
    rig.stop();
}

#[test]
fn a_stop_fades_the_force_and_leaves_everything_closed() {
    let mut rig = Rig::holding();
    let _before = control::take_rows();
    rig.stop();
    let rows = control::take_rows();
    let last = rows.last().expect("the fade has frames");
    assert_eq!((last.asked_n, last.arrived_n), (Vec3::zeros(), Vec3::zeros()));
    assert!(rows.windows(2).all(|pair| (pair[1].asked_n - pair[0].asked_n).norm() <= 0.5 + 1e-9), "no step at the end");
    assert!(rows.len() <= 100, "50 ms of fade and its tail: {}", rows.len());
    assert!(!control::is_running() && !control::is_open(0));
}

#[test]
fn the_vendor_s_ramp_and_ours_let_the_first_force_rise_slowly() {
    let rig = Rig::start(&Setup::default(), None, NO_STALL);
    control::lead(0, Vec3::from(PLACE_MM));
    rig.step(2_400);
    rig.pull();
    for pair in control::take_rows().windows(2) {
        assert!((pair[1].arrived_n - pair[0].arrived_n).norm() < 0.55, "0.5 N of slew and one DAC step of each motor");
    }
}
