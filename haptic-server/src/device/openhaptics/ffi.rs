//! The edge to the vendor's library: types, functions, and safe calls. The only unsafe code of the driver.
//!
//! | C | here |
//! |---|---|
//! | `HDErrorInfo` by value | [`HdErrorInfo`], 12 bytes, checked at compile time |
//! | `HDSchedulerCallback` | [`HdCallback`]; a panic inside ends the callback, it never unwinds into C |
//! | arrays of a parameter | buffers of 32 numbers, twice what any parameter has |
//! | a library | loaded once, never closed: the vendor's driver does not survive a second loading |
//!
//! Sizes and numbers were written down from the interface's description; no vendor header is used.
//! Deliberately absent: what an error means (`severity.rs`), when what is called (`frame_loop.rs`, `keeper.rs`).
#![expect(unsafe_code, reason = "a C library is called, and it calls back")]

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_LAZY};
use std::ffi::{CStr, c_char, c_ulong, c_void};
use std::mem::offset_of;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Numbers that any parameter fits into.
const BUFFER: usize = 32;

/// A callback of the scheduler.
// SAFETY: the type is unsafe to call, because only who scheduled it knows what its argument points to.
pub type HdCallback = unsafe extern "C" fn(*mut c_void) -> u32;

/// An error as the library gives it, by value.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HdErrorInfo {
    /// Code, 0 for none.
    pub code: u32,
    /// The driver's own code.
    pub internal: i32,
    /// Device it belongs to.
    pub device: u32,
}

const _: () = assert!(size_of::<HdErrorInfo>() == 12 && align_of::<HdErrorInfo>() == 4);
const _: () = assert!(offset_of!(HdErrorInfo, internal) == 4 && offset_of!(HdErrorInfo, device) == 8);
const _: () = assert!(size_of::<c_ulong>() == 8 && size_of::<HdCallback>() == 8, "64-bit Linux only");

macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($arg:ty),*) $(-> $ret:ty)?;)*) => {
        /// The functions of the library that this driver uses.
        #[derive(Clone, Copy)]
        #[expect(missing_docs, reason = "each is the C function of the like name")]
        pub struct HdFunctions {
            // SAFETY: the types are unsafe to call; the calls stand below, each with its reason.
            $(pub $field: unsafe extern "C" fn($($arg),*) $(-> $ret)?,)*
        }

        /// Their names.
        pub const SYMBOLS: &[&str] = &[$($symbol),*];

        fn resolve(library: &Library) -> Result<HdFunctions, (&'static str, libloading::Error)> {
            Ok(HdFunctions {
                // SAFETY: the types are those of the interface's description; both published versions have them.
                $($field: *unsafe { library.get(concat!($symbol, "\0").as_bytes()) }.map_err(|e| ($symbol, e))?,)*
            })
        }
    };
}

functions! {
    init_device = "hdInitDevice": fn(*const c_char) -> u32;
    disable_device = "hdDisableDevice": fn(u32);
    make_current_device = "hdMakeCurrentDevice": fn(u32);
    begin_frame = "hdBeginFrame": fn(u32);
    end_frame = "hdEndFrame": fn(u32);
    get_error = "hdGetError": fn() -> HdErrorInfo;
    get_error_string = "hdGetErrorString": fn(u32) -> *const c_char;
    enable = "hdEnable": fn(u32);
    disable = "hdDisable": fn(u32);
    get_boolean = "hdGetBooleanv": fn(u32, *mut u8);
    get_integer = "hdGetIntegerv": fn(u32, *mut i32);
    get_double = "hdGetDoublev": fn(u32, *mut f64);
    get_string = "hdGetString": fn(u32) -> *const c_char;
    set_double = "hdSetDoublev": fn(u32, *const f64);
    check_calibration = "hdCheckCalibration": fn() -> u32;
    update_calibration = "hdUpdateCalibration": fn(u32);
    start_scheduler = "hdStartScheduler": fn();
    stop_scheduler = "hdStopScheduler": fn();
    set_scheduler_rate = "hdSetSchedulerRate": fn(c_ulong);
    schedule_asynchronous = "hdScheduleAsynchronous": fn(Option<HdCallback>, *mut c_void, u16) -> c_ulong;
    unschedule = "hdUnschedule": fn(c_ulong);
    scheduler_time_stamp = "hdGetSchedulerTimeStamp": fn() -> f64;
}

