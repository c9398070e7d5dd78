//! Device and hand of a run, built from the command line's choices; live and lockstep use the same.
//!
//! A recording is laid onto the wound by the similarity transform of `hand::registration`: every scene stands in
//! the wound frame (middle of the wound = origin, x across, y along, z out of the tissue), so the place is the
//! same in all. A pointer's hand gets its wishes through a cell whose other end stands in the rig. The middle of the simulated device's workspace goes to where the hand works. With a given
//! run time a recording repeats until the end; without, the run ends with it.

use crate::cli::choice::{DeviceChoice, HandChoice, HandSide};
use crate::convert;
use crate::device::frame::SceneFromDevice;
use crate::device::openhaptics::OpenHaptics;
use crate::device::replay::ReplayDevice;
use crate::device::simulated::{SimulatedDevice, SimulatedDeviceParams};
use crate::device::{Device, PulledDevice, firewire, hid};
use crate::error::ServerError;
use crate::hand::pointer::{PointerHand, PointerWish};
use crate::hand::recorded::RecordedHand;
use crate::hand::registration::{Registration, ScaleRule, WoundPlace};
use crate::hand::resample::AtEnd;
use crate::hand::synthetic::{SyntheticHand, SyntheticHandParams};
use crate::hand::{Hand, HandFileFault, csv};
use crate::servo_link::RunLength;
use sim_core::vector::Vec3;
use std::path::Path;
use triple_buffer::{Input, triple_buffer};

/// Where the synthetic hand waits above the wound, and where the middle of its workspace is, metres.
const SYNTHETIC_HOME_M: f64 = 0.02;

/// What to build.
#[derive(Clone, Copy, Debug)]
pub struct RigChoice<'a> {
    /// Device.
    pub device: &'a DeviceChoice,
    /// Who moves a simulated stylus.
    pub hand: &'a HandChoice,
    /// Which hand of a recording.
    pub side: HandSide,
    /// Whether a recording repeats.
    pub length: RunLength,
    /// The OpenHaptics library, if it is not the system's.
    pub library: Option<&'a Path>,
    /// What the rig knows of its device.
    pub device_file: Option<&'a Path>,
}

/// A device, ready to run.
pub enum RigDevice {
    /// Simulated Omni.
    Simulated(Box<SimulatedDevice>),
    /// Open-loop replay.
    Replay(Box<ReplayDevice>),
    /// A real Omni or Touch.
    OpenHaptics(Box<OpenHaptics>),
    /// A device on a wire of its own: HID or FireWire.
    Wire(Box<dyn Device>),
}

/// Device and what is known about its hand.
pub struct Rig {
    /// The device.
    pub device: RigDevice,
    /// How a recorded hand was placed, in words; empty for others.
    pub registration: String,
    /// How long the hand moves, if it ends by itself, seconds.
    pub ends_after_s: Option<f64>,
    /// Where the wishes of a pointer go, if that is the hand.
    pub wishes: Option<Input<PointerWish>>,
}

impl Rig {
    /// A device whose hand needs nothing and does not end by itself.
    fn of(device: RigDevice) -> Self {
        Self { device, registration: String::new(), ends_after_s: None, wishes: None }
    }
}

impl RigDevice {
    /// As a device that runs the loop.
    #[must_use]
    pub fn into_device(self) -> Box<dyn Device> {
        match self {
            Self::Simulated(device) => device,
            Self::Replay(device) => device,
            Self::OpenHaptics(device) => device,
            Self::Wire(device) => device,
        }
    }

