//! One device: stylus, sensors, motors, frame, calibration. What faults have left behind is in `ailments.rs`.
//!
//! Frames: begin latches what the sensors say and zeroes the force; end sends what was set; data read outside a frame are
//! those of the last one. An inkwell device is calibrated while its stylus stands in the inkwell; until then its joints
//! count from a wrong zero. SI inside, device frame; millimetres appear in `parameters.rs` only.

use crate::ailments::Ailments;
use crate::arm::{self, Reading, UNCALIBRATED_RAD};
use crate::codes;
use crate::faults::Fault;
use crate::grip::{Grip, Stylus};
use crate::motors::{Asked, Motors, Settings};
use haptic_server::device::velocity_filter::VelocityFilter;
use sim_core::vector::Vec3;
use std::ffi::CString;

/// The stylus stands in the inkwell within this distance, metres.
const DOCK_M: f64 = 0.003;

/// Whether the device is calibrated when it is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// From the last session.
    Kept,
    /// The stylus has to be in the inkwell once.
    Missing,
}

/// What a frame holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Latched {
    pub(crate) reading: Reading,
    pub(crate) velocity_m_per_s: Vec3,
    pub(crate) buttons: u32,
    pub(crate) docked: bool,
    pub(crate) garbage: bool,
}

/// Force of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Wanted {
    /// Cartesian, newtons.
    pub(crate) force_n: Vec3,
    /// Joint torque, newton metres; stands above the force.
    pub(crate) torque_nm: Option<Vec3>,
}

/// Where a device stands in its frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Frames {
    pub(crate) open: bool,
    /// Scheduler tick of the last begun frame.
    pub(crate) tick: Option<u64>,
}

/// One device.
pub(crate) struct VirtualDevice {
    pub(crate) name: CString,
    pub(crate) open: bool,
    /// Taken in by the running scheduler.
    pub(crate) joined: bool,
    pub(crate) settings: Settings,
    pub(crate) motors: Motors,
    pub(crate) stylus: Stylus,
    pub(crate) frames: Frames,
    pub(crate) wanted: Wanted,
    pub(crate) last_wanted: Wanted,
    pub(crate) current: Latched,
    pub(crate) last: Latched,
    pub(crate) calibration: Calibration,
    pub(crate) light: i32,
    filter: VelocityFilter,
    since_frame_s: f64,
    /// Joint angles at which the encoders count zero, radians.
    zero_error: Vec3,
    ailments: Ailments,
}

impl VirtualDevice {
    /// A device that stands there, closed.
    pub(crate) fn new(name: CString, calibration: Calibration, grip: Grip) -> Self {
        let stylus = Stylus::new(grip);
        let reading = arm::read(arm::inkwell_m(), Vec3::from(arm::HELD_GIMBAL_RAD), Vec3::zeros());
        let latched = Latched { reading, velocity_m_per_s: Vec3::zeros(), buttons: 0, docked: true, garbage: false };
        Self {
            name,
            open: false,
            joined: false,
            settings: Settings::default(),
            motors: Motors::default(),
            stylus,
            frames: Frames::default(),
            wanted: Wanted::default(),
            last_wanted: Wanted::default(),
            current: latched,
            last: latched,
            calibration,
            light: 0,
            filter: VelocityFilter::default(),
            since_frame_s: 0.0,
            zero_error: match calibration {
                Calibration::Kept => Vec3::zeros(),
                Calibration::Missing => Vec3::from(UNCALIBRATED_RAD),
            },
            ailments: Ailments::default(),
        }
    }

    /// Whether it can be opened; the error otherwise.
    pub(crate) fn openable(&self) -> Result<(), u32> {
        if self.open { Err(codes::DEVICE_ALREADY_INITIATED) } else { self.ailments.openable() }
    }

    /// Opens it: forces are off, limits at their defaults.
    pub(crate) fn open(&mut self) {
        self.open = true;
        self.settings = Settings::default();
        self.motors.restart();
        (self.frames, self.joined) = (Frames::default(), false);
    }

    /// Closes it: motors off.
    pub(crate) fn close(&mut self) {
        (self.open, self.joined, self.frames.open) = (false, false, false);
        self.motors.restart();
    }

