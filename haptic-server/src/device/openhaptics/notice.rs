//! What the driver has to say: plain `Copy` values in a ring, told by another thread.
//!
//! The library's thread never logs. An error that comes in every tick is told once, then once a second.

use super::severity::{self, Reaction};
use super::state::{Calibration, DeviceState};
use super::thermal::Warmth;
use crate::device::notice::{DeviceNotice, NoticeRing, Weight, What};
use std::fmt;

/// An error that goes on is told again after so many ticks.
const AGAIN_TICKS: u32 = 1_000;

/// One thing that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HdNotice {
    /// The device's state has changed.
    State(DeviceState, DeviceState),
    /// The library gave an error: code, internal code.
    Error(u32, i32),
    /// Somebody has to act, or the calibration has been done.
    Calibration(Calibration),
    /// The motors, with their temperature.
    Motors(Warmth, f64),
    /// The pose is the one of a configuration that was read with a decimal comma.
    DecimalComma,
    /// The library has not called for so many milliseconds.
    Stalled(u64),
    /// The driver panicked in the library's thread.
    Panicked,
    /// An attempt to open the device again has failed, with this error.
    NotReopened(u32),
    /// The device is open again.
    Reopened,
}

impl HdNotice {
    /// How much it weighs.
    #[must_use]
    pub fn weight(&self) -> Weight {
        match self {
            Self::Error(code, _) if severity::of(*code).reaction >= Reaction::Trip => Weight::Fault,
            Self::DecimalComma | Self::Stalled(_) | Self::Panicked => Weight::Fault,
            Self::Error(..) | Self::Motors(Warmth::Reducing | Warmth::Resting, _) => Weight::Warning,
            Self::NotReopened(_) | Self::Reopened | Self::Calibration(Calibration::NeedsHand) => Weight::Warning,
            _ => Weight::Note,
        }
    }
}

impl fmt::Display for HdNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::State(from, to) => write!(f, "{} → {}", from.name(), to.name()),
            Self::Error(code, internal) => {
                write!(f, "OpenHaptics error {code:#06x} (internal {internal}): {}", severity::of(code).meaning)
            }
            Self::Calibration(Calibration::NeedsHand) => f.write_str(
                "not calibrated: put the stylus into the inkwell until the light is steady; no force until then",
            ),
            Self::Calibration(Calibration::Possible) => f.write_str("the stylus is in the inkwell: calibrating"),
            Self::Calibration(Calibration::Good) => f.write_str("calibrated"),
            Self::Motors(Warmth::Cold, t) => write!(f, "the motors are cool again ({t:.2} of 1)"),
            Self::Motors(Warmth::Reducing, t) => {
                write!(
                    f,
                    "the motors are getting warm ({t:.2} of 1): the force is taken back to the continuous one; hold it less"
                )
            }
            Self::Motors(Warmth::Resting, t) => {
                write!(
                    f,
                    "the motors are too warm ({t:.2} of 1): no force until they have cooled down; let go for a minute"
                )
            }
            Self::DecimalComma => f.write_str(
                "every joint reads exactly zero: the vendor's configuration was written or read with a decimal comma; \
                 delete it, set LC_ALL=C and run the vendor's set-up again",
            ),
            Self::Stalled(ms) => write!(
                f,
                "the library has not called for {ms} ms; the force is off. Check cable and load; it is started again by itself"
            ),
            Self::Panicked => {
                f.write_str("the driver broke in the library's thread; the force is off, report the message above")
            }
            Self::NotReopened(code) => {
                write!(f, "the device cannot be opened again yet ({code:#06x}): {}", severity::of(code).meaning)
            }
            Self::Reopened => f.write_str("the device is open again; re-arm to go on"),
        }
    }
}

/// Tells the notices of one device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Teller<'a> {
    pub(super) ring: &'a NoticeRing,
    pub(super) device: u32,
}

impl Teller<'_> {
    /// One notice; a full ring drops it, nobody waits.
    pub(super) fn tell(&self, notice: HdNotice) {
        let what = What::OpenHaptics(notice);
        let _full = self.ring.push(DeviceNotice { device: self.device, weight: notice.weight(), what });
    }
}

/// Holds back an error that is told in every tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorWatch {
    last: u32,
    quiet: u32,
}

impl ErrorWatch {
    /// A tick has passed.
    pub(super) fn tick(&mut self) {
        self.quiet = self.quiet.saturating_add(1);
    }

    /// Whether this error is told.
    pub(super) fn is_news(&mut self, code: u32) -> bool {
        let is_news = code != self.last || self.quiet >= AGAIN_TICKS;
        if is_news {
            (self.last, self.quiet) = (code, 0);
        }
        is_news
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_goes_on_is_told_once_a_second() {
        let mut watch = ErrorWatch::default();
        let mut told = 0;
        for _ in 0..3_000 {
            watch.tick();
            told += u32::from(watch.is_news(0x0302));
        }
        assert_eq!(told, 3);
        assert!(watch.is_news(0x0300));
    }

    #[test]
    fn a_notice_says_what_to_do_and_weighs_what_it_costs() {
        let lost = HdNotice::Error(0x0302, -28);
        assert_eq!(lost.weight(), Weight::Fault);
        assert!(lost.to_string().contains("0x0302 (internal -28)") && lost.to_string().contains("cable"));
        assert_eq!(HdNotice::Error(0x0200, 0).weight(), Weight::Warning);
        assert_eq!(HdNotice::Calibration(Calibration::Good).weight(), Weight::Note);
    }
}
