//! `session_command`: what a person asks of a running session.

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

pod! {
    /// One command; the sender counts its own sequence.
    pub struct SessionCommand as "suture.v3.SessionCommand" {
        /// Header.
        pub header: Header,
        /// One of the codes of this file.
        pub command: u32,
        /// Identifies the sender (process id).
        pub sender: u32,
    }
}

message!(SessionCommand, "session_command", parts: [], check: |m| {
    (!(RESTORE..=REARM).contains(&m.command)).then_some("command")
});