    /// A fault is done to it.
    pub(crate) fn suffer(&mut self, fault: Fault) {
        match fault {
            Fault::Uncalibrate => self.calibration = Calibration::Missing,
            Fault::Warm(temperature) => self.motors.temperature = Vec3::repeat(temperature),
            fault => self.ailments.add(fault),
        }
        if fault.stops_motors() {
            self.motors.restart();
        }
    }

    /// Time passes: hand, stylus, motors. Complaints wait for the next frame.
    pub(crate) fn pass(&mut self, dt_s: f64) {
        self.since_frame_s += dt_s;
        if let Some(code) = self.motors.pass(dt_s, &self.settings) {
            self.ailments.complain(code);
        }
        self.stylus.pass(dt_s, self.motors.force_n, self.calibration);
    }

    /// Whether the stylus stands in the inkwell.
    pub(crate) fn is_docked(&self) -> bool {
        (self.stylus.state.position_m - arm::inkwell_m()).norm() < DOCK_M
    }

    /// Calibration as the interface answers it.
    pub(crate) fn calibration_code(&self) -> u32 {
        match (self.calibration, self.is_docked()) {
            (Calibration::Kept, _) => codes::CALIBRATION_OK,
            (Calibration::Missing, true) => codes::CALIBRATION_NEEDS_UPDATE,
            (Calibration::Missing, false) => codes::CALIBRATION_NEEDS_MANUAL_INPUT,
        }
    }

    /// Counts from the right zero from now on, if the stylus is where it has to be.
    pub(crate) fn calibrate(&mut self) -> Result<(), u32> {
        if !self.is_docked() {
            return Err(codes::INVALID_OPERATION);
        }
        self.calibration = Calibration::Kept;
        self.zero_error = Vec3::zeros();
        self.ailments.forget_slip();
        // A new zero is no motion.
        self.filter = VelocityFilter::default();
        Ok(())
    }

    /// Begins a frame; gives the errors that have come up.
    pub(crate) fn begin(&mut self, tick: u64) -> Result<Vec<u32>, u32> {
        if self.frames.open || (self.settings.one_frame && self.frames.tick == Some(tick)) {
            return Err(codes::ILLEGAL_BEGIN);
        }
        self.frames = Frames { open: true, tick: Some(tick) };
        self.last = self.current;
        self.last_wanted = std::mem::take(&mut self.wanted);
        let errors = self.ailments.complaints();
        if !self.ailments.is_plugged() {
            return Ok(errors);
        }
        let buttons = self.stylus.buttons | self.ailments.stuck_buttons();
        self.current.garbage = self.ailments.is_garbage();
        if self.ailments.is_frozen() {
            return Ok(errors);
        }
        let place = self.stylus.state.position_m + self.ailments.slip_m();
        let reading = arm::read(place, self.stylus.gimbal, self.zero_error);
        let velocity_m_per_s = self.filter.update(reading.position_m, self.since_frame_s);
        self.since_frame_s = 0.0;
        let docked = self.is_docked();
        self.current = Latched { reading, velocity_m_per_s, buttons, docked, garbage: self.current.garbage };
        Ok(errors)
    }

