//! Haptic devices. The device owns the clock: it runs the loop and calls the tick.
//!
//! A driven device (OpenHaptics) calls [`ServoRoom::tick`] from its own scheduler thread. A pulled
//! device (simulated, replay, HID, FireWire) implements [`PulledDevice`] and is driven by
//! [`run_pulled`], which sleeps in [`ServoRoom::wait`]. Live, the room sleeps on the monotonic clock; in
//! lockstep it advances a virtual one. Positions are metres in the scene frame
//! (`scene_from_device` is applied inside the device).

pub mod encoder;
pub mod firewire;
pub mod frame;
pub mod hid;
pub mod notice;
pub mod omni;
pub mod openhaptics;
pub mod replay;
pub mod simulated;
pub mod stylus;
pub mod velocity_filter;
pub mod wire;

use notice::NoticeRing;
use protocol::tissue_port::TissuePort;
use sim_core::vector::Vec3;
use std::sync::Arc;

/// What a device reports at the start of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceSample {
    /// Monotonic nanoseconds of the sampling.
    pub time_ns: u64,
    /// Stylus position, metres, scene frame.
    pub position_m: Vec3,
    /// Filtered stylus velocity, metres per second.
    pub velocity_m_per_s: Vec3,
    /// `scene_from_stylus` as quaternion (x, y, z, w).
    pub orientation: [f64; 4],
    /// Bit 0 front button, bit 1 back button.
    pub buttons: u32,
    /// What this sample is worth.
    pub quality: SampleQuality,
}

impl DeviceSample {
    /// A device that has not moved yet.
    #[must_use]
    pub fn resting(position_m: Vec3) -> Self {
        Self {
            time_ns: 0,
            position_m,
            velocity_m_per_s: Vec3::zeros(),
            orientation: [0.0, 0.0, 0.0, 1.0],
            buttons: 0,
            quality: SampleQuality::Stale,
        }
    }
}

/// What a sample is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleQuality {
    /// A new, plausible sample.
    Fresh,
    /// The device had nothing new; the values are the last ones.
    Stale,
    /// The device works but cannot be used yet (it is not calibrated): no position, no force, no fault.
    Unready,
    /// The device has switched its force off for a reason of its own; it must be re-armed.
    Tripped,
    /// The device is gone.
    Lost,
}

/// What a device must do after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceCommand {
    /// Force on the hand, newtons, scene frame; already through the safety stage.
    pub force_n: Vec3,
}

/// What the device can do, from the device itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// Largest force, newtons (Omni: 3.3).
    pub peak_force_n: f64,
    /// Force it can hold for ever, newtons (Omni: 0.88).
    pub continuous_force_n: f64,
    /// Largest stiffness it can render, newtons per metre (Omni: 500 nominal).
    pub stiffness_n_per_m: f64,
}

impl DeviceLimits {
    /// The PHANTOM Omni and the Touch.
    pub const OMNI: Self = Self { peak_force_n: 3.3, continuous_force_n: 0.88, stiffness_n_per_m: 500.0 };

    /// What both of two devices can do.
    #[must_use]
    pub fn smaller(self, other: Self) -> Self {
        Self {
            peak_force_n: self.peak_force_n.min(other.peak_force_n),
            continuous_force_n: self.continuous_force_n.min(other.continuous_force_n),
            stiffness_n_per_m: self.stiffness_n_per_m.min(other.stiffness_n_per_m),
        }
    }

    /// What the motors make of a commanded force: its direction, at most the peak, nothing if not finite.
    #[must_use]
    pub fn saturate(&self, force_n: Vec3) -> Vec3 {
        let size = force_n.norm();
        if !size.is_finite() {
            Vec3::zeros()
        } else if size > self.peak_force_n {
            force_n * (self.peak_force_n / size)
        } else {
            force_n
        }
    }
}

