//! The original Omni as a driver: packets in, samples out; force only with a scale of its own motors.
//!
//! `θ_i = θ_dock,i + d_i·step_i·(n_i − n_dock,i)`; the encoders wrap at 16 bits, their step is the Omni's
//! (`encoder`), the zero is taken when the stylus stands still in its dock. Gimbal angles: shares of the potentiometers,
//! averaged over 20 packets, `5.48 x − 2.74, −5.28 x + 2.64, 4.76 x − 2.38` rad. The dock's light burns until there is a zero.
//! A duplicate or late packet counts as none. Radians, metres, newtons.
//! Assumed, since the sources do not say: the direction of each encoder. Deliberately absent: taking the zero anew.

use super::force_scale::ForceScale;
use super::packet::{DockLight, Motors, OmniPacket, encode};
use super::sequence::Sequence;
use crate::device::encoder::STEP_RAD;
use crate::device::frame::SceneFromDevice;
use crate::device::notice::NoticeRing;
use crate::device::openhaptics::state::{Calibration, Latch};
use crate::device::wire::arm::{Pose, WireArm};
use crate::device::wire::notice::WireNotice;
use crate::device::wire::{Arrival, Packet, WireDriver};
use crate::device::{DeviceLimits, DeviceSample, TickTime, omni};
use sim_core::vector::Vec3;

/// Joint angles in the dock, radians.
pub const DOCK_RAD: [f64; 3] = [0.0, 0.268_889_55, -0.370_812_89];
/// Direction of each encoder.
pub(super) const DIRECTION: [f64; 3] = [1.0; 3];
/// Gain and offset of each gimbal angle, radians.
const GIMBAL_RAD: [[f64; 2]; 3] = [[5.48, -2.74], [-5.28, 2.64], [4.76, -2.38]];
/// Packets over which the gimbals are averaged.
const GIMBAL_PACKETS: f64 = 20.0;
/// The stylus stands still in its dock for so many packets before the zero is taken.
const DOCKED_PACKETS: u32 = 100;
/// Still is within so many counts.
const DOCKED_COUNTS: u16 = 4;
/// What somebody has to do.
const REMEDY: &str = "put the stylus into the inkwell and let it stand there until the light goes out";
/// Why there is no force.
pub const NO_SCALE: &str = "the scale of its motors is not public; measure it with `haptic-server calibrate-force` and give \
                            the file with --device-file";

/// State of the arm.
#[derive(Clone, Copy, Debug)]
pub struct FireWireOmni {
    scale: Option<ForceScale>,
    arm: WireArm,
    sequence: Sequence,
    docking: Docking,
    joints: Vec3,
    gimbal_shares: Option<Vec3>,
}

#[derive(Clone, Copy, Debug)]
enum Docking {
    Waiting { at: [u16; 3], still: u32 },
    Done { dock: [u16; 3] },
}

const NOT_DOCKED: Docking = Docking::Waiting { at: [0; 3], still: 0 };

impl FireWireOmni {
    /// An arm that has just been opened; without a scale it gives its pose only.
    #[must_use]
    pub fn new(scale: Option<ForceScale>, frame: SceneFromDevice) -> Self {
        Self {
            scale,
            arm: WireArm::new(frame),
            sequence: Sequence::default(),
            docking: NOT_DOCKED,
            joints: Vec3::from(DOCK_RAD),
            gimbal_shares: None,
        }
    }

    /// What it can do: without a scale no force, with one at most what it allows.
    #[must_use]
    pub fn limits(&self) -> DeviceLimits {
        let peak_force_n = self.scale.map_or(0.0, |scale| scale.max_force_n().min(DeviceLimits::OMNI.peak_force_n));
        DeviceLimits {
            peak_force_n,
            continuous_force_n: DeviceLimits::OMNI.continuous_force_n.min(peak_force_n),
            ..DeviceLimits::OMNI
        }
    }

    fn is_calibrated(&self) -> bool {
        matches!(self.docking, Docking::Done { .. })
    }

    fn dock(&mut self, packet: &OmniPacket, ring: &NoticeRing) {
        let Docking::Waiting { at, still } = self.docking else { return };
        let is_near = at.into_iter().zip(packet.encoders).all(|(a, n)| {
            let away = n.wrapping_sub(a);
            away.min(away.wrapping_neg()) <= DOCKED_COUNTS
        });
        self.docking = match (packet.is_docked, is_near) {
            (true, true) if still >= DOCKED_PACKETS => {
                self.arm.forget_motion();
                WireNotice::Calibrated.tell(ring);
                Docking::Done { dock: packet.encoders }
            }
            (true, true) => Docking::Waiting { at, still: still + 1 },
            _ => Docking::Waiting { at: packet.encoders, still: 0 },
        };
    }

    fn take(&mut self, packet: &OmniPacket, ring: &NoticeRing) -> Option<Pose> {
        self.dock(packet, ring);
        let shares = Vec3::from(packet.gimbal_shares());
        let average = self.gimbal_shares.map_or(shares, |average| average + (shares - average) / GIMBAL_PACKETS);
        self.gimbal_shares = Some(average);
        let Docking::Done { dock } = self.docking else { return None };
        self.joints = Vec3::from_fn(|i, _| {
            let counts = packet.encoders[i].wrapping_sub(dock[i]).cast_signed();
            DOCK_RAD[i] + DIRECTION[i] * STEP_RAD[i] * f64::from(counts)
        });
        let gimbal = Vec3::from_fn(|i, _| GIMBAL_RAD[i][0] * average[i] + GIMBAL_RAD[i][1]);
        let position_m = omni::forward(self.joints);
        Some(Pose { position_m, rotation: omni::stylus_rotation(self.joints, gimbal), buttons: packet.buttons })
    }
}

impl WireDriver for FireWireOmni {
    fn is_sound(bytes: &[u8]) -> bool {
        OmniPacket::parse(bytes).is_some()
    }

    fn sample(&mut self, time: TickTime, arrival: &Arrival, latch: Latch, ring: &NoticeRing) -> DeviceSample {
        let arrival = self.sequence.sift(arrival, ring);
        let judged = self.arm.judge(&arrival, ring);
        if judged.restart {
            (self.docking, self.gimbal_shares) = (NOT_DOCKED, None);
            self.sequence.forget();
        }
        let had_zero = self.is_calibrated();
        let packet = judged.newest.and_then(|packet| OmniPacket::parse(packet.bytes()));
        let pose = packet.and_then(|packet| self.take(&packet, ring));
        if !had_zero && self.is_calibrated() && self.scale.is_none() {
            WireNotice::NoForce(NO_SCALE).tell(ring);
        }
        let calibration = if self.is_calibrated() { Calibration::Good } else { Calibration::NeedsHand };
        self.arm.settle(&judged, calibration, REMEDY, (latch, time), ring);
        self.arm.sample(&judged, pose, time)
    }

    fn packet(&mut self, force_n: Vec3) -> Packet {
        let motors = match self.scale {
            Some(scale) if self.arm.has_forces() => {
                let force = scale.within(self.arm.device_force(force_n));
                Motors::On(scale.counts(omni::joint_torque(self.joints, force)))
            }
            _ => Motors::Off,
        };
        encode(motors, if self.is_calibrated() { DockLight::Dark } else { DockLight::Steady })
    }

    fn rest(&self) -> Packet {
        encode(Motors::Off, DockLight::Dark)
    }
}
