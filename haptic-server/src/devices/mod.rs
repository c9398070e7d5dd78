//! `haptic-server devices`: what is attached, what would drive it, what is missing.
//!
//! A look at the kernel's lists and at the vendor's configuration; no device is opened, so that a running server is not disturbed.
//! What needs no hardware stands in the list, too. JSON keys are a contract with scripts: add, don't rename.

mod attached;
mod known;

pub use attached::{Attached, attached};
pub use known::{Backend, Link, Role};

use crate::cli::Format;
use crate::device::openhaptics::library;
use crate::doctor::configured;
use crate::error::ServerError;
use crate::machine::{GROUP, Machine};
use serde::Serialize;
use std::fmt;

/// A device and what it takes to drive it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// The device.
    #[serde(flatten)]
    pub device: Attached,
    /// The option that drives it; null for one that nothing here drives.
    pub option: Option<String>,
    /// What is missing, each with its remedy; empty when it can be driven now.
    pub missing: Vec<String>,
}

/// The whole list.
#[derive(Clone, Debug, Serialize)]
pub struct Listing {
    /// Known devices that are attached.
    pub attached: Vec<Row>,
    /// Whether the vendor's library loads.
    pub openhaptics_library: bool,
    /// Names of the devices that the vendor's set-up has configured.
    pub openhaptics_names: Vec<String>,
    /// Devices that need no hardware.
    pub without_hardware: [&'static str; 3],
}

/// Lists the devices of this machine.
///
/// # Errors
/// The list cannot be written as JSON.
pub fn run(format: Format) -> Result<String, ServerError> {
    let listing = list(&Machine::of_process(), library::load(None).is_ok());
    Ok(match format {
        Format::Text => listing.to_string(),
        Format::Json => {
            let text = serde_json::to_string(&listing);
            text.map_err(|e| ServerError::Internal(format!("cannot write the list as JSON: {e}")))? + "\n"
        }
    })
}

/// The list for a machine on which the vendor's library loads, or does not.
#[must_use]
pub fn list(machine: &Machine, library_loads: bool) -> Listing {
    let names = configured(machine);
    let row = |device: Attached| {
        let option = option(&device);
        let missing = missing(machine, &device, library_loads, &names);
        Row { device, option, missing }
    };
    Listing {
        attached: attached(machine).into_iter().map(row).collect(),
        openhaptics_library: library_loads,
        openhaptics_names: names,
        without_hardware: ["simulated", "replay:FILE", "pointer"],
    }
}

/// The option that drives a device; side inputs and strangers have none.
fn option(device: &Attached) -> Option<String> {
    match (device.role, device.backend) {
        (Role::SideInput, _) | (_, Backend::None) => None,
        (_, Backend::Openhaptics) => Some("openhaptics".to_owned()),
        (_, Backend::Hid) => Some(device.node.as_ref().map_or_else(|| "hid".to_owned(), |node| format!("hid:{node}"))),
        (_, Backend::Firewire) => Some("firewire".to_owned()),
    }
}

fn missing(machine: &Machine, device: &Attached, library_loads: bool, names: &[String]) -> Vec<String> {
    let mut missing = Vec::new();
    match &device.node {
        None => missing.push(match device.link {
            Link::Serial => "no serial port: as root: modprobe cdc_acm".to_owned(),
            Link::Hid => "no report node: as root: modprobe hid-generic; a driver may have claimed the device".to_owned(),
            Link::Usb => "no device file: is /dev/bus/usb mounted here (a container: --device /dev/bus/usb)".to_owned(),
            Link::Firewire => "no node: as root: modprobe firewire-ohci".to_owned(),
        }),
        Some(node) if !device.usable => missing.push(format!(
            "{node} is closed to this user: install the package's udev rules (packaging/), then as root: usermod -aG {GROUP} {}, log in again and plug the device in again",
            machine.user_name()
        )),
        Some(_) => {}
    }
    if device.backend == Backend::Openhaptics {
        if !library_loads {
            missing.push("the OpenHaptics library: see `haptic-server doctor`".to_owned());
        }
        if names.is_empty() {
            missing.push("a configuration: run the vendor's set-up as this user: LC_ALL=C Touch_Setup".to_owned());
        }
    }
    if device.backend == Backend::None {
        missing.push("a driver: nothing here drives it".to_owned());
    }
    missing
}

impl fmt::Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in &self.attached {
            let node = row.device.node.as_deref().unwrap_or("no node");
            let use_for = match (&row.option, row.device.side_input) {
                (Some(option), _) => format!("--device {option}"),
                (None, Some(side)) => format!("--side-input {side}"),
                (None, None) => "no driver".to_owned(),
            };
            writeln!(f, "{}  {}  {node}  {use_for}", row.device.id, row.device.model)?;
            for missing in &row.missing {
                writeln!(f, "    missing: {missing}")?;
            }
        }
        if !self.attached.iter().any(|row| row.device.role == Role::Haptic) {
            writeln!(f, "no haptic device is attached that is known here")?;
        }
        let library = if self.openhaptics_library { "loads" } else { "does not load (see `haptic-server doctor`)" };
        let names =
            if self.openhaptics_names.is_empty() { "none".to_owned() } else { self.openhaptics_names.join(", ") };
        writeln!(f, "OpenHaptics: library {library}; devices set up: {names}")?;
        writeln!(f, "without hardware: --device {}", self.without_hardware.join(", --device "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::fixture::Tree;

    fn touch() -> Tree {
        Tree::new()
            .with("sys/bus/usb/devices/1-1/idVendor", "2988\n")
            .with("sys/bus/usb/devices/1-1/idProduct", "0302\n")
            .with("sys/class/tty/ttyACM0/device/uevent", "PRODUCT=2988/302/100\n")
            .with("rig/config/Default Device.config", "L1=133.35\n")
    }

    #[test]
    fn a_touch_with_everything_in_place_lacks_nothing() {
        let listing = list(&touch().machine().with_variable("GTDD_HOME", "/rig"), true);
        let [row] = &listing.attached[..] else { panic!("{listing:?}") };
        assert_eq!((row.option.as_deref(), row.missing.len()), (Some("openhaptics"), 0));
        assert_eq!(listing.openhaptics_names, ["Default Device"]);
        assert!(
            listing
                .to_string()
                .starts_with("2988:0302  3D Systems Touch (USB serial)  /dev/ttyACM0  --device openhaptics\n")
        );
    }

    #[test]
    fn what_is_missing_is_said_with_its_remedy() {
        let listing = list(&touch().locked(), false);
        let missing = listing.attached[0].missing.join("\n");
        for part in ["/dev/ttyACM0 is closed", "usermod -aG haptic", "OpenHaptics library", "Touch_Setup"] {
            assert!(missing.contains(part), "{part} is not in: {missing}");
        }
        let falcon = Tree::new()
            .with("sys/bus/usb/devices/1-1/idVendor", "0403")
            .with("sys/bus/usb/devices/1-1/idProduct", "cb48");
        assert!(list(&falcon.machine(), true).to_string().contains("no driver"));
        let none = list(&Tree::new().machine(), false).to_string();
        assert!(none.contains("no haptic device is attached") && none.contains("--device simulated"), "{none}");
    }

    #[test]
    fn the_json_has_its_keys() {
        let value = serde_json::to_value(list(&touch().machine(), true)).expect("strings and flags");
        for key in ["attached", "openhaptics_library", "openhaptics_names", "without_hardware"] {
            assert!(value.get(key).is_some(), "{key}");
        }
        for key in ["model", "role", "link", "id", "node", "usable", "backend", "option", "missing"] {
            assert!(value["attached"][0].get(key).is_some(), "{key}");
        }
        assert_eq!(value["attached"][0]["backend"], "openhaptics");
    }
}
