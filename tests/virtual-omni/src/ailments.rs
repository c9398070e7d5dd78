//! What faults leave behind in a device: a pulled cable, a lock, slipped encoders, frames of garbage or of a frozen pose, stuck
//! buttons, and errors that wait for the next frame.
//!
//! Counted frames are used up by asking, once per begun frame. Deliberately absent: calibration and the temperature of the
//! motors, which belong to the device itself (`device.rs`).

use crate::codes;
use crate::faults::Fault;
use sim_core::vector::Vec3;

/// Errors that wait without making room anew.
const WAITING: usize = 16;

/// What is wrong with one device.
#[derive(Debug)]
pub(crate) struct Ailments {
    waiting: Vec<u32>,
    plugged: bool,
    locked: bool,
    slip_m: f64,
    garbage_frames: u32,
    frozen_frames: u32,
    stuck_buttons: u32,
}

impl Default for Ailments {
    /// A sound device.
    fn default() -> Self {
        Self {
            waiting: Vec::with_capacity(WAITING),
            plugged: true,
            locked: false,
            slip_m: 0.0,
            garbage_frames: 0,
            frozen_frames: 0,
            stuck_buttons: 0,
        }
    }
}

impl Ailments {
    /// One more; calibration and temperature are none of these.
    pub(crate) fn add(&mut self, fault: Fault) {
        match fault {
            Fault::Error(code) => self.complain(code),
            Fault::Unplug => self.plugged = false,
            Fault::Replug => self.plugged = true,
            Fault::Jump(millimetres) => self.slip_m += millimetres * 1e-3,
            Fault::Garbage(frames) => self.garbage_frames = frames,
            Fault::Freeze(frames) => self.frozen_frames = frames,
            Fault::Buttons(bits) => self.stuck_buttons = bits,
            Fault::Lock => self.locked = true,
            Fault::Uncalibrate | Fault::Warm(_) => {}
        }
    }

    /// An error that comes up in the next frame.
    pub(crate) fn complain(&mut self, code: u32) {
        self.waiting.push(code);
    }

    /// The errors of a frame that begins.
    pub(crate) fn complaints(&mut self) -> Vec<u32> {
        let mut errors = std::mem::take(&mut self.waiting);
        if !self.plugged {
            errors.push(codes::COMM_ERROR);
        }
        errors
    }

    /// Whether a closed device can be opened; the error otherwise.
    pub(crate) fn openable(&self) -> Result<(), u32> {
        if self.locked {
            Err(codes::COMM_CONFIG_ERROR)
        } else if self.plugged {
            Ok(())
        } else {
            Err(codes::DEVICE_FAULT)
        }
    }

    /// Whether the cable is there.
    pub(crate) fn is_plugged(&self) -> bool {
        self.plugged
    }

    /// Whether this frame's numbers are none.
    pub(crate) fn is_garbage(&mut self) -> bool {
        used_up(&mut self.garbage_frames)
    }

    /// Whether this frame shows the last one's pose.
    pub(crate) fn is_frozen(&mut self) -> bool {
        used_up(&mut self.frozen_frames)
    }

    /// Buttons that are down whatever the hand does.
    pub(crate) fn stuck_buttons(&self) -> u32 {
        self.stuck_buttons
    }

    /// How far the encoders are off.
    pub(crate) fn slip_m(&self) -> Vec3 {
        Vec3::new(self.slip_m, 0.0, 0.0)
    }

    /// The encoders count from the right zero again.
    pub(crate) fn forget_slip(&mut self) {
        self.slip_m = 0.0;
    }
}

/// One frame less; whether there was one.
fn used_up(frames: &mut u32) -> bool {
    let was_there = *frames > 0;
    *frames = frames.saturating_sub(1);
    was_there
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counted_frames_are_used_up_and_complaints_are_told_once() {
        let mut ailments = Ailments::default();
        ailments.add(Fault::Garbage(2));
        assert_eq!([(); 3].map(|()| ailments.is_garbage()), [true, true, false]);
        ailments.add(Fault::Error(codes::WARM_MOTORS));
        assert_eq!(ailments.complaints(), [codes::WARM_MOTORS]);
        assert!(ailments.complaints().is_empty());
        ailments.add(Fault::Unplug);
        assert_eq!([ailments.complaints(), ailments.complaints()], [[codes::COMM_ERROR], [codes::COMM_ERROR]]);
    }
}
