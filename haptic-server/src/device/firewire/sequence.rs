//! Order of the packets by their counter of eight bits: what is missing, what comes twice or too late.
//!
//! With d = counter − last counter (modulo 256): d = 0 is a duplicate, d ≥ 128 comes too late, both are refused; otherwise
//! d − (packets that have arrived since) are missing. The newest packet of a tick is all that the servo sees, so arrivals are
//! counted by the wire's thread. Deliberately absent: losses of more than 127 packets in a row, which are a lost device.

use super::packet::OmniPacket;
use crate::device::notice::NoticeRing;
use crate::device::wire::Arrival;
use crate::device::wire::notice::WireNotice;
use crate::device::wire::watch::Growing;

/// From here on a difference is a step back.
const TOO_LATE: u8 = 128;

/// Watches the counter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequence {
    last: Option<(u8, u64)>,
    generation: u32,
    missed: u64,
    out_of_order: u64,
    tell_missed: Growing,
    tell_order: Growing,
}

impl Sequence {
    /// The arrival without a packet that is out of order.
    pub fn sift(&mut self, arrival: &Arrival, ring: &NoticeRing) -> Arrival {
        if arrival.generation != self.generation {
            *self = Self { last: None, generation: arrival.generation, ..*self };
        }
        let packet = arrival.newest.and_then(|packet| OmniPacket::parse(packet.bytes()));
        let mut sifted = *arrival;
        match (packet, self.last) {
            (None, _) => sifted.newest = None,
            (Some(packet), None) => self.last = Some((packet.counter, arrival.sound)),
            (Some(packet), Some((last, sound))) => match packet.counter.wrapping_sub(last) {
                0 | TOO_LATE.. => {
                    self.out_of_order += 1;
                    sifted.newest = None;
                }
                step => {
                    self.missed += u64::from(step).saturating_sub(arrival.sound - sound);
                    self.last = Some((packet.counter, arrival.sound));
                }
            },
        }
        if let Some(count) = self.tell_missed.tick(self.missed) {
            WireNotice::Missed(count).tell(ring);
        }
        if let Some(count) = self.tell_order.tick(self.out_of_order) {
            WireNotice::OutOfOrder(count).tell(ring);
        }
        sifted
    }

    /// The device begins anew.
    pub fn forget(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::notice::NOTICES;

    fn arrival(counter: u8, sound: u64) -> Arrival {
        let packet = OmniPacket { encoders: [0; 3], gimbal: [(1, 1); 3], counter, buttons: 0, is_docked: false };
        Arrival { generation: 0, broken: None, newest: Some(packet.encode()), sound, refused: 0 }
    }

    #[test]
    fn a_counter_that_grows_is_well_also_round_the_corner_and_several_a_tick() {
        let (mut sequence, ring) = (Sequence::default(), NoticeRing::new(NOTICES));
        for i in 0..600_u64 {
            // Three packets a tick, of which the servo sees the last.
            let sifted = sequence.sift(&arrival((3 * i % 256) as u8, 3 * i), &ring);
            assert!(sifted.newest.is_some());
        }
        assert_eq!((sequence.missed, sequence.out_of_order, ring.len()), (0, 0, 0));
    }

    #[test]
    fn missing_double_and_late_packets_are_told_apart() {
        let (mut sequence, ring) = (Sequence::default(), NoticeRing::new(NOTICES));
        sequence.sift(&arrival(250, 1), &ring);
        assert!(sequence.sift(&arrival(3, 2), &ring).newest.is_some());
        assert_eq!(sequence.missed, 8, "nine steps, one arrived");
        assert!(sequence.sift(&arrival(3, 3), &ring).newest.is_none());
        assert!(sequence.sift(&arrival(2, 4), &ring).newest.is_none());
        assert_eq!(sequence.out_of_order, 2);
        assert!(sequence.sift(&arrival(4, 5), &ring).newest.is_some());
        assert_eq!(sequence.missed, 8, "late ones have been counted as arrived");
        assert_eq!(ring.len(), 2);
    }
}
