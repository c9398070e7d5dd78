//! What a driver on a wire has to say: plain `Copy` values in a ring, told by another thread.
//!
//! Every sentence says what happened and what to do. Deliberately absent: how often (the drivers hold back what goes on).

use super::WireError;
use crate::device::notice::{DeviceNotice, NoticeRing, Weight, What};
use crate::device::openhaptics::state::DeviceState;
use std::fmt;

/// One thing that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WireNotice {
    /// The device's state has changed.
    State(DeviceState, DeviceState),
    /// The wire is broken.
    Broken(WireError),
    /// No packet for so many ticks.
    Silent(u32),
    /// So many packets since start had the wrong length or the wrong marks and were refused.
    Refused(u64),
    /// So many packets since start did not arrive, by their counter.
    Missed(u64),
    /// So many packets since start came twice or in the wrong order and were refused.
    OutOfOrder(u64),
    /// Somebody has to act before there is force.
    NeedsHand(&'static str),
    /// The joints have their zero.
    Calibrated,
    /// The device did not take the zero of its joints.
    NotCalibrated,
    /// The device gives its pose and no force, and why.
    NoForce(&'static str),
    /// An attempt to open the device again has failed.
    NotReopened(WireError),
    /// The device is open again.
    Reopened,
    /// The deadman switch was let go.
    DeadmanReleased,
    /// The deadman switch is held.
    DeadmanHeld,
    /// A side input is gone: a deadman switch counts as released.
    SideInputGone,
}

impl WireNotice {
    /// How much it weighs.
    #[must_use]
    pub fn weight(&self) -> Weight {
        match self {
            Self::Broken(_) | Self::Silent(_) => Weight::Fault,
            Self::State(..) | Self::Calibrated | Self::DeadmanReleased | Self::DeadmanHeld => Weight::Note,
            _ => Weight::Warning,
        }
    }

    /// Tells it; a full ring drops it, nobody waits.
    pub fn tell(self, ring: &NoticeRing) {
        let _full = ring.push(DeviceNotice { device: 0, weight: self.weight(), what: What::Wire(self) });
    }
}

impl fmt::Display for WireNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::State(from, to) => write!(f, "{} → {}", from.name(), to.name()),
            Self::Broken(error) => write!(f, "{error}; the force is off, it is opened again by itself"),
            Self::Silent(ticks) => write!(
                f,
                "no packet for {ticks} ticks; the force is off. Check cable, power and load; re-arm when it is back"
            ),
            Self::Refused(count) => {
                write!(f, "{count} packets of the wrong form were refused; check cable and firmware of the device")
            }
            Self::Missed(count) => write!(f, "{count} packets did not arrive; check cable and load of the bus"),
            Self::OutOfOrder(count) => {
                write!(f, "{count} packets came twice or too late and were refused; check cable and load of the bus")
            }
            Self::NeedsHand(what) => write!(f, "not calibrated: {what}; no force until then"),
            Self::Calibrated => f.write_str("calibrated"),
            Self::NotCalibrated => {
                f.write_str("the device did not take the zero of its joints; check its firmware and try again")
            }
            Self::NoForce(why) => write!(f, "pose only, no force: {why}"),
            Self::NotReopened(error) => write!(f, "the device cannot be opened again yet: {error}"),
            Self::Reopened => f.write_str("the device is open again; calibrate it and re-arm to go on"),
            Self::DeadmanReleased => f.write_str("the foot switch is up: no force"),
            Self::DeadmanHeld => f.write_str("the foot switch is down: the force comes back by its ramp"),
            Self::SideInputGone => {
                f.write_str("a side input is gone; check its cable. A foot switch counts as up: no force")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::notice::NOTICES;

    #[test]
    fn what_takes_the_force_is_a_fault_and_a_full_ring_makes_nobody_wait() {
        assert_eq!(WireNotice::Broken(WireError::Gone).weight(), Weight::Fault);
        assert_eq!(WireNotice::Silent(20).weight(), Weight::Fault);
        assert_eq!(WireNotice::Refused(3).weight(), Weight::Warning);
        let ring = NoticeRing::new(NOTICES);
        for _ in 0..2 * NOTICES {
            WireNotice::Calibrated.tell(&ring);
        }
        assert_eq!(ring.len(), NOTICES);
    }
}
