//! `--side-input`: foot switches and 3D mice beside the haptic device.
//!
//! Parsed once, here; whether one is attached is asked when the servo process opens it.

use crate::device::hid::known::HidRole;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// One side input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SideChoice {
    /// A foot switch: force only while it is down.
    Pedal(Option<PathBuf>),
    /// A 3D mouse: its first two buttons are the stylus' buttons.
    SpaceMouse(Option<PathBuf>),
}

impl SideChoice {
    /// What is looked for, and at which node.
    #[must_use]
    pub fn wanted(&self) -> (HidRole, Option<&std::path::Path>) {
        match self {
            Self::Pedal(path) => (HidRole::Pedal, path.as_deref()),
            Self::SpaceMouse(path) => (HidRole::SpaceMouse, path.as_deref()),
        }
    }
}

impl FromStr for SideChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, path) = match text.split_once(':') {
            Some((_, "")) => return Err(format!("nothing follows the colon of {text:?}; leave the colon out")),
            Some((kind, path)) => (kind, Some(PathBuf::from(path))),
            None => (text, None),
        };
        match kind {
            "pedal" => Ok(Self::Pedal(path)),
            "space-mouse" => Ok(Self::SpaceMouse(path)),
            _ => Err("give pedal[:PATH] or space-mouse[:PATH]".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_input_is_a_kind_and_perhaps_a_node() {
        assert_eq!("pedal".parse(), Ok(SideChoice::Pedal(None)));
        let mouse = "space-mouse:/dev/hidraw2".parse::<SideChoice>().expect("a node");
        assert_eq!(mouse.wanted(), (HidRole::SpaceMouse, Some(std::path::Path::new("/dev/hidraw2"))));
        for text in ["", "pedal:", "wheel"] {
            assert!(text.parse::<SideChoice>().is_err(), "{text:?}");
        }
    }
}
