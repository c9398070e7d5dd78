//! The open HID arm as a driver: reports in, samples out; forces in, currents out.
//!
//! A packet is sent in every tick, with or without force: the firmware's watchdog switches the amplifiers off after 0.5 s
//! without one. Before the arm has its zero, and whenever the state is not "forces on", the currents are zero.
//! The gimbal's encoders have no published scale: the orientation stays that of the device. Metres, newtons.
//! Deliberately absent: a model of the motors' temperature; the servo's continuous-force policy stands for it.

use super::arm_kinematics::ArmParams;
use super::homing::{Homing, Step};
use super::report::{ArmOrder, ArmReport};
use crate::device::frame::SceneFromDevice;
use crate::device::notice::NoticeRing;
use crate::device::openhaptics::state::{Calibration, Latch};
use crate::device::wire::arm::{Pose, WireArm};
use crate::device::wire::notice::WireNotice;
use crate::device::wire::{Arrival, Packet, WireDriver};
use crate::device::{DeviceLimits, DeviceSample, TickTime};
use sim_core::vector::{Mat3, Vec3};

/// After so long without a packet the firmware switches its amplifiers off, seconds.
pub const FIRMWARE_WATCHDOG_S: f64 = 0.5;
/// What somebody has to do.
const REMEDY: &str = "put the arm into its rest pose, hold it still and press the front button for a second";

/// State of the arm.
#[derive(Clone, Copy, Debug)]
pub struct HidArm {
    params: ArmParams,
    arm: WireArm,
    homing: Homing,
    joints: Vec3,
}

impl HidArm {
    /// An arm that has just been opened; the middle of its workspace lies where the frame says.
    #[must_use]
    pub fn new(params: ArmParams, frame: SceneFromDevice) -> Self {
        let joints = Vec3::from(params.config().rest_rad);
        Self { params, arm: WireArm::new(frame), homing: Homing::default(), joints }
    }

    /// What it can do.
    #[must_use]
    pub fn limits(&self) -> DeviceLimits {
        let config = self.params.config();
        DeviceLimits {
            peak_force_n: config.peak_force_n,
            continuous_force_n: config.continuous_force_n,
            stiffness_n_per_m: config.stiffness_n_per_m,
        }
    }

    /// Pose of a report; none before there is a zero.
    fn take(&mut self, report: &ArmReport, ring: &NoticeRing) -> Option<Pose> {
        let [a, b, c, ..] = report.encoders;
        match self.homing.tick([a, b, c], report.info, self.params.rest_counts()) {
            Step::Nothing => {}
            Step::Done => {
                self.arm.forget_motion();
                WireNotice::Calibrated.tell(ring);
            }
            Step::Refused => WireNotice::NotCalibrated.tell(ring),
        }
        if self.homing != Homing::Done {
            return None;
        }
        self.joints = self.params.joints([a, b, c]);
        let position_m = self.params.forward(self.joints);
        Some(Pose { position_m, rotation: Mat3::identity(), buttons: u32::from(report.info.cast_unsigned() & 0b11) })
    }
}

impl WireDriver for HidArm {
    fn is_sound(bytes: &[u8]) -> bool {
        ArmReport::parse(bytes).is_some()
    }

    fn sample(&mut self, time: TickTime, arrival: &Arrival, latch: Latch, ring: &NoticeRing) -> DeviceSample {
        let judged = self.arm.judge(arrival, ring);
        if judged.restart {
            // Whoever lost power has lost its counts.
            self.homing = Homing::default();
        }
        let report = judged.newest.and_then(|packet| ArmReport::parse(packet.bytes()));
        let pose = report.and_then(|report| self.take(&report, ring));
        let calibration = if self.homing == Homing::Done { Calibration::Good } else { Calibration::NeedsHand };
        self.arm.settle(&judged, calibration, REMEDY, (latch, time), ring);
        self.arm.sample(&judged, pose, time)
    }

    fn packet(&mut self, force_n: Vec3) -> Packet {
        if self.homing.is_telling() {
            return ArmOrder::SetEncoders(self.params.rest_counts()).encode();
        }
        if !self.arm.has_forces() {
            return self.rest();
        }
        ArmOrder::Drive(self.params.currents(self.joints, self.arm.device_force(force_n))).encode()
    }

    fn rest(&self) -> Packet {
        ArmOrder::Drive([0; 3]).encode()
    }
}
