//! An Omni or Touch through the vendor's OpenHaptics library, which is loaded when the program runs.
//!
//! | file | work |
//! |---|---|
//! | `library` | find and load it; say why not, with the remedy |
//! | `ffi` | the unsafe edge: functions, error structure, callback |
//! | `codes`, `severity` | numbers of the interface; what each error means |
//! | `state` | the way to forces: calibrated, on, tripped, lost |
//! | `thermal` | force taken back before the motors are too warm |
//! | `reading`, `arm` | from a frame to a sample, from a force to a frame |
//! | `frame_loop`, `keeper` | the tick; which thread runs it; losing and finding the device |
//!
//! The library owns the clock and calls the servo's tick (1 kHz, highest priority, one callback for all devices). Limits are
//! read from the device; the servo takes the smaller of them and its configuration. Two devices: `openhaptics:LEFT+RIGHT`.
//! No vendor file and no vendor text is part of this.

mod arm;
pub mod codes;
pub mod ffi;
mod frame_loop;
mod keeper;
pub mod library;
pub mod notice;
mod reading;
pub mod severity;
pub mod state;
pub mod thermal;

use super::frame::SceneFromDevice;
use super::notice::{NOTICES, NoticeRing};
use super::{Device, DeviceLimits, ServoRoom};
use arm::Arm;
use ffi::Hd;
use frame_loop::{FrameLoop, MOST};
pub use keeper::KeeperParams;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rate of the scheduler, hertz.
const RATE_HZ: u64 = 1_000;
/// A device that says that it is open already is asked again so often.
const OPEN_ATTEMPTS: u32 = 3;
/// Largest nominal values that are believed: newtons, newtons, newtons per millimetre.
const BELIEVABLE: [f64; 3] = [40.0, 40.0, 10.0];

/// Why the device cannot be driven.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpenError {
    /// The library.
    #[error(transparent)]
    Library(#[from] library::LibraryError),
    /// A name that is none, or too many.
    #[error("{0:?} does not name one or two devices; give --device openhaptics:NAME or openhaptics:LEFT+RIGHT")]
    Names(String),
    /// The device.
    #[error("the haptic device {name} cannot be opened: OpenHaptics error {code:#06x} ({text}): {meaning}")]
    Device {
        /// Its name.
        name: String,
        /// Code.
        code: u32,
        /// What the library calls it.
        text: String,
        /// What it means.
        meaning: &'static str,
    },
    /// A nominal value that cannot be.
    #[error(
        "the haptic device {name} says that its {what} is {value}; run the vendor's set-up, its configuration is broken"
    )]
    Nominal {
        /// Its name.
        name: String,
        /// Which value.
        what: &'static str,
        /// What it says.
        value: f64,
    },
}

/// One or two devices, open, motors off.
pub struct OpenHaptics {
    work: FrameLoop,
    names: Vec<Option<CString>>,
    limits: DeviceLimits,
    params: KeeperParams,
    description: String,
}

impl OpenHaptics {
    /// Loads the library and opens the devices.
    ///
    /// # Errors
    /// [`OpenError`] says what is missing and what to do.
    pub fn open(names: Option<&str>, library: Option<&Path>, frame: SceneFromDevice) -> Result<Self, OpenError> {
        let (hd, path): (Hd, PathBuf) = library::load(library)?;
        let mut device = Self::with(hd, names, KeeperParams::default(), frame)?;
        device.description = format!("{}, library {}", device.description, path.display());
        Ok(device)
    }

    /// Opens the devices behind these functions.
    ///
    /// # Errors
    /// [`OpenError`] says what is missing and what to do.
    pub fn with(hd: Hd, names: Option<&str>, params: KeeperParams, frame: SceneFromDevice) -> Result<Self, OpenError> {
        let names = parse_names(names)?;
        while hd.pop_error().is_some() {}
        let mut arms: Vec<Arm> = Vec::new();
        let mut all = Vec::new();
        let mut descriptions = Vec::new();
        for (index, name) in (0..).zip(&names) {
            let opened = open_one(&hd, name.as_ref()).and_then(|handle| {
                prepare(&hd, handle);
                nominal(&hd, handle, label(name.as_ref())).map(|limits| (handle, limits))
            });
            let (handle, limits) = opened.inspect_err(|_| {
                for arm in &arms {
                    hd.disable_device(arm.handle());
                }
            })?;
            descriptions.push(format!(
                "{} ({}, serial {}, driver {})",
                label(name.as_ref()),
                hd.string(codes::DEVICE_MODEL_TYPE),
                hd.string(codes::DEVICE_SERIAL_NUMBER),
                hd.string(codes::DEVICE_DRIVER_VERSION)
            ));
            let style = codes::preferred_style(hd.integer(codes::CALIBRATION_STYLE));
            arms.push(Arm::new(index, handle, style, limits, frame));
            all.push(limits);
        }
        hd.set_scheduler_rate(RATE_HZ);
        while hd.pop_error().is_some() {}
        let ring = Arc::new(NoticeRing::new(NOTICES));
        let limits = all.into_iter().reduce(DeviceLimits::smaller).unwrap_or(DeviceLimits::OMNI);
        let description = descriptions.join(" and ");
        Ok(Self { work: FrameLoop { hd, arms, ring }, names, limits, params, description })
    }

