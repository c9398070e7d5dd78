//! What the kernel says of the bus: the bytes of an event ↔ what happened. Pure; native byte order, but for packet headers.
//!
//! | event | bytes |
//! |---|---|
//! | every | 0–7 closure, 8–11 kind |
//! | 0 bus reset | 12 node, …, 32 generation |
//! | 1 answer of a transaction | 12 result, 16 length, 20… data |
//! | 3 packets have arrived or gone | 12 cycle, 16 length of headers, 20… headers, big-endian: payload length in the upper half |
//! | 4 channel and bandwidth reserved | 12 handle, 16 channel (negative: none), 20 bandwidth |

/// Packets of one event at most: the kernel's page of headers.
pub(super) const MOST_PACKETS: usize = 1024;
/// Longest event, bytes.
pub(super) const LONGEST_EVENT: usize = 20 + 4 * MOST_PACKETS;

/// One event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// The bus has a new generation.
    BusReset(u32),
    /// The answer of a transaction at this address: result (0 is well) and data.
    Answer(u64, u32, &'a [u8]),
    /// Packets, one header of four bytes each.
    Packets(&'a [u8]),
    /// Channel, if there was one.
    Reserved(Option<u8>),
    /// Nothing that matters here.
    Other,
}

/// Reads an event; `None` when it is shorter than it says.
pub(super) fn parse(bytes: &[u8]) -> Option<Event<'_>> {
    let word = |at: usize| Some(u32::from_ne_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let closure = u64::from_ne_bytes(bytes.get(..8)?.try_into().ok()?);
    let tail = |length: u32| bytes.get(20..20_usize.checked_add(usize::try_from(length).ok()?)?);
    Some(match word(8)? {
        0 => Event::BusReset(word(32)?),
        1 => Event::Answer(closure, word(12)?, tail(word(16)?)?),
        3 => Event::Packets(tail(word(16)?)?),
        4 => Event::Reserved(u8::try_from(word(16)?).ok().filter(|channel| *channel < 64)),
        _ => Event::Other,
    })
}

/// Payload length of a packet's header.
pub(super) fn payload_length(header: &[u8]) -> usize {
    usize::from(header.first().copied().unwrap_or(0)) << 8 | usize::from(header.get(1).copied().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn event(kind: u32, words: &[u32]) -> Vec<u8> {
        let mut bytes = 0x1087_u64.to_ne_bytes().to_vec();
        for word in [kind].iter().chain(words) {
            bytes.extend(word.to_ne_bytes());
        }
        bytes
    }

    #[test]
    fn each_event_is_read() {
        assert_eq!(parse(&event(0, &[1, 2, 3, 4, 5, 77])), Some(Event::BusReset(77)));
        let answer = event(1, &[0, 4, u32::from_ne_bytes([0, 11, 0x99, 0])]);
        assert_eq!(parse(&answer), Some(Event::Answer(0x1087, 0, &[0, 11, 0x99, 0])));
        let packets = event(3, &[9, 8, u32::from_ne_bytes([0, 44, 0x40, 0xa0]), 0]);
        let Some(Event::Packets(headers)) = parse(&packets) else { panic!("packets") };
        assert_eq!((headers.len(), payload_length(headers)), (8, 44));
        assert_eq!(parse(&event(4, &[7, 12, 816])), Some(Event::Reserved(Some(12))));
        assert_eq!(parse(&event(4, &[7, (-16_i32).cast_unsigned(), 0])), Some(Event::Reserved(None)));
        assert_eq!(parse(&event(9, &[])), Some(Event::Other));
        assert_eq!(parse(&event(1, &[0, 400, 0])), None, "shorter than it says");
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..80), kind in 0..6_u8) {
            let mut bytes = bytes;
            if bytes.len() > 12 {
                bytes[8..12].copy_from_slice(&[kind, 0, 0, 0]);
            }
            let _ = parse(&bytes);
            prop_assert!(payload_length(&bytes) < 1 << 16);
        }
    }
}
