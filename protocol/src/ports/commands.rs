//! `session_command`: several senders, every command counts, so a queue instead of newest-wins.
//!
//! A queue of 16 per sender; when a receiver sleeps longer, the oldest commands are lost (safe
//! overflow), because a sender must never wait for the solver. The receiver empties all queues at each look and lets
//! the senders take turns (`turns.rs`).

use super::latest::{Depth, open, receive_error, send_error, subscriber_error, writer};
use super::node::retried;
use super::turns::{CommandFlood, Turns};
use super::{PortError, PortNode, monotonic_ns};
use crate::session_command::{Order, SessionCommand};
use crate::wire::{Field, Message};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;

/// Commands that wait for a receiver, per sender.
const QUEUE: usize = 16;
/// Programs that may send commands at the same time: every viewer, and some that do nothing else.
const MAX_SENDERS: usize = 40;
/// Commands that are taken in at a look: all that can wait when it begins.
const MOST_IN_A_LOOK: usize = QUEUE * MAX_SENDERS;
/// Sequences of a sender begin at its process id times 2 to this power: an answer that carries a sequence then names one
/// command of one sender, and no process id is so large that this overflows.
const SENDER_SHIFT: u32 = 32;
const TOPIC: &str = SessionCommand::NAME;

const DEPTH: Depth = Depth { buffer: QUEUE, history: 0, writers: MAX_SENDERS };

/// Sends commands to the running session.
#[derive(Debug)]
pub struct SessionCommandPublisher {
    publisher: Publisher<ipc::Service, SessionCommand, ()>,
    sequence: u64,
}

impl SessionCommandPublisher {
    /// Opens the topic for sending.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        let publisher = writer(&open(node, &DEPTH)?)?;
        Ok(Self { publisher, sequence: u64::from(std::process::id()) << SENDER_SHIFT })
    }

    /// Sends an order and returns how many receivers got it.
    ///
    /// # Errors
    /// [`PortError::Send`].
    pub fn send(&mut self, order: Order) -> Result<usize, PortError> {
        self.sequence += 1;
        let mut message = SessionCommand { command: order.code(), sender: std::process::id(), ..SessionCommand::EMPTY };
        message.stamp(self.sequence, monotonic_ns());
        self.publisher.send_copy(message).map_err(|e| send_error(TOPIC, &e))
    }

    /// Sequence of the last command: what its answer in `wound_report` names
    /// ([`WoundReport::answer_to`](crate::wound_report::WoundReport::answer_to)).
    #[must_use]
    pub fn last_sequence(&self) -> u64 {
        self.sequence
    }
}

/// Receives commands.
#[derive(Debug)]
pub struct SessionCommandSubscriber {
    subscriber: Subscriber<ipc::Service, SessionCommand, ()>,
    turns: Turns,
}

impl SessionCommandSubscriber {
    /// Opens the topic for receiving.
    ///
    /// # Errors
    /// [`PortError::Full`], [`PortError::Incompatible`], [`PortError::Open`].
    pub fn open(node: &PortNode) -> Result<Self, PortError> {
        let service = open(node, &DEPTH)?;
        let subscriber = retried(|| {
            service.subscriber_builder().buffer_size(QUEUE).create().map_err(subscriber_error::<SessionCommand>)
        })?;
        Ok(Self { subscriber, turns: Turns::default() })
    }

    /// Takes in what came since the last look.
    ///
    /// # Errors
    /// [`PortError::Rejected`] when a command must not be obeyed; the others were taken in all the same.
    /// [`PortError::Receive`].
    pub fn look(&mut self) -> Result<(), PortError> {
        let mut rejected = None;
        for _ in 0..MOST_IN_A_LOOK {
            let Some(sample) = self.subscriber.receive().map_err(|e| receive_error(TOPIC, &e))? else { break };
            let copy = *sample;
            match copy.validate() {
                Ok(()) => self.turns.add(sample.header().publisher_id().value(), copy),
                Err(error) => rejected = Some(error),
            }
        }
        rejected.map_or(Ok(()), |error| Err(error.into()))
    }

    /// The next of the commands that were taken in: of each sender the oldest, senders in turn.
    pub fn next_command(&mut self) -> Option<SessionCommand> {
        self.turns.next()
    }

    /// The next thing to tell about senders whose commands are lost, because they send faster than is obeyed.
    pub fn flood(&mut self) -> Option<CommandFlood> {
        self.turns.flood()
    }
}

/// Sends what no publisher of this crate would.
#[cfg(test)]
pub(super) fn raw_sender_for_test(node: &PortNode) -> Result<Publisher<ipc::Service, SessionCommand, ()>, PortError> {
    writer(&open(node, &DEPTH)?)
}
