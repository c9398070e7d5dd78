//! `pointer_hand`: where a viewer's mouse wants the stylus of a pointer device to be.
//!
//! A wish, not a pose: the server limits its speed and its room, and lets go when it falls silent. Several viewers may
//! send; one at a time is the hand, and `servo_state` says which. A viewer that asks while another one is the hand is
//! passed over. SI units, scene frame.

use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// Bit of [`PointerHand::buttons`]: the sender gives the hand back; whoever asks next is the hand.
pub const GIVES_BACK: u32 = 4;

pod! {
    /// The newest wish of one sender.
    pub struct PointerHand as "suture.v4.PointerHand" {
        /// Header.
        pub header: Header,
        /// Where the stylus tip should go, metres.
        pub position_m: [f64; 3],
        /// Bit 0 front button, bit 1 back button, bit 2 [`GIVES_BACK`].
        pub buttons: u32,
        /// Identifies the sender (process id); not 0.
        pub sender: u32,
    }
}

message!(PointerHand, "pointer_hand", parts: [], check: |m| {
    if m.buttons >= GIVES_BACK << 1 {
        return Some("buttons");
    }
    (m.sender == 0).then_some("sender")
});
