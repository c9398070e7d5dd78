//! Which HID devices this program knows, by USB vendor and product: pure tables for the driver and for diagnosis.
//!
//! | device | vendor:product | use |
//! |---|---|---|
//! | open HID arm (WoodenHaptics, Polhem) | 16c0:0486, older 1234:0006 | driven: `--device hid` |
//! | Touch HID | 2988:0304 | through OpenHaptics only: its interface authenticates the vendor's driver |
//! | SpaceMouse and kin | 256f:*, older 046d:c603 … c62b | side input |
//! | foot switch | 0c45:7403, 0c45:7404, 413d:2107, 1a86:e026, 3553:b001 | side input |
//!
//! 16c0:0486 belongs to every board with the same raw-HID firmware base, 1234:0006 to nobody: only the usage page or the
//! user can say that such a device is an arm.

/// What a device is to this program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HidRole {
    /// The open HID arm.
    Arm,
    /// The vendor's device, closed to us.
    TouchHid,
    /// A 3D mouse.
    SpaceMouse,
    /// A foot switch.
    Pedal,
}

impl HidRole {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "open HID arm (WoodenHaptics, Polhem)",
            Self::TouchHid => "3D Systems Touch HID",
            Self::SpaceMouse => "3Dconnexion 3D mouse",
            Self::Pedal => "foot switch",
        }
    }

    /// How it is used.
    #[must_use]
    pub fn usage(self) -> &'static str {
        match self {
            Self::Arm => "haptic-server run --device hid",
            Self::TouchHid => {
                "driven through OpenHaptics, since its interface admits only the vendor's driver: \
                 haptic-server run --device openhaptics"
            }
            Self::SpaceMouse => "haptic-server run --side-input space-mouse",
            Self::Pedal => "haptic-server run --side-input pedal",
        }
    }
}

/// Usage page of the raw reports of a Teensy, the open HID arm's board; its other interface (a serial console) has another.
pub const ARM_USAGE_PAGE: u16 = 0xffab;

/// The number at the end of a node's name (`hidraw10`: 10), by which nodes are ordered; the largest without one.
#[must_use]
pub fn node_number(name: &str) -> u32 {
    name.rsplit(|c: char| !c.is_ascii_digit()).next().and_then(|digits| digits.parse().ok()).unwrap_or(u32::MAX)
}

/// Products of the older 3D mice among those of their maker.
const OLD_MICE: [u16; 11] = [0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625, 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b];

/// The role of a USB vendor and product; `None` for one that is unknown.
#[must_use]
pub fn role_of(vendor: u16, product: u16) -> Option<HidRole> {
    match (vendor, product) {
        (0x16c0, 0x0486) | (0x1234, 0x0006) => Some(HidRole::Arm),
        (0x2988, 0x0304) => Some(HidRole::TouchHid),
        (0x256f, _) => Some(HidRole::SpaceMouse),
        (0x046d, mouse) if OLD_MICE.contains(&mouse) => Some(HidRole::SpaceMouse),
        (0x0c45, 0x7403 | 0x7404) | (0x413d, 0x2107) | (0x1a86, 0xe026) | (0x3553, 0xb001) => Some(HidRole::Pedal),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_devices_have_their_role_and_a_keyboard_has_none() {
        assert_eq!(role_of(0x16c0, 0x0486), Some(HidRole::Arm));
        assert_eq!(role_of(0x2988, 0x0304), Some(HidRole::TouchHid));
        assert_eq!(role_of(0x256f, 0xc635), Some(HidRole::SpaceMouse));
        assert_eq!(role_of(0x046d, 0xc626), Some(HidRole::SpaceMouse));
        assert_eq!(role_of(0x046d, 0xc31c), None);
        // The Touch with a serial interface is no HID device.
        assert_eq!(role_of(0x2988, 0x0302), None);
        assert!(HidRole::TouchHid.usage().contains("openhaptics"));
    }
}
