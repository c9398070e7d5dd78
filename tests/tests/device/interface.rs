//! The interface's semantics, called as the driver calls it, and its numbers, compared with the driver's.

use crate::alone;
use haptic_server::device::openhaptics::codes as driver;
use haptic_server::device::openhaptics::ffi::{Hd, Next, SYMBOLS};
use haptic_server::device::openhaptics::{library, severity};
use sim_core::vector::Vec3;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use suture_tests::processes::virtual_omni;
use virtual_omni::{Calibration, Fault, Setup, codes, control, functions};

fn opened(setup: &Setup) -> Hd {
    control::reset(setup);
    let hd = Hd::new(functions());
    assert_eq!(hd.init_device(None), 0);
    hd
}

fn codes_of(hd: &Hd) -> Vec<u32> {
    std::iter::from_fn(|| hd.pop_error()).map(|error| error.code).collect()
}

#[test]
fn driver_and_virtual_library_have_the_same_numbers() {
    for (ours, theirs) in [
        (driver::INVALID_HANDLE, codes::INVALID_HANDLE),
        (driver::CURRENT_BUTTONS, codes::CURRENT_BUTTONS),
        (driver::CURRENT_INKWELL_SWITCH, codes::CURRENT_INKWELL_SWITCH),
        (driver::CURRENT_POSITION, codes::CURRENT_POSITION),
        (driver::CURRENT_TRANSFORM, codes::CURRENT_TRANSFORM),
        (driver::CURRENT_FORCE, codes::CURRENT_FORCE),
        (driver::DEVICE_MODEL_TYPE, codes::DEVICE_MODEL_TYPE),
        (driver::DEVICE_DRIVER_VERSION, codes::DEVICE_DRIVER_VERSION),
        (driver::DEVICE_SERIAL_NUMBER, codes::DEVICE_SERIAL_NUMBER),
        (driver::CALIBRATION_STYLE, codes::CALIBRATION_STYLE),
        (driver::NOMINAL_MAX_STIFFNESS, codes::NOMINAL_MAX_STIFFNESS),
        (driver::NOMINAL_MAX_FORCE, codes::NOMINAL_MAX_FORCE),
        (driver::NOMINAL_MAX_CONTINUOUS_FORCE, codes::NOMINAL_MAX_CONTINUOUS_FORCE),
        (driver::MOTOR_TEMPERATURE, codes::MOTOR_TEMPERATURE),
        (driver::FORCE_OUTPUT, codes::FORCE_OUTPUT),
        (driver::MAX_FORCE_CLAMPING, codes::MAX_FORCE_CLAMPING),
        (driver::FORCE_RAMPING, codes::FORCE_RAMPING),
        (driver::CALIBRATION_OK, codes::CALIBRATION_OK),
        (driver::CALIBRATION_NEEDS_UPDATE, codes::CALIBRATION_NEEDS_UPDATE),
        (driver::CALIBRATION_INKWELL, codes::CALIBRATION_INKWELL),
    ] {
        assert_eq!(ours, theirs);
    }
    for (code, name) in codes::ERRORS {
        let known = code == codes::SUCCESS || severity::TABLE.iter().any(|row| row.code == code);
        assert!(known, "{code:#06x} ({name:?}) has no row in the severity table");
    }
}

#[test]
fn calls_out_of_order_leave_their_errors_on_the_stack_newest_first() {
    let _alone = alone();
    let hd = opened(&Setup::default());
    hd.set_triple(driver::CURRENT_FORCE, [0.1, 0.0, 0.0]);
    hd.end_frame(0);
    hd.begin_frame(0);
    hd.begin_frame(0);
    let _ = hd.doubles::<3>(0x2FFF);
    let _ = hd.integer(driver::CURRENT_POSITION);
    hd.begin_frame(7);
    let newest_first = [
        codes::BAD_HANDLE,
        codes::INVALID_INPUT_TYPE,
        codes::INVALID_ENUM,
        codes::ILLEGAL_BEGIN,
        codes::ILLEGAL_END,
        codes::FRAME_ERROR,
    ];
    assert_eq!(codes_of(&hd), newest_first);
    assert_eq!(hd.error_text(codes::FRAME_ERROR), "call outside a frame");
    assert_eq!(hd.init_device(None), driver::INVALID_HANDLE);
    assert_eq!(codes_of(&hd), [codes::DEVICE_ALREADY_INITIATED]);
    assert_eq!(hd.init_device(Some(c"nobody")), driver::INVALID_HANDLE);
    assert_eq!(codes_of(&hd), [codes::DEVICE_FAULT]);
}

