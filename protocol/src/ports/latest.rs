//! Newest-wins topics of fixed-size messages: `tissue_port` and `wound_report`.
//!
//! Safe overflow, buffer 1, history 1, one publisher, discard when a receiver is slow: neither
//! side ever waits for the other. A late receiver gets the last message as soon as the publisher
//! sends again.

use super::node::{incompatible, name_of, open_error, required_layout, retried};
use super::{MAX_NODES, MAX_RECEIVERS, PortError, PortNode, monotonic_ns};
use crate::wire::Message;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::prelude::{BackpressureStrategy, ZeroCopySend, ipc};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeOpenError as OpenError, PublishSubscribeOpenOrCreateError as OpenOrCreateError,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::fmt::Debug;

/// Newest-wins topics keep one message, for receivers and for late joiners.
pub(super) const KEPT: usize = 1;
/// Messages that are looked at in one go: far more than writers that can have left one.
pub(super) const MOST_WAITING: usize = 16;
/// One sample in hand while the next is fetched.
pub(super) const BORROWED: usize = 2;

/// What a topic of fixed-size messages keeps, and for how many.
pub(super) struct Depth {
    /// Messages that wait for a receiver.
    pub(super) buffer: usize,
    /// Messages that a late receiver gets.
    pub(super) history: usize,
    /// Writers at the same time.
    pub(super) writers: usize,
}

const NEWEST: Depth = Depth { buffer: KEPT, history: KEPT, writers: 1 };

/// Opens a topic; a full buffer loses its oldest message.
pub(super) fn open<M: Message + ZeroCopySend + Debug>(
    node: &PortNode,
    depth: &Depth,
) -> Result<PortFactory<ipc::Service, M, ()>, PortError> {
    let name = name_of::<M>()?;
    let layout = required_layout::<M>()?;
    retried(|| {
        node.node()
            .service_builder(&name)
            .publish_subscribe::<M>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(depth.buffer)
            .history_size(depth.history)
            .subscriber_max_borrowed_samples(BORROWED)
            .max_publishers(depth.writers)
            .max_subscribers(MAX_RECEIVERS)
            .max_nodes(MAX_NODES)
            .open_or_create_with_attributes(&layout)
            .map_err(|e| service_error::<M>(&e))
    })
}

/// A writer that never waits for a receiver.
pub(super) fn writer<M: Message + ZeroCopySend + Debug>(
    service: &PortFactory<ipc::Service, M, ()>,
) -> Result<Publisher<ipc::Service, M, ()>, PortError> {
    retried(|| {
        service
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_samples(1)
            .create()
            .map_err(publisher_error::<M>)
    })
}

pub(super) fn service_error<M: Message>(error: &OpenOrCreateError) -> PortError {
    match error {
        OpenOrCreateError::PublishSubscribeOpenError(
            OpenError::IncompatibleTypes | OpenError::IncompatibleAttributes | OpenError::VersionMismatch,
        ) => incompatible::<M>(),
        OpenOrCreateError::PublishSubscribeOpenError(OpenError::ExceedsMaxNumberOfNodes) => {
            PortError::Full { topic: M::NAME, role: "participant" }
        }
        other => open_error(M::NAME, other),
    }
}

pub(super) fn publisher_error<M: Message>(error: PublisherCreateError) -> PortError {
    match error {
        PublisherCreateError::ExceedsMaxSupportedPublishers => PortError::Full { topic: M::NAME, role: "writer" },
        other => open_error(M::NAME, &other),
    }
}

pub(super) fn subscriber_error<M: Message>(error: SubscriberCreateError) -> PortError {
    match error {
        SubscriberCreateError::ExceedsMaxSupportedSubscribers => PortError::Full { topic: M::NAME, role: "receiver" },
        other => open_error(M::NAME, &other),
    }
}

pub(super) fn send_error(topic: &'static str, reason: &impl Debug) -> PortError {
    PortError::Send { topic, reason: format!("{reason:?}") }
}

pub(super) fn receive_error(topic: &'static str, reason: &impl Debug) -> PortError {
    PortError::Receive { topic, reason: format!("{reason:?}") }
}

/// The one writer of a newest-wins topic.
#[derive(Debug)]
pub struct LatestPublisher<M: Message + ZeroCopySend + Debug + 'static> {
    publisher: Publisher<ipc::Service, M, ()>,
    sequence: u64,
}

impl<M: Message + ZeroCopySend + Debug> LatestPublisher<M> {
    /// Opens the topic for writing. A dead predecessor's place is taken over.
    ///
    /// # Errors
    /// [`PortError::Full`] while another writer lives, [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        Ok(Self { publisher: writer(&open::<M>(node, &NEWEST)?)?, sequence: 0 })
    }

    /// Fills the header (sequence, time) and sends.
    ///
    /// # Errors
    /// [`PortError::Send`]; the caller may go on with the next message.
    pub fn send(&mut self, message: &mut M) -> Result<(), PortError> {
        self.sequence += 1;
        message.stamp(self.sequence, monotonic_ns());
        self.publisher.send_copy(*message).map(drop).map_err(|e| send_error(M::NAME, &e))
    }
}

/// A receiver of a newest-wins topic.
#[derive(Debug)]
pub struct LatestSubscriber<M: Message + ZeroCopySend + Debug + 'static> {
    subscriber: Subscriber<ipc::Service, M, ()>,
}

impl<M: Message + ZeroCopySend + Debug> LatestSubscriber<M> {
    /// Opens the topic for reading; the writer need not exist yet.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        let service = open::<M>(node, &NEWEST)?;
        let subscriber = retried(|| service.subscriber_builder().create().map_err(subscriber_error::<M>))?;
        Ok(Self { subscriber })
    }

    /// The newest message since the last call, validated; `None` when there is none.
    ///
    /// # Errors
    /// [`PortError::Rejected`] when the newest message must not be used; the caller keeps its last
    /// good one. [`PortError::Receive`].
    pub fn newest(&mut self) -> Result<Option<M>, PortError> {
        let mut newest: Option<M> = None;
        let mut rejected = None;
        // A restarted writer has a connection of its own, so more than one message can wait here. A writer that sends without
        // end must not keep the reader here.
        for _ in 0..MOST_WAITING {
            let Some(sample) = self.subscriber.receive().map_err(|e| receive_error(M::NAME, &e))? else { break };
            let copy = *sample;
            match copy.validate() {
                Err(error) => rejected = Some(error),
                Ok(()) if newest.is_none_or(|n| n.header().time_ns <= copy.header().time_ns) => newest = Some(copy),
                Ok(()) => {}
            }
        }
        match (newest, rejected) {
            (None, Some(error)) => Err(error.into()),
            (newest, _) => Ok(newest),
        }
    }
}
