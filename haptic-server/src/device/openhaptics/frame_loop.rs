//! The tick of all devices, called by the library's scheduler: one callback for every device.
//!
//! Frames are begun and ended per device, the servo's tick runs between; the error stack is drained after the begin and
//! after the end. The first device sutures, the second holds tissue. No heap, no lock, no log.
//! Deliberately absent: starting and stopping the scheduler (`keeper.rs`).

use super::arm::Arm;
use super::ffi::Hd;
use super::state::{DeviceState, Latch};
use crate::device::notice::NoticeRing;
use crate::device::{DeviceSample, SampleQuality, ServoRoom, TickTime};
use sim_core::vector::Vec3;
use std::sync::Arc;

/// Devices at most.
pub(super) const MOST: usize = 2;
/// Errors taken off the stack in one go: a stack that never empties must not keep the tick.
const ERRORS_PER_DRAIN: usize = 32;
/// A tick that began longer ago than this did not: the library's clock is not to be trusted.
const LATEST_S: f64 = 0.1;

/// What became of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ticked {
    /// All is well.
    Well,
    /// The servo wants to end.
    Stopped,
    /// A device is gone.
    Lost,
}

/// The devices and what they need.
pub(super) struct FrameLoop {
    pub(super) hd: Hd,
    pub(super) arms: Vec<Arm>,
    pub(super) ring: Arc<NoticeRing>,
}

impl FrameLoop {
    /// One tick.
    pub(super) fn tick(&mut self, room: &mut dyn ServoRoom) -> Ticked {
        let Self { hd, arms, ring } = self;
        let late_s = Some(hd.scheduler_time_stamp()).filter(|s| (0.0..LATEST_S).contains(s)).unwrap_or(0.0);
        let Some(time) = room.begin((late_s * 1e9) as u64) else {
            self.rest();
            return Ticked::Stopped;
        };
        let latch = if room.is_latched() { Latch::Closed } else { Latch::Open };
        let mut samples = [DeviceSample::resting(Vec3::zeros()); MOST];
        let mut readings = [None; MOST];
        for (arm, reading) in arms.iter_mut().zip(&mut readings) {
            arm.check_calibration(hd, ring);
            *reading = Some(arm.begin(hd));
        }
        drain(hd, arms, ring);
        for ((arm, sample), reading) in arms.iter_mut().zip(&mut samples).zip(&readings) {
            if let Some(reading) = reading {
                *sample = arm.judge(hd, reading, time, latch, ring);
            }
        }
        let mut forces = [room.tick(time, &samples[0]).force_n, Vec3::zeros()];
        if arms.len() > 1 {
            forces[1] = room.tick_second(time, &samples[1]).force_n;
        }
        for (arm, force_n) in arms.iter_mut().zip(forces) {
            arm.end(hd, force_n);
        }
        drain(hd, arms, ring);
        if arms.iter().any(|arm| arm.state() == DeviceState::Lost) { Ticked::Lost } else { Ticked::Well }
    }

    /// A tick without the library: the devices are gone.
    pub(super) fn tick_lost(&mut self, room: &mut dyn ServoRoom, time: TickTime) {
        let mut sample = DeviceSample::resting(Vec3::zeros());
        sample.quality = SampleQuality::Lost;
        sample.time_ns = time.now_ns;
        room.tick(time, &sample);
        if self.arms.len() > 1 {
            room.tick_second(time, &sample);
        }
    }

    /// Frames without force, before the end.
    fn rest(&mut self) {
        for arm in &mut self.arms {
            self.hd.begin_frame(arm.handle());
            arm.end(&self.hd, Vec3::zeros());
        }
        drain(&self.hd, &mut self.arms, &self.ring);
    }
}

/// Empties the error stack; an error without a device belongs to the first.
fn drain(hd: &Hd, arms: &mut [Arm], ring: &NoticeRing) {
    for _ in 0..ERRORS_PER_DRAIN {
        let Some(error) = hd.pop_error() else { return };
        let at = arms.iter().position(|arm| arm.handle() == error.device).unwrap_or(0);
        if let Some(arm) = arms.get_mut(at) {
            arm.take(&error, ring);
        }
    }
}