/// Opens a library for good and resolves every function.
///
/// # Errors
/// The symbol (`None`: the library itself) and what the loader says.
pub fn load(path: &Path) -> Result<HdFunctions, (Option<&'static str>, libloading::Error)> {
    // SAFETY: a library's initialisers run; who names a library, or installs it where it is found, vouches for it.
    let library = unsafe { Library::open(Some(path), RTLD_LAZY | RTLD_GLOBAL) }.map_err(|e| (None, e))?;
    // Never closed, whatever the symbols turn out to be: the driver fails when it is loaded a second time.
    let library: &'static Library = Box::leak(Box::new(library));
    resolve(library).map_err(|(symbol, e)| (Some(symbol), e))
}

/// Whether a callback wants to be called again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// In the next tick.
    GoOn,
    /// Never again.
    End,
}

/// The library, with calls that cannot go wrong for the memory.
#[derive(Clone, Copy)]
pub struct Hd {
    functions: HdFunctions,
}

macro_rules! calls {
    ($($(#[$doc:meta])* fn $name:ident($($arg:ident: $ty:ty),*) $(-> $ret:ty)? = $field:ident;)*) => { $(
        $(#[$doc])*
        pub fn $name(&self, $($arg: $ty),*) $(-> $ret)? {
            // SAFETY: numbers in, numbers out; the library checks handles and codes itself.
            unsafe { (self.functions.$field)($($arg),*) }
        }
    )* };
}

impl Hd {
    /// These functions.
    #[must_use]
    pub fn new(functions: HdFunctions) -> Self {
        Self { functions }
    }

    calls! {
        /// Closes a device.
        fn disable_device(device: u32) = disable_device;
        /// Parameters now belong to this device, in this thread.
        fn make_current(device: u32) = make_current_device;
        /// Begins a frame: the sensors are latched, the force is zero.
        fn begin_frame(device: u32) = begin_frame;
        /// Ends a frame: the force goes out.
        fn end_frame(device: u32) = end_frame;
        /// Switches a capability on.
        fn enable(capability: u32) = enable;
        /// Switches a capability off.
        fn disable(capability: u32) = disable;
        /// Asks for the calibration.
        fn check_calibration() -> u32 = check_calibration;
        /// Updates the calibration.
        fn update_calibration(style: u32) = update_calibration;
        /// Rate of the scheduler, hertz.
        fn set_scheduler_rate(hertz: c_ulong) = set_scheduler_rate;
        /// Time since the tick began, seconds.
        fn scheduler_time_stamp() -> f64 = scheduler_time_stamp;
    }

    /// Opens a device by its name, or the default one.
    #[must_use]
    pub fn init_device(&self, name: Option<&CStr>) -> u32 {
        // SAFETY: null or a string with an end, which the library only reads.
        unsafe { (self.functions.init_device)(name.map_or(std::ptr::null(), CStr::as_ptr)) }
    }

    /// The newest error, taken off the stack.
    #[must_use]
    pub fn pop_error(&self) -> Option<HdErrorInfo> {
        // SAFETY: the structure comes back by value, as declared above.
        let error = unsafe { (self.functions.get_error)() };
        (error.code != super::codes::SUCCESS).then_some(error)
    }

    /// What the library says about a code.
    #[must_use]
    pub fn error_text(&self, code: u32) -> String {
        // SAFETY: a number in, a string out.
        text(unsafe { (self.functions.get_error_string)(code) })
    }

    /// A string parameter; empty when there is none.
    #[must_use]
    pub fn string(&self, parameter: u32) -> String {
        // SAFETY: a number in, a string out.
        text(unsafe { (self.functions.get_string)(parameter) })
    }

    /// A switch.
    #[must_use]
    pub fn boolean(&self, parameter: u32) -> bool {
        let mut values = [0_u8; BUFFER];
        // SAFETY: the buffer is larger than any parameter.
        unsafe { (self.functions.get_boolean)(parameter, values.as_mut_ptr()) };
        values[0] != 0
    }

    /// A whole number.
    #[must_use]
    pub fn integer(&self, parameter: u32) -> i32 {
        let mut values = [0_i32; BUFFER];
        // SAFETY: the buffer is larger than any parameter.
        unsafe { (self.functions.get_integer)(parameter, values.as_mut_ptr()) };
        values[0]
    }

    /// Numbers, at most 32; those that the library does not give are zero.
    #[must_use]
    pub fn doubles<const N: usize>(&self, parameter: u32) -> [f64; N] {
        let mut values = [0.0; BUFFER];
        // SAFETY: the buffer is larger than any parameter.
        unsafe { (self.functions.get_double)(parameter, values.as_mut_ptr()) };
        std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
    }

    /// Sets three numbers.
    pub fn set_triple(&self, parameter: u32, values: [f64; 3]) {
        // SAFETY: only parameters of three numbers at most are set by this driver.
        unsafe { (self.functions.set_double)(parameter, values.as_ptr()) };
    }

    /// Schedules `work` at the highest priority, starts the scheduler, runs `meanwhile`, stops the scheduler and takes
    /// `work` off: when this returns, `work` does not run and never will again.
    pub fn while_scheduled<R>(&self, work: &(dyn Fn() -> Next + Sync), meanwhile: impl FnOnce(&Job<'_>) -> R) -> R {
        let job = Job { work, inside: AtomicBool::new(false), broke: AtomicBool::new(false) };
        let argument = std::ptr::from_ref(&job).cast_mut().cast::<c_void>();
        // SAFETY: the job outlives the schedule, which `Scheduled` ends even when `meanwhile` panics.
        let handle = unsafe { (self.functions.schedule_asynchronous)(Some(trampoline), argument, u16::MAX) };
        let _ends_here = Scheduled { hd: self, handle, job: &job };
        // SAFETY: no argument.
        unsafe { (self.functions.start_scheduler)() };
        meanwhile(&job)
    }
}

/// A piece of work as the library's thread sees it.
pub struct Job<'a> {
    work: &'a (dyn Fn() -> Next + Sync),
    inside: AtomicBool,
    broke: AtomicBool,
}

impl Job<'_> {
    /// Whether the work has panicked; it is not called again then.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.broke.load(Ordering::Acquire)
    }
}

