//! The real wire of HID devices: hidraw nodes through `hidapi` (its native Linux backend, no C library).
//!
//! Facts of that crate, read in its source: a read is `poll` and `read`, a write is `write`, neither uses the heap unless it
//! fails. The write is synchronous in the kernel: until the transfer has gone through, or for seconds when a device hangs;
//! so both happen in the wire's own thread (`wire::pump`).
//! A device is refused with what, where and the remedy: none attached, no rights on its node, or one that is driven otherwise.

use super::known::{HidRole, role_of};
use crate::device::wire::{LONGEST, Opener, WireError, WirePort};
use hidapi::{BusType, HidApi, HidDevice, HidError};
use std::ffi::{CStr, CString};
use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Why no HID device can be driven.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HidOpenError {
    /// The list of devices cannot be read.
    #[error("the list of HID devices cannot be read ({0}); is /sys mounted?")]
    NoList(String),
    /// Nothing fits.
    #[error(
        "no {wanted} is attached ({seen} HID devices seen under /sys/class/hidraw); plug it in and switch it on, or name its \
         node with a path; `haptic-server devices` shows what there is"
    )]
    None {
        /// What was looked for.
        wanted: &'static str,
        /// Devices seen.
        seen: usize,
    },
    /// The named node is not there.
    #[error("{0}: no such HID device; `haptic-server devices` shows the nodes that there are")]
    NotThere(PathBuf),
    /// It is there and another thing.
    #[error("{path}: {found}, not {wanted}; {usage}")]
    Other {
        /// Node.
        path: PathBuf,
        /// What it is.
        found: String,
        /// What was looked for.
        wanted: &'static str,
        /// What to do with it.
        usage: &'static str,
    },
    /// More than one fits.
    #[error("more than one {wanted} is attached: {nodes}; name one of these nodes with a path")]
    Several {
        /// What was looked for.
        wanted: &'static str,
        /// Their nodes.
        nodes: String,
    },
    /// The node cannot be opened, and rights are not the cause.
    #[error("{path}: cannot be opened ({reason}); end other programs that use it, check its cable and power")]
    Unusable {
        /// Node.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The rights on the node are missing.
    #[error(
        "{path}: cannot be opened ({reason}); give the user read and write rights on it by a udev rule: \
         KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", ATTRS{{idProduct}}==\"{product:04x}\", MODE=\"0660\", \
         GROUP=\"haptic\", TAG+=\"uaccess\""
    )]
    Refused {
        /// Node.
        path: PathBuf,
        /// What the system says.
        reason: String,
        /// USB vendor.
        vendor: u16,
        /// USB product.
        product: u16,
    },
}

/// A HID device as the list shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Its node.
    pub path: PathBuf,
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// What it calls itself.
    pub name: String,
    /// Usage pages of its reports, as far as the system tells.
    pub usage_pages: Vec<u16>,
}

/// Usage page of the raw reports of an arm's board; its emulated serial port is another node with another page.
const RAW_REPORTS: u16 = 0xffab;

impl Listed {
    /// Whether it can have this role. The number of an arm is that of every board with its firmware base.
    fn fits(&self, role: HidRole) -> bool {
        let is_shared = (self.vendor, self.product) == (0x16c0, 0x0486);
        let is_raw = self.usage_pages.is_empty() || self.usage_pages.contains(&RAW_REPORTS);
        role_of(self.vendor, self.product) == Some(role) && (!is_shared || is_raw)
    }
}

/// Every HID device that the system shows; a node that may not be opened is in the list all the same.
///
/// # Errors
/// The list cannot be read.
pub fn list() -> Result<Vec<Listed>, HidOpenError> {
    let api = HidApi::new().map_err(|e| HidOpenError::NoList(e.to_string()))?;
    let mut all: Vec<Listed> = api
        .device_list()
        .filter(|info| !matches!(info.bus_type(), BusType::Spi))
        .map(|info| Listed {
            path: PathBuf::from(info.path().to_string_lossy().into_owned()),
            vendor: info.vendor_id(),
            product: info.product_id(),
            name: info.product_string().unwrap_or_default().to_owned(),
            // 0 is what the list says when it knows none.
            usage_pages: Some(info.usage_page()).filter(|page| *page != 0).into_iter().collect(),
        })
        .collect();
    // One node may hold several usages.
    all.sort_by(|a, b| a.path.cmp(&b.path));
    all.dedup_by(|again, first| {
        let is_same = again.path == first.path;
        if is_same {
            first.usage_pages.append(&mut again.usage_pages);
        }
        is_same
    });
    Ok(all)
}

