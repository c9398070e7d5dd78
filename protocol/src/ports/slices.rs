//! `scene_frame` and `scene_outline`: a header and a slice, newest wins.
//!
//! The receiver copies header and slice into buffers of its own (reused from message to message)
//! and then checks the copies: capacity before anything is copied, announced against carried
//! count, finite numbers. Memory for a larger scene is added by the publisher on demand.

use super::latest::{
    BORROWED, KEPT, MOST_WAITING, publisher_error, receive_error, send_error, service_error, subscriber_error,
};
use super::node::{name_of, required_layout, retried};
use super::{MAX_NODES, MAX_RECEIVERS, PortError, PortNode, monotonic_ns};
use crate::scene_frame::{self, FrameHeader, FrameNode, MAX_OUTLINE_WORDS, OutlineHeader};
use crate::wire::{Field, Header, Message, WireError};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::fmt::Debug;

/// A message header with the length of the slice that belongs to it.
pub trait SliceHeader: Message + Default + Debug + ZeroCopySend + 'static {
    /// One element of the slice.
    type Element: Field + Debug + ZeroCopySend + 'static;
    /// Most elements that a receiver accepts.
    const MAX_ELEMENTS: usize;
    /// Elements that this header announces.
    fn announced(&self) -> u64;
    /// Why this slice must not be used, beyond numbers that are not finite.
    fn first_bad_element(&self, _elements: &[Self::Element]) -> Option<&'static str> {
        None
    }
}

impl SliceHeader for FrameHeader {
    type Element = FrameNode;
    const MAX_ELEMENTS: usize = scene_frame::MAX_NODES;
    fn announced(&self) -> u64 {
        u64::from(self.node_count)
    }
}

impl SliceHeader for OutlineHeader {
    type Element = u32;
    const MAX_ELEMENTS: usize = MAX_OUTLINE_WORDS;
    fn announced(&self) -> u64 {
        self.words()
    }
    fn first_bad_element(&self, words: &[u32]) -> Option<&'static str> {
        let parts = self.split(words)?;
        let inside = |nodes: &[u32]| nodes.iter().all(|&n| n < self.node_count);
        (!(inside(parts.triangles) && inside(parts.pairs) && inside(parts.edges))).then_some("node index")
    }
}

/// Header and slice of one message, in buffers of the receiver.
#[derive(Clone, Debug, Default)]
pub struct SliceMessage<H: SliceHeader> {
    /// Validated header.
    pub header: H,
    /// Validated elements.
    pub elements: Vec<H::Element>,
}

/// A frame: header and nodes.
pub type SceneFrame = SliceMessage<FrameHeader>;
/// An outline: header and words.
pub type SceneOutline = SliceMessage<OutlineHeader>;
/// Sends frames (solver).
pub type SceneFramePublisher = SlicePublisher<FrameHeader>;
/// Receives frames (viewers, recorder).
pub type SceneFrameSubscriber = SliceSubscriber<FrameHeader>;
/// Sends the outline, once per scene (solver).
pub type SceneOutlinePublisher = SlicePublisher<OutlineHeader>;
/// Receives the outline (viewers, recorder).
pub type SceneOutlineSubscriber = SliceSubscriber<OutlineHeader>;

impl<H: SliceHeader> SliceMessage<H> {
    fn check(&self) -> Result<(), PortError> {
        self.header.validate()?;
        check_count::<H>(self.header.announced(), self.elements.len())?;
        let field = if self.elements.iter().all(Field::is_usable) {
            self.header.first_bad_element(&self.elements)
        } else {
            Some("elements")
        };
        field.map_or(Ok(()), |field| Err(WireError::Field { message: H::NAME, field }.into()))
    }
}

fn check_count<H: SliceHeader>(announced: u64, carried: usize) -> Result<(), PortError> {
    let carried = carried as u64;
    if announced != carried || carried > H::MAX_ELEMENTS as u64 {
        return Err(PortError::Count { topic: H::NAME, announced, carried });
    }
    Ok(())
}

fn open<H: SliceHeader>(node: &PortNode) -> Result<PortFactory<ipc::Service, [H::Element], H>, PortError> {
    let name = name_of::<H>()?;
    let layout = required_layout::<H>()?;
    retried(|| {
        node.node()
            .service_builder(&name)
            .publish_subscribe::<[H::Element]>()
            .user_header::<H>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(KEPT)
            .history_size(KEPT)
            .subscriber_max_borrowed_samples(BORROWED)
            .max_publishers(1)
            .max_subscribers(MAX_RECEIVERS)
            .max_nodes(MAX_NODES)
            .open_or_create_with_attributes(&layout)
            .map_err(|e| service_error::<H>(&e))
    })
}

