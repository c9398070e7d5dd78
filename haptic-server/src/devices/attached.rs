//! What is attached, by the lists that the kernel keeps; no device is opened.
//!
//! USB: `/sys/bus/usb/devices/*/idVendor`. Its node is a serial port whose interface names the same product (`PRODUCT=2988/302/…`), a
//! report node with the same numbers (`HID_ID=0003:00002988:00000304`), or the device file that libusb opens. FireWire: nodes
//! with SensAble's vendor number. Deliberately absent: asking the device anything.

use super::known::{Backend, Kind, Link, OMNI, Role, SENSABLE, of_usb};
use crate::device::hid::known::{ARM_USAGE_PAGE, node_number};
use crate::machine::Machine;

/// One known device.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Attached {
    /// What it is.
    pub model: &'static str,
    /// What it is good for.
    pub role: Role,
    /// How its driver reaches it.
    pub link: Link,
    /// Its number: vendor:product, or the FireWire identity.
    pub id: String,
    /// Its node, if there is one.
    pub node: Option<String>,
    /// Whether this user may read and write the node.
    pub usable: bool,
    /// What drives it.
    pub backend: Backend,
    /// The value of `--side-input` that uses it; null for what is none.
    pub side_input: Option<&'static str>,
}

/// All known devices that are attached, USB first.
#[must_use]
pub fn attached(machine: &Machine) -> Vec<Attached> {
    let mut found = usb(machine);
    found.extend(firewire(machine));
    found
}

impl Attached {
    fn new(machine: &Machine, kind: Kind, id: String, node: Option<String>) -> Self {
        let usable = node.as_deref().is_some_and(|node| machine.is_usable(node));
        let Kind { model, link, backend, role, side_input } = kind;
        Self { model, role, link, id, node, usable, backend, side_input }
    }
}

fn hex(text: &str) -> Option<u16> {
    u16::from_str_radix(text.trim(), 16).ok()
}

fn usb(machine: &Machine) -> Vec<Attached> {
    const FOLDER: &str = "/sys/bus/usb/devices";
    let (serial, reports) = (serial_ports(machine), report_nodes(machine));
    let mut taken: Vec<String> = Vec::new();
    let mut found = Vec::new();
    for name in machine.names(FOLDER) {
        let read = |what: &str| machine.value(&format!("{FOLDER}/{name}/{what}"));
        let Some((vendor, product)) =
            read("idVendor").as_deref().and_then(hex).zip(read("idProduct").as_deref().and_then(hex))
        else {
            continue;
        };
        let Some(kind) = of_usb(vendor, product) else { continue };
        let mut free = |nodes: &[(u16, u16, String)]| {
            let same = |(v, p, node): &&(u16, u16, String)| (*v, *p) == (vendor, product) && !taken.contains(node);
            let node = nodes.iter().find(same).map(|(_, _, node)| node.clone());
            taken.extend(node.clone());
            node
        };
        let node = match kind.link {
            Link::Serial => free(&serial),
            Link::Hid => free(&reports),
            Link::Usb | Link::Firewire => {
                let number = |what: &str| read(what).and_then(|text| text.parse::<u16>().ok());
                let file =
                    number("busnum").zip(number("devnum")).map(|(bus, dev)| format!("/dev/bus/usb/{bus:03}/{dev:03}"));
                file.filter(|file| machine.has(file))
            }
        };
        found.push(Attached::new(machine, kind, format!("{vendor:04x}:{product:04x}"), node));
    }
    found
}

/// Serial ports with the numbers of the product that they belong to.
fn serial_ports(machine: &Machine) -> Vec<(u16, u16, String)> {
    let mut names = machine.names("/sys/class/tty");
    names.retain(|name| name.starts_with("ttyACM"));
    names.sort_by_key(|name| node_number(name));
    let port = |name: String| {
        let text = machine.text(&format!("/sys/class/tty/{name}/device/uevent"))?;
        let product = text.lines().find_map(|line| line.strip_prefix("PRODUCT="))?;
        let mut parts = product.split('/');
        Some((hex(parts.next()?)?, hex(parts.next()?)?, format!("/dev/{name}")))
    };
    names.into_iter().filter_map(port).collect()
}

/// Report nodes with their numbers: those with the arm's usage page first, since a Teensy has a second node, then by the node's number.
fn report_nodes(machine: &Machine) -> Vec<(u16, u16, String)> {
    let node = |name: String| {
        let text = machine.text(&format!("/sys/class/hidraw/{name}/device/uevent"))?;
        let id = text.lines().find_map(|line| line.strip_prefix("HID_ID="))?;
        let mut parts = id.split(':').skip(1);
        let mut number = || u32::from_str_radix(parts.next()?, 16).ok().and_then(|n| u16::try_from(n).ok());
        Some((number()?, number()?, format!("/dev/{name}")))
    };
    // A report descriptor begins with its usage page: item 06, two bytes, the lower one first.
    let [low, high] = ARM_USAGE_PAGE.to_le_bytes();
    let is_arm = |name: &str| {
        let descriptor = machine.bytes(&format!("/sys/class/hidraw/{name}/device/report_descriptor"));
        descriptor.is_some_and(|bytes| bytes.starts_with(&[0x06, low, high]))
    };
    let mut names = machine.names("/sys/class/hidraw");
    names.sort_by_cached_key(|name| (!is_arm(name), node_number(name)));
    names.into_iter().filter_map(node).collect()
}

