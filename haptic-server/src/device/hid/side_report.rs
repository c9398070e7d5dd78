//! Reports of side inputs: bytes ↔ numbers, nothing else.
//!
//! | device | report | content |
//! |---|---|---|
//! | 3D mouse | 1, 7 bytes | three i16: translation · newer ones, 13 bytes: translation and rotation |
//! | | 2, 7 bytes | three i16: rotation |
//! | | 3, 2 to 9 bytes | bitmap of buttons, lowest first |
//! | foot switch | 8 bytes, or 9 behind a report number | a keyboard's: modifiers, 0, six keys; any of them is "down" |
//!
//! Deflections are the device's own, about ±350. Deliberately absent: what a camera makes of them.

/// What a 3D mouse says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MouseReport {
    /// Pushed along right, to the user, down.
    Translation([i16; 3]),
    /// Turned about the same axes.
    Rotation([i16; 3]),
    /// Both at once.
    Both([i16; 6]),
    /// Buttons.
    Buttons(u32),
}

/// State of a 3D mouse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MouseState {
    /// Translation, then rotation.
    pub axes: [i16; 6],
    /// Bitmap.
    pub buttons: u32,
}

impl MouseReport {
    /// Reads a report; `None` for one that no 3D mouse sends.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let (number, body) = bytes.split_first()?;
        match (number, body.len()) {
            (1, 6) => Some(Self::Translation(words(body)?)),
            (2, 6) => Some(Self::Rotation(words(body)?)),
            (1, 12) => Some(Self::Both(words(body)?)),
            (3, 1..=8) => {
                let bits =
                    body.iter().take(4).enumerate().fold(0, |bits, (i, byte)| bits | u32::from(*byte) << (8 * i));
                Some(Self::Buttons(bits))
            }
            _ => None,
        }
    }
}

impl MouseState {
    /// Takes a report.
    pub fn take(&mut self, report: MouseReport) {
        match report {
            MouseReport::Translation(axes) => self.axes[..3].copy_from_slice(&axes),
            MouseReport::Rotation(axes) => self.axes[3..].copy_from_slice(&axes),
            MouseReport::Both(axes) => self.axes = axes,
            MouseReport::Buttons(buttons) => self.buttons = buttons,
        }
    }
}

/// Whether a foot switch is down; `None` for a report that is none of its.
#[must_use]
pub fn pedal_is_down(bytes: &[u8]) -> Option<bool> {
    let keys = match bytes.len() {
        8 => bytes,
        9 => &bytes[1..],
        _ => return None,
    };
    Some(keys[0] != 0 || keys[2..].iter().any(|key| *key != 0))
}

fn words<const N: usize>(bytes: &[u8]) -> Option<[i16; N]> {
    let mut values = [0; N];
    for (i, value) in values.iter_mut().enumerate() {
        *value = i16::from_le_bytes([*bytes.get(2 * i)?, *bytes.get(2 * i + 1)?]);
    }
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_mouse_is_read_report_by_report() {
        let mut state = MouseState::default();
        for bytes in [&[1, 0x5e, 1, 0xa2, 0xfe, 0, 0][..], &[2, 1, 0, 2, 0, 3, 0], &[3, 0b10, 1]] {
            state.take(MouseReport::parse(bytes).expect("a report of a mouse"));
        }
        assert_eq!(state, MouseState { axes: [350, -350, 0, 1, 2, 3], buttons: 0x102 });
        state.take(MouseReport::parse(&[1, 9, 0, 8, 0, 7, 0, 6, 0, 5, 0, 4, 0]).expect("a newer one"));
        assert_eq!(state.axes, [9, 8, 7, 6, 5, 4]);
        for bytes in [&[][..], &[1], &[1, 2, 3], &[4, 0, 0], &[3]] {
            assert_eq!(MouseReport::parse(bytes), None, "{bytes:?}");
        }
    }

    #[test]
    fn a_pedal_is_down_while_any_key_is() {
        assert_eq!(pedal_is_down(&[0; 8]), Some(false));
        assert_eq!(pedal_is_down(&[0, 0, 5, 0, 0, 0, 0, 0]), Some(true));
        assert_eq!(pedal_is_down(&[2, 0, 0, 0, 0, 0, 0, 0]), Some(true));
        assert_eq!(pedal_is_down(&[1, 0, 0, 5, 0, 0, 0, 0, 0]), Some(true));
        assert_eq!(pedal_is_down(&[1, 0, 0, 0, 0, 0, 0, 0, 0]), Some(false), "a report number is no key");
        assert_eq!(pedal_is_down(&[1, 2]), None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_codecs_panic(bytes in prop::collection::vec(any::<u8>(), 0..70)) {
            let mut state = MouseState::default();
            if let Some(report) = MouseReport::parse(&bytes) {
                state.take(report);
            }
            let _ = pedal_is_down(&bytes);
        }
    }
}
