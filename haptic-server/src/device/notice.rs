//! What a device has to say beside its samples: plain values in a ring of fixed size, told by another thread.
//!
//! A device's loop must not log. It pushes notices; the process that owns it empties the ring now and then, writes them to
//! the log, and reports those of weight [`Weight::Fault`] to the operator.

use crate::device::openhaptics::notice::HdNotice;
use crate::device::wire::notice::WireNotice;
use crossbeam::queue::ArrayQueue;
use std::fmt;

/// Notices that wait for their reader at most.
pub const NOTICES: usize = 256;

/// How much a notice weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// For the log.
    Note,
    /// Somebody should act.
    Warning,
    /// The force is off.
    Fault,
}

/// One notice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceNotice {
    /// Which device, from 0.
    pub device: u32,
    /// How much it weighs.
    pub weight: Weight,
    /// What happened.
    pub what: What,
}

/// What a driver has to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// The OpenHaptics driver.
    OpenHaptics(HdNotice),
    /// A driver on a wire: HID or FireWire.
    Wire(WireNotice),
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OpenHaptics(notice) => notice.fmt(f),
            Self::Wire(notice) => notice.fmt(f),
        }
    }
}

/// Notices on their way.
pub type NoticeRing = ArrayQueue<DeviceNotice>;
