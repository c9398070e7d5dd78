//! The state machine of suturing, by its events.

use super::*;

fn places(gap: f64) -> Vec<PairPlace> {
    (0..2)
        .map(|i| PairPlace {
            left_m: Vec3::new(-gap / 2.0, 0.01 * f64::from(i), 0.0),
            right_m: Vec3::new(gap / 2.0, 0.01 * f64::from(i), 0.0),
            closed_m: 0.004,
        })
        .collect()
}

fn at(position_m: Vec3, press_count: u32, release_count: u32) -> HandInput {
    HandInput { position_m, press_count, release_count }
}

fn started(pairs: usize) -> Suturing {
    let mut s = Suturing::new(pairs, 0.003);
    s.advance(&at(Vec3::zeros(), 0, 0), &places(0.008));
    s
}

#[test]
fn a_stitch_goes_left_right_pull_tie() {
    let mut s = started(2);
    let open = places(0.008);
    assert_eq!(s.advance(&at(open[0].left_m, 1, 0), &open), [Some(SuturingEvent::LeftTaken(0)), None]);
    assert_eq!(s.advance(&at(open[0].left_m, 1, 1), &open), [Some(SuturingEvent::LeftReleased(0)), None]);
    assert_eq!(s.advance(&at(open[0].right_m, 2, 1), &open), [Some(SuturingEvent::LineTaken(0)), None]);
    assert_eq!(s.advance(&at(open[0].right_m, 2, 2), &open), [Some(SuturingEvent::LineReleased(0)), None]);
    assert_eq!(s.stage(), Stage::LineFree);
    assert_eq!(s.advance(&at(open[0].right_m, 3, 2), &open)[0], Some(SuturingEvent::LineTaken(0)));
    assert_eq!(s.advance(&at(open[0].right_m, 3, 3), &places(0.003))[0], Some(SuturingEvent::Tied(0)));
    assert_eq!((s.stage(), s.stitches(), s.pair(), s.points_taken()), (Stage::Idle, 1, 1, 2));
    // Left, right, and the line once more.
    assert_eq!(s.grips_used(), 3);
}

#[test]
fn a_press_out_of_reach_takes_nothing() {
    let mut s = started(2);
    let open = places(0.008);
    assert_eq!(s.advance(&at(Vec3::new(0.0, 0.0, 0.02), 1, 0), &open), [None, None]);
    assert_eq!(s.stage(), Stage::Idle);
}

#[test]
fn a_short_press_between_two_steps_is_not_lost() {
    let mut s = started(2);
    let open = places(0.008);
    let events = s.advance(&at(open[0].left_m, 1, 1), &open);
    assert_eq!(events, [Some(SuturingEvent::LeftTaken(0)), Some(SuturingEvent::LeftReleased(0))]);
    assert_eq!(s.stage(), Stage::LeftTaken);
}

#[test]
fn a_button_held_at_start_is_no_press() {
    let mut s = Suturing::new(1, 0.003);
    let open = places(0.008);
    assert_eq!(s.advance(&at(open[0].left_m, 5, 4), &open), [None, None]);
}

#[test]
fn tie_is_refused_with_the_gap_open() {
    let mut s = started(1);
    let open = &places(0.008)[..1];
    assert!(s.tie(open).is_err());
    s.advance(&at(open[0].left_m, 1, 1), open);
    s.advance(&at(open[0].right_m, 2, 1), open);
    assert!(s.tie(open).is_err());
    assert_eq!(s.tie(&places(0.003)[..1]), Ok(SuturingEvent::Tied(0)));
    assert_eq!(s.stage(), Stage::Done);
}

#[test]
fn a_tied_point_can_be_dragged() {
    let mut s = started(1);
    let closed = &places(0.003)[..1];
    s.advance(&at(closed[0].left_m, 1, 1), closed);
    s.advance(&at(closed[0].right_m, 2, 2), closed);
    assert_eq!(s.stage(), Stage::Done);
    let events = s.advance(&at(closed[0].right_m, 3, 2), closed);
    assert_eq!(events[0], Some(SuturingEvent::DragBegun(0, Side::Right)));
    assert_eq!(s.advance(&at(closed[0].right_m, 3, 3), closed)[0], Some(SuturingEvent::DragEnded(0)));
}

#[test]
fn a_hand_that_was_down_released_before_it_pressed_again() {
    let mut s = started(2);
    let open = places(0.008);
    s.advance(&at(open[0].left_m, 1, 0), &open);
    // A late step sees the release and the press on the partner at once.
    let events = s.advance(&at(open[0].right_m, 2, 1), &open);
    assert_eq!(events, [Some(SuturingEvent::LeftReleased(0)), Some(SuturingEvent::LineTaken(0))]);
    assert_eq!(s.stage(), Stage::LinePulled);
}
