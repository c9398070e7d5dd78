//! Devices that are known by their numbers, and how each would be driven.
//!
//! USB numbers are vendor:product; FireWire nodes are known by the vendor number of their configuration memory. A number is a sign, not a proof:
//! 16c0:0486 is that of every Teensy with raw reports. Devices with reports are those of `device::hid::known`. Sources: udev rules and drivers named in the public repositories of these devices.

use crate::device::hid::known::{HidRole, role_of};

/// How something is attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Link {
    /// A USB serial port (`/dev/ttyACM*`).
    Serial,
    /// USB reports (`/dev/hidraw*`).
    Hid,
    /// A USB device that its driver talks to by libusb (`/dev/bus/usb/…`).
    Usb,
    /// FireWire (`/dev/fw*`).
    Firewire,
}

/// What drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// `--device openhaptics`.
    Openhaptics,
    /// `--device hid`.
    Hid,
    /// `--device firewire`.
    Firewire,
    /// Nothing here.
    None,
}

/// What it is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// It has force.
    Haptic,
    /// A 3D mouse's buttons, or the dead man's switch.
    SideInput,
}

/// A kind of device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    /// Its name.
    pub(super) model: &'static str,
    /// How its driver reaches it.
    pub(super) link: Link,
    /// What drives it.
    pub(super) backend: Backend,
    /// What it is good for.
    pub(super) role: Role,
    /// The value of `--side-input`, for a side input.
    pub(super) side_input: Option<&'static str>,
}

const fn haptic(model: &'static str, link: Link, backend: Backend) -> Kind {
    Kind { model, link, backend, role: Role::Haptic, side_input: None }
}

const fn side(model: &'static str, option: &'static str) -> Kind {
    Kind { model, link: Link::Hid, backend: Backend::Hid, role: Role::SideInput, side_input: Some(option) }
}

/// FireWire vendor number of SensAble.
pub(super) const SENSABLE: u32 = 0x00_0b99;
/// The original Omni.
pub(super) const OMNI: Kind = haptic("PHANTOM Omni (FireWire)", Link::Firewire, Backend::Firewire);

/// USB devices that are not driven by reports.
const USB: [(u16, u16, Kind); 3] = [
    (0x2988, 0x0302, haptic("3D Systems Touch (USB serial)", Link::Serial, Backend::Openhaptics)),
    (0x0301, 0x2988, haptic("3D Systems Touch 3D Stylus (USB serial)", Link::Serial, Backend::Openhaptics)),
    (0x0403, 0xcb48, haptic("Novint Falcon", Link::Usb, Backend::None)),
];

/// The kind that has these numbers.
#[must_use]
pub(super) fn of_usb(vendor: u16, product: u16) -> Option<Kind> {
    let Some(role) = role_of(vendor, product) else {
        return USB.iter().find(|(v, p, _)| (*v, *p) == (vendor, product)).map(|(_, _, kind)| *kind);
    };
    Some(match role {
        HidRole::Arm => haptic(role.name(), Link::Hid, Backend::Hid),
        HidRole::TouchHid => haptic(role.name(), Link::Usb, Backend::Openhaptics),
        HidRole::SpaceMouse => side(role.name(), "space-mouse"),
        HidRole::Pedal => side(role.name(), "pedal"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_each_generation_lead_to_its_driver() {
        for (vendor, product, link, backend) in [
            (0x2988, 0x0302, Link::Serial, Backend::Openhaptics),
            (0x0301, 0x2988, Link::Serial, Backend::Openhaptics),
            (0x2988, 0x0304, Link::Usb, Backend::Openhaptics),
            (0x16c0, 0x0486, Link::Hid, Backend::Hid),
        ] {
            let kind = of_usb(vendor, product).expect("known");
            assert_eq!((kind.link, kind.backend, kind.role), (link, backend, Role::Haptic));
        }
        assert_eq!(of_usb(0x256f, 0xc635).map(|k| k.role), Some(Role::SideInput));
        assert_eq!(of_usb(0x046d, 0xc626).map(|k| k.role), Some(Role::SideInput));
        assert_eq!(of_usb(0x046d, 0xc52b), None, "a receiver of keyboards is no space mouse");
        assert_eq!(of_usb(0x2988, 0x9999), None);
    }
}
