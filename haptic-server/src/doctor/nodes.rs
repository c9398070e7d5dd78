//! Rows for the devices that are attached, and for what they and their users have in common.
//!
//! A haptic device that cannot be driven by this user fails; a side input that cannot be read warns; no device at all is well:
//! the simulated one needs none.

use super::check::Check;
use crate::devices::{Listing, Role};
use crate::exit;

/// One row per device, or one that says that there is none.
pub(super) fn checks(listing: &Listing) -> Vec<Check> {
    const NAME: &str = "device";
    if listing.attached.is_empty() {
        return vec![Check::ok(
            NAME,
            "none attached that is known here; simulated, replayed and pointer ones need none",
        )];
    }
    let row = |row: &crate::devices::Row| {
        let device = &row.device;
        let found = format!("{} {} at {}", device.model, device.id, device.node.as_deref().unwrap_or("no node"));
        let remedy = row.missing.join("; ");
        match (row.missing.is_empty(), device.role) {
            (true, _) => {
                let option = row.option.as_ref().map_or_else(String::new, |option| format!(", --device {option}"));
                Check::ok(NAME, format!("{found}{option}"))
            }
            (false, Role::Haptic) => {
                let is_closed = device.node.is_some() && !device.usable;
                let code = if is_closed { exit::PERMISSION } else { exit::UNAVAILABLE };
                Check::fail(NAME, found, remedy, code)
            }
            (false, Role::SideInput) => Check::warn(NAME, found, remedy),
        }
    };
    listing.attached.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::list;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;

    #[test]
    fn a_closed_device_fails_and_a_closed_side_input_warns() {
        let usb = |tree: Tree, name: &str, vendor: &str, product: &str| {
            tree.with(&format!("sys/bus/usb/devices/{name}/idVendor"), vendor)
                .with(&format!("sys/bus/usb/devices/{name}/idProduct"), product)
        };
        assert_eq!(checks(&list(&Tree::new().machine(), false))[0].status, Status::Ok);
        let tree = usb(usb(Tree::new(), "1-1", "2988", "0302"), "1-2", "256f", "c635")
            .with("sys/class/tty/ttyACM0/device/uevent", "PRODUCT=2988/302/100\n")
            .with("sys/class/hidraw/hidraw0/device/uevent", "HID_ID=0003:0000256F:0000C635\n")
            .with("rig/config/Left.config", "");
        let rows = |machine: crate::machine::Machine| checks(&list(&machine.with_variable("GTDD_HOME", "/rig"), true));
        assert_eq!(rows(tree.machine()).iter().map(|c| c.status).collect::<Vec<_>>(), [Status::Ok; 2]);
        let locked = rows(tree.locked());
        assert_eq!(locked.iter().map(|c| c.status).collect::<Vec<_>>(), [Status::Fail, Status::Warn]);
        assert!(locked[0].remedy.as_ref().is_some_and(|r| r.contains("/dev/ttyACM0 is closed")), "{locked:?}");
    }
}