/// What a hand sees: enough for a synthetic surgeon to suture by eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandView {
    /// Not seen yet: no tissue port has arrived.
    pub valid: bool,
    /// Suturing stage as in `protocol::tissue_port`.
    pub stage: u32,
    /// Suture pair at work.
    pub pair: u32,
    /// Pairs in the scene.
    pub pair_count: u32,
    /// Stitches tied in this scene.
    pub stitches: u32,
    /// Changes when a scene is loaded or restored.
    pub scene_generation: u32,
    /// Where the hand should go next, metres.
    pub target_m: Vec3,
    /// Outward normal there, unit.
    pub target_normal: Vec3,
    /// Across the wound, left to right, unit.
    pub across: Vec3,
    /// Distance of the pair at work, metres.
    pub gap_m: f64,
    /// A release at or below this distance ties the stitch, metres.
    pub closed_gap_m: f64,
}

impl HandView {
    /// Before the first tissue port: nothing to see.
    #[must_use]
    pub fn unseen() -> Self {
        Self {
            valid: false,
            stage: 0,
            pair: 0,
            pair_count: 0,
            stitches: 0,
            scene_generation: 0,
            target_m: Vec3::zeros(),
            target_normal: Vec3::z(),
            across: Vec3::x(),
            gap_m: 0.0,
            closed_gap_m: 0.0,
        }
    }
}

impl From<&TissuePort> for HandView {
    /// What the hand sees by this port.
    fn from(port: &TissuePort) -> Self {
        Self {
            valid: port.header.sequence > 0,
            stage: port.stage,
            pair: port.pair,
            pair_count: port.pair_count,
            stitches: port.stitches,
            scene_generation: port.scene_generation,
            target_m: Vec3::from(port.target_m),
            target_normal: Vec3::from(port.target_normal),
            across: Vec3::from(port.across),
            gap_m: port.gap_m,
            closed_gap_m: port.closed_gap_m,
        }
    }
}

/// Time of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickTime {
    /// Scheduled monotonic nanoseconds of this tick.
    pub scheduled_ns: u64,
    /// Nanoseconds now.
    pub now_ns: u64,
    /// True time since the last executed tick, seconds.
    pub dt_s: f64,
}

/// The servo as a device sees it.
pub trait ServoRoom {
    /// Waits for the next tick; `None` when the loop must end.
    fn wait(&mut self) -> Option<TickTime>;
    /// For a device that owns the clock: the tick that it began `late_ns` ago; `None` when the loop must end.
    fn begin(&mut self, late_ns: u64) -> Option<TickTime>;
    /// What the hand sees now.
    fn view(&self) -> HandView;
    /// Whether the servo is in Fault: no force until the operator has re-armed it.
    fn is_latched(&self) -> bool;
    /// One servo tick: sample in, force out.
    fn tick(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand;
    /// The same for a second device, after the first one's.
    fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand;
}

/// A device that runs the loop.
pub trait Device: Send {
    /// Name for reports.
    fn name(&self) -> &str;
    /// What it can do.
    fn limits(&self) -> DeviceLimits;
    /// Runs until the room says stop. Sends zero force before it returns.
    fn run(&mut self, room: &mut dyn ServoRoom);
    /// What the device has to say while it runs.
    fn notices(&self) -> Option<Arc<NoticeRing>> {
        None
    }
}

/// A device that is asked once per tick.
pub trait PulledDevice {
    /// Reads the device; must not block, allocate or log.
    fn sample(&mut self, time: TickTime, view: &HandView) -> DeviceSample;
    /// Hands the force over.
    fn command(&mut self, command: DeviceCommand);
}

/// The loop of every pulled device.
pub fn run_pulled(device: &mut dyn PulledDevice, room: &mut dyn ServoRoom) {
    while let Some(time) = room.wait() {
        let view = room.view();
        let sample = device.sample(time, &view);
        let command = room.tick(time, &sample);
        device.command(command);
    }
    device.command(DeviceCommand { force_n: Vec3::zeros() });
}
