//! What silence, a broken wire and garbage mean for a device: one judgement per tick.
//!
//! | since the last packet | sample |
//! |---|---|
//! | 1 tick | fresh: the bus and the servo have clocks of their own, one tick without a packet is their beat |
//! | 2 to 19 ticks | stale (the servo takes the force back from the fifth on) |
//! | 20 ticks, or a broken wire | lost |
//!
//! After a loss the device begins anew with the first packet that arrives: whoever lost power has lost its zero, too.
//! Refused packets are told when their number has grown, at most once in a thousand ticks.

use super::notice::WireNotice;
use super::{Arrival, Packet};
use crate::device::notice::NoticeRing;
use crate::device::openhaptics::severity::Reaction;

/// Ticks without a packet that are the beat of two clocks.
const BRIDGED_TICKS: u32 = 1;
/// Ticks without a packet that are a loss.
pub const LOST_TICKS: u32 = 20;
/// A device that has just been opened may take so many ticks to its first packet.
const START_TICKS: u32 = 500;
/// What goes on is told again after so many ticks.
const AGAIN_TICKS: u32 = 1_000;

/// How new the newest packet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freshness {
    /// Of this tick.
    New,
    /// Old enough to be the beat of two clocks.
    Bridged,
    /// Older.
    Stale,
    /// There has been none since the device was opened.
    None,
}

/// The judgement of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// The packet to work with.
    pub newest: Option<Packet>,
    /// How new it is.
    pub freshness: Freshness,
    /// The device must begin anew.
    pub restart: bool,
    /// What is done.
    pub reaction: Option<Reaction>,
}

/// Watches one wire.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkWatch {
    generation: u32,
    silent_ticks: u32,
    has_packet: bool,
    is_lost: bool,
    refused: Growing,
}

impl LinkWatch {
    /// One tick.
    pub fn tick(&mut self, arrival: &Arrival, ring: &NoticeRing) -> Judgement {
        if let Some(count) = self.refused.tick(arrival.refused) {
            WireNotice::Refused(count).tell(ring);
        }
        let is_back = self.is_lost && arrival.broken.is_none() && arrival.newest.is_some();
        let restart = arrival.generation != self.generation || is_back;
        if restart {
            *self = Self { generation: arrival.generation, refused: self.refused, ..Self::default() };
        }
        self.silent_ticks = if arrival.newest.is_some() { 0 } else { self.silent_ticks.saturating_add(1) };
        self.has_packet |= arrival.newest.is_some();
        let patience = if self.has_packet { LOST_TICKS } else { START_TICKS };
        let is_silent = self.silent_ticks >= patience;
        if !self.is_lost {
            match arrival.broken {
                Some(error) => WireNotice::Broken(error).tell(ring),
                None if is_silent => WireNotice::Silent(self.silent_ticks).tell(ring),
                None => {}
            }
        }
        self.is_lost |= arrival.broken.is_some() || is_silent;
        let freshness = match self.silent_ticks {
            _ if !self.has_packet => Freshness::None,
            0 => Freshness::New,
            1..=BRIDGED_TICKS => Freshness::Bridged,
            _ => Freshness::Stale,
        };
        let reaction = self.is_lost.then_some(Reaction::Lose);
        Judgement { newest: arrival.newest, freshness, restart, reaction }
    }
}

/// A count that is told when it has grown, now and then.
#[derive(Clone, Copy, Debug, Default)]
pub struct Growing {
    told: u64,
    quiet_ticks: u32,
}

impl Growing {
    /// The count to tell in this tick.
    pub fn tick(&mut self, count: u64) -> Option<u64> {
        self.quiet_ticks = self.quiet_ticks.saturating_sub(1);
        if count == self.told || self.quiet_ticks > 0 {
            return None;
        }
        (self.told, self.quiet_ticks) = (count, AGAIN_TICKS);
        Some(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::notice::NOTICES;
    use crate::device::wire::WireError;

    const NOTHING: Arrival = Arrival { generation: 0, broken: None, newest: None, sound: 0, refused: 0 };

    fn packet() -> Arrival {
        Arrival { newest: Some(Packet::new(&[1])), ..NOTHING }
    }

    #[test]
    fn silence_is_bridged_then_stale_then_a_loss_and_a_packet_begins_anew() {
        let ring = NoticeRing::new(NOTICES);
        let mut watch = LinkWatch::default();
        assert_eq!(watch.tick(&NOTHING, &ring).freshness, Freshness::None);
        assert_eq!(watch.tick(&packet(), &ring).freshness, Freshness::New);
        assert_eq!(watch.tick(&NOTHING, &ring).freshness, Freshness::Bridged);
        for tick in 2..LOST_TICKS {
            let judged = watch.tick(&NOTHING, &ring);
            assert_eq!((judged.freshness, judged.reaction), (Freshness::Stale, None), "{tick}");
        }
        assert_eq!(watch.tick(&NOTHING, &ring).reaction, Some(Reaction::Lose));
        assert_eq!(watch.tick(&NOTHING, &ring).reaction, Some(Reaction::Lose));
        assert_eq!(ring.len(), 1, "told once");
        let judged = watch.tick(&packet(), &ring);
        assert_eq!((judged.restart, judged.reaction, judged.freshness), (true, None, Freshness::New));
        assert!(!watch.tick(&packet(), &ring).restart);
    }

    #[test]
    fn a_broken_wire_is_lost_at_once_and_back_when_it_is_open_again() {
        let ring = NoticeRing::new(NOTICES);
        let mut watch = LinkWatch::default();
        watch.tick(&packet(), &ring);
        let broken = Arrival { broken: Some(WireError::Gone), ..NOTHING };
        for _ in 0..5_000 {
            assert_eq!(watch.tick(&broken, &ring).reaction, Some(Reaction::Lose));
        }
        assert_eq!(ring.len(), 1);
        let judged = watch.tick(&Arrival { generation: 1, ..NOTHING }, &ring);
        assert_eq!((judged.restart, judged.reaction, judged.freshness), (true, None, Freshness::None));
    }

    #[test]
    fn garbage_is_told_at_once_and_then_once_a_second() {
        let ring = NoticeRing::new(NOTICES);
        let mut watch = LinkWatch::default();
        for refused in 1..=2_500 {
            watch.tick(&Arrival { refused, ..packet() }, &ring);
        }
        assert_eq!(ring.len(), 3);
    }
}