    /// Ends a frame: the force goes to the motors. Gives what the client asked for, or the complaint.
    pub(crate) fn end(&mut self) -> Result<Vec3, u32> {
        if !std::mem::take(&mut self.frames.open) {
            return Err(codes::ILLEGAL_END);
        }
        let reading = self.current.reading;
        let asked_n = match self.wanted.torque_nm {
            None => self.wanted.force_n,
            Some(_) if self.wanted.force_n != Vec3::zeros() => {
                self.motors.restart();
                return Err(codes::FORCE_ERROR);
            }
            Some(torque) => reading.force(torque).unwrap_or_default(),
        };
        if !self.ailments.is_plugged() || !self.joined {
            self.motors.restart();
            return Ok(asked_n);
        }
        let speed_m_per_s = self.current.velocity_m_per_s.norm();
        let force = self.motors.judge(&Asked { force_n: asked_n, speed_m_per_s }, &self.settings)?;
        let torque = Reading::dac(reading.torque(force));
        self.motors.torque_nm = torque;
        self.motors.force_n = reading.force(torque).unwrap_or(force);
        Ok(asked_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::vector::Vec3;

    const PLACE: [f64; 3] = [0.0, 0.01, -0.02];

    fn device() -> VirtualDevice {
        calibrated(Calibration::Kept)
    }

    fn calibrated(calibration: Calibration) -> VirtualDevice {
        let mut device = VirtualDevice::new(c"test".to_owned(), calibration, Grip::Led);
        device.open();
        device.joined = true;
        device.settings.force_output = true;
        device.settings.ramping = false;
        device.stylus.lead(Vec3::from(PLACE));
        device
    }

    #[test]
    fn a_frame_that_sets_no_force_gives_none() {
        let mut device = device();
        assert_eq!(device.begin(1), Ok(vec![]));
        device.wanted.force_n = Vec3::new(1.0, 0.0, 0.0);
        assert!(device.end().is_ok());
        assert!((device.motors.force_n.x - 1.0).abs() < 0.01);
        device.pass(1e-3);
        assert_eq!(device.begin(2), Ok(vec![]));
        assert_eq!(device.last_wanted.force_n.x, 1.0);
        assert!(device.end().is_ok());
        assert_eq!(device.motors.force_n, Vec3::zeros());
    }

    #[test]
    fn frames_are_one_per_tick_and_in_pairs() {
        let mut device = device();
        assert_eq!(device.end(), Err(codes::ILLEGAL_END));
        assert!(device.begin(1).is_ok());
        assert_eq!(device.begin(1), Err(codes::ILLEGAL_BEGIN));
        assert!(device.end().is_ok());
        assert_eq!(device.begin(1), Err(codes::ILLEGAL_BEGIN), "a second frame in one tick");
        device.settings.one_frame = false;
        assert!(device.begin(1).is_ok());
    }

    #[test]
    fn calibration_needs_the_inkwell_and_moves_the_position() {
        let mut device = calibrated(Calibration::Missing);
        assert_eq!(device.calibration_code(), codes::CALIBRATION_NEEDS_MANUAL_INPUT);
        assert_eq!(device.calibrate(), Err(codes::INVALID_OPERATION));
        device.stylus.lead(arm::inkwell_m());
        assert_eq!(device.calibration_code(), codes::CALIBRATION_NEEDS_UPDATE);
        device.begin(1).expect("a frame");
        device.end().expect("its end");
        let off = (device.current.reading.position_m - arm::inkwell_m()).norm();
        assert_eq!(device.calibrate(), Ok(()));
        device.begin(2).expect("a frame");
        let right = (device.current.reading.position_m - arm::inkwell_m()).norm();
        assert!(off > 5e-3 && right < 1e-4, "{off} then {right}");
    }

    #[test]
    fn an_unplugged_device_complains_in_every_frame_and_gives_no_force() {
        let mut device = device();
        device.begin(1).expect("a frame");
        device.wanted.force_n = Vec3::new(0.0, 1.0, 0.0);
        device.end().expect("its end");
        device.suffer(Fault::Unplug);
        assert_eq!(device.motors.force_n, Vec3::zeros());
        assert_eq!(device.begin(2), Ok(vec![codes::COMM_ERROR]));
        device.close();
        assert_eq!(device.openable(), Err(codes::DEVICE_FAULT));
        device.suffer(Fault::Replug);
        assert_eq!(device.openable(), Ok(()));
    }

    #[test]
    fn forces_of_two_kinds_contradict_each_other() {
        let mut device = device();
        device.begin(1).expect("a frame");
        device.wanted = Wanted { force_n: Vec3::x(), torque_nm: Some(Vec3::new(0.01, 0.0, 0.0)) };
        assert_eq!(device.end(), Err(codes::FORCE_ERROR));
        device.begin(2).expect("a frame");
        device.wanted.torque_nm = Some(Vec3::new(0.02, 0.0, 0.0));
        device.end().expect("a torque alone");
        assert!((device.motors.torque_nm.x - 0.02).abs() <= 0.5 * arm::TORQUE_STEP_NM);
    }
}
