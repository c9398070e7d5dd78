//! `pointer_hand`: several senders, of each the newest wish; who of them is the hand is the receiver's to say.
//!
//! Safe overflow, buffer 1, no history: a wish is for now. A sender that is stopped or killed keeps nothing but its own
//! place of [`MAX_HAND_SENDERS`].

use super::latest::{Depth, KEPT, MOST_WAITING, open, receive_error, send_error, subscriber_error, writer};
use super::node::retried;
use super::{PortError, PortNode, monotonic_ns};
use crate::pointer_hand::PointerHand;
use crate::wire::Message;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;

/// Programs that may ask for the hand at the same time, stopped ones included.
pub const MAX_HAND_SENDERS: usize = 8;
/// Wishes of one look: as many as two of each. One who sends without end may take them all; the hand then stands, and
/// its place is free after the usual silence.
const MOST_IN_A_LOOK: usize = 2 * MAX_HAND_SENDERS;
const TOPIC: &str = PointerHand::NAME;

const DEPTH: Depth = Depth { buffer: KEPT, history: 0, writers: MAX_HAND_SENDERS };
const _: () = assert!(MOST_IN_A_LOOK <= MOST_WAITING);

/// Tells the ports of two senders apart whatever they say of themselves.
pub type WriterId = u128;

/// Sends wishes.
#[derive(Debug)]
pub struct PointerHandPublisher {
    publisher: Publisher<ipc::Service, PointerHand, ()>,
    sequence: u64,
}

impl PointerHandPublisher {
    /// Opens the topic for sending.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        Ok(Self { publisher: writer(&open(node, &DEPTH)?)?, sequence: 0 })
    }

    /// Fills the header (sequence, time) and sends.
    ///
    /// # Errors
    /// [`PortError::Send`]; the caller may go on with the next message.
    pub fn send(&mut self, message: &mut PointerHand) -> Result<(), PortError> {
        self.sequence += 1;
        message.stamp(self.sequence, monotonic_ns());
        self.publisher.send_copy(*message).map(drop).map_err(|e| send_error(TOPIC, &e))
    }
}

/// Receives the wishes of all senders (bridge thread of the servo process).
#[derive(Debug)]
pub struct PointerHandSubscriber {
    subscriber: Subscriber<ipc::Service, PointerHand, ()>,
}

impl PointerHandSubscriber {
    /// Opens the topic for receiving; no sender need exist yet.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        let service = open(node, &DEPTH)?;
        let subscriber = retried(|| service.subscriber_builder().create().map_err(subscriber_error::<PointerHand>))?;
        Ok(Self { subscriber })
    }

    /// Hands over what came since the last call, validated, with the port that it came from.
    ///
    /// # Errors
    /// [`PortError::Rejected`] when a message must not be used; the others were handed over all the same.
    /// [`PortError::Receive`].
    pub fn each(&mut self, mut take: impl FnMut(WriterId, PointerHand)) -> Result<(), PortError> {
        let mut rejected = None;
        for _ in 0..MOST_IN_A_LOOK {
            let Some(sample) = self.subscriber.receive().map_err(|e| receive_error(TOPIC, &e))? else { break };
            let copy = *sample;
            match copy.validate() {
                Ok(()) => take(sample.header().publisher_id().value(), copy),
                Err(error) => rejected = Some(error),
            }
        }
        rejected.map_or(Ok(()), |error| Err(error.into()))
    }
}
