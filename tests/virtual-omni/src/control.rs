//! The side channel: what a test does to the virtual devices and reads back from them.
//!
//! Handles are those of the interface (0, 1). A handle that is none changes nothing and reads zero. Millimetres and
//! newtons in the device's frame, as in the interface itself.

use crate::faults::Fault;
use crate::log::FrameRow;
use crate::world::{Setup, renew, world};
use crate::{arm, clockwork};
use sim_core::vector::Vec3;

/// Makes everything anew; a scheduler that runs is stopped first.
pub fn reset(setup: &Setup) {
    clockwork::stop();
    renew(setup);
}

/// Makes ticks, each of one millisecond.
pub fn step(ticks: u32) {
    clockwork::step(ticks);
}

/// Lets milliseconds pass without a tick.
pub fn stall(milliseconds: u32) {
    clockwork::stall(milliseconds);
}

/// Whether the scheduler runs.
#[must_use]
pub fn is_running() -> bool {
    world().running
}

/// Whether a client has opened this device.
#[must_use]
pub fn is_open(device: u32) -> bool {
    world().devices.get(device as usize).is_some_and(|d| d.open)
}

/// Puts the stylus of a led device somewhere.
pub fn lead(device: u32, position_mm: Vec3) {
    if let Some(device) = world().devices.get_mut(device as usize) {
        device.stylus.lead(position_mm * 1e-3);
    }
}

/// Puts it into the inkwell.
pub fn dock(device: u32) {
    lead(device, arm::inkwell_m() * 1e3);
}

/// Presses buttons of a led device.
pub fn press(device: u32, buttons: u32) {
    if let Some(device) = world().devices.get_mut(device as usize) {
        device.stylus.buttons = buttons;
    }
}

/// Turns the gimbal of a device, radians.
pub fn turn(device: u32, gimbal_rad: Vec3) {
    if let Some(device) = world().devices.get_mut(device as usize) {
        device.stylus.gimbal = gimbal_rad;
    }
}

/// Does a fault to a device.
pub fn inject(device: u32, fault: Fault) {
    if let Some(device) = world().devices.get_mut(device as usize) {
        device.suffer(fault);
    }
}

/// The force that acts on the hand now.
#[must_use]
pub fn arrived_n(device: u32) -> Vec3 {
    world().devices.get(device as usize).map_or_else(Vec3::zeros, |d| d.motors.force_n)
}

/// Every frame since the last call.
#[must_use]
pub fn take_rows() -> Vec<FrameRow> {
    world().log.take()
}
