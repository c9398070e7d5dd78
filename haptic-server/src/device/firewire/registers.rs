//! Registers of the original Omni on the bus, and how it is recognised: addresses and pure functions.
//!
//! | address | width | content |
//! |---|---|---|
//! | 0x1000, 0x1001 | byte | isochronous channel to the device, from the device (free to write and read back: a sign of life) |
//! | 0x1082, 0x1083 | byte | 0x00 and 0xc0 in a device that works |
//! | 0x1087 | byte | bit 3: packets flow |
//! | 0x1006000c | quadlet | maker 0x000b99 in the upper 24 bits |
//! | 0x10060010 | quadlet | serial number, five fields |
//!
//! Quadlets stand big-endian on the bus. A write to 0x20010 is said to be needed by one source and to stall two devices by
//! another: it is left out. Deliberately absent: reading and writing them (`session.rs`).

/// Channel on which the device listens.
pub const CHANNEL_TO_DEVICE: u64 = 0x1000;
/// Channel on which the device talks.
pub const CHANNEL_FROM_DEVICE: u64 = 0x1001;
/// What a device that works has in two registers.
pub const SIGNS: [(u64, u8); 2] = [(0x1082, 0x00), (0x1083, 0xc0)];
/// Start and stop of the packets.
pub const CONTROL: u64 = 0x1087;
/// In [`CONTROL`]: packets flow.
pub const CONTROL_RUN: u8 = 0x08;
/// Maker.
pub const MAKER: u64 = 0x1006_000c;
/// Serial number.
pub const SERIAL: u64 = 0x1006_0010;
/// The value that is written and read back.
pub const ALIVE: u8 = 0x40;
/// Company number of the maker.
pub const COMPANY: u32 = 0x00_0b99;
/// Largest payload of either channel, bytes.
pub const PAYLOAD: usize = 64;
/// Channels of a bus.
pub const CHANNELS: u8 = 64;

/// Whether the maker's quadlet is that of an Omni.
#[must_use]
pub fn is_maker(quadlet: u32) -> bool {
    quadlet >> 8 == COMPANY
}

/// Whether a node's 64-bit identification (as sysfs shows it: `0x000b99…`) is that of an Omni.
#[must_use]
pub fn is_omni_guid(text: &str) -> bool {
    let digits = text.trim().trim_start_matches("0x");
    u64::from_str_radix(digits, 16).is_ok_and(|guid| guid >> 40 == u64::from(COMPANY))
}

/// Whether a node's vendor number (as sysfs shows it: `0x000b99`) is that of an Omni.
#[must_use]
pub fn is_omni_vendor(text: &str) -> bool {
    u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).is_ok_and(|vendor| vendor == COMPANY)
}

/// The serial number as it is printed on the device; `None` when the fixed bits are not there.
///
/// Bit 31 and bit 0 are set; a = bits 25 to 23, b = 22 to 19, c = 18 to 14, d = 13 to 11, e = 10 to 1.
#[must_use]
pub fn serial_number(quadlet: u32) -> Option<String> {
    if quadlet & 0x8000_0001 != 0x8000_0001 {
        return None;
    }
    let bits = |low: u32, count: u32| quadlet >> low & ((1 << count) - 1);
    let (a, b, c, d, e) = (bits(23, 3), bits(19, 4), bits(14, 5), bits(11, 3), bits(1, 10));
    Some(format!("{a}{b:02}{c:02}{d}{e:05}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_omni_is_known_by_its_maker() {
        assert!(is_maker(0x000b_9900) && is_maker(0x000b_99ff));
        assert!(!is_maker(0x000b_9a00) && !is_maker(0));
        assert!(is_omni_guid("0x000b990080123456\n") && !is_omni_guid("0x0011060000123456"));
        assert!(is_omni_vendor("0x000b99\n") && !is_omni_vendor("0x00000b990"));
        for text in ["", "0x", "omni", "0xfffffffffffffffff"] {
            assert!(!is_omni_guid(text) && !is_omni_vendor(text), "{text:?}");
        }
    }

    #[test]
    fn a_serial_number_has_its_five_fields() {
        let quadlet = 0x8000_0001 | 5 << 23 | 12 << 19 | 31 << 14 | 7 << 11 | 321 << 1;
        assert_eq!(serial_number(quadlet), Some("51231700321".to_owned()));
        assert_eq!(serial_number(quadlet & !1), None);
        assert_eq!(serial_number(quadlet & 0x7fff_ffff), None);
    }

    proptest! {
        #[test]
        fn every_serial_number_has_eleven_digits(quadlet: u32) {
            let digits = serial_number(quadlet | 0x8000_0001).expect("the fixed bits are set");
            prop_assert!(digits.len() == 11 && digits.bytes().all(|b| b.is_ascii_digit()), "{}", digits);
        }

        #[test]
        fn no_text_makes_the_recognition_panic(text in ".{0,24}") {
            let _ = is_omni_guid(&text) || is_omni_vendor(&text);
        }
    }
}