    /// As a device that is asked once per tick; `None`: it owns its clock.
    pub fn pulled(&mut self) -> Option<&mut dyn PulledDevice> {
        match self {
            Self::Simulated(device) => Some(device.as_mut()),
            Self::Replay(device) => Some(device.as_mut()),
            Self::OpenHaptics(_) | Self::Wire(_) => None,
        }
    }
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

/// Builds what was chosen.
///
/// # Errors
/// 66 or 65 for a recording that cannot be used, 69 for a device that is not there.
pub fn build(choice: &RigChoice<'_>) -> Result<Rig, ServerError> {
    match (choice.device, choice.hand) {
        (DeviceChoice::Replay(path), _) => {
            let recorded = Recorded::read(path, choice.side, choice.length)?;
            Ok(recorded.rig(|hand, _| RigDevice::Replay(Box::new(ReplayDevice::new(Box::new(hand))))))
        }
        (DeviceChoice::Openhaptics(names), _) => {
            let frame = SceneFromDevice::workspace_at(workspace_centre_m());
            let device = OpenHaptics::open(names.as_deref(), choice.library, frame)
                .map_err(|e| ServerError::Unavailable(e.to_string()))?;
            tracing::info!("{}", device.description());
            Ok(Rig::of(RigDevice::OpenHaptics(Box::new(device))))
        }
        (DeviceChoice::Hid(path), _) => {
            let device = hid::open(path.as_deref(), choice.device_file, workspace_centre_m())?;
            Ok(Rig::of(RigDevice::Wire(device)))
        }
        (DeviceChoice::Firewire, _) => {
            let device = firewire::open(choice.device_file, workspace_centre_m())?;
            Ok(Rig::of(RigDevice::Wire(device)))
        }
        (DeviceChoice::Pointer, _) => {
            let home_m = workspace_centre_m();
            let (wishes, cell) = triple_buffer(&PointerWish::none());
            let device = simulated_by(Box::new(PointerHand::new(cell, home_m)), home_m).named("pointer");
            Ok(Rig { wishes: Some(wishes), ..Rig::of(RigDevice::Simulated(Box::new(device))) })
        }
        (_, HandChoice::File(path)) => {
            let recorded = Recorded::read(path, choice.side, choice.length)?;
            Ok(recorded.rig(|hand, centre_m| simulated(Box::new(hand), centre_m)))
        }
        (_, HandChoice::Synthetic) => {
            let home_m = workspace_centre_m();
            Ok(Rig::of(simulated(synthetic_hand(home_m), home_m)))
        }
    }
}

/// Where the middle of a device's workspace is in the scene, unless a recording says otherwise.
#[must_use]
pub fn workspace_centre_m() -> Vec3 {
    Vec3::new(0.0, 0.0, SYNTHETIC_HOME_M)
}

/// The synthetic surgeon, waiting at `home_m`.
#[must_use]
pub fn synthetic_hand(home_m: Vec3) -> Box<dyn Hand> {
    Box::new(SyntheticHand::new(SyntheticHandParams::default(), home_m))
}

/// The right hand of a recording, laid onto the wound, again and again.
///
/// # Errors
/// 66 or 65 for a recording that cannot be used.
pub fn recorded_hand(path: &Path) -> Result<Box<dyn Hand>, ServerError> {
    Ok(Box::new(Recorded::read(path, HandSide::Right, RunLength::Given)?.hand))
}

fn simulated(hand: Box<dyn Hand>, centre_m: Vec3) -> RigDevice {
    RigDevice::Simulated(Box::new(simulated_by(hand, centre_m)))
}

fn simulated_by(hand: Box<dyn Hand>, centre_m: Vec3) -> SimulatedDevice {
    SimulatedDevice::new(SimulatedDeviceParams::default(), SceneFromDevice::workspace_at(centre_m), hand)
}

/// A recorded hand on the wound.
struct Recorded {
    hand: RecordedHand,
    registration: Registration,
    ends_after_s: Option<f64>,
}

impl Recorded {
    fn read(path: &Path, side: HandSide, length: RunLength) -> Result<Self, ServerError> {
        let side = match side {
            HandSide::Left => csv::HandSide::Left,
            HandSide::Right => csv::HandSide::Right,
        };
        let (file, end) = convert::read_hand(path, side)?;
        if let Some(fault) = convert::end_fault(path, &end) {
            tracing::warn!("{fault}");
        }
        let wound = WoundPlace { centre_m: Vec3::zeros(), along: Vec3::y(), across: Vec3::x(), outward: Vec3::z() };
        let registration = Registration::new(file.kind, &file.recording, &wound);
        let at_end = match length {
            RunLength::Given => AtEnd::Loop,
            RunLength::OfTheHand => AtEnd::Hold,
        };
        let unusable = |e| ServerError::BadData(format!("{}: {e}", path.display()));
        let hand = RecordedHand::new(&registration.apply(file.recording), at_end).map_err(unusable)?;
        let ends_after_s = (length == RunLength::OfTheHand).then(|| hand.duration_s());
        Ok(Self { hand, registration, ends_after_s })
    }