struct Scheduled<'a, 'b> {
    hd: &'a Hd,
    handle: c_ulong,
    job: &'a Job<'b>,
}

impl Drop for Scheduled<'_, '_> {
    fn drop(&mut self) {
        // SAFETY: no argument.
        unsafe { (self.hd.functions.stop_scheduler)() };
        // SAFETY: a handle that this schedule was given; one that has ended is an error on the stack, nothing else.
        unsafe { (self.hd.functions.unschedule)(self.handle) };
        while self.job.inside.load(Ordering::Acquire) {
            std::thread::yield_now();
        }
    }
}

extern "C" fn trampoline(argument: *mut c_void) -> u32 {
    // SAFETY: `while_scheduled` gave this pointer, and keeps what it points to until the schedule has ended.
    let job = unsafe { &*argument.cast::<Job<'_>>() };
    job.inside.store(true, Ordering::Release);
    let next = catch_unwind(AssertUnwindSafe(|| (job.work)()));
    job.broke.fetch_or(next.is_err(), Ordering::Release);
    job.inside.store(false, Ordering::Release);
    u32::from(matches!(next, Ok(Next::GoOn)))
}

fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the library gives static strings with an end.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// Something that one thread hands to another and takes back; never used by both at a time.
pub(super) struct HandedOver<T>(pub(super) T);

// SAFETY: the servo thread hands its room to the library's thread behind a mutex, works on it only while that mutex is
// its own, and outlives it: `Device::run` returns after the scheduler has stopped.
unsafe impl<T> Send for HandedOver<T> {}
