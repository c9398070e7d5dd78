//! The two packets of the original Omni: bytes ↔ numbers, nothing else. All numbers little-endian.
//!
//! | to the device, 16 bytes | |
//! |---|---|
//! | 0–5 | three u16: motor converters, 12-bit offset binary, 0x07ff is zero |
//! | 6–7 | status: 0x53c0 idle; bit 0 dock light, bit 1 quick, bit 3 motors on |
//!
//! | from the device, about 44 bytes | |
//! |---|---|
//! | 0–3 | 0x001e0000 · 4–9: three u16 encoders · 10–15: gimbal a · 18: packet counter |
//! | 19 | active low: bit 0 and 1 buttons, bit 2 docked · 22–27: gimbal b, complement of a · 28–29: 0x5746 |
//!
//! The gimbals are potentiometers: a/(a+b), of which the low five bits are noise.
//! Deliberately absent: what encoders and converters mean (`arm.rs`).

use crate::device::wire::Packet;

/// Converter value without force.
pub const DAC_ZERO: u16 = 0x07ff;
/// Largest distance from [`DAC_ZERO`] in both directions, counts.
pub const DAC_MOST: i16 = 0x07ff;
/// Status with the motors off.
const IDLE: u16 = 0x53c0;
/// Status bit: motors on.
const MOTORS_ON: u16 = 1 << 3;
/// Status bits: dock light, steady.
const LIGHT: u16 = 0b11;
/// First bytes of a packet of the device.
const HEAD: u32 = 0x001e_0000;
/// A mark within it.
const MARK: u16 = 0x5746;
/// Least bytes that hold all of it.
const LEAST: usize = 36;

/// What is sent to the motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motors {
    /// Off.
    Off,
    /// On, with these counts from zero; beyond the converter they end at its end.
    On([i16; 3]),
}

/// The dock's light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DockLight {
    /// Dark.
    Dark,
    /// Steady.
    Steady,
}

/// Bytes to the device.
#[must_use]
pub fn encode(motors: Motors, light: DockLight) -> Packet {
    let (counts, on) = match motors {
        Motors::Off => ([0; 3], 0),
        Motors::On(counts) => (counts, MOTORS_ON),
    };
    let lit = if light == DockLight::Steady { LIGHT } else { 0 };
    let mut bytes = [0; 16];
    for (pair, count) in bytes[..6].chunks_exact_mut(2).zip(counts) {
        let value = DAC_ZERO.saturating_add_signed(count.clamp(-DAC_MOST, DAC_MOST));
        pair.copy_from_slice(&value.to_le_bytes());
    }
    bytes[6..8].copy_from_slice(&(IDLE | on | lit).to_le_bytes());
    Packet::new(&bytes)
}

/// What bytes to the device ask of the motors; for a device of the tests and for the record.
#[must_use]
pub fn motors_of(bytes: &[u8]) -> Option<Motors> {
    let bytes: &[u8; 16] = bytes.try_into().ok()?;
    let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let counts = [word(0), word(2), word(4)];
    if counts.iter().any(|c| *c > DAC_ZERO + DAC_MOST.unsigned_abs()) {
        return None;
    }
    let from_zero = counts.map(|c| c.cast_signed() - DAC_ZERO.cast_signed());
    Some(if word(6) & MOTORS_ON == 0 { Motors::Off } else { Motors::On(from_zero) })
}

/// A packet of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OmniPacket {
    /// Encoders of the three joints, counts; they wrap round.
    pub encoders: [u16; 3],
    /// Gimbal voltages and their complements.
    pub gimbal: [(u16, u16); 3],
    /// Grows by one per packet, wraps round.
    pub counter: u8,
    /// Bit 0 front button, bit 1 back button.
    pub buttons: u32,
    /// The stylus stands in its dock.
    pub is_docked: bool,
}

