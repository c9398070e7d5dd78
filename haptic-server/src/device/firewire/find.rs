//! Which nodes of the bus are Omnis: the kernel's list under `/sys/bus/firewire/devices`.
//!
//! A node shows `guid` (its upper 24 bits are the maker) and `vendor`; its character device has the same name under `/dev`.
//! Deliberately absent: opening it.

use super::registers::{is_omni_guid, is_omni_vendor};
use std::path::{Path, PathBuf};

/// Where the kernel lists the nodes.
pub const LIST: &str = "/sys/bus/firewire/devices";

/// An Omni on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its character device.
    pub node: PathBuf,
    /// Its 64-bit identification as the kernel prints it.
    pub guid: String,
}

/// Why there is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoOmni {
    /// No bus.
    #[error(
        "this machine has no FireWire bus ({LIST} is missing); fit a FireWire card, load the module firewire-ohci, and \
         plug the Omni into its second port"
    )]
    NoBus,
    /// No Omni on it.
    #[error(
        "no PHANTOM Omni (maker 000b99) on the FireWire bus, {0} other nodes under {LIST}; switch the Omni on and use its \
         second port"
    )]
    NotThere(usize),
}

/// The Omnis of the list, at least one.
///
/// # Errors
/// [`NoOmni`] says what is missing.
pub fn find(list: &Path) -> Result<Vec<Found>, NoOmni> {
    let mut nodes: Vec<PathBuf> =
        std::fs::read_dir(list).map_err(|_| NoOmni::NoBus)?.flatten().map(|entry| entry.path()).collect();
    nodes.sort();
    let read = |node: &Path, name: &str| std::fs::read_to_string(node.join(name)).unwrap_or_default();
    // Units of a node have a dot in their name and no device of their own.
    nodes.retain(|node| node.file_name().is_some_and(|name| !name.to_string_lossy().contains('.')));
    let is_omni = |node: &Path| is_omni_guid(&read(node, "guid")) || is_omni_vendor(&read(node, "vendor"));
    let found = |node: &PathBuf| Found {
        node: Path::new("/dev").join(node.file_name().unwrap_or_default()),
        guid: read(node, "guid").trim().to_owned(),
    };
    let omnis: Vec<Found> = nodes.iter().filter(|node| is_omni(node)).map(found).collect();
    if omnis.is_empty() { Err(NoOmni::NotThere(nodes.len())) } else { Ok(omnis) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(list: &Path, name: &str, guid: &str, vendor: &str) {
        std::fs::create_dir_all(list.join(name)).expect("folder");
        std::fs::write(list.join(name).join("guid"), guid).expect("file");
        std::fs::write(list.join(name).join("vendor"), vendor).expect("file");
    }

    #[test]
    fn an_omni_is_found_among_other_nodes_and_its_absence_told() {
        let folder = tempfile::tempdir().expect("folder");
        let list = folder.path();
        assert_eq!(find(&list.join("none")), Err(NoOmni::NoBus));
        node(list, "fw0", "0x0011060000123456\n", "0x001106\n");
        node(list, "fw1.0", "0x000b990000000001\n", "0x000b99\n");
        let absent = find(list).expect_err("a host and a unit only");
        assert_eq!(absent, NoOmni::NotThere(1));
        assert!(absent.to_string().contains("second port"));
        node(list, "fw1", "0x000b990000000001\n", "0x000b99\n");
        node(list, "fw2", "0x000b990000000002\n", "0x000b99\n");
        let found = find(list).expect("there");
        assert_eq!((found[0].node.to_str(), found[0].guid.as_str()), (Some("/dev/fw1"), "0x000b990000000001"));
        assert_eq!((found.len(), found[1].node.to_str()), (2, Some("/dev/fw2")));
    }
}
