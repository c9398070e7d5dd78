//! A haptic device from its library to the servo: the virtual Omni in place of a real one.
//!
//! Interface and kinematics of the virtual library, the driver against it step by step with every error and fault, and
//! the whole program live. No test asserts a time of the wall clock.

mod doctor;
mod faults;
mod firewire;
mod firewire_node;
mod guest;
mod hid;
mod hid_peer;
mod interface;
mod kinematics;
mod live;
mod order;
mod rig;
mod uhid;
mod wire_rig;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// One virtual device at a time: it is one per process, as the real library is.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}
