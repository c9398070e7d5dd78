//! Which Omni is opened, at the start and after a loss.
//!
//! The list of the bus is read anew each time: after a replug the same Omni has another node. Its serial number is kept from the
//! first time, since the force scale is that of this very device; another Omni is asked who it is and nothing else.
//! Deliberately absent: the talk itself (`session.rs`) and the node (`node.rs`).

use super::find::find;
use super::node::CdevNode;
use super::registers::{MAKER, SERIAL, is_maker, serial_number};
use super::session::{FireWireNode, Session};
use crate::device::wire::{Opener, Packet, WireError};
use std::path::{Path, PathBuf};

/// Opens the session with an Omni, again and again; after the first time only with the same one, wherever it is.
#[derive(Clone, Debug)]
pub struct NodeOpener {
    list: PathBuf,
    rest: Packet,
    serial: Option<String>,
}

impl NodeOpener {
    /// For an Omni of this list; `rest` is the packet without force.
    #[must_use]
    pub fn new(list: &Path, rest: Packet) -> Self {
        Self { list: list.to_owned(), rest, serial: None }
    }

    fn open_by<N: FireWireNode>(
        &mut self,
        open: impl Fn(&Path) -> Result<N, WireError>,
    ) -> Result<Session<N>, WireError> {
        let all = find(&self.list).map_err(|_| WireError::Gone)?;
        // At the start only the first: why it cannot be opened is to be told.
        let most = if self.serial.is_some() { all.len() } else { 1 };
        let mut why = None;
        for found in all.iter().take(most) {
            match open(&found.node).and_then(|node| self.start(node)) {
                Ok(session) => return Ok(session),
                Err(error) => why = why.or(Some(error)),
            }
        }
        Err(why.unwrap_or(WireError::Gone))
    }

    /// The session, if the node is the Omni of the start; another one is only asked who it is.
    fn start<N: FireWireNode>(&mut self, mut node: N) -> Result<Session<N>, WireError> {
        if !is_maker(node.read_quadlet(MAKER)?) {
            return Err(WireError::Gone);
        }
        if self.serial.is_some() && serial_number(node.read_quadlet(SERIAL)?) != self.serial {
            return Err(WireError::Another);
        }
        let session = Session::open(node, self.rest.bytes())?;
        self.serial = Some(session.serial().to_owned());
        Ok(session)
    }
}

impl Opener for NodeOpener {
    type Port = Session<CdevNode>;

    fn open(&mut self) -> Result<Self::Port, WireError> {
        self.open_by(CdevNode::open)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::firewire::registers::{ALIVE, SIGNS};
    use crate::device::firewire::session::Direction;
    use crate::device::wire::LONGEST;
    use std::time::Duration;

    /// An Omni with this serial number quadlet that is well.
    struct Omni(u32);

    impl FireWireNode for Omni {
        fn read_quadlet(&mut self, address: u64) -> Result<u32, WireError> {
            Ok(if address == MAKER { 0x000b_9900 } else { self.0 })
        }

        fn read_byte(&mut self, address: u64) -> Result<u8, WireError> {
            Ok(SIGNS.into_iter().find(|(of, _)| *of == address).map_or(ALIVE, |(_, sign)| sign))
        }

        fn write_byte(&mut self, _address: u64, _value: u8) -> Result<(), WireError> {
            Ok(())
        }

        fn open_channel(&mut self, _direction: Direction) -> Result<u8, WireError> {
            Ok(1)
        }

        fn receive(&mut self, _buffer: &mut [u8; LONGEST], _wait: Duration) -> Result<usize, WireError> {
            Ok(0)
        }

        fn send(&mut self, _bytes: &[u8]) -> Result<(), WireError> {
            Ok(())
        }
    }

    #[test]
    fn after_a_replug_the_same_omni_is_found_at_its_new_node_and_another_is_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let plug = |name: &str| {
            std::fs::create_dir(folder.path().join(name)).expect("folder");
            std::fs::write(folder.path().join(name).join("vendor"), "0x000b99\n").expect("file");
        };
        let unplug = |name: &str| std::fs::remove_dir_all(folder.path().join(name)).expect("there");
        // By name: fw1 and fw3 are the Omni of the start, fw2 is another.
        let is_first = |path: &Path| !path.ends_with("fw2");
        let node = |path: &Path| Ok(Omni(if is_first(path) { 0x8000_0003 } else { 0x8000_0005 }));
        let mut opener = NodeOpener::new(folder.path(), Packet::new(&[0]));
        let mut open = || opener.open_by(node).map(|session| session.serial().to_owned());
        assert_eq!(open(), Err(WireError::Gone));
        plug("fw1");
        let serial = open().expect("the first one");
        unplug("fw1");
        plug("fw2");
        assert_eq!(open(), Err(WireError::Another));
        plug("fw3");
        assert_eq!(open(), Ok(serial), "beside another one, at a new node");
    }
}