    fn rig(self, device: impl FnOnce(RecordedHand, Vec3) -> RigDevice) -> Rig {
        Rig {
            device: device(self.hand, self.registration.workspace_centre_m),
            registration: in_words(&self.registration),
            ends_after_s: self.ends_after_s,
            wishes: None,
        }
    }
}

/// The similarity transform in words.
fn in_words(r: &Registration) -> String {
    let rule = match r.rule {
        ScaleRule::Workspace => "the motion fills the device's workspace",
        ScaleRule::LifeSize => "life size",
    };
    let t = r.translation_m * 1e3;
    format!(
        "scale {:.3} ({rule}), {} grips, moved by ({:.1}, {:.1}, {:.1}) mm after rotation",
        r.scale, r.grips, t.x, t.y, t.z
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;

    fn choice<'a>(device: &'a DeviceChoice, hand: &'a HandChoice) -> RigChoice<'a> {
        RigChoice {
            device,
            hand,
            side: HandSide::Right,
            length: RunLength::OfTheHand,
            library: None,
            device_file: None,
        }
    }

    #[test]
    fn the_synthetic_hand_never_ends_and_a_recording_does() {
        let rig = build(&choice(&DeviceChoice::Simulated, &HandChoice::Synthetic)).expect("needs nothing");
        assert!(rig.ends_after_s.is_none() && rig.registration.is_empty());
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("hand.csv");
        let recording = crate::hand::HandRecording {
            times_s: vec![0.0, 0.5, 2.0],
            positions_m: vec![Vec3::zeros(), Vec3::new(0.01, 0.0, 0.0), Vec3::new(0.0, 0.02, 0.0)],
            buttons: vec![0, 1, 0],
        };
        csv::write_scene(&recording, &mut std::fs::File::create(&path).expect("file")).expect("written");
        for (device, hand) in [
            (DeviceChoice::Replay(path.clone()), HandChoice::Synthetic),
            (DeviceChoice::Simulated, HandChoice::File(path.clone())),
        ] {
            let rig = build(&choice(&device, &hand)).expect("a sound recording");
            assert_eq!(rig.ends_after_s, Some(2.0));
            assert!(rig.registration.contains("1 grips"), "{}", rig.registration);
            let repeating = RigChoice { length: RunLength::Given, ..choice(&device, &hand) };
            assert!(build(&repeating).expect("a sound recording").ends_after_s.is_none());
        }
    }

    #[test]
    fn a_pointer_has_a_way_for_its_wishes_and_others_have_none() {
        let rig = build(&choice(&DeviceChoice::Pointer, &HandChoice::Synthetic)).expect("needs nothing");
        assert!(rig.wishes.is_some() && rig.ends_after_s.is_none());
        assert_eq!(rig.device.into_device().name(), "pointer");
        let rig = build(&choice(&DeviceChoice::Simulated, &HandChoice::Synthetic)).expect("needs nothing");
        assert!(rig.wishes.is_none());
    }

    #[test]
    fn missing_and_broken_recordings_have_their_codes() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("hand.csv");
        let code = || {
            let device = DeviceChoice::Replay(path.clone());
            build(&choice(&device, &HandChoice::Synthetic)).err().map(|e| e.exit_code())
        };
        assert_eq!(code(), Some(exit::NO_INPUT));
        std::fs::write(&path, "no,such,columns\n1,2,3\n").expect("written");
        assert_eq!(code(), Some(exit::BAD_DATA));
        // No node has this name, whatever is attached.
        let absent = DeviceChoice::Hid(Some(folder.path().join("hidraw9")));
        let absent = build(&choice(&absent, &HandChoice::Synthetic)).err().expect("not there");
        assert_eq!(absent.exit_code(), exit::UNAVAILABLE);
        assert!(absent.to_string().contains("hidraw9"), "{absent}");
    }
}
