//! `servo_state` as a blackboard entry: writing costs the servo thread neither heap nor system
//! call, and readers come and go without it noticing.
//!
//! A blackboard is not restart-safe for its writer in iceoryx2 0.10 (a successor cannot take the
//! entry over), so a servo restart is a new run. Readers keep trying while the writer is absent.

use super::node::{incompatible, name_of, open_error, required_layout, retried, stated_layout};
use super::{MAX_NODES, MAX_RECEIVERS, PortError, PortNode, monotonic_ns};
use crate::servo_state::ServoState;
use crate::wire::{Field, Message};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ipc;
use iceoryx2::service::builder::blackboard::{BlackboardCreateError as CreateError, BlackboardOpenError as OpenError};
use std::time::{Duration, Instant};

/// Key of the only entry.
const KEY: u64 = 0;
/// Pause between two looks for an absent writer.
const LOOK_PAUSE: Duration = Duration::from_millis(20);
const TOPIC: &str = ServoState::NAME;

/// The servo thread's side.
pub struct ServoStateWriter {
    entry: EntryHandleMut<ipc::Service, u64, ServoState>,
    _writer: Writer<ipc::Service, u64>,
    sequence: u64,
}

impl ServoStateWriter {
    /// Creates the entry; once per run.
    ///
    /// # Errors
    /// [`PortError::Full`] when the run had a servo before, [`PortError::Open`].
    pub fn create(node: &PortNode) -> Result<Self, PortError> {
        let name = name_of::<ServoState>()?;
        let layout = stated_layout::<ServoState>()?;
        let service = retried(|| {
            node.node()
                .service_builder(&name)
                .blackboard_creator::<u64>()
                .max_readers(MAX_RECEIVERS)
                .max_nodes(MAX_NODES)
                .add::<ServoState>(KEY, ServoState::EMPTY)
                .create_with_attributes(&layout)
                .map_err(|e| match e {
                    CreateError::AlreadyExists => PortError::Full { topic: TOPIC, role: "writer" },
                    other => open_error(TOPIC, &other),
                })
        })?;
        let writer = service.writer_builder().create().map_err(|e| open_error(TOPIC, &e))?;
        let entry = writer.entry::<ServoState>(&KEY).map_err(|e| open_error(TOPIC, &e))?;
        Ok(Self { entry, _writer: writer, sequence: 0 })
    }

    /// Fills the header (sequence, time) and writes. No heap, no system call.
    pub fn write(&mut self, state: &mut ServoState) {
        self.sequence += 1;
        state.stamp(self.sequence, monotonic_ns());
        self.entry.update_with_copy(*state);
    }
}

/// A reader; the writer need not exist yet.
pub struct ServoStateReader {
    node: PortNode,
    connection: Option<Connection>,
    next_look: Option<Instant>,
    last_sequence: u64,
}

struct Connection {
    entry: EntryHandle<ipc::Service, u64, ServoState>,
    _reader: Reader<ipc::Service, u64>,
}

impl ServoStateReader {
    /// A reader in this run; it connects by itself when the writer appears.
    #[must_use]
    pub fn new(node: &PortNode) -> Self {
        Self { node: node.clone(), connection: None, next_look: None, last_sequence: 0 }
    }

    /// The state of the newest tick since the last call, validated; `None` when there is none.
    ///
    /// # Errors
    /// [`PortError::Rejected`], [`PortError::Incompatible`], [`PortError::Full`], [`PortError::Open`].
    pub fn newest(&mut self) -> Result<Option<ServoState>, PortError> {
        let Some(connection) = self.connected()? else { return Ok(None) };
        let copy = *connection.entry.get();
        if copy.header == crate::wire::Header::EMPTY {
            return Ok(None);
        }
        copy.validate()?;
        if copy.header.sequence == self.last_sequence {
            return Ok(None);
        }
        self.last_sequence = copy.header.sequence;
        Ok(Some(copy))
    }

    #[cfg(test)]
    pub(super) fn connected_for_test(&mut self) -> Result<bool, PortError> {
        Ok(self.connected()?.is_some())
    }

    fn connected(&mut self) -> Result<Option<&Connection>, PortError> {
        if self.connection.is_none() {
            let now = Instant::now();
            if self.next_look.is_some_and(|t| now < t) {
                return Ok(None);
            }
            self.next_look = Some(now + LOOK_PAUSE);
            self.connection = connect(&self.node)?;
        }
        Ok(self.connection.as_ref())
    }
}

fn connect(node: &PortNode) -> Result<Option<Connection>, PortError> {
    let name = name_of::<ServoState>()?;
    let layout = required_layout::<ServoState>()?;
    let opened = node.node().service_builder(&name).blackboard_opener::<u64>().open_with_attributes(&layout);
    let service = match opened {
        Ok(service) => service,
        // Absent, half created or half removed: look again later.
        Err(OpenError::DoesNotExist | OpenError::IsMarkedForDestruction | OpenError::HangsInCreation) => {
            return Ok(None);
        }
        Err(OpenError::IncompatibleKeys | OpenError::IncompatibleAttributes | OpenError::VersionMismatch) => {
            return Err(incompatible::<ServoState>());
        }
        Err(OpenError::ExceedsMaxNumberOfNodes) => return Err(PortError::Full { topic: TOPIC, role: "participant" }),
        Err(other) => return Err(open_error(TOPIC, &other)),
    };
    let reader = service.reader_builder().create().map_err(|e| match e {
        iceoryx2::port::reader::ReaderCreateError::ExceedsMaxSupportedReaders => {
            PortError::Full { topic: TOPIC, role: "receiver" }
        }
        other => open_error(TOPIC, &other),
    })?;
    let entry = reader.entry::<ServoState>(&KEY).map_err(|_| incompatible::<ServoState>())?;
    Ok(Some(Connection { entry, _reader: reader }))
}
