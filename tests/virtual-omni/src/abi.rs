//! The C interface: 36 functions with the names, types and meanings of the vendor's library.
//!
//! The unsafe edge of this package: exported names, a client's pointers, a client's callbacks. Nothing unwinds out of a
//! function: a panic becomes its fallback value. The current device is the one of the calling thread.
#![expect(unsafe_code, reason = "a C interface exports names and takes pointers and callbacks from its client")]

use crate::clockwork;
use crate::codes;
use crate::errors::{self, ErrorInfo};
use crate::parameters::{self, Kind, LONGEST};
use crate::scheduler::Callback;
use crate::world::{Timing, current, make_current, world};
use haptic_server::device::openhaptics::ffi::{HdCallback, HdErrorInfo, HdFunctions};
use std::ffi::{CStr, c_char, c_long, c_ulong, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

macro_rules! exports {
    ($(fn $name:ident($($arg:ident: $ty:ty),*) $(-> $ret:ty = $fallback:expr)?; $body:block)*) => { $(
        // SAFETY: no other object of a process that loads this one exports these names; that is its purpose.
        #[unsafe(no_mangle)]
        pub(crate) extern "C" fn $name($($arg: $ty),*) $(-> $ret)? {
            guarded(move || $body).unwrap_or_else(|| { $($fallback)? })
        }
    )* };
}

fn guarded<R>(work: impl FnOnce() -> R) -> Option<R> {
    catch_unwind(AssertUnwindSafe(work)).ok()
}

/// Calls a client.
pub(crate) fn call(callback: Callback) -> u32 {
    if callback.function == 0 {
        return codes::CALLBACK_DONE;
    }
    // SAFETY: the number was made from a client's function of this very type in `scheduled`.
    let function = unsafe { std::mem::transmute::<usize, HdCallback>(callback.function) };
    // SAFETY: the client promises that function and argument are good until it has unscheduled them.
    unsafe { function(callback.argument as *mut c_void) }
}

fn text<'a>(pointer: *const c_char) -> Option<&'a CStr> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: the client gives a string with an end, or null.
    Some(unsafe { CStr::from_ptr(pointer) })
}

fn give<T: Copy>(pointer: *mut T, values: &[T]) {
    if !pointer.is_null() {
        // SAFETY: the client gives room for the parameter that it names.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), pointer, values.len()) };
    }
}

fn take<T: Copy + Default>(pointer: *const T, count: usize) -> [T; LONGEST] {
    let mut values = [T::default(); LONGEST];
    if !pointer.is_null() {
        // SAFETY: the client gives as many numbers as the parameter that it names has.
        unsafe { std::ptr::copy_nonoverlapping(pointer, values.as_mut_ptr(), count.min(LONGEST)) };
    }
    values
}

fn read<T: Copy + Default>(parameter: u32, kind: Kind, out: *mut T, convert: impl Fn(f64) -> T) {
    let mut world = world();
    let rate_hz = world.rate_hz;
    let Some(device) = world.open_device(current()) else { return };
    match parameters::get(device, rate_hz, parameter) {
        None => world.complain(codes::INVALID_ENUM),
        Some(value) if !value.answers(kind) => world.complain(codes::INVALID_INPUT_TYPE),
        Some(value) => {
            let (numbers, count) = value.numbers();
            let values: [T; LONGEST] = numbers.map(convert);
            give(out, &values[..count]);
        }
    }
}

fn write<T: Copy + Default>(parameter: u32, kind: Kind, values: *const T, convert: impl Fn(T) -> f64) {
    let count = parameters::settable(parameter).map_or(0, |(count, _)| count);
    let values = take(values, count).map(convert);
    let mut world = world();
    let Some(device) = world.open_device(current()) else { return };
    if let Err(code) = parameters::set(device, parameter, kind, &values[..count]) {
        world.complain(code);
    }
}

fn switch(capability: u32, on: bool) {
    let mut world = world();
    let Some(device) = world.open_device(current()) else { return };
    match device.settings.switch(capability) {
        Some(switch) => *switch = on,
        None => world.complain(codes::INVALID_ENUM),
    }
}

fn scheduled(callback: Option<HdCallback>, argument: *mut c_void, priority: u16) -> Option<u64> {
    let function = callback.map_or(0, |function| function as usize);
    let handle = world().table.add(Callback { function, argument: argument as usize }, priority);
    if handle.is_none() {
        world().complain(codes::SCHEDULER_FULL);
    }
    handle
}