    /// Model, serial number and versions, for the log.
    #[must_use]
    pub fn description(&self) -> &str {
        &self.description
    }
}

/// A device that was opened and never run (a start that failed later on) is closed, motors off.
impl Drop for OpenHaptics {
    fn drop(&mut self) {
        for arm in &self.work.arms {
            self.work.hd.disable_device(arm.handle());
        }
    }
}

impl Device for OpenHaptics {
    fn name(&self) -> &str {
        "openhaptics"
    }

    fn limits(&self) -> DeviceLimits {
        self.limits
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        keeper::run(&mut self.work, &self.names, &self.params, room);
        // The keeper has closed them.
        self.work.arms.clear();
    }

    fn notices(&self) -> Option<Arc<NoticeRing>> {
        Some(self.work.ring.clone())
    }
}

/// `None`, one name, or two with a plus between.
fn parse_names(names: Option<&str>) -> Result<Vec<Option<CString>>, OpenError> {
    let Some(names) = names else { return Ok(vec![None]) };
    let refused = || OpenError::Names(names.to_owned());
    let parsed: Result<Vec<_>, _> = names
        .split('+')
        .map(|name| CString::new(name).ok().filter(|n| !n.is_empty()).map(Some).ok_or_else(refused))
        .collect();
    parsed.and_then(|list| if list.len() <= MOST { Ok(list) } else { Err(refused()) })
}

fn label(name: Option<&CString>) -> String {
    name.map_or_else(|| "by default".to_owned(), |n| format!("{:?}", n.to_string_lossy()))
}

fn open_one(hd: &Hd, name: Option<&CString>) -> Result<u32, OpenError> {
    let mut code = codes::SUCCESS;
    for _ in 0..OPEN_ATTEMPTS {
        let handle = hd.init_device(name.map(CString::as_c_str));
        code = hd.pop_error().map_or(codes::SUCCESS, |error| error.code);
        while hd.pop_error().is_some() {}
        if handle != codes::INVALID_HANDLE {
            return Ok(handle);
        }
        if code != severity::DEVICE_ALREADY_INITIATED {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let meaning = severity::of(code).meaning;
    Err(OpenError::Device { name: label(name), code, text: hd.error_text(code), meaning })
}

/// Motors off, and the library's own safeguards on.
fn prepare(hd: &Hd, handle: u32) {
    hd.make_current(handle);
    hd.disable(codes::FORCE_OUTPUT);
    hd.enable(codes::MAX_FORCE_CLAMPING);
    hd.enable(codes::FORCE_RAMPING);
}

/// What the device can do, by its own word.
fn nominal(hd: &Hd, handle: u32, name: String) -> Result<DeviceLimits, OpenError> {
    let asked = [
        (codes::NOMINAL_MAX_FORCE, "nominal force (N)"),
        (codes::NOMINAL_MAX_CONTINUOUS_FORCE, "nominal continuous force (N)"),
        (codes::NOMINAL_MAX_STIFFNESS, "nominal stiffness (N/mm)"),
    ];
    let mut values = [0.0; 3];
    for ((value, (parameter, what)), most) in values.iter_mut().zip(asked).zip(BELIEVABLE) {
        [*value] = hd.doubles(parameter);
        if !(*value > 0.0 && *value <= most) {
            hd.disable_device(handle);
            return Err(OpenError::Nominal { name, what, value: *value });
        }
    }
    let [peak_force_n, continuous_force_n, stiffness_n_per_mm] = values;
    Ok(DeviceLimits {
        peak_force_n,
        continuous_force_n: continuous_force_n.min(peak_force_n),
        stiffness_n_per_m: stiffness_n_per_mm * 1e3,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_or_two_names_and_nothing_else() {
        assert_eq!(parse_names(None), Ok(vec![None]));
        assert_eq!(parse_names(Some("Left Device")).map(|n| n.len()), Ok(1));
        assert_eq!(parse_names(Some("Left+Right")).map(|n| n.len()), Ok(2));
        for text in ["", "a+", "a+b+c", "a\0b"] {
            assert!(matches!(parse_names(Some(text)), Err(OpenError::Names(_))), "{text:?}");
        }
    }
}