fn firewire(machine: &Machine) -> Vec<Attached> {
    const FOLDER: &str = "/sys/bus/firewire/devices";
    let omni = |name: String| {
        // Units (fw1.0) stand beside their nodes (fw1).
        let vendor = machine.value(&format!("{FOLDER}/{name}/vendor")).filter(|_| !name.contains('.'))?;
        let vendor = u32::from_str_radix(vendor.trim_start_matches("0x"), 16).ok()?;
        let id = machine.value(&format!("{FOLDER}/{name}/guid")).unwrap_or_else(|| format!("{vendor:#08x}"));
        let node = Some(format!("/dev/{name}")).filter(|node| machine.has(node));
        (vendor == SENSABLE).then(|| Attached::new(machine, OMNI, id, node))
    };
    machine.names(FOLDER).into_iter().filter_map(omni).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::fixture::Tree;
    use proptest::prelude::*;

    fn usb_device(tree: Tree, name: &str, vendor: &str, product: &str) -> Tree {
        let at = |what: &str| format!("sys/bus/usb/devices/{name}/{what}");
        tree.with(&at("idVendor"), &format!("{vendor}\n"))
            .with(&at("idProduct"), &format!("{product}\n"))
            .with(&at("busnum"), "1\n")
            .with(&at("devnum"), "7\n")
    }

    #[test]
    fn every_generation_is_found_with_its_node() {
        let tree =
            usb_device(Tree::new(), "1-1", "2988", "0302").with("sys/bus/usb/devices/1-1:1.0/bInterfaceClass", "02\n");
        let tree = usb_device(tree, "1-2", "2988", "0304").with("dev/bus/usb/001/007", "");
        let tree = usb_device(tree, "1-3", "16c0", "0486");
        let tree = usb_device(tree, "1-4", "256f", "c635");
        let tree = usb_device(tree, "usb1", "1d6b", "0002")
            .with("sys/class/tty/ttyACM3/device/uevent", "DEVTYPE=usb_interface\nPRODUCT=2988/302/100\n")
            .with("sys/class/tty/ttyS0/uevent", "")
            .with("sys/class/hidraw/hidraw0/device/uevent", "HID_ID=0003:000016C0:00000486\nHID_NAME=x\n")
            .with("sys/bus/firewire/devices/fw0/vendor", "0x00d1\n")
            .with("sys/bus/firewire/devices/fw1/vendor", "0x000b99\n")
            .with("sys/bus/firewire/devices/fw1/guid", "0x000b990012345678\n")
            .with("sys/bus/firewire/devices/fw1.0/vendor", "0x000b99\n")
            .with("dev/fw1", "");
        let nodes: Vec<_> = attached(&tree.machine()).into_iter().map(|a| (a.id, a.node, a.usable)).collect();
        let row = |id: &str, node: Option<&str>| (id.to_owned(), node.map(str::to_owned), node.is_some());
        assert_eq!(
            nodes,
            [
                row("2988:0302", Some("/dev/ttyACM3")),
                row("2988:0304", Some("/dev/bus/usb/001/007")),
                row("16c0:0486", Some("/dev/hidraw0")),
                row("256f:c635", None),
                row("0x000b990012345678", Some("/dev/fw1")),
            ]
        );
        assert!(attached(&tree.locked()).iter().all(|a| !a.usable));
    }

    #[test]
    fn two_of_a_kind_have_two_nodes() {
        let tree = usb_device(usb_device(Tree::new(), "1-1", "2988", "0302"), "1-2", "2988", "0302")
            .with("sys/class/tty/ttyACM0/device/uevent", "PRODUCT=2988/302/100\n")
            .with("sys/class/tty/ttyACM1/device/uevent", "PRODUCT=2988/302/100\n");
        let nodes: Vec<_> = attached(&tree.machine()).into_iter().filter_map(|a| a.node).collect();
        assert_eq!(nodes, ["/dev/ttyACM0", "/dev/ttyACM1"]);
    }

    #[test]
    fn of_the_two_nodes_of_a_teensy_the_one_with_the_arms_page_is_shown_else_the_lower_number() {
        const ID: &str = "HID_ID=0003:000016C0:00000486\n";
        let at = |number: u32, what: &str| format!("sys/class/hidraw/hidraw{number}/device/{what}");
        let tree =
            usb_device(Tree::new(), "1-1", "16c0", "0486").with(&at(9, "uevent"), ID).with(&at(10, "uevent"), ID);
        let node = |tree: &Tree| attached(&tree.machine()).into_iter().find_map(|a| a.node);
        assert_eq!(node(&tree).as_deref(), Some("/dev/hidraw9"), "no descriptor is shown");
        let tree = tree.with_bytes(&at(9, "report_descriptor"), &[0x06, 0xc9, 0xff, 0x09, 0x04]);
        assert_eq!(node(&tree).as_deref(), Some("/dev/hidraw9"), "another page");
        let tree = tree.with_bytes(&at(10, "report_descriptor"), &[0x06, 0xab, 0xff, 0x0a, 0x00, 0x02]);
        assert_eq!(node(&tree).as_deref(), Some("/dev/hidraw10"));
    }

    proptest! {
        #[test]
        fn no_text_stops_the_reading(id in ".{0,12}", product in "(PRODUCT=)?.{0,30}", hid in "(HID_ID=)?.{0,40}") {
            let tree = usb_device(Tree::new(), "1-1", "2988", "0302")
                .with("sys/bus/usb/devices/1-2/idVendor", &id)
                .with("sys/class/tty/ttyACM0/device/uevent", &product)
                .with("sys/class/hidraw/hidraw0/device/uevent", &hid)
                .with("sys/bus/firewire/devices/fw0/vendor", &id);
            prop_assert!(attached(&tree.machine()).iter().any(|a| a.id == "2988:0302"));
        }
    }
}
