//! One device in the loop: its handle, its state, its motors' warmth, its way from frame to sample and force.
//!
//! Order in a tick: calibration (outside the frame, forces off), begin frame, read, errors, state, …, force, end frame.
//! The force is set in every frame: a frame without one means zero. FORCE_OUTPUT is on in the state ForcesOn only.

use super::codes;
use super::ffi::{Hd, HdErrorInfo};
use super::notice::{ErrorWatch, HdNotice, Teller};
use super::reading::{Reading, Sampler};
use super::severity::{self, Reaction};
use super::state::{Calibration, DeviceState, Latch, Machine, Situation};
use super::thermal::Thermal;
use crate::device::frame::SceneFromDevice;
use crate::device::notice::NoticeRing;
use crate::device::{DeviceLimits, DeviceSample, TickTime};
use sim_core::vector::Vec3;

/// The calibration is asked for once in so many ticks.
const CALIBRATION_TICKS: u64 = 100;

/// One device.
#[derive(Debug)]
pub(super) struct Arm {
    index: u32,
    handle: u32,
    style: u32,
    limits: DeviceLimits,
    machine: Machine,
    thermal: Thermal,
    sampler: Sampler,
    errors: ErrorWatch,
    ticks: u64,
    calibration: Option<Calibration>,
    asked: Option<Calibration>,
    worst: Option<Reaction>,
    complained: bool,
    temperature: f64,
    forces_on: bool,
}

impl Arm {
    pub(super) fn new(index: u32, handle: u32, style: u32, limits: DeviceLimits, frame: SceneFromDevice) -> Self {
        Self {
            index,
            handle,
            style,
            limits,
            machine: Machine::opened(),
            thermal: Thermal::new(limits.peak_force_n, limits.continuous_force_n),
            sampler: Sampler::new(frame),
            errors: ErrorWatch::default(),
            ticks: 0,
            calibration: None,
            asked: None,
            worst: None,
            complained: false,
            temperature: 0.0,
            forces_on: false,
        }
    }

    /// The device has been opened again under this handle; its motors may still be warm.
    pub(super) fn reopened(&mut self, handle: u32) {
        let thermal = self.thermal;
        let fresh = Self::new(self.index, handle, self.style, self.limits, self.sampler.frame());
        *self = Self { thermal, errors: self.errors, ..fresh };
    }

    pub(super) fn handle(&self) -> u32 {
        self.handle
    }

    pub(super) fn state(&self) -> DeviceState {
        self.machine.state()
    }

    fn teller<'a>(&self, ring: &'a NoticeRing) -> Teller<'a> {
        Teller { ring, device: self.index }
    }

    /// Before the frame: the calibration, now and then.
    pub(super) fn check_calibration(&mut self, hd: &Hd, ring: &NoticeRing) {
        let is_due = self.ticks.is_multiple_of(CALIBRATION_TICKS) || self.calibration.is_none();
        self.ticks += 1;
        self.errors.tick();
        if !is_due || self.state() == DeviceState::Lost {
            return;
        }
        hd.make_current(self.handle);
        let answer = match hd.check_calibration() {
            codes::CALIBRATION_OK => Calibration::Good,
            codes::CALIBRATION_NEEDS_UPDATE => Calibration::Possible,
            _ => Calibration::NeedsHand,
        };
        if self.calibration != Some(answer) && !(self.calibration.is_none() && answer == Calibration::Good) {
            self.teller(ring).tell(HdNotice::Calibration(answer));
        }
        if answer == Calibration::Possible && self.state() == DeviceState::NeedsCalibration {
            hd.update_calibration(self.style);
            self.sampler.restart();
        }
        (self.calibration, self.asked) = (Some(answer), Some(answer));
    }

    /// Begins the frame and reads it.
    pub(super) fn begin(&mut self, hd: &Hd) -> Reading {
        hd.begin_frame(self.handle);
        hd.make_current(self.handle);
        let temperatures: [f64; 6] = hd.doubles(codes::MOTOR_TEMPERATURE);
        self.temperature = temperatures.into_iter().fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a });
        Reading {
            position_mm: hd.doubles(codes::CURRENT_POSITION),
            transform: hd.doubles(codes::CURRENT_TRANSFORM),
            buttons: hd.integer(codes::CURRENT_BUTTONS),
        }
    }

    /// An error of this device.
    pub(super) fn take(&mut self, error: &HdErrorInfo, ring: &NoticeRing) {
        let severity = severity::of(error.code);
        self.worst = self.worst.max(Some(severity.reaction));
        self.complained |= severity.reaction == Reaction::Cool;
        if self.errors.is_news(error.code) {
            self.teller(ring).tell(HdNotice::Error(error.code, error.internal));
        }
    }

    /// State and motors after the reading; the sample for the servo.
    pub(super) fn judge(
        &mut self,
        hd: &Hd,
        reading: &Reading,
        time: TickTime,
        latch: Latch,
        ring: &NoticeRing,
    ) -> DeviceSample {
        if self.sampler.shows_decimal_comma() {
            self.worst = self.worst.max(Some(Reaction::Trip));
            self.teller(ring).tell(HdNotice::DecimalComma);
        }
        let situation = Situation { calibration: self.asked.take(), worst: self.worst.take(), latch, dt_s: time.dt_s };
        if let Some(from) = self.machine.tick(&situation) {
            self.teller(ring).tell(HdNotice::State(from, self.state()));
        }
        if let Some(warmth) = self.thermal.tick(self.temperature, std::mem::take(&mut self.complained)) {
            self.teller(ring).tell(HdNotice::Motors(warmth, self.temperature));
        }
        let forces_on = self.state() == DeviceState::ForcesOn;
        if forces_on != self.forces_on {
            self.forces_on = forces_on;
            hd.make_current(self.handle);
            if forces_on {
                hd.enable(codes::FORCE_OUTPUT);
            } else {
                hd.disable(codes::FORCE_OUTPUT);
            }
        }
        match self.state() {
            DeviceState::Lost => self.sampler.last(time, self.machine.quality()),
            _ => self.sampler.sample(reading, time, self.machine.quality()),
        }
    }

    /// Sets the force and ends the frame.
    pub(super) fn end(&mut self, hd: &Hd, force_n: Vec3) {
        let share = self.thermal.within(self.limits.saturate(force_n)) * self.machine.gain();
        let device_n = self.sampler.device_force(share);
        hd.make_current(self.handle);
        hd.set_triple(codes::CURRENT_FORCE, [device_n.x, device_n.y, device_n.z]);
        hd.end_frame(self.handle);
    }
}
