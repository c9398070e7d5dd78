//! The vendor's library and its configuration.
//!
//! The library is loaded as the server would load it; what the loader says is matched with the known signatures (a missing curses,
//! device driver, FireWire or USB library). No device is opened. A library that is not installed is a warning, unless it was
//! asked for by its path. The configuration (`$GTDD_HOME/config/*.config`, by default below `~/.3dsystems`) is read for what breaks rigs:
//! decimal commas, lengths and reductions of 0, a `Channel` whose serial port is not there.

use super::check::Check;
use crate::device::openhaptics::library::LibraryError;
use crate::devices::attached;
use crate::exit;
use crate::machine::Machine;
use std::path::{Path, PathBuf};

/// Values that are numbers and never 0 on a sound device.
const NUMBERS: [&str; 9] = [
    "L1",
    "L2",
    "Reduction1",
    "Reduction2",
    "Reduction3",
    "NominalMaxStiffness",
    "NominalMaxDamping",
    "NominalMaxForce",
    "NominalMaxContinuousForce",
];
/// Numbers of the Touch HID.
const TOUCH_HID: &str = "2988:0304";
/// Where the FireWire generation keeps its configuration.
const FIREWIRE_FOLDER: &str = "/etc/SensAble/PHANToMDeviceDrivers";

/// The library, by what loading it gave.
pub(super) fn library(asked_for: Option<&Path>, loaded: &Result<PathBuf, LibraryError>) -> Check {
    const NAME: &str = "openhaptics_library";
    match loaded {
        Ok(path) => Check::ok(NAME, format!("{} loads and has every function", path.display())),
        Err(error) => {
            let found = error.to_string();
            let (found, remedy) = found.rsplit_once("; ").unwrap_or((found.as_str(), "install OpenHaptics for Linux"));
            if asked_for.is_none() && is_simply_absent(error) {
                Check::warn(NAME, "not installed; only --device openhaptics needs it", remedy)
            } else {
                Check::fail(NAME, found, remedy, exit::UNAVAILABLE)
            }
        }
    }
}

/// Whether no file of any of the names is there, rather than one that cannot be loaded.
fn is_simply_absent(error: &LibraryError) -> bool {
    match error {
        LibraryError::NotLoaded { tried, .. } => tried.split("; ").all(|one| {
            let name = one.split(": ").next().unwrap_or_default();
            one.contains(&format!("{name}: cannot open shared object file"))
        }),
        LibraryError::NoSymbol { .. } => false,
    }
}

/// Folder of the vendor's configuration.
fn folder(machine: &Machine) -> Option<String> {
    let home = machine.variable("GTDD_HOME").map(str::to_owned);
    let home = home.or_else(|| machine.variable("HOME").map(|home| format!("{home}/.3dsystems")))?;
    Some(format!("{home}/config"))
}

/// Names of the devices that the vendor's set-up has configured.
pub(crate) fn configured(machine: &Machine) -> Vec<String> {
    let names = folder(machine).map(|folder| machine.names(&folder)).unwrap_or_default();
    names.iter().filter_map(|name| name.strip_suffix(".config")).map(str::to_owned).collect()
}

/// The configuration. `is_needed`: there is a library that would read it.
pub(super) fn config(machine: &Machine, is_needed: bool) -> Check {
    const NAME: &str = "openhaptics_config";
    let names = configured(machine);
    let Some(folder) = folder(machine).filter(|_| !names.is_empty()) else {
        let old = machine.names(FIREWIRE_FOLDER).iter().filter(|n| n.ends_with(".ini")).count();
        return match (old, is_needed) {
            (0, false) => Check::ok(NAME, "none, and no library that would read one"),
            (0, true) => Check::warn(
                NAME,
                "no device is set up for this user",
                "plug the device in and run the vendor's set-up as this user, not with sudo: LC_ALL=C Touch_Setup",
            ),
            (many, _) => Check::ok(NAME, format!("{many} FireWire device(s) in {FIREWIRE_FOLDER}")),
        };
    };
    for name in &names {
        let path = format!("{folder}/{name}.config");
        let Some(text) = machine.text(&path) else {
            let remedy = format!("as root: chown -R {} {folder}", machine.user_name());
            return Check::fail(NAME, format!("{path} cannot be read"), remedy, exit::PERMISSION);
        };
        if let Some(fault) = fault(machine, &text) {
            let remedy = format!("delete {path} and run the vendor's set-up again: LC_ALL=C Touch_Setup");
            return Check::fail(NAME, format!("{path}: {fault}"), remedy, exit::CONFIGURATION);
        }
    }
    Check::ok(NAME, format!("{} in {folder}", names.join(", ")))
}

/// The value of a key.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let pair = |line: &'a str| line.split_once('=').map(|(k, v)| (k.trim(), v.trim()));
    text.lines().filter_map(pair).find(|(k, _)| *k == key).map(|(_, v)| v)
}

