//! Reports of the open HID arm (WoodenHaptics, Polhem): bytes ↔ numbers, nothing else.
//!
//! | report | bytes | content |
//! |---|---|---|
//! | in | 14, 15 or 64 | seven i16, little-endian: encoders a to f, info; firmware of either age, the rest is padding |
//! | out | 65 | report number 0, then seven i16: current a, b, c in mA, command, attribute 0 to 2; padded with zeros |
//!
//! Command 0 drives the motors, 1 sets the encoders a, b, c to the attributes. 15 bytes in are 14 behind a report number 0.
//! Reports have neither counter nor checksum: only their length can be judged here.
//! Deliberately absent: what an encoder means (`arm.rs`).

use crate::device::wire::Packet;

/// Bytes of the numbers of a report.
const NUMBERS: usize = 14;
/// Bytes of a report out, with its number.
const OUT: usize = 65;

/// A report of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmReport {
    /// Encoders a to f, counts: three joints, three of the gimbal.
    pub encoders: [i16; 6],
    /// Bit 0 front button, bit 1 back button (as the firmware has them).
    pub info: i16,
}

impl ArmReport {
    /// Reads a report; `None` when the length is none that any firmware sends.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let numbers = match bytes.len() {
            NUMBERS | 64 => &bytes[..NUMBERS],
            15 if bytes[0] == 0 => &bytes[1..],
            _ => return None,
        };
        let mut values = [0; 7];
        for (value, pair) in values.iter_mut().zip(numbers.chunks_exact(2)) {
            *value = i16::from_le_bytes([pair[0], pair[1]]);
        }
        let [a, b, c, d, e, f, info] = values;
        Some(Self { encoders: [a, b, c, d, e, f], info })
    }
}

/// What is sent to the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmOrder {
    /// Currents of the three motors, milliamperes.
    Drive([i16; 3]),
    /// Motors off, and the encoders of the joints get these counts.
    SetEncoders([i16; 3]),
}

impl ArmOrder {
    /// The bytes of the order.
    #[must_use]
    pub fn encode(self) -> Packet {
        let numbers: [i16; 7] = match self {
            Self::Drive([a, b, c]) => [a, b, c, 0, 0, 0, 0],
            Self::SetEncoders([a, b, c]) => [0, 0, 0, 1, a, b, c],
        };
        let mut bytes = [0; OUT];
        for (pair, number) in bytes[1..=NUMBERS].chunks_exact_mut(2).zip(numbers) {
            pair.copy_from_slice(&number.to_le_bytes());
        }
        Packet::new(&bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Encoders 1, −1, 258, −32768, 32767, 0, info 3.
    const IN: [u8; 14] = [1, 0, 0xff, 0xff, 2, 1, 0, 0x80, 0xff, 0x7f, 0, 0, 3, 0];

    #[test]
    fn a_report_of_either_firmware_is_read() {
        let expected = ArmReport { encoders: [1, -1, 258, -32768, 32767, 0], info: 3 };
        assert_eq!(ArmReport::parse(&IN), Some(expected));
        let mut numbered = [0; 15];
        numbered[1..].copy_from_slice(&IN);
        assert_eq!(ArmReport::parse(&numbered), Some(expected));
        let mut padded = [0xaa; 64];
        padded[..14].copy_from_slice(&IN);
        assert_eq!(ArmReport::parse(&padded), Some(expected));
        numbered[0] = 2;
        assert_eq!(ArmReport::parse(&numbered), None, "another report number");
        for len in [0, 1, 13, 16, 63, 65] {
            assert_eq!(ArmReport::parse(&[0; 65][..len]), None, "{len} bytes");
        }
    }

    #[test]
    fn an_order_has_the_stated_bytes() {
        let drive = ArmOrder::Drive([1000, -2, 0]).encode();
        assert_eq!(drive.bytes().len(), 65);
        assert_eq!(drive.bytes()[..15], [0, 0xe8, 3, 0xfe, 0xff, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        let set = ArmOrder::SetEncoders([0, 256, -1]).encode();
        assert_eq!(set.bytes()[..15], [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0xff, 0xff]);
        assert!(set.bytes()[15..].iter().all(|b| *b == 0));
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_codec_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let parsed = ArmReport::parse(&bytes);
            prop_assert_eq!(parsed.is_some(), matches!(bytes.len(), 14 | 64) || bytes.len() == 15 && bytes[0] == 0);
        }

        #[test]
        fn what_is_written_is_read_back(numbers: [i16; 7]) {
            let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            let report = ArmReport::parse(&bytes).expect("fourteen bytes");
            prop_assert_eq!(&report.encoders[..], &numbers[..6]);
            prop_assert_eq!(report.info, numbers[6]);
            let [a, b, c, ..] = numbers;
            let order = ArmOrder::Drive([a, b, c]).encode();
            let back = ArmReport::parse(&order.bytes()[..15]).expect("behind the report number");
            prop_assert_eq!(&back.encoders[..3], &numbers[..3]);
        }
    }
}
