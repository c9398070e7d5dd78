//! Who is the hand: one sender at a time, of several that may ask.
//!
//! The place belongs to the sender whose wish was taken last for as long as that is less than [`LET_GO_AFTER_S`] old; all others
//! are passed over meanwhile. A sender that gives it back, or is silent for that long (stopped, killed, hung), leaves it free,
//! and the next wish takes it. Each take is a turn with a number of its own; the hand begins a turn with its buttons up
//! (`pointer.rs`), and goes to the new place within its limits of speed and acceleration.
//! What counts is when a wish was sent, not when it arrives: one that is more than [`OLDEST_NS`] old is what a stopped process had
//! in hand; it neither moves the hand nor keeps or takes the place. Senders are told apart by their ports, not by what they
//! say of themselves. Nanoseconds of the monotonic clock. Deliberately absent: clock and ports (`servo_process/pointer.rs`).

use crate::hand::pointer::{LET_GO_AFTER_S, PointerWish};
use protocol::pointer_hand::{GIVES_BACK, PointerHand};
use protocol::ports::WriterId;
use sim_core::vector::Vec3;

/// A wish that was sent longer ago than this does not count.
pub const OLDEST_NS: u64 = 250_000_000;
/// The clock is one for all processes; a stamp that is farther ahead than this is invented.
pub const CLOCK_SLACK_NS: u64 = 5_000_000;
/// A sender that is silent for this long has left.
pub const FREE_AFTER_NS: u64 = (LET_GO_AFTER_S * 1e9) as u64;

/// A wish that arrived, and the port it came from.
#[derive(Clone, Copy, Debug)]
pub struct Heard {
    /// The port.
    pub writer: WriterId,
    /// The wish.
    pub message: PointerHand,
}

impl Heard {
    fn sent_ns(&self) -> u64 {
        self.message.header.time_ns
    }

    fn is_fresh(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.sent_ns()) <= OLDEST_NS && self.sent_ns() <= now_ns.saturating_add(CLOCK_SLACK_NS)
    }

    fn gives_back(&self) -> bool {
        self.message.buttons & GIVES_BACK != 0
    }

    fn wish(&self, turn: u32) -> PointerWish {
        let PointerHand { position_m, buttons, .. } = self.message;
        let buttons = if self.gives_back() { 0 } else { buttons };
        PointerWish { position_m: Vec3::from(position_m), buttons, turn }
    }
}

#[derive(Clone, Copy, Debug)]
struct Holder {
    writer: WriterId,
    sender: u32,
    sent_ns: u64,
}

/// The place of the hand.
#[derive(Debug, Default)]
pub struct Place {
    holder: Option<Holder>,
    turn: u32,
}

impl Place {
    /// What the hand is to do after these wishes, which arrived since the last call; `None`: nothing new.
    pub fn hear(&mut self, heard: &[Heard], now_ns: u64) -> Option<PointerWish> {
        let fresh = || heard.iter().filter(|h| h.is_fresh(now_ns));
        if let Some(holder) = &mut self.holder {
            // The holder's wish first: when we come late, nobody takes the place of one who never was silent.
            let of_holder = fresh().filter(|h| h.writer == holder.writer && h.sent_ns() > holder.sent_ns);
            if let Some(newest) = of_holder.max_by_key(|h| h.sent_ns()) {
                holder.sent_ns = newest.sent_ns();
                if newest.gives_back() {
                    self.holder = None;
                }
                return Some(newest.wish(self.turn));
            }
            if now_ns.saturating_sub(holder.sent_ns) < FREE_AFTER_NS {
                return None;
            }
            self.holder = None;
        }
        let first = fresh().filter(|h| !h.gives_back()).min_by_key(|h| h.sent_ns())?;
        self.turn = self.turn.wrapping_add(1).max(1);
        self.holder = Some(Holder { writer: first.writer, sender: first.message.sender, sent_ns: first.sent_ns() });
        Some(first.wish(self.turn))
    }

    /// Process id of the sender that is the hand now, 0 nobody; and the number of its turn, or of the last one.
    #[must_use]
    pub fn standing(&self, now_ns: u64) -> (u32, u32) {
        let holder = self.holder.filter(|h| now_ns.saturating_sub(h.sent_ns) < FREE_AFTER_NS);
        (holder.map_or(0, |h| h.sender), self.turn)
    }
}

#[cfg(test)]
#[path = "place_tests.rs"]
mod tests;
