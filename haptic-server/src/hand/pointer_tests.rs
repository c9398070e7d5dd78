//! The pointer's hand keeps its limits whatever is sent, arrives where it may, and lets go of what nobody holds.

use super::*;
use proptest::prelude::*;
use triple_buffer::{Input, triple_buffer};

const TICK_S: f64 = 1e-3;
/// Rounding of a difference of positions of a tenth of a metre, over the shortest step, metres per second.
const ROUNDING_M_PER_S: f64 = 1e-12;
/// The hand may pass its goal, and with it the border, by the way that it needs to stop.
const BRAKING_M: f64 = SPEED_M_PER_S * SPEED_M_PER_S / ACCELERATION_M_PER_S2;
const HOME_M: Vec3 = Vec3::new(0.01, -0.02, 0.03);

struct Bench {
    wishes: Input<PointerWish>,
    hand: PointerHand,
    time_s: f64,
}

impl Bench {
    fn new() -> Self {
        let (wishes, cell) = triple_buffer(&PointerWish::none());
        let mut hand = PointerHand::new(cell, HOME_M);
        hand.target(0.0, &HandView::unseen());
        Self { wishes, hand, time_s: 0.0 }
    }

    fn send(&mut self, position_m: Vec3, buttons: u32, turn: u32) {
        self.wishes.write(PointerWish { position_m, buttons, turn });
    }

    fn after(&mut self, dt_s: f64) -> HandTarget {
        self.time_s += dt_s;
        self.hand.target(self.time_s, &HandView::unseen())
    }

    /// Ticks for this long, with a wish in each of them.
    fn follow(&mut self, seconds: f64, position_m: Vec3, buttons: u32, turn: u32) -> HandTarget {
        for _ in 0..(seconds / TICK_S).round() as u32 {
            self.send(position_m, buttons, turn);
            self.after(TICK_S);
        }
        self.after(0.0)
    }

    /// Ticks for this long without a word.
    fn silence(&mut self, seconds: f64) -> HandTarget {
        for _ in 0..(seconds / TICK_S).round() as u32 {
            self.after(TICK_S);
        }
        self.after(0.0)
    }
}

#[test]
fn it_waits_at_home_and_goes_where_it_is_sent_to_the_bit() {
    let mut bench = Bench::new();
    assert_eq!(bench.silence(3.0), HandTarget { position_m: HOME_M, buttons: 0 });
    let goal = HOME_M + Vec3::new(0.05, 0.01, -0.02);
    let there = bench.follow(1.0, goal, 0, 7);
    // The last step is the way that is left: one rounding of a sum.
    assert!((there.position_m - goal).amax() < 1e-16, "{}", there.position_m - goal);
}

#[test]
fn a_place_outside_the_workspace_is_its_border() {
    let mut bench = Bench::new();
    let reached = bench.follow(2.0, Vec3::new(1e300, -1e300, 0.0), 0, 7).position_m - HOME_M;
    let [x, y, _] = HALF_WORKSPACE_M;
    assert!((reached - Vec3::new(x, -y, -0.03)).amax() < 1e-15, "{reached}");
}

#[test]
fn a_wish_that_is_no_place_is_no_wish() {
    let mut bench = Bench::new();
    bench.follow(0.5, HOME_M, 0, 7);
    bench.follow(0.5, HOME_M, 1, 7);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        // Another turn whose words cannot be used changes nothing either.
        bench.send(Vec3::new(0.0, bad, 0.0), 2, 9);
        assert_eq!(bench.after(TICK_S), HandTarget { position_m: HOME_M, buttons: 1 });
    }
    // Nor does it break the silence.
    for _ in 0..1_100 {
        bench.send(Vec3::repeat(f64::NAN), 1, 7);
        bench.after(TICK_S);
    }
    assert_eq!(bench.after(TICK_S).buttons, 0);
}

