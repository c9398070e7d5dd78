//! Builds the device with the hand that moves it, from the specification.
//!
//! A recording is laid onto the wound by the similarity transform of `hand::registration`; the middle of the
//! simulated device's workspace goes to where the hand works. With a given run time a recording repeats until
//! the end; without, the run ends with it.

use crate::cli::choice::{DeviceChoice, HandChoice, HandSide};
use crate::device::Device;
use crate::device::frame::SceneFromDevice;
use crate::device::replay::ReplayDevice;
use crate::device::simulated::{SimulatedDevice, SimulatedDeviceParams};
use crate::error::ServerError;
use crate::hand::HandFileFault;
use crate::hand::csv;
use crate::hand::recorded::RecordedHand;
use crate::hand::registration::{Registration, ScaleRule, WoundPlace};
use crate::hand::resample::AtEnd;
use crate::hand::synthetic::{SyntheticHand, SyntheticHandParams};
use crate::servo_link::{RunLength, ServoSpec};
use sim_core::vector::Vec3;
use std::path::Path;

/// Height of the workspace's middle above the wound for the synthetic hand, metres.
const SYNTHETIC_CENTRE_M: f64 = 0.02;

/// A device, ready to run, and what is known about its hand.
pub(super) struct Built {
    /// The device.
    pub(super) device: Box<dyn Device>,
    /// How a recorded hand was placed, in words; empty for others.
    pub(super) registration: String,
    /// How long the hand moves, if it ends by itself, seconds.
    pub(super) ends_after_s: Option<f64>,
}

impl From<HandFileFault> for ServerError {
    fn from(fault: HandFileFault) -> Self {
        let sentence = fault.to_string();
        match fault {
            HandFileFault::NotFound { .. } | HandFileFault::Unreadable { .. } => Self::NoInput(sentence),
            _ => Self::BadData(sentence),
        }
    }
}

/// Builds what the specification asks for.
pub(super) fn device(spec: &ServoSpec) -> Result<Built, ServerError> {
    match (&spec.device, &spec.hand) {
        (DeviceChoice::Replay(path), _) => {
            let recorded = Recorded::read(path, spec)?;
            Ok(Built {
                device: Box::new(ReplayDevice::new(Box::new(recorded.hand))),
                registration: in_words(&recorded.registration),
                ends_after_s: recorded.ends_after_s,
            })
        }
        (DeviceChoice::Simulated, HandChoice::File(path)) => {
            let recorded = Recorded::read(path, spec)?;
            let frame = SceneFromDevice::workspace_at(recorded.registration.workspace_centre_m);
            let device = SimulatedDevice::new(SimulatedDeviceParams::default(), frame, Box::new(recorded.hand));
            Ok(Built {
                device: Box::new(device),
                registration: in_words(&recorded.registration),
                ends_after_s: recorded.ends_after_s,
            })
        }
        (DeviceChoice::Simulated, HandChoice::Synthetic) => {
            let home = Vec3::new(0.0, 0.0, SYNTHETIC_CENTRE_M);
            let frame = SceneFromDevice::workspace_at(home);
            let hand = Box::new(SyntheticHand::new(SyntheticHandParams::default(), home));
            let device = SimulatedDevice::new(SimulatedDeviceParams::default(), frame, hand);
            Ok(Built { device: Box::new(device), registration: String::new(), ends_after_s: None })
        }
        (other, _) => {
            other.require_drivable()?;
            Err(ServerError::Unavailable(format!(
                "device {other} has no driver in this build; give another with --device"
            )))
        }
    }
}

/// A recorded hand on the wound.
struct Recorded {
    hand: RecordedHand,
    registration: Registration,
    ends_after_s: Option<f64>,
}

impl Recorded {
    fn read(path: &Path, spec: &ServoSpec) -> Result<Self, ServerError> {
        let side = match spec.hand_side {
            HandSide::Left => csv::HandSide::Left,
            HandSide::Right => csv::HandSide::Right,
        };
        let file = csv::read_path(path, side)?;
        let wound = WoundPlace {
            centre_m: Vec3::zeros(),
            along: Vec3::y(),
            across: Vec3::x(),
            outward: Vec3::z(),
            extent_m: spec.wound_extent_m,
        };
        let registration = Registration::new(file.kind, &file.recording, &wound);
        let at_end = match spec.length {
            RunLength::Given => AtEnd::Loop,
            RunLength::OfTheHand => AtEnd::Hold,
        };
        let unusable = |e| ServerError::BadData(format!("{}: {e}", path.display()));
        let hand = RecordedHand::new(&registration.apply(file.recording), at_end).map_err(unusable)?;
        let ends_after_s = (spec.length == RunLength::OfTheHand).then(|| hand.duration_s());
        Ok(Self { hand, registration, ends_after_s })
    }
}

/// The similarity transform in words.
fn in_words(r: &Registration) -> String {
    let rule = match r.rule {
        ScaleRule::SutureExtent => "the grips span the suture points",
        ScaleRule::Workspace => "the motion fills the workspace",
        ScaleRule::LifeSize => "life size",
    };
    let t = r.translation_m * 1e3;
    format!(
        "scale {:.3} ({rule}), {} grips, moved by ({:.1}, {:.1}, {:.1}) mm after rotation",
        r.scale, r.grips, t.x, t.y, t.z
    )
}