impl OmniPacket {
    /// Reads a packet; `None` when length, head, mark or gimbals are not those of an Omni.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        if !(LEAST..=super::registers::PAYLOAD).contains(&bytes.len()) {
            return None;
        }
        let head = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let gimbal = [0, 2, 4].map(|i| (word(10 + i), word(22 + i)));
        let has_voltage = gimbal.iter().all(|(a, b)| *a > 0 || *b > 0);
        if head != HEAD || word(28) != MARK || !has_voltage {
            return None;
        }
        let status = !bytes[19];
        Some(Self {
            encoders: [word(4), word(6), word(8)],
            gimbal,
            counter: bytes[18],
            buttons: u32::from(status & 0b11),
            is_docked: status & 0b100 != 0,
        })
    }

    /// The bytes of a packet; for a device of the tests.
    #[must_use]
    pub fn encode(&self) -> Packet {
        let mut bytes = [0; 44];
        let mut put = |at: usize, value: u16| bytes[at..at + 2].copy_from_slice(&value.to_le_bytes());
        put(2, (HEAD >> 16) as u16);
        for (i, (encoder, (a, b))) in self.encoders.into_iter().zip(self.gimbal).enumerate() {
            put(4 + 2 * i, encoder);
            put(10 + 2 * i, a);
            put(22 + 2 * i, b);
        }
        put(20, 0x1007);
        put(28, MARK);
        bytes[18] = self.counter;
        bytes[19] = !((self.buttons & 0b11) as u8 | u8::from(self.is_docked) << 2);
        Packet::new(&bytes)
    }

    /// Where the gimbals stand, 0 to 1.
    #[must_use]
    pub fn gimbal_shares(&self) -> [f64; 3] {
        self.gimbal.map(|(a, b)| f64::from(a) / (f64::from(a) + f64::from(b)).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn packet() -> OmniPacket {
        OmniPacket {
            encoders: [1, 0x8000, 0xffff],
            gimbal: [(0x4000, 0xc000), (0x8000, 0x8000), (1, 0)],
            counter: 200,
            buttons: 2,
            is_docked: true,
        }
    }

    #[test]
    fn bytes_to_the_device_are_the_stated_ones() {
        assert_eq!(
            encode(Motors::Off, DockLight::Dark).bytes(),
            [0xff, 7, 0xff, 7, 0xff, 7, 0xc0, 0x53, 0, 0, 0, 0, 0, 0, 0, 0]
        );
        let on = encode(Motors::On([1, -1, 0x7ff]), DockLight::Steady);
        assert_eq!(on.bytes()[..8], [0, 8, 0xfe, 7, 0xfe, 0x0f, 0xcb, 0x53]);
        let beyond = encode(Motors::On([i16::MAX, i16::MIN, 0]), DockLight::Dark);
        assert_eq!(motors_of(beyond.bytes()), Some(Motors::On([DAC_MOST, -DAC_MOST, 0])));
    }

    #[test]
    fn bytes_of_the_device_stand_where_they_are_said_to() {
        let mut bytes = [0_u8; 44];
        bytes[2] = 0x1e;
        bytes[4..10].copy_from_slice(&[1, 0, 0, 0x80, 0xff, 0xff]);
        bytes[10..16].copy_from_slice(&[0, 0x40, 0, 0x80, 1, 0]);
        bytes[22..28].copy_from_slice(&[0, 0xc0, 0, 0x80, 0, 0]);
        bytes[28..30].copy_from_slice(&[0x46, 0x57]);
        (bytes[18], bytes[19]) = (200, !0b110);
        assert_eq!(OmniPacket::parse(&bytes), Some(packet()));
        assert_eq!(packet().gimbal_shares(), [0.25, 0.5, 1.0]);
        for broken in [0, 3, 28] {
            let mut other = bytes;
            other[broken] ^= 0x10;
            assert_eq!(OmniPacket::parse(&other), None, "byte {broken}");
        }
        assert_eq!(OmniPacket::parse(&bytes[..35]), None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_codec_panic(bytes in prop::collection::vec(any::<u8>(), 0..100)) {
            let _ = OmniPacket::parse(&bytes);
            let _ = motors_of(&bytes);
        }

        #[test]
        fn flipped_bits_never_panic_and_what_is_written_is_read_back(
            encoders: [u16; 3], gimbal in prop::array::uniform3((1..u16::MAX, any::<u16>())), counter: u8,
            buttons in 0..4_u32, is_docked: bool, at in 0..44_usize, bit in 0..8_u32, counts: [i16; 3]
        ) {
            let packet = OmniPacket { encoders, gimbal, counter, buttons, is_docked };
            let encoded = packet.encode();
            prop_assert_eq!(OmniPacket::parse(encoded.bytes()), Some(packet));
            let mut broken = encoded.bytes().to_vec();
            broken[at] ^= 1 << bit;
            let _ = OmniPacket::parse(&broken);
            let sent = encode(Motors::On(counts), DockLight::Dark);
            let read = motors_of(sent.bytes());
            prop_assert_eq!(read, Some(Motors::On(counts.map(|c| c.clamp(-DAC_MOST, DAC_MOST)))));
        }
    }
}