#[test]
fn a_silent_sender_leaves_the_hand_where_it_is_and_then_without_grip() {
    let mut bench = Bench::new();
    let far = HOME_M + Vec3::new(0.08, 0.0, 0.0);
    bench.follow(1.0, HOME_M - Vec3::new(0.08, 0.0, 0.0), 0, 7);
    bench.follow(0.1, far, 1, 7);
    let moving = bench.silence(HOLD_AFTER_S - 2.0 * TICK_S);
    let held = bench.silence(0.1);
    let slid_m = (held.position_m - moving.position_m).norm();
    assert!(slid_m > 0.0 && slid_m <= BRAKING_M && held.position_m.x < far.x - 0.01, "{slid_m} m, {}", held.position_m);
    assert_eq!(bench.silence(0.3), HandTarget { position_m: held.position_m, buttons: 1 }, "it stands and holds");
    assert_eq!(bench.silence(LET_GO_AFTER_S).buttons, 0);
    // The same sender comes back with the button still down: it never pressed it here.
    assert_eq!(bench.follow(0.2, far, 1, 7).buttons, 0);
    bench.follow(0.01, far, 0, 7);
    assert_eq!(bench.follow(0.01, far, 1, 7).buttons, 1);
}

#[test]
fn another_turn_begins_with_nothing_in_the_hand() {
    let mut bench = Bench::new();
    bench.follow(0.1, HOME_M, 0, 7);
    assert_eq!(bench.follow(0.1, HOME_M, 3, 7).buttons, 3);
    assert_eq!(bench.follow(0.1, HOME_M, 3, 8).buttons, 0);
    bench.follow(0.1, HOME_M, 2, 8);
    assert_eq!(bench.follow(0.1, HOME_M, 3, 8).buttons, 1, "the front button was seen up, the back one never");
    assert_eq!(bench.follow(0.1, HOME_M, 0xffff_ff00, 8).buttons, 0, "bits that no stylus has");
}

/// Anything that a sender may put into a wish.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -0.2..0.2,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e308), Just(1e308), Just(f64::MIN_POSITIVE)],
        1 => any::<f64>(),
    ]
}

fn wish() -> impl Strategy<Value = Option<PointerWish>> {
    let sent = ([coordinate(), coordinate(), coordinate()], 0..5_u32, 1..4_u32)
        .prop_map(|(at, buttons, turn)| PointerWish { position_m: Vec3::from(at), buttons, turn });
    prop_oneof![1 => Just(None), 2 => sent.prop_map(Some)]
}

proptest! {
    #[test]
    fn speed_acceleration_and_room_are_kept_whatever_is_sent(
        // A tick may be late by up to twenty periods; a wish may stand for long.
        acts in proptest::collection::vec((wish(), 50e-6..20e-3, 1..40_u32), 1..20),
    ) {
        let mut bench = Bench::new();
        let (mut at_m, mut velocity) = (HOME_M, Vec3::zeros());
        for (wish, dt_s, ticks) in acts {
            for _ in 0..ticks {
                if let Some(wish) = wish {
                    bench.wishes.write(wish);
                }
                let before_s = bench.time_s;
                let target = bench.after(dt_s);
                let dt_s = bench.time_s - before_s;
                let now = (target.position_m - at_m) / dt_s;
                prop_assert!(now.norm() <= SPEED_M_PER_S + ROUNDING_M_PER_S, "{} m/s", now.norm());
                let change = (now - velocity).norm();
                prop_assert!(
                    change <= ACCELERATION_M_PER_S2 * dt_s + 2.0 * ROUNDING_M_PER_S,
                    "{} m/s² over {dt_s} s", change / dt_s
                );
                let out = (target.position_m - HOME_M).abs() - Vec3::from(HALF_WORKSPACE_M);
                prop_assert!(out.max() <= BRAKING_M, "{} m outside", out.max());
                prop_assert!(target.buttons <= 3);
                (at_m, velocity) = (target.position_m, now);
            }
        }
        // Whatever went before, a steady wish is reached.
        let goal = HOME_M + Vec3::new(-0.02, 0.03, 0.01);
        let there = bench.follow(2.0, goal, 0, 9);
        prop_assert!((there.position_m - goal).norm() < 1e-12, "{}", there.position_m - goal);
    }

    #[test]
    fn equal_wishes_at_equal_times_give_equal_bits(acts in proptest::collection::vec(wish(), 1..200)) {
        let run = || {
            let mut bench = Bench::new();
            acts.iter().map(|wish| {
                wish.iter().for_each(|w| bench.wishes.write(*w));
                bench.after(TICK_S)
            }).collect::<Vec<_>>()
        };
        prop_assert_eq!(run(), run());
    }
}
