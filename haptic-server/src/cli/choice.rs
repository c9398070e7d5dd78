//! The values of the command line: scene, device, hand, control.
//!
//! A value is parsed once, here, into a closed type; nothing downstream looks at the text again.
//! Deliberately absent: opening anything.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// `--scene`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneChoice {
    /// Skin preset.
    Skin,
    /// Liver preset.
    Liver,
    /// Hepatic vessel preset.
    Vessel,
    /// A scene file.
    File(PathBuf),
}

impl FromStr for SceneChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "skin" => Ok(Self::Skin),
            "liver" => Ok(Self::Liver),
            "vessel" => Ok(Self::Vessel),
            _ if text.ends_with(".toml") => Ok(Self::File(text.into())),
            _ => Err("give skin, liver, vessel or a scene file that ends in .toml".to_owned()),
        }
    }
}

impl fmt::Display for SceneChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Skin => f.write_str("skin"),
            Self::Liver => f.write_str("liver"),
            Self::Vessel => f.write_str("vessel"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// `--procedure`: several scenes in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ProcedureChoice {
    /// Skin, then liver, then vessel.
    LiverSurgery,
}

impl fmt::Display for ProcedureChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("liver-surgery")
    }
}

/// `--device`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// A simulated Omni whose stylus a hand holds by a spring.
    Simulated,
    /// A recorded trace, open loop.
    Replay(PathBuf),
    /// A simulated Omni that follows mouse or touch pad of a viewer.
    Pointer,
    /// An Omni through the OpenHaptics library, by configuration name; two names with a plus between.
    Openhaptics(Option<String>),
    /// The open HID arm through hidraw, by path.
    Hid(Option<PathBuf>),
    /// An Omni on FireWire.
    Firewire,
}

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, argument) = match text.split_once(':') {
            Some((_, "")) => return Err(format!("nothing follows the colon of {text:?}; leave the colon out")),
            Some((kind, argument)) => (kind, Some(argument)),
            None => (text, None),
        };
        match (kind, argument) {
            ("simulated", None) => Ok(Self::Simulated),
            ("replay", Some(file)) => Ok(Self::Replay(file.into())),
            ("replay", None) => Err("replay needs a file: replay:FILE".to_owned()),
            ("pointer", None) => Ok(Self::Pointer),
            ("openhaptics", name) => Ok(Self::Openhaptics(name.map(str::to_owned))),
            ("hid", path) => Ok(Self::Hid(path.map(PathBuf::from))),
            ("firewire", None) => Ok(Self::Firewire),
            _ => Err("give simulated, replay:FILE, pointer, openhaptics[:NAME], hid[:PATH] or firewire".to_owned()),
        }
    }
}

impl DeviceChoice {
    /// Whether it is a device that can push a real hand.
    #[must_use]
    pub fn is_hardware(&self) -> bool {
        !matches!(self, Self::Simulated | Self::Replay(_) | Self::Pointer)
    }
}

impl fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulated => f.write_str("simulated"),
            Self::Replay(path) => write!(f, "replay:{}", path.display()),
            Self::Pointer => f.write_str("pointer"),
            Self::Openhaptics(None) => f.write_str("openhaptics"),
            Self::Openhaptics(Some(name)) => write!(f, "openhaptics:{name}"),
            Self::Hid(None) => f.write_str("hid"),
            Self::Hid(Some(path)) => write!(f, "hid:{}", path.display()),
            Self::Firewire => f.write_str("firewire"),
        }
    }
}

/// `--hand`: who moves the simulated stylus.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandChoice {
    /// A synthetic surgeon who sutures by eye.
    Synthetic,
    /// A recorded hand: CSV or MCAP.
    File(PathBuf),
}

impl FromStr for HandChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "synthetic" => Ok(Self::Synthetic),
            "" => Err("give synthetic or a recorded hand file".to_owned()),
            _ => Ok(Self::File(text.into())),
        }
    }
}

impl fmt::Display for HandChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Synthetic => f.write_str("synthetic"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// `--hand-side`: which hand of a two-handed recording holds the needle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum HandSide {
    /// The left hand.
    Left,
    /// The right hand.
    #[default]
    Right,
}

/// `--control`: supervision of the finished stitches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ControlChoice {
    /// Rate-limited compliant constraint.
    On,
    /// No supervision.
    Off,
    /// Algorithm 2 as printed.
    Paper,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_documented_device_is_understood_and_printed_back() {
        for text in [
            "simulated",
            "replay:a/b.csv",
            "pointer",
            "openhaptics",
            "openhaptics:Left Device",
            "hid",
            "hid:/dev/hidraw3",
            "firewire",
        ] {
            assert_eq!(text.parse::<DeviceChoice>().expect(text).to_string(), text);
        }
        for text in ["", "replay", "replay:", "simulated:x", "firewire:1", "omni"] {
            assert!(text.parse::<DeviceChoice>().is_err(), "{text:?} must be refused");
        }
    }

    #[test]
    fn what_is_no_hardware_needs_no_rights() {
        for (text, real) in [("simulated", false), ("replay:a.csv", false), ("pointer", false), ("hid", true)] {
            assert_eq!(text.parse::<DeviceChoice>().expect(text).is_hardware(), real, "{text}");
        }
    }

    #[test]
    fn a_scene_is_a_preset_or_a_toml_file() {
        assert_eq!("vessel".parse(), Ok(SceneChoice::Vessel));
        assert_eq!("my/liver.toml".parse(), Ok(SceneChoice::File("my/liver.toml".into())));
        assert!("skn".parse::<SceneChoice>().is_err());
    }

    proptest! {
        #[test]
        fn no_text_makes_a_choice_panic(text in ".{0,40}") {
            let _ = text.parse::<DeviceChoice>();
            let _ = text.parse::<SceneChoice>();
            let _ = text.parse::<HandChoice>();
        }
    }
}
