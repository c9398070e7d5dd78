//! `session_command`: what a person asks of a running session, and the form of the answer.
//!
//! A sender numbers its commands; its numbers begin at its process id, so that no two senders of a run share one. The solver
//! answers every command in `wound_report`, where the sender looks for its own number.

use crate::text;
use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// What may be asked of a session; the numbers are the codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Order {
    /// Reset the current scene to its start.
    Restore = 1,
    /// Go to the next scene of the procedure.
    Next = 2,
    /// Go to the previous scene of the procedure.
    Previous = 3,
    /// Tie the stitch at work now (refused when the gap is open).
    Tie = 4,
    /// Suture control on (sound mode).
    ControlOn = 5,
    /// Suture control off.
    ControlOff = 6,
    /// Suture control as printed in the paper.
    ControlPaper = 7,
    /// Re-arm the servo after a fault.
    Rearm = 8,
    /// Begin the procedure from its start: first scene, no stitches.
    Start = 9,
}

impl Order {
    /// All of them, by their codes.
    pub const ALL: [Self; 9] = [
        Self::Restore,
        Self::Next,
        Self::Previous,
        Self::Tie,
        Self::ControlOn,
        Self::ControlOff,
        Self::ControlPaper,
        Self::Rearm,
        Self::Start,
    ];

    /// Its code.
    #[must_use]
    pub fn code(self) -> u32 {
        self as u32
    }

    /// The order of a code; `None` for a code that nobody knows.
    #[must_use]
    pub fn of_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|order| order.code() == code)
    }

    /// For sentences.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Restore => "restore",
            Self::Next => "next scene",
            Self::Previous => "previous scene",
            Self::Tie => "tie",
            Self::ControlOn => "control on",
            Self::ControlOff => "control off",
            Self::ControlPaper => "control as in the paper",
            Self::Rearm => "re-arm",
            Self::Start => "start",
        }
    }
}

/// [`CommandAnswer::result`]: carried out.
pub const DONE: u32 = 1;
/// [`CommandAnswer::result`]: refused, nothing has changed.
pub const REFUSED: u32 = 2;

/// Answers that are kept, the newest.
pub const MAX_ANSWERS: usize = 16;
/// Words of eight bytes that a reason may take.
pub const MAX_ANSWER_WORDS: usize = 16;

pod! {
    /// One command; the sender counts its own sequence.
    pub struct SessionCommand as "suture.v4.SessionCommand" {
        /// Header.
        pub header: Header,
        /// Code of an [`Order`].
        pub command: u32,
        /// Identifies the sender (process id).
        pub sender: u32,
    }
}

pod! {
    /// What became of one command.
    pub struct CommandAnswer as "suture.v4.CommandAnswer" {
        /// Sequence in the header of the command.
        pub sequence: u64,
        /// Its sender.
        pub sender: u32,
        /// Its code.
        pub command: u32,
        /// 0 there is no answer here, [`DONE`], [`REFUSED`].
        pub result: u32,
        /// Padding, zero.
        pub reserved: u32,
        /// Why it was refused: text (see `text`).
        pub reason: [u64; MAX_ANSWER_WORDS],
    }
}

impl CommandAnswer {
    /// An answer; with a reason it is a refusal.
    #[must_use]
    pub fn new(sequence: u64, sender: u32, command: u32, reason: &str) -> Self {
        let result = if reason.is_empty() { DONE } else { REFUSED };
        Self { sequence, sender, command, result, reserved: 0, reason: text::words(reason) }
    }

    /// Whether the command was refused.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.result == REFUSED
    }

    /// Why, as a sentence; empty when it was carried out.
    #[must_use]
    pub fn reason(&self) -> String {
        text::of_words(&self.reason)
    }
}

message!(SessionCommand, "session_command", parts: [], check: |m| {
    m.order().is_none().then_some("command")
});

impl SessionCommand {
    /// What it asks; a command that was validated asks something.
    #[must_use]
    pub fn order(&self) -> Option<Order> {
        Order::of_code(self.command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_read_back_and_orders_have_names_of_their_own() {
        for (i, order) in Order::ALL.into_iter().enumerate() {
            assert_eq!((order.code() as usize, Order::of_code(order.code())), (i + 1, Some(order)));
            assert!(Order::ALL[..i].iter().all(|other| other.name() != order.name()), "{}", order.name());
        }
        assert_eq!([0, 10, u32::MAX].map(Order::of_code), [None; 3]);
    }
}
