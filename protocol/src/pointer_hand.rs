//! `pointer_hand`: where a viewer's mouse wants the stylus of a pointer device to be.
//!
//! A wish, not a pose: the server limits its speed and its room, and lets go when it falls silent. One viewer at a
//! time is the hand. SI units, scene frame.

use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

pod! {
    /// The newest wish.
    pub struct PointerHand as "suture.v3.PointerHand" {
        /// Header.
        pub header: Header,
        /// Where the stylus tip should go, metres.
        pub position_m: [f64; 3],
        /// Bit 0 front button, bit 1 back button.
        pub buttons: u32,
        /// Identifies the sender (process id).
        pub sender: u32,
    }
}

message!(PointerHand, "pointer_hand", parts: [], check: |m| (m.buttons > 3).then_some("buttons"));