fn is_over(handle: u64) -> bool {
    !world().table.holds(handle)
}

exports! {
    fn hdInitDevice(name: *const c_char) -> u32 = codes::INVALID_HANDLE; {
        let mut world = world();
        if world.timing == Timing::Real {
            world.strike(protocol::ports::monotonic_ns());
        }
        let Some(handle) = world.named(text(name)) else {
            world.errors.push(codes::DEVICE_FAULT, 0, codes::INVALID_HANDLE);
            return codes::INVALID_HANDLE;
        };
        let device = &mut world.devices[handle as usize];
        match device.openable() {
            Ok(()) => {
                device.open();
                make_current(handle);
                handle
            }
            Err(code) => {
                world.errors.push(code, 0, codes::INVALID_HANDLE);
                codes::INVALID_HANDLE
            }
        }
    }
    fn hdDisableDevice(handle: u32); {
        let mut world = world();
        if let Some(device) = world.open_device(handle) {
            device.close();
            world.log.write();
        }
    }
    fn hdMakeCurrentDevice(handle: u32); {
        if world().open_device(handle).is_some() {
            make_current(handle);
        }
    }
    fn hdGetCurrentDevice() -> u32 = codes::INVALID_HANDLE; { current() }
    fn hdBeginFrame(handle: u32); { world().begin_frame(handle); }
    fn hdEndFrame(handle: u32); {
        let now_ns = clockwork::now_ns();
        world().end_frame(handle, now_ns);
    }
    fn hdGetError() -> ErrorInfo = ErrorInfo { code: codes::SUCCESS, internal: 0, device: codes::INVALID_HANDLE }; {
        world().errors.pop()
    }
    fn hdGetErrorString(code: u32) -> *const c_char = std::ptr::null(); { errors::text(code).as_ptr() }
    fn hdEnable(capability: u32); { switch(capability, true); }
    fn hdDisable(capability: u32); { switch(capability, false); }
    fn hdIsEnabled(capability: u32) -> u8 = 0; {
        let mut world = world();
        let Some(device) = world.open_device(current()) else { return 0 };
        match device.settings.switch(capability) {
            Some(switch) => u8::from(*switch),
            None => {
                world.complain(codes::INVALID_ENUM);
                0
            }
        }
    }
    fn hdGetBooleanv(parameter: u32, out: *mut u8); { read(parameter, Kind::Bool, out, |n| n as u8); }
    fn hdGetIntegerv(parameter: u32, out: *mut i32); { read(parameter, Kind::Int, out, |n| n as i32); }
    fn hdGetFloatv(parameter: u32, out: *mut f32); { read(parameter, Kind::Float, out, |n| n as f32); }
    fn hdGetDoublev(parameter: u32, out: *mut f64); { read(parameter, Kind::Double, out, |n| n); }
    fn hdGetLongv(parameter: u32, out: *mut c_long); { read(parameter, Kind::Long, out, |n| n as c_long); }
    fn hdGetString(parameter: u32) -> *const c_char = std::ptr::null(); {
        let mut world = world();
        let Some(_) = world.open_device(current()) else { return std::ptr::null() };
        let text = match parameter {
            codes::VERSION => c"3.30.0 virtual",
            codes::DEVICE_MODEL_TYPE => c"PHANTOM Omni",
            codes::DEVICE_DRIVER_VERSION => c"virtual",
            codes::DEVICE_VENDOR => c"none: virtual device",
            codes::DEVICE_SERIAL_NUMBER => c"00000000000",
            _ => {
                world.complain(codes::INVALID_ENUM);
                return std::ptr::null();
            }
        };
        text.as_ptr()
    }
    fn hdSetBooleanv(parameter: u32, values: *const u8); { write(parameter, Kind::Bool, values, f64::from); }
    fn hdSetIntegerv(parameter: u32, values: *const i32); { write(parameter, Kind::Int, values, f64::from); }
    fn hdSetFloatv(parameter: u32, values: *const f32); { write(parameter, Kind::Float, values, f64::from); }
    fn hdSetDoublev(parameter: u32, values: *const f64); { write(parameter, Kind::Double, values, |n| n); }
    fn hdSetLongv(parameter: u32, values: *const c_long); { write(parameter, Kind::Long, values, |n| n as f64); }
    fn hdCheckCalibration() -> u32 = codes::CALIBRATION_NEEDS_MANUAL_INPUT; {
        let mut world = world();
        world.open_device(current()).map_or(codes::CALIBRATION_NEEDS_MANUAL_INPUT, |d| d.calibration_code())
    }
    fn hdCheckCalibrationStyle() -> u32 = codes::CALIBRATION_INKWELL; { codes::CALIBRATION_INKWELL }
    fn hdUpdateCalibration(style: u32); {
        let mut world = world();
        let is_running = world.running;
        let Some(device) = world.open_device(current()) else { return };
        let updated = if style != codes::CALIBRATION_INKWELL {
            Err(codes::INVALID_VALUE)
        } else if is_running {
            device.calibrate()
        } else {
            Err(codes::INVALID_OPERATION)
        };
        if let Err(code) = updated {
            world.complain(code);
        }
    }
    fn hdUpdateCalibrationMessage(style: u32); { hdUpdateCalibration(style); }
    fn hdScaleGimbalAngles(_x: f64, _y: f64, _z: f64, matrix: *mut f64); {
        let transform = world().open_device(current()).map(|device| device.current.reading.transform());
        if let Some(transform) = transform {
            give(matrix, &transform);
        }
    }
    fn hdDeploymentLicense(_vendor: *const c_char, _application: *const c_char, _password: *const c_char) -> u8 = 0; { 1 }
    fn hdStartScheduler(); {
        if !clockwork::start() {
            world().complain(codes::INVALID_OPERATION);
        }
    }
    fn hdStopScheduler(); { clockwork::stop(); }
    fn hdSetSchedulerRate(hertz: c_ulong); {
        let mut world = world();
        match hertz {
            500 | 1_000 | 1_600 | 2_000 => world.rate_hz = hertz as u32,
            _ => world.complain(codes::INVALID_VALUE),
        }
    }
    fn hdScheduleSynchronous(callback: Option<HdCallback>, argument: *mut c_void, priority: u16); {
        if clockwork::is_in_tick() {
            call(Callback { function: callback.map_or(0, |function| function as usize), argument: argument as usize });
        } else if let Some(handle) = scheduled(callback, argument, priority) {
            clockwork::wait_until(|| is_over(handle));
        }
    }
    fn hdScheduleAsynchronous(callback: Option<HdCallback>, argument: *mut c_void, priority: u16) -> c_ulong = 0; {
        scheduled(callback, argument, priority).unwrap_or(0)
    }
    fn hdUnschedule(handle: c_ulong); {
        let mut world = world();
        if !world.table.remove(handle) {
            world.complain(codes::INVALID_OPERATION);
        }
    }
    fn hdWaitForCompletion(handle: c_ulong, code: u32) -> u8 = 0; {
        if code != codes::WAIT_CHECK_STATUS {
            clockwork::wait_until(|| is_over(handle));
        }
        u8::from(!is_over(handle))
    }
    fn hdGetSchedulerTimeStamp() -> f64 = 0.0; {
        let now_ns = clockwork::now_ns();
        now_ns.saturating_sub(world().tick_began_ns) as f64 * 1e-9
    }
}