/// The one writer of a slice topic.
#[derive(Debug)]
pub struct SlicePublisher<H: SliceHeader> {
    publisher: Publisher<ipc::Service, [H::Element], H>,
    service: PortFactory<ipc::Service, [H::Element], H>,
    sequence: u64,
}

impl<H: SliceHeader> SlicePublisher<H> {
    /// Opens the topic for writing; memory for `expected_elements` is set aside, more is added on
    /// demand. A dead predecessor's place is taken over.
    ///
    /// # Errors
    /// [`PortError::Full`] while another writer lives, [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode, expected_elements: usize) -> Result<Self, PortError> {
        let service = open::<H>(node)?;
        let publisher = retried(|| {
            service
                .publisher_builder()
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .max_loaned_samples(1)
                .initial_max_slice_len(expected_elements.clamp(1, H::MAX_ELEMENTS))
                .allocation_strategy(AllocationStrategy::PowerOfTwo)
                .create()
                .map_err(publisher_error::<H>)
        })?;
        Ok(Self { publisher, service, sequence: 0 })
    }

    /// Whether anybody would receive a message; a receiver that died counts until it is cleaned up.
    #[must_use]
    pub fn has_receivers(&self) -> bool {
        self.service.dynamic_config().number_of_subscribers() > 0
    }

    /// Fills the header (sequence, time) and sends; `element(i)` writes straight into shared memory.
    ///
    /// # Errors
    /// [`PortError::Count`] when `count` is not what the header announces, [`PortError::Send`].
    pub fn send(
        &mut self,
        header: &mut H,
        count: usize,
        element: impl FnMut(usize) -> H::Element,
    ) -> Result<(), PortError> {
        check_count::<H>(header.announced(), count)?;
        self.sequence += 1;
        let mut sample = self.publisher.loan_slice_uninit(count).map_err(|e| send_error(H::NAME, &e))?;
        header.stamp(self.sequence, monotonic_ns());
        *sample.user_header_mut() = *header;
        sample.write_from_fn(element).send().map(drop).map_err(|e| send_error(H::NAME, &e))
    }

    /// Hands the last message to receivers that have joined since; call once per step for a topic
    /// that is sent seldom.
    ///
    /// # Errors
    /// [`PortError::Send`].
    pub fn serve_late_joiners(&self) -> Result<(), PortError> {
        self.publisher.update_connections().map_err(|e| send_error(H::NAME, &e))
    }
}

/// A receiver of a slice topic.
#[derive(Debug)]
pub struct SliceSubscriber<H: SliceHeader> {
    subscriber: Subscriber<ipc::Service, [H::Element], H>,
    message: SliceMessage<H>,
}

impl<H: SliceHeader> SliceSubscriber<H> {
    /// Opens the topic for reading; the writer need not exist yet.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        let service = open::<H>(node)?;
        let subscriber = retried(|| service.subscriber_builder().create().map_err(subscriber_error::<H>))?;
        Ok(Self { subscriber, message: SliceMessage { header: H::EMPTY, elements: Vec::new() } })
    }

    /// The newest message since the last call, validated; `None` when there is none.
    ///
    /// # Errors
    /// [`PortError::Rejected`] or [`PortError::Count`] when the newest message must not be used;
    /// [`PortError::Receive`].
    pub fn newest(&mut self) -> Result<Option<&SliceMessage<H>>, PortError> {
        let mut newest: Option<(Header, _)> = None;
        // A restarted writer has a connection of its own, so more than one message can wait here.
        for _ in 0..MOST_WAITING {
            let Some(sample) = self.subscriber.receive().map_err(|e| receive_error(H::NAME, &e))? else { break };
            let header = *sample.user_header().header();
            if newest.as_ref().is_none_or(|(n, _)| n.time_ns <= header.time_ns) {
                newest = Some((header, sample));
            }
        }
        let Some((_, sample)) = newest else { return Ok(None) };
        let header = *sample.user_header();
        header.validate()?;
        check_count::<H>(header.announced(), sample.payload().len())?;
        self.message.header = header;
        self.message.elements.clear();
        self.message.elements.extend_from_slice(sample.payload());
        self.message.check()?;
        Ok(Some(&self.message))
    }
}
