//! Everything there is, behind one lock: devices, error stack, scheduler, time.
//!
//! The handle of an open device is its number (0, 1). A client's thread has a current device of its own. The world is
//! made at the first call, from the environment ([`Setup::of_environment`]), or anew by a test.

use crate::codes;
use crate::device::{Calibration, VirtualDevice};
use crate::errors::ErrorStack;
use crate::eyes::Eyes;
use crate::faults::Script;
use crate::grip::{Grip, HeldBy};
use crate::log::{FrameLog, FrameRow};
use crate::scheduler::Table;
use haptic_server::rig;
use std::cell::Cell;
use std::ffi::{CStr, CString};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

thread_local! {
    static CURRENT: Cell<u32> = const { Cell::new(codes::INVALID_HANDLE) };
}

/// Who makes the ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// A thread at 1 kHz, with the jitter that was measured on a Touch.
    Real,
    /// A test, one by one.
    Stepped,
}

/// Who moves the stylus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mover {
    /// The test.
    Test,
    /// The synthetic surgeon, by eye.
    Synthetic,
    /// A recorded hand.
    Recorded(PathBuf),
}

/// What the world is made of.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Who makes the ticks.
    pub timing: Timing,
    /// Whether the devices are calibrated when they are opened.
    pub calibration: Calibration,
    /// Devices by name; each is moved by the test but the first.
    pub names: Vec<String>,
    /// Who moves the first device.
    pub mover: Mover,
    /// Helper process that sees for a hand.
    pub eyes: Option<PathBuf>,
    /// File for the frames.
    pub log: Option<PathBuf>,
    /// Faults of the first device.
    pub faults: String,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            timing: Timing::Stepped,
            calibration: Calibration::Kept,
            names: vec!["Default Device".to_owned(), "Left Device".to_owned()],
            mover: Mover::Test,
            eyes: None,
            log: None,
            faults: String::new(),
        }
    }
}

impl Setup {
    /// From `VIRTUAL_OMNI_HAND` (`synthetic`, a recording, or nothing), `VIRTUAL_OMNI_CALIBRATION` (`kept`, or nothing:
    /// missing), `VIRTUAL_OMNI_EYES` (the helper program), `VIRTUAL_OMNI_LOG` (a file) and `VIRTUAL_OMNI_FAULTS` (a script); timing is real.
    #[must_use]
    pub fn of_environment() -> Self {
        let text = |name: &str| std::env::var(name).unwrap_or_default();
        let calibration = match text("VIRTUAL_OMNI_CALIBRATION").as_str() {
            "kept" => Calibration::Kept,
            _ => Calibration::Missing,
        };
        let mover = match text("VIRTUAL_OMNI_HAND").as_str() {
            "" => Mover::Test,
            "synthetic" => Mover::Synthetic,
            file => Mover::Recorded(file.into()),
        };
        Self {
            timing: Timing::Real,
            calibration,
            mover,
            eyes: std::env::var_os("VIRTUAL_OMNI_EYES").map(PathBuf::from),
            log: std::env::var_os("VIRTUAL_OMNI_LOG").map(PathBuf::from),
            faults: text("VIRTUAL_OMNI_FAULTS"),
            ..Self::default()
        }
    }
}

/// Everything.
pub(crate) struct World {
    pub(crate) errors: ErrorStack,
    pub(crate) devices: Vec<VirtualDevice>,
    pub(crate) table: Table,
    pub(crate) timing: Timing,
    pub(crate) running: bool,
    pub(crate) rate_hz: u32,
    pub(crate) tick: u64,
    /// Monotonic or virtual nanoseconds.
    pub(crate) now_ns: u64,
    /// When the running tick began.
    pub(crate) tick_began_ns: u64,
    pub(crate) log: FrameLog,
    script: Script,
    scheduled_s: f64,
    /// Time of the first tick, nanoseconds.
    first_ns: Option<u64>,
}

static WORLD: Mutex<Option<World>> = Mutex::new(None);

/// The world, locked.
pub(crate) struct Locked(MutexGuard<'static, Option<World>>);

impl std::ops::Deref for Locked {
    type Target = World;

    fn deref(&self) -> &World {
        self.0.as_ref().expect("made when it was locked")
    }
}

impl std::ops::DerefMut for Locked {
    fn deref_mut(&mut self) -> &mut World {
        self.0.as_mut().expect("made when it was locked")
    }
}

/// Locks the world; makes it first if there is none.
pub(crate) fn world() -> Locked {
    let mut guard = WORLD.lock().unwrap_or_else(PoisonError::into_inner);
    guard.get_or_insert_with(|| World::new(&Setup::of_environment()));
    Locked(guard)
}

/// Makes the world anew.
pub(crate) fn renew(setup: &Setup) {
    let world = World::new(setup);
    *WORLD.lock().unwrap_or_else(PoisonError::into_inner) = Some(world);
}

/// The current device of this thread.
pub(crate) fn current() -> u32 {
    CURRENT.get()
}

/// Makes a device the current one of this thread.
pub(crate) fn make_current(device: u32) {
    CURRENT.set(device);
}

fn grip(mover: &Mover, eyes: Option<&Path>) -> Grip {
    let held = |hand, centre_m| {
        let frame = haptic_server::device::frame::SceneFromDevice::workspace_at(centre_m);
        Grip::Held(Box::new(HeldBy { hand, eyes: Eyes::open(eyes), frame }))
    };
    match mover {
        Mover::Test => Grip::Led,
        Mover::Synthetic => {
            let centre_m = rig::workspace_centre_m();
            let frame = haptic_server::device::frame::SceneFromDevice::workspace_at(centre_m);
            held(rig::synthetic_hand(frame.point(crate::arm::inkwell_m())), centre_m)
        }
        Mover::Recorded(path) => match rig::recorded_hand(Path::new(path)) {
            Ok(hand) => held(hand, rig::workspace_centre_m()),
            Err(error) => {
                // Nothing can be done when stderr is gone.
                let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("virtual device: {error}\n"));
                Grip::Led
            }
        },
    }
}

