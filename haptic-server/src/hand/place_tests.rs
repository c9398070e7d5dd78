//! One sender at a time is the hand, whatever the others send, and nobody keeps the place by being stopped.

use super::*;
use crate::device::HandView;
use crate::hand::pointer::{ACCELERATION_M_PER_S2, PointerHand as Hand, SPEED_M_PER_S};
use crate::hand::{Hand as _, HandTarget};
use proptest::prelude::*;
use protocol::wire::{Field, Message};
use triple_buffer::{Input, triple_buffer};

const MS: u64 = 1_000_000;
/// The clock has run for a while.
const START_NS: u64 = 100_000 * MS;
/// Rounding of a difference of positions of a tenth of a metre, over a tick, metres per second.
const ROUNDING_M_PER_S: f64 = 1e-12;

fn heard(writer: WriterId, buttons: u32, sent_ns: u64) -> Heard {
    let mut message = PointerHand { buttons, sender: 1_000 + writer as u32, ..PointerHand::EMPTY };
    message.stamp(1, sent_ns);
    Heard { writer, message }
}

#[test]
fn the_first_is_the_hand_and_the_others_are_passed_over() {
    let mut place = Place::default();
    assert_eq!(place.standing(START_NS), (0, 0));
    let both = [heard(2, 1, START_NS), heard(1, 0, START_NS - 1)];
    assert_eq!(place.hear(&both, START_NS).map(|w| (w.turn, w.buttons)), Some((1, 0)));
    assert_eq!(place.standing(START_NS), (1_001, 1));
    for now_ns in (1..100).map(|k| START_NS + 8 * k * MS) {
        assert_eq!(place.hear(&[heard(2, 1, now_ns)], now_ns), None);
        let both = [heard(2, 1, now_ns), heard(1, 2, now_ns)];
        assert_eq!(place.hear(&both, now_ns).map(|w| (w.turn, w.buttons)), Some((1, 2)));
    }
}

#[test]
fn a_silent_hand_is_followed_and_its_old_words_do_not_count() {
    let mut place = Place::default();
    place.hear(&[heard(1, 1, START_NS)], START_NS);
    let almost_ns = START_NS + FREE_AFTER_NS - 1;
    assert_eq!(place.hear(&[heard(2, 0, almost_ns)], almost_ns), None);
    assert_eq!(place.standing(almost_ns), (1_001, 1));
    let free_ns = START_NS + FREE_AFTER_NS;
    assert_eq!(place.standing(free_ns), (0, 1));
    // What the stopped one had in hand, and what a sender without a clock invents, takes nothing.
    for sent_ns in [START_NS + 1, free_ns - OLDEST_NS - 1, free_ns + CLOCK_SLACK_NS + 1, u64::MAX] {
        assert_eq!(place.hear(&[heard(1, 1, sent_ns)], free_ns), None, "{sent_ns}");
    }
    assert_eq!(place.hear(&[heard(2, 0, free_ns)], free_ns).map(|w| w.turn), Some(2));
    // Continued: it speaks again and is one of the others.
    let later_ns = free_ns + 100 * MS;
    assert_eq!(place.hear(&[heard(1, 1, later_ns), heard(2, 0, later_ns)], later_ns).map(|w| w.turn), Some(2));
    assert_eq!(place.hear(&[heard(1, 1, later_ns + MS)], later_ns + MS), None);
    assert_eq!(place.standing(later_ns), (1_002, 2));
}

#[test]
fn a_look_that_comes_late_takes_the_place_from_nobody() {
    let mut place = Place::default();
    place.hear(&[heard(1, 0, START_NS)], START_NS);
    // The bridge had no processor for ten seconds; both have gone on sending.
    let late_ns = START_NS + 10_000 * MS;
    let both = [heard(2, 0, late_ns - 7 * MS), heard(1, 0, late_ns - 2 * MS)];
    assert_eq!(place.hear(&both, late_ns).map(|w| w.turn), Some(1));
}

#[test]
fn a_hand_that_is_given_back_is_free_at_once_and_lets_go() {
    let mut place = Place::default();
    place.hear(&[heard(1, 0, START_NS)], START_NS);
    let back_ns = START_NS + MS;
    assert_eq!(place.hear(&[heard(2, GIVES_BACK, back_ns)], back_ns), None, "it is not its to give");
    assert_eq!(place.hear(&[heard(1, 3 | GIVES_BACK, back_ns)], back_ns).map(|w| (w.turn, w.buttons)), Some((1, 0)));
    assert_eq!(place.standing(back_ns), (0, 1));
    assert_eq!(place.hear(&[heard(1, GIVES_BACK, back_ns + 1)], back_ns + 1), None, "said twice");
    assert_eq!(place.hear(&[heard(2, 0, back_ns + 2)], back_ns + 2).map(|w| w.turn), Some(2));
}

/// A place with the hand behind it, ticking at 1 kHz.
struct Bench {
    place: Place,
    wishes: Input<PointerWish>,
    hand: Hand,
    now_ns: u64,
}