#[test]
fn two_devices_have_a_frame_each_and_a_thread_its_own_current_device() {
    let _alone = alone();
    let hd = opened(&Setup::default());
    assert_eq!(hd.init_device(Some(c"Left Device")), 1);
    control::lead(0, Vec3::new(10.0, 0.0, 0.0));
    control::lead(1, Vec3::new(-10.0, 0.0, 0.0));
    hd.begin_frame(0);
    hd.begin_frame(1);
    let x = |hd: &Hd| hd.doubles::<3>(driver::CURRENT_POSITION)[0];
    assert!(x(&hd) < -9.9, "the one that was begun last is current");
    hd.make_current(0);
    assert!(x(&hd) > 9.9);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let _none = x(&hd);
            assert_eq!(codes_of(&hd), [codes::BAD_HANDLE], "a new thread has no current device");
        });
    });
    hd.end_frame(1);
    hd.end_frame(0);
    assert_eq!(codes_of(&hd), [0_u32; 0]);
}

#[test]
fn a_callback_runs_once_per_tick_and_forces_vanish_when_a_frame_sets_none() {
    let _alone = alone();
    let hd = opened(&Setup::default());
    hd.enable(codes::FORCE_OUTPUT);
    hd.disable(codes::FORCE_RAMPING);
    control::lead(0, Vec3::zeros());
    let ticks = AtomicU32::new(0);
    let arrived = Mutex::new(Vec::new());
    let work = || {
        hd.begin_frame(0);
        let tick = ticks.fetch_add(1, Ordering::Relaxed) + 1;
        if !tick.is_multiple_of(2) {
            hd.set_triple(driver::CURRENT_FORCE, [0.0, 1.0, 0.0]);
        }
        hd.end_frame(0);
        arrived.lock().expect("one thread").push(control::arrived_n(0).y);
        if tick == 4 { Next::End } else { Next::GoOn }
    };
    hd.while_scheduled(&work, |_| control::step(10));
    let arrived = arrived.into_inner().expect("one thread");
    assert_eq!(arrived.len(), 4, "a callback that is done is not called again");
    assert!(arrived.iter().enumerate().all(|(i, n)| (n - f64::from(u8::from(i % 2 == 0))).abs() < 0.01), "{arrived:?}");
    assert!(!control::is_running());
}

#[test]
fn a_panic_in_a_callback_ends_the_callback_and_nothing_else() {
    let _alone = alone();
    let hd = opened(&Setup::default());
    let work = || -> Next { std::panic::resume_unwind(Box::new("broken")) };
    let broken = hd.while_scheduled(&work, |job| {
        control::step(3);
        job.is_broken()
    });
    assert!(broken);
    let _unscheduled = codes_of(&hd);
    hd.begin_frame(0);
    assert_eq!(codes_of(&hd), [0_u32; 0], "the library still works");
}

#[test]
fn the_inkwell_calibrates_and_the_position_jumps() {
    let _alone = alone();
    let hd = opened(&Setup { calibration: Calibration::Missing, ..Setup::default() });
    control::lead(0, Vec3::zeros());
    assert_eq!(hd.check_calibration(), codes::CALIBRATION_NEEDS_MANUAL_INPUT);
    control::dock(0);
    assert_eq!(hd.check_calibration(), codes::CALIBRATION_NEEDS_UPDATE);
    hd.update_calibration(codes::CALIBRATION_INKWELL);
    assert_eq!(codes_of(&hd), [codes::INVALID_OPERATION], "the scheduler has to run");
    hd.while_scheduled(&|| Next::GoOn, |_| {
        let read = |hd: &Hd| {
            control::step(1);
            hd.begin_frame(0);
            hd.end_frame(0);
            Vec3::from(hd.doubles::<3>(driver::CURRENT_POSITION))
        };
        let before = read(&hd);
        hd.update_calibration(codes::CALIBRATION_INKWELL);
        let after = read(&hd);
        assert!((after - before).norm() > 5.0, "from {before} to {after}");
        assert_eq!(hd.check_calibration(), codes::CALIBRATION_OK);
    });
}

#[test]
fn an_unplugged_and_a_locked_device_cannot_be_opened() {
    let _alone = alone();
    control::reset(&Setup::default());
    let hd = Hd::new(functions());
    for (fault, code) in [(Fault::Unplug, codes::DEVICE_FAULT), (Fault::Lock, codes::COMM_CONFIG_ERROR)] {
        control::inject(0, fault);
        assert_eq!(hd.init_device(None), driver::INVALID_HANDLE);
        assert_eq!(codes_of(&hd), [code]);
    }
}

#[test]
fn the_shared_library_loads_by_path_and_answers() {
    let path = virtual_omni();
    let (hd, loaded) = library::load(Some(&path)).expect("every symbol is there");
    assert_eq!((loaded, SYMBOLS.len()), (path, 22));
    assert_eq!(hd.init_device(Some(c"nobody")), driver::INVALID_HANDLE);
    let error = hd.pop_error().expect("an error by value, of twelve bytes");
    assert_eq!((error.code, error.internal, error.device), (codes::DEVICE_FAULT, 0, driver::INVALID_HANDLE));
    let device = hd.init_device(None);
    assert_eq!((device, hd.string(driver::DEVICE_MODEL_TYPE).as_str()), (0, "PHANTOM Omni"));
    assert_eq!(hd.doubles::<1>(driver::NOMINAL_MAX_STIFFNESS), [0.5]);
    hd.disable_device(device);
    assert_eq!(hd.pop_error(), None);
}