impl World {
    fn new(setup: &Setup) -> Self {
        let device = |(i, name): (usize, &String)| {
            let name = CString::new(name.as_str()).unwrap_or_default();
            VirtualDevice::new(
                name,
                setup.calibration,
                if i == 0 { grip(&setup.mover, setup.eyes.as_deref()) } else { Grip::Led },
            )
        };
        Self {
            errors: ErrorStack::new(),
            devices: setup.names.iter().enumerate().map(device).collect(),
            table: Table::default(),
            timing: setup.timing,
            running: false,
            rate_hz: 1_000,
            tick: 0,
            now_ns: 1_000_000_000,
            tick_began_ns: 1_000_000_000,
            log: FrameLog::new(setup.log.clone()),
            script: Script::parse(&setup.faults),
            scheduled_s: 0.0,
            first_ns: None,
        }
    }

    /// The device of this name, or the first for no name; `None`: there is none.
    pub(crate) fn named(&self, name: Option<&CStr>) -> Option<u32> {
        let found = match name {
            None => Some(0),
            Some(name) => self.devices.iter().position(|device| device.name.as_c_str() == name),
        };
        found.and_then(|i| u32::try_from(i).ok())
    }

    /// An open device; otherwise the error is on the stack.
    pub(crate) fn open_device(&mut self, handle: u32) -> Option<&mut VirtualDevice> {
        let is_open = self.devices.get(handle as usize).is_some_and(|device| device.open);
        if !is_open {
            self.errors.push(codes::BAD_HANDLE, 0, handle);
            return None;
        }
        self.devices.get_mut(handle as usize)
    }

    /// An error of this thread's current device.
    pub(crate) fn complain(&mut self, code: u32) {
        self.errors.push(code, 0, current());
    }

    /// A tick begins: time has passed for every device, faults of the script strike.
    pub(crate) fn begin_tick(&mut self, dt_s: f64, now_ns: u64) -> u64 {
        self.first_ns.get_or_insert(now_ns);
        self.pass(dt_s, now_ns);
        self.tick += 1;
        self.tick_began_ns = now_ns;
        self.tick
    }

    /// Time passes, whether or not there is a tick.
    pub(crate) fn pass(&mut self, dt_s: f64, now_ns: u64) {
        self.now_ns = now_ns;
        self.scheduled_s += dt_s;
        self.strike(now_ns);
        for device in &mut self.devices {
            device.pass(dt_s);
        }
    }

    /// Faults of the script strike that are due: by the clock since the first tick, so that a cable comes back while nobody
    /// ticks; by the ticks when a test makes them.
    pub(crate) fn strike(&mut self, now_ns: u64) {
        let since_s = match (self.timing, self.first_ns) {
            (Timing::Real, Some(first_ns)) => now_ns.saturating_sub(first_ns) as f64 * 1e-9,
            _ => self.scheduled_s,
        };
        while let Some(fault) = self.script.due(since_s) {
            if let Some(device) = self.devices.first_mut() {
                device.suffer(fault);
            }
        }
    }

    /// A frame begins.
    pub(crate) fn begin_frame(&mut self, handle: u32) {
        let tick = self.tick;
        let Some(device) = self.open_device(handle) else { return };
        make_current(handle);
        match device.begin(tick) {
            Ok(errors) => {
                for code in errors {
                    // What the vendor's driver says inside of a broken connection.
                    let internal = if code == codes::COMM_ERROR { -28 } else { 0 };
                    self.errors.push(code, internal, handle);
                }
            }
            Err(code) => self.errors.push(code, 0, handle),
        }
    }

    /// A frame ends: the force arrives.
    pub(crate) fn end_frame(&mut self, handle: u32, time_ns: u64) {
        let Some(device) = self.open_device(handle) else { return };
        match device.end() {
            Ok(asked_n) => {
                let reading = device.current.reading;
                let arrived_n = device.motors.force_n;
                let row = FrameRow {
                    time_ns,
                    device: handle,
                    asked_n,
                    arrived_n,
                    torque_error_nm: reading.torque(asked_n) - device.motors.torque_nm,
                    position_mm: device.stylus.state.position_m * 1e3,
                };
                self.log.push(row);
            }
            Err(code) => self.errors.push(code, 0, handle),
        }
    }
}
