//! The second hand of a surgeon: it holds tissue while the first one sutures.
//!
//! A press near a suture point that the first hand does not have takes it (two-sided coupling, as the needle does), the
//! release lets go. Where both want a point, the hand that comes last has it. Deliberately absent: a line in the second
//! hand, ties, attachments (holding is no suturing).

use super::suturing::{HandInput, PairPlace, Side};

/// What the second hand's act means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SecondEvent {
    /// It takes this point.
    Taken(usize, Side),
    /// It lets go.
    Released,
}

/// What the second hand is doing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SecondHand {
    seen: Option<(u32, u32)>,
    is_down: bool,
    capture_radius_m: f64,
}

impl SecondHand {
    /// An open hand; a point is taken within `capture_radius_m` of the stylus.
    pub(super) fn new(capture_radius_m: f64) -> Self {
        Self { seen: None, is_down: false, capture_radius_m }
    }

    /// Takes in what the hand did. At most two events in the order of the edges. No hand is an open hand; a button that
    /// is down when a hand comes is no press.
    pub(super) fn advance(&mut self, hand: Option<&HandInput>, places: &[PairPlace]) -> [Option<SecondEvent>; 2] {
        let Some(hand) = hand else {
            self.seen = None;
            return [std::mem::take(&mut self.is_down).then_some(SecondEvent::Released), None];
        };
        let now = (hand.press_count, hand.release_count);
        let (presses, releases) = self.seen.replace(now).unwrap_or(now);
        let (pressed, released) = (now.0 != presses, now.1 != releases);
        let was_down = self.is_down;
        self.is_down = if was_down == released { pressed } else { was_down };
        let press = if pressed { self.nearest(hand, places) } else { None };
        let release = (released && (was_down || pressed)).then_some(SecondEvent::Released);
        if was_down { [release, press] } else { [press, release] }
    }

    /// The suture point within reach that is nearest to the stylus; the lower pair and the left side win a tie.
    fn nearest(&self, hand: &HandInput, places: &[PairPlace]) -> Option<SecondEvent> {
        let sides =
            |(pair, place): (usize, &PairPlace)| [(pair, Side::Left, place.left_m), (pair, Side::Right, place.right_m)];
        let reach = places.iter().enumerate().flat_map(sides);
        let all = reach.map(|(pair, side, at)| (pair, side, (at - hand.position_m).norm()));
        let nearest = all.min_by(|a, b| a.2.total_cmp(&b.2)).filter(|(_, _, d)| *d <= self.capture_radius_m);
        nearest.map(|(pair, side, _)| SecondEvent::Taken(pair, side))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::Vec3;

    fn places() -> Vec<PairPlace> {
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        (0..2)
            .map(|i| PairPlace {
                left_m: at(-0.004, 0.01 * f64::from(i)),
                right_m: at(0.004, 0.01 * f64::from(i)),
                closed_m: 1e-3,
            })
            .collect()
    }

    fn hand(x: f64, press_count: u32, release_count: u32) -> HandInput {
        HandInput { position_m: Vec3::new(x, 0.01, 0.0), press_count, release_count }
    }

    #[test]
    fn a_press_takes_the_nearest_point_in_reach_and_the_release_lets_go() {
        let mut second = SecondHand::new(2e-3);
        let places = places();
        assert_eq!(second.advance(Some(&hand(0.004, 3, 2)), &places), [None, None], "down when it came");
        assert_eq!(second.advance(Some(&hand(0.004, 3, 3)), &places), [None, None]);
        assert_eq!(second.advance(Some(&hand(0.0, 4, 3)), &places), [None, None], "out of reach");
        assert_eq!(second.advance(Some(&hand(0.0035, 4, 4)), &places), [Some(SecondEvent::Released), None]);
        let taken = Some(SecondEvent::Taken(1, Side::Right));
        assert_eq!(second.advance(Some(&hand(0.0035, 5, 4)), &places), [taken, None]);
        assert_eq!(second.advance(Some(&hand(0.0035, 6, 5)), &places), [Some(SecondEvent::Released), taken]);
        assert_eq!(second.advance(None, &places), [Some(SecondEvent::Released), None], "gone with the point in it");
        assert_eq!(second.advance(None, &places), [None, None]);
    }

    #[test]
    fn a_short_press_between_two_steps_takes_and_lets_go() {
        let mut second = SecondHand::new(2e-3);
        let _ = second.advance(Some(&hand(-0.004, 0, 0)), &places());
        let events = second.advance(Some(&hand(-0.004, 1, 1)), &places());
        assert_eq!(events, [Some(SecondEvent::Taken(1, Side::Left)), Some(SecondEvent::Released)]);
    }
}