impl Bench {
    fn new() -> Self {
        let (wishes, cell) = triple_buffer(&PointerWish::none());
        let mut hand = Hand::new(cell, Vec3::zeros());
        hand.target(0.0, &HandView::unseen());
        Self { place: Place::default(), wishes, hand, now_ns: START_NS }
    }

    fn tick(&mut self, heard: &[Heard]) -> (Option<PointerWish>, HandTarget) {
        self.now_ns += MS;
        let wish = self.place.hear(heard, self.now_ns);
        wish.into_iter().for_each(|wish| self.wishes.write(wish));
        (wish, self.hand.target((self.now_ns - START_NS) as f64 * 1e-9, &HandView::unseen()))
    }
}

/// What one of three senders does for a while: speaks at this period with these buttons from this place, or is stopped.
#[derive(Clone, Copy, Debug)]
struct Act {
    period_ms: u64,
    buttons: u32,
    x_m: f64,
    /// Its stamps are this old when they arrive.
    age_ns: u64,
}

fn act() -> impl Strategy<Value = Option<Act>> {
    let age = prop_oneof![6 => 0..2 * MS, 1 => 200 * MS..300 * MS, 1 => Just(2_000 * MS)];
    let speaks = (1..20_u64, 0..8_u32, -0.2..0.2, age).prop_map(|(period_ms, buttons, x_m, age_ns)| Act {
        period_ms,
        buttons,
        x_m,
        age_ns,
    });
    prop_oneof![1 => Just(None), 2 => speaks.prop_map(Some)]
}

proptest! {
    #[test]
    fn whatever_they_send_one_is_the_hand_and_no_take_over_presses_or_jumps(
        acts in proptest::collection::vec(([act(), act(), act()], 1..1_500_u64), 1..12),
    ) {
        let mut bench = Bench::new();
        let (mut at_m, mut velocity) = (Vec3::zeros(), Vec3::zeros());
        // Of the sender that is the hand: its number, its turn, when its last wish was sent, buttons that it has had up.
        let mut hand: Option<(WriterId, u64)> = None;
        let (mut turn, mut seen_up) = (0, 0);
        for (senders, ms) in acts {
            for k in 0..ms {
                let now_ns = bench.now_ns + MS;
                let speaking = (0_u128..).zip(senders).filter_map(|(writer, act)| Some((writer, act?)));
                let said: Vec<Heard> = speaking
                    .filter(|(_, act)| k % act.period_ms == 0)
                    .map(|(writer, act)| {
                        let mut one = heard(writer, act.buttons, now_ns - act.age_ns);
                        one.message.position_m[0] = act.x_m;
                        one
                    })
                    .collect();
                let (wish, target) = bench.tick(&said);
                if let Some(wish) = wish {
                    let spoke = said.iter().find(|h| h.message.position_m[0] == wish.position_m.x);
                    let spoke = spoke.expect("a wish is one of those sent");
                    prop_assert!(spoke.is_fresh(now_ns));
                    if wish.turn == turn {
                        prop_assert_eq!(hand.map(|(writer, _)| writer), Some(spoke.writer), "a turn has one sender");
                    } else {
                        let is_free = hand.is_none_or(|(_, sent_ns)| now_ns - sent_ns >= FREE_AFTER_NS);
                        prop_assert!(is_free, "taken from a sender that speaks");
                        prop_assert_eq!(wish.turn, turn + 1);
                        seen_up = 0;
                    }
                    turn = wish.turn;
                    seen_up |= !wish.buttons;
                    hand = (!spoke.gives_back()).then(|| (spoke.writer, spoke.sent_ns()));
                }
                prop_assert_eq!(target.buttons & !seen_up, 0, "pressed without having been up in this turn");
                let (sender, told) = bench.place.standing(now_ns);
                let holder = hand.filter(|(_, sent_ns)| now_ns - sent_ns < FREE_AFTER_NS);
                prop_assert_eq!(told, turn);
                prop_assert_eq!(sender, holder.map_or(0, |(writer, _)| 1_000 + writer as u32));
                let now = (target.position_m - at_m) / 1e-3;
                prop_assert!(now.norm() <= SPEED_M_PER_S + ROUNDING_M_PER_S, "{} m/s", now.norm());
                let change = (now - velocity).norm();
                prop_assert!(change <= ACCELERATION_M_PER_S2 * 1e-3 + 2.0 * ROUNDING_M_PER_S, "{change} m/s in a tick");
                (at_m, velocity) = (target.position_m, now);
            }
        }
        // Whatever went before: everybody falls silent, and the next one is the hand with nothing in it.
        for _ in 0..FREE_AFTER_NS / MS + 10 {
            let (_, target) = bench.tick(&[]);
            at_m = target.position_m;
        }
        prop_assert_eq!(bench.tick(&[]).1, HandTarget { position_m: at_m, buttons: 0 });
        let next = [heard(7, 3, bench.now_ns)];
        let (wish, target) = bench.tick(&next);
        prop_assert_eq!((wish.map(|w| w.turn), target.buttons), (Some(turn + 1), 0));
    }
}
