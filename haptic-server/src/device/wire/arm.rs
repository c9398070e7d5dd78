//! What every arm on a wire has: its state, its way from pose to sample, and what it tells.
//!
//! The state machine is that of the OpenHaptics driver (`openhaptics::state`): initialised → needs calibration → ready →
//! forces on, with the ramp of half a second; lost for as long as the wire is. Velocity is our own filter's, over the time
//! between packets; a jump is passed on to the servo's gate, which refuses it, but not into the filter. Metres, seconds, device frame in, scene frame out.
//! Deliberately absent: packets and calibration (`hid`, `firewire`).

use super::Arrival;
use super::notice::WireNotice;
use super::watch::{Freshness, Judgement, LinkWatch};
use crate::device::frame::SceneFromDevice;
use crate::device::notice::NoticeRing;
use crate::device::openhaptics::state::{Calibration, DeviceState, Latch, Machine, Situation};
use crate::device::velocity_filter::VelocityFilter;
use crate::device::{DeviceSample, SampleQuality, TickTime};
use sim_core::vector::{Mat3, Vec3};

/// A larger way in a tick is a jump, metres (as the servo's gate has it by default).
const JUMP_M: f64 = 0.005;
/// So many jumps in a row are a new place.
const JUMPS: u32 = 3;

/// A pose in the device's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Stylus, metres.
    pub position_m: Vec3,
    /// Where it points.
    pub rotation: Mat3,
    /// Mask.
    pub buttons: u32,
}

/// State and last sample of one arm.
#[derive(Clone, Copy, Debug)]
pub struct WireArm {
    frame: SceneFromDevice,
    watch: LinkWatch,
    machine: Machine,
    filter: VelocityFilter,
    since_packet_s: f64,
    /// Last place that was no jump, and jumps since.
    place: Option<(Vec3, u32)>,
    last: DeviceSample,
}

impl WireArm {
    /// Just opened.
    #[must_use]
    pub fn new(frame: SceneFromDevice) -> Self {
        Self {
            frame,
            watch: LinkWatch::default(),
            machine: Machine::opened(),
            filter: VelocityFilter::default(),
            since_packet_s: 0.0,
            place: None,
            last: DeviceSample::resting(frame.translation_m()),
        }
    }

    /// What has arrived; after a restart the arm is as if just opened.
    pub fn judge(&mut self, arrival: &Arrival, ring: &NoticeRing) -> Judgement {
        let judged = self.watch.tick(arrival, ring);
        if judged.restart {
            let from = self.machine.state();
            *self = Self { watch: self.watch, last: self.last, ..Self::new(self.frame) };
            WireNotice::State(from, self.machine.state()).tell(ring);
        }
        judged
    }

    /// The state after this tick; `remedy` is what somebody has to do when the calibration is missing.
    pub fn settle(
        &mut self,
        judged: &Judgement,
        calibration: Calibration,
        remedy: &'static str,
        situation: (Latch, TickTime),
        ring: &NoticeRing,
    ) {
        let (latch, time) = situation;
        let is_known = judged.freshness != Freshness::None;
        let calibration = is_known.then_some(calibration);
        let now = Situation { calibration, worst: judged.reaction, latch, dt_s: time.dt_s };
        let Some(from) = self.machine.tick(&now) else { return };
        let to = self.machine.state();
        WireNotice::State(from, to).tell(ring);
        if to == DeviceState::NeedsCalibration {
            WireNotice::NeedsHand(remedy).tell(ring);
        }
    }

    /// The sample of this tick; `pose` is that of a new packet.
    pub fn sample(&mut self, judged: &Judgement, pose: Option<Pose>, time: TickTime) -> DeviceSample {
        self.since_packet_s += time.dt_s.max(0.0);
        let quality = match (self.machine.quality(), judged.freshness) {
            (SampleQuality::Fresh, Freshness::Stale) => SampleQuality::Stale,
            (quality, _) => quality,
        };
        self.last = DeviceSample { time_ns: time.now_ns, quality, ..self.last };
        if let Some(pose) = pose {
            let position_m = self.frame.point(pose.position_m);
            self.follow(position_m);
            self.last.position_m = position_m;
            self.last.orientation = self.frame.orientation(&pose.rotation);
            self.last.buttons = pose.buttons;
        }
        if matches!(quality, SampleQuality::Stale | SampleQuality::Lost) {
            self.last.velocity_m_per_s = Vec3::zeros();
        }
        self.last
    }

    /// The position is about to jump: the motion so far is forgotten.
    pub fn forget_motion(&mut self) {
        self.filter = VelocityFilter::default();
        self.place = None;
        self.since_packet_s = 0.0;
    }

    /// The velocity, unless this is a jump.
    fn follow(&mut self, position_m: Vec3) {
        if let Some((place_m, jumps)) = &mut self.place {
            let ticks = (self.since_packet_s / 1e-3).max(1.0);
            if (position_m - *place_m).norm() > JUMP_M * ticks && *jumps < JUMPS {
                *jumps += 1;
                return;
            }
            if *jumps >= JUMPS {
                self.filter = VelocityFilter::default();
            }
        }
        self.last.velocity_m_per_s = self.filter.update(position_m, self.since_packet_s);
        self.place = Some((position_m, 0));
        self.since_packet_s = 0.0;
    }

    /// A force of the scene on the device's axes, at the share that the state allows, newtons.
    #[must_use]
    pub fn device_force(&self, scene_n: Vec3) -> Vec3 {
        self.frame.inverse_vector(scene_n) * self.machine.gain()
    }

    /// Whether motors may be on.
    #[must_use]
    pub fn has_forces(&self) -> bool {
        self.machine.state() == DeviceState::ForcesOn
    }
}