extern "C" fn error_for_client() -> HdErrorInfo {
    let ErrorInfo { code, internal, device } = hdGetError();
    HdErrorInfo { code, internal, device }
}

/// The functions that a driver uses, without a shared library between: for tests that step.
#[must_use]
pub fn functions() -> HdFunctions {
    HdFunctions {
        init_device: hdInitDevice,
        disable_device: hdDisableDevice,
        make_current_device: hdMakeCurrentDevice,
        begin_frame: hdBeginFrame,
        end_frame: hdEndFrame,
        get_error: error_for_client,
        get_error_string: hdGetErrorString,
        enable: hdEnable,
        disable: hdDisable,
        get_boolean: hdGetBooleanv,
        get_integer: hdGetIntegerv,
        get_double: hdGetDoublev,
        get_string: hdGetString,
        set_double: hdSetDoublev,
        check_calibration: hdCheckCalibration,
        update_calibration: hdUpdateCalibration,
        start_scheduler: hdStartScheduler,
        stop_scheduler: hdStopScheduler,
        set_scheduler_rate: hdSetSchedulerRate,
        schedule_asynchronous: hdScheduleAsynchronous,
        unschedule: hdUnschedule,
        scheduler_time_stamp: hdGetSchedulerTimeStamp,
    }
}
