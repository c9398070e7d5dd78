//! `session_command`: what a person asks of a running session, and the form of the answer.
//!
//! A sender numbers its commands; its numbers begin at its process id, so that no two senders of a run share one. The solver
//! answers every command in `wound_report`, where the sender looks for its own number.

use crate::text;
use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// Reset the current scene to its start.
pub const RESTORE: u32 = 1;
/// Go to the next scene of the procedure.
pub const NEXT: u32 = 2;
/// Go to the previous scene of the procedure.
pub const PREVIOUS: u32 = 3;
/// Tie the stitch at work now (refused when the gap is open).
pub const TIE: u32 = 4;
/// Suture control on (sound mode).
pub const CONTROL_ON: u32 = 5;
/// Suture control off.
pub const CONTROL_OFF: u32 = 6;
/// Suture control as printed in the paper.
pub const CONTROL_PAPER: u32 = 7;
/// Re-arm the servo after a fault.
pub const REARM: u32 = 8;
/// Begin the procedure from its start: first scene, no stitches.
pub const START: u32 = 9;

/// [`CommandAnswer::result`]: carried out.
pub const DONE: u32 = 1;
/// [`CommandAnswer::result`]: refused, nothing has changed.
pub const REFUSED: u32 = 2;

/// Answers that are kept: one of every sender that may send at a time.
pub const MAX_ANSWERS: usize = 16;
/// Words of eight bytes that a reason may take.
pub const MAX_ANSWER_WORDS: usize = 16;

pod! {
    /// One command; the sender counts its own sequence.
    pub struct SessionCommand as "suture.v4.SessionCommand" {
        /// Header.
        pub header: Header,
        /// One of the codes of this file.
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
    (!(RESTORE..=START).contains(&m.command)).then_some("command")
});
