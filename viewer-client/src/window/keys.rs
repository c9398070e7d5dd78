//! From keys to wishes.

use crate::camera::FixedView;
use crate::orders::Order;
use crate::overlay::Help;
use crate::overlay::wish::{PlayWish, Wish};
use crate::pointer::Button;
use winit::keyboard::{Key, NamedKey};

/// What a key depends on besides itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Keyboard {
    /// Whether a recording is played.
    pub(super) played: Played,
    /// Whether the list of keys is open.
    pub(super) help: Help,
    /// Whether Shift is down.
    pub(super) shift: bool,
}

/// Whether a recording is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Played {
    /// A server runs.
    Live,
    /// A recording.
    Recording,
}

/// The wish of a key.
pub(super) fn wish(key: &Key, keyboard: Keyboard) -> Option<Wish> {
    match key {
        Key::Named(key) => named(*key, keyboard),
        Key::Character(text) => character(text, keyboard),
        _ => None,
    }
}

fn named(key: NamedKey, keyboard: Keyboard) -> Option<Wish> {
    let played = keyboard.played == Played::Recording;
    Some(match key {
        NamedKey::Space if played => Wish::Play(PlayWish::Toggle),
        NamedKey::Space => Wish::Pause,
        NamedKey::Escape if keyboard.help == Help::Open => Wish::Help,
        NamedKey::Escape => Wish::Quit,
        NamedKey::F1 => Wish::Help,
        NamedKey::F12 => Wish::Screenshot,
        NamedKey::Home if played => Wish::Play(PlayWish::Seek(0.0)),
        NamedKey::ArrowLeft if played => Wish::Play(PlayWish::Back),
        NamedKey::ArrowRight if played => Wish::Play(PlayWish::Forward),
        _ => return None,
    })
}

fn character(text: &str, keyboard: Keyboard) -> Option<Wish> {
    let key = text.chars().next()?.to_ascii_lowercase();
    Some(match key {
        'f' => Wish::FrameAll,
        '1' => Wish::Fixed(FixedView::Front),
        '3' => Wish::Fixed(FixedView::Side),
        '7' => Wish::Fixed(FixedView::Top),
        '0' => Wish::Fixed(FixedView::Surgeon),
        'p' => Wish::Screenshot,
        'r' if keyboard.shift => Wish::Order(Order::Start),
        'r' => Wish::Order(Order::Restore),
        'n' => Wish::Order(Order::Next),
        'b' => Wish::Order(Order::Previous),
        't' => Wish::Order(Order::Tie),
        'c' => Wish::CycleControl,
        'a' => Wish::Order(Order::Rearm),
        'v' => Wish::NextColour,
        's' => Wish::Stereo,
        'g' => Wish::Background,
        'h' | '?' => Wish::Help,
        'o' => Wish::Panels,
        'k' => Wish::SaveSamples,
        'j' => Wish::ClearSamples,
        'm' => Wish::Hand,
        'q' => Wish::Quit,
        ',' => Wish::Play(PlayWish::Back),
        '.' => Wish::Play(PlayWish::Forward),
        '-' => Wish::Play(PlayWish::Slower),
        '+' | '=' => Wish::Play(PlayWish::Faster),
        _ => return None,
    })
}

/// The stylus' button that a key stands for.
pub(super) fn button(key: &Key) -> Option<Button> {
    match key {
        Key::Character(text) if text.eq_ignore_ascii_case("x") => Some(Button::Front),
        Key::Character(text) if text.eq_ignore_ascii_case("z") => Some(Button::Back),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::help::KEYS;

    const LIVE: Keyboard = Keyboard { played: Played::Live, help: Help::Closed, shift: false };

    fn of(text: &str) -> Option<Wish> {
        wish(&Key::Character(text.into()), LIVE)
    }

    #[test]
    fn every_letter_of_the_list_does_something_and_no_other_does() {
        let listed: Vec<char> = KEYS
            .iter()
            .flat_map(|(_, keys)| *keys)
            .flat_map(|(key, _)| key.split([' ', ',']))
            .filter(|word| word.len() == 1)
            .filter_map(|word| word.chars().next())
            .collect();
        for letter in 'A'..='Z' {
            let key = Key::Character(letter.to_string().into());
            let does = wish(&key, LIVE).is_some() || button(&key).is_some();
            assert_eq!(does, listed.contains(&letter), "{letter}");
        }
    }

    #[test]
    fn shift_and_the_recording_change_what_a_key_means() {
        assert_eq!(of("r"), Some(Wish::Order(Order::Restore)));
        assert_eq!(
            wish(&Key::Character("R".into()), Keyboard { shift: true, ..LIVE }),
            Some(Wish::Order(Order::Start))
        );
        let space = Key::Named(NamedKey::Space);
        assert_eq!(wish(&space, LIVE), Some(Wish::Pause));
        let recording = Keyboard { played: Played::Recording, ..LIVE };
        assert_eq!(wish(&space, recording), Some(Wish::Play(PlayWish::Toggle)));
        let escape = Key::Named(NamedKey::Escape);
        assert_eq!(wish(&escape, LIVE), Some(Wish::Quit));
        assert_eq!(wish(&escape, Keyboard { help: Help::Open, ..LIVE }), Some(Wish::Help));
    }
}