/// The device to use for a role: the named one, the only fitting arm, or the first fitting side input.
///
/// # Errors
/// [`HidOpenError`] says what is there instead, and what to do.
pub fn choose(listed: &[Listed], role: HidRole, path: Option<&Path>) -> Result<Listed, HidOpenError> {
    let wanted = role.name();
    let Some(path) = path else {
        let closed = listed.iter().find(|d| role_of(d.vendor, d.product) == Some(HidRole::TouchHid));
        let fitting: Vec<&Listed> = listed.iter().filter(|device| device.fits(role)).collect();
        return match (fitting.as_slice(), closed) {
            ([_, _, ..], _) if role == HidRole::Arm => Err(HidOpenError::Several { wanted, nodes: nodes(&fitting) }),
            ([device, ..], _) => Ok((*device).clone()),
            ([], Some(touch)) if role == HidRole::Arm => Err(other(touch, wanted)),
            ([], _) => Err(HidOpenError::None { wanted, seen: listed.len() }),
        };
    };
    let device = listed.iter().find(|device| device.path == path);
    let device = device.ok_or_else(|| HidOpenError::NotThere(path.to_owned()))?;
    // Who names a node says what it is, as far as its number allows.
    if role_of(device.vendor, device.product) == Some(role) { Ok(device.clone()) } else { Err(other(device, wanted)) }
}