/// What is wrong with a configuration, if anything is.
fn fault(machine: &Machine, text: &str) -> Option<String> {
    for key in NUMBERS {
        let Some(number) = value(text, key) else { continue };
        if number.contains(',') {
            return Some(format!("{key}={number} has a decimal comma"));
        }
        match number.parse::<f64>() {
            Ok(n) if n.is_finite() && n > 0.0 => {}
            _ => return Some(format!("{key}={number} cannot be")),
        }
    }
    let is_serial = value(text, "CardType").is_some_and(|card| card.eq_ignore_ascii_case("usb"));
    let port =
        value(text, "Channel").and_then(|channel| channel.parse::<u32>().ok()).map(|n| format!("/dev/ttyACM{n}"));
    // A Touch HID has no serial port, whatever its configuration says.
    let has_touch_hid = || attached(machine).iter().any(|device| device.id == TOUCH_HID);
    port.filter(|port| is_serial && !machine.has(port) && !has_touch_hid()).map(|port| {
        format!("Channel names {port}, which is not there (the number changes when a device is plugged in again)")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::openhaptics::library::load;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use proptest::prelude::*;

    const SOUND: &str = "ModelType=OMNI\nL1=133.35\nL2 = 133.35\nCardType=USB\nChannel=0\nReduction1=0.134030\nNominalMaxForce=3.3\nWorkspaceOffset=(0,-110,-35)\n";

    fn tree(text: &str) -> Tree {
        Tree::new().with("h/.3dsystems/config/Default Device.config", text).with("dev/ttyACM0", "")
    }

    fn row(tree: &Tree) -> Check {
        config(&tree.machine().with_variable("HOME", "/h"), true)
    }

    #[test]
    fn a_sound_configuration_is_named_and_what_breaks_rigs_is_found() {
        let sound = row(&tree(SOUND));
        assert_eq!(sound.status, Status::Ok);
        assert!(sound.found.starts_with("Default Device in "), "{sound:?}");
        for (from, to, said) in [
            ("L1=133.35", "L1=133,35", "decimal comma"),
            ("L2 = 133.35", "L2 = 0", "cannot be"),
            ("Reduction1=0.134030", "Reduction1=nan", "cannot be"),
            ("Channel=0", "Channel=300", "ttyACM300"),
        ] {
            let row = row(&tree(&SOUND.replace(from, to)));
            assert_eq!(row.status, Status::Fail, "{to}");
            assert!(row.found.contains(said), "{row:?}");
        }
    }

    #[test]
    fn a_channel_without_port_is_excused_by_a_touch_hid_and_not_by_a_keyboard() {
        let keyboard = tree(&SOUND.replace("Channel=0", "Channel=7"))
            .with("sys/class/hidraw/hidraw0/device/uevent", "HID_ID=0003:0000046D:0000C31C\n")
            .with("sys/bus/usb/devices/1-1/idVendor", "046d\n")
            .with("sys/bus/usb/devices/1-1/idProduct", "c31c\n");
        assert_eq!(row(&keyboard).status, Status::Fail);
        let touch = keyboard
            .with("sys/bus/usb/devices/1-2/idVendor", "2988\n")
            .with("sys/bus/usb/devices/1-2/idProduct", "0304\n");
        assert_eq!(row(&touch).status, Status::Ok);
    }

    #[test]
    fn without_configuration_it_depends_on_the_library() {
        let empty = Tree::new();
        assert_eq!(config(&empty.machine(), true).status, Status::Warn);
        assert_eq!(config(&empty.machine(), false).status, Status::Ok);
        let old = empty.with("etc/SensAble/PHANToMDeviceDrivers/PHANToM1.ini", "");
        assert!(config(&old.machine(), true).found.contains("1 FireWire"));
        let elsewhere = Tree::new().with("rig/config/Left.config", "L1=133.35");
        assert_eq!(configured(&elsewhere.machine().with_variable("GTDD_HOME", "/rig")), ["Left"]);
    }

    #[test]
    fn a_library_that_is_asked_for_or_broken_fails_and_one_that_nobody_has_warns() {
        let missing = load(Some(Path::new("no/such/libHD.so"))).map(|(_, path)| path);
        assert_eq!(library(None, &missing).status, Status::Warn);
        let asked = library(Some(Path::new("no/such/libHD.so")), &missing);
        assert_eq!(asked.status, Status::Fail);
        assert!(asked.remedy.is_some_and(|r| r.contains("--openhaptics-library")));
        let broken = LibraryError::NotLoaded {
            tried: "libHD.so: dlopen failed: libncurses.so.5: cannot open shared object file: No such file or directory; \
                    libHD.so.3.4: dlopen failed: libHD.so.3.4: cannot open shared object file: No such file or directory"
                .into(),
            remedy: "apt install libncurses5",
        };
        let row = library(None, &Err(broken));
        assert_eq!((row.status, row.remedy.as_deref()), (Status::Fail, Some("apt install libncurses5")));
        assert!(row.found.contains("libncurses.so.5"), "{row:?}");
    }

    proptest! {
        #[test]
        fn no_configuration_stops_the_reading(text in "(L1|Channel|CardType)?=?.{0,60}") {
            row(&tree(&text));
        }
    }
}