fn nodes(devices: &[&Listed]) -> String {
    devices.iter().map(|device| device.path.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn other(device: &Listed, wanted: &'static str) -> HidOpenError {
    let role = role_of(device.vendor, device.product);
    let name = role.map_or_else(|| format!("{:?}", device.name), |role| role.name().to_owned());
    HidOpenError::Other {
        path: device.path.clone(),
        found: format!("{name} ({:04x}:{:04x})", device.vendor, device.product),
        wanted,
        usage: role.map_or("this program has no use for it", HidRole::usage),
    }
}

/// Opens one node, again and again.
#[derive(Clone, Debug)]
pub struct HidOpener {
    path: CString,
    listed: Listed,
}

impl HidOpener {
    /// For this device.
    ///
    /// # Errors
    /// Its path is none.
    pub fn new(listed: Listed) -> Result<Self, HidOpenError> {
        let path = CString::new(listed.path.to_string_lossy().into_owned())
            .map_err(|_| HidOpenError::NotThere(listed.path.clone()))?;
        Ok(Self { path, listed })
    }

    /// Opens it for the first time: an error names the remedy.
    ///
    /// # Errors
    /// [`HidOpenError::Refused`] without rights, else [`HidOpenError::Unusable`].
    pub fn open_first(&self) -> Result<HidrawPort, HidOpenError> {
        open(&self.path).map_err(|error| {
            // `hidapi` says why in words only, so the system is asked once more.
            let again = OpenOptions::new().read(true).write(true).open(&self.listed.path);
            refusal(&self.listed, error.to_string(), again.err().map(|cause| cause.kind()))
        })
    }
}

/// Only missing rights are mended by a rule.
fn refusal(listed: &Listed, reason: String, kind: Option<ErrorKind>) -> HidOpenError {
    let path = listed.path.clone();
    if kind == Some(ErrorKind::PermissionDenied) {
        return HidOpenError::Refused { path, reason, vendor: listed.vendor, product: listed.product };
    }
    HidOpenError::Unusable { path, reason }
}

fn open(path: &CStr) -> Result<HidrawPort, HidError> {
    Ok(HidrawPort { device: HidApi::new()?.open_path(path)? })
}

impl Opener for HidOpener {
    type Port = HidrawPort;

    fn open(&mut self) -> Result<HidrawPort, WireError> {
        // A device that was plugged in again may have another node, and its old node may be another device's.
        let kind = |d: &Listed| (d.vendor, d.product, d.usage_pages.clone());
        let is_same = |d: &&Listed| kind(d) == kind(&self.listed);
        let all = list().map_err(|_| WireError::Gone)?;
        let found = all.iter().find(|d| is_same(d) && d.path == self.listed.path).or(all.iter().find(is_same));
        let found = found.ok_or(WireError::Gone)?;
        *self = Self::new(found.clone()).map_err(|_| WireError::Gone)?;
        open(&self.path).map_err(|error| wire_error(&error))
    }
}

/// An open node.
#[derive(Debug)]
pub struct HidrawPort {
    device: HidDevice,
}

impl WirePort for HidrawPort {
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
        let wait_ms = i32::try_from(wait.as_millis()).unwrap_or(i32::MAX);
        self.device.read_timeout(buffer, wait_ms).map_err(|error| wire_error(&error))
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        let taken = self.device.write(bytes).map_err(|error| wire_error(&error))?;
        if taken == bytes.len() { Ok(()) } else { Err(WireError::Short { taken, sent: bytes.len() }) }
    }
}

/// Without a number of the system the device has left: that is the one thing `hidapi` says in words only.
fn wire_error(error: &HidError) -> WireError {
    match error {
        HidError::IoError { error } => error.raw_os_error().map_or(WireError::Gone, WireError::Os),
        _ => WireError::Gone,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(path: &str, vendor: u16, product: u16) -> Listed {
        Listed { path: path.into(), vendor, product, name: "something".to_owned(), usage_pages: Vec::new() }
    }

    #[test]
    fn of_a_board_with_two_nodes_the_raw_one_is_the_arm_and_of_two_arms_none_is_guessed() {
        let node = |path: &str, page: u16| Listed { usage_pages: vec![page], ..listed(path, 0x16c0, 0x0486) };
        let (serial, raw) = (node("/dev/hidraw1", 0xffc9), node("/dev/hidraw2", 0xffab));
        assert_eq!(choose(&[serial.clone(), raw.clone()], HidRole::Arm, None), Ok(raw.clone()));
        assert!(matches!(choose(&[serial], HidRole::Arm, None), Err(HidOpenError::None { .. })));
        let two = [raw.clone(), listed("/dev/hidraw3", 0x1234, 0x0006)];
        let told = choose(&two, HidRole::Arm, None).expect_err("which one?").to_string();
        assert!(told.contains("/dev/hidraw2, /dev/hidraw3"), "{told}");
        assert_eq!(choose(&two, HidRole::Arm, Some(Path::new("/dev/hidraw2"))), Ok(raw));
        // A pedal may show as keyboard and mouse: the first.
        let pedals = ["/dev/hidraw4", "/dev/hidraw5"].map(|path| listed(path, 0x0c45, 0x7403));
        assert_eq!(choose(&pedals, HidRole::Pedal, None), Ok(pedals[0].clone()));
    }

    #[test]
    fn the_arm_is_found_and_its_absence_told_with_the_remedy() {
        let keyboard = listed("/dev/hidraw0", 0x046d, 0xc31c);
        let arm = listed("/dev/hidraw1", 0x16c0, 0x0486);
        let touch = listed("/dev/hidraw2", 0x2988, 0x0304);
        let all = [keyboard.clone(), arm.clone(), touch.clone()];
        assert_eq!(choose(&all, HidRole::Arm, None), Ok(arm.clone()));
        assert_eq!(choose(&all, HidRole::Arm, Some(Path::new("/dev/hidraw1"))), Ok(arm));
        let none = choose(&[keyboard], HidRole::Arm, None).expect_err("a keyboard is no arm").to_string();
        assert!(none.contains("1 HID devices") && none.contains("haptic-server devices"), "{none}");
        // The vendor's device alone: explained, not driven.
        let closed = choose(&[touch], HidRole::Arm, None).expect_err("not for force").to_string();
        assert!(closed.contains("Touch HID") && closed.contains("--device openhaptics"), "{closed}");
        let wrong = choose(&all, HidRole::Arm, Some(Path::new("/dev/hidraw0"))).expect_err("no arm").to_string();
        assert!(wrong.contains("/dev/hidraw0") && wrong.contains("046d:c31c"), "{wrong}");
        let absent = choose(&all, HidRole::Pedal, Some(Path::new("/dev/hidraw9"))).expect_err("absent");
        assert_eq!(absent, HidOpenError::NotThere("/dev/hidraw9".into()));
    }

    #[test]
    fn a_machine_without_hid_devices_has_an_empty_list_or_says_why() {
        match list() {
            Ok(all) => assert!(all.iter().all(|d| d.path.starts_with("/dev"))),
            Err(error) => assert!(error.to_string().contains("/sys"), "{error}"),
        }
    }

    #[test]
    fn only_a_node_without_rights_names_the_rule_that_helps() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("hidraw7");
        let arm = listed(&path.to_string_lossy(), 0x16c0, 0x0486);
        let opener = HidOpener::new(arm.clone()).expect("a path");
        let gone = opener.open_first().expect_err("no such node");
        assert!(matches!(gone, HidOpenError::Unusable { .. }) && !gone.to_string().contains("udev"), "{gone}");
        let refused = refusal(&arm, "os error 13".to_owned(), Some(ErrorKind::PermissionDenied)).to_string();
        assert!(refused.contains("hidraw7") && refused.contains("idVendor}==\"16c0\""), "{refused}");
    }
}
