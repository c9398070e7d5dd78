//! What a view shows becomes solids, tubes and points, and nothing when it is missing.

use super::points::{Pair, PointState, path_length, survey};
use super::*;
use protocol::servo_state::ServoState;
use protocol::wire::Field;
use protocol::wound_report::{LedgerRow, WoundReport};

const LEFT: [f32; 3] = [-0.004, 0.0, 0.0];
const RIGHT: [f32; 3] = [0.004, 0.0, 0.0];

/// Three pairs, 10 mm apart.
fn pairs() -> Vec<Pair> {
    let shifted = |p: [f32; 3], i: u16| Some(Vector3::from(p) + Vector3::y() * (0.01 * f32::from(i)));
    (0..3).map(|i| [shifted(LEFT, i), shifted(RIGHT, i)]).collect()
}

fn view(stage: u32, tied: &[u32], line: &[[f32; 3]]) -> View {
    let mut report = WoundReport { stage, row_count: tied.len() as u32, ..WoundReport::EMPTY };
    for (row, pair) in report.rows.iter_mut().zip(tied) {
        *row = LedgerRow { pair: *pair, ..LedgerRow::EMPTY };
    }
    report.line_point_count = line.len() as u32;
    report.line_m.iter_mut().zip(line).for_each(|(to, from)| *to = from.map(f64::from));
    View { report: Some(Box::new(report)), ..View::default() }
}

fn states(view: &View) -> Vec<[PointState; 2]> {
    let mut states = Vec::new();
    survey(view, &pairs(), &mut states);
    states
}

#[test]
fn a_point_is_free_then_taken_then_tied() {
    use PointState::{Free, Taken, Tied};
    let beside = |y: f32| [LEFT[0], y + 0.0002, 0.0];
    assert_eq!(states(&View::default()), [[Free; 2]; 3]);
    assert_eq!(states(&view(2, &[], &[beside(0.01), [0.0, 0.0, 0.1]])), [[Free; 2], [Taken, Free], [Free; 2]]);
    let line = [LEFT, RIGHT, beside(0.02), RIGHT, [0.0, 0.0, 0.1]];
    assert_eq!(states(&view(3, &[0], &line)), [[Tied; 2], [Free; 2], [Taken; 2]]);
    // Of another scene of the procedure.
    let mut other = view(0, &[0], &[]);
    other.report.iter_mut().for_each(|r| r.scene_index = 1);
    assert_eq!(states(&other), [[Free; 2]; 3]);
}

#[test]
fn a_torn_stitch_and_a_dragged_point_show() {
    let mut view = view(0, &[1, 900], &[]);
    view.report.iter_mut().for_each(|r| r.rows[0].flags = 8);
    let mut servo = ServoState::EMPTY;
    servo.handle_count = 1;
    servo.handles[0].mode = 1;
    servo.handles[0].pair = 2;
    servo.handles[0].position_m = RIGHT.map(f64::from);
    view.servo = Some(servo);
    let states = states(&view);
    assert_eq!(states[1], [PointState::Torn; 2]);
    assert_eq!(states[2], [PointState::Free, PointState::Taken]);
}

#[test]
fn a_report_that_promises_more_than_it_has_does_no_harm() {
    for stage in 0..6 {
        for (tied, points) in [(48, 0), (48, 128), (1, 1), (3, 2), (0, 1)] {
            let rows: Vec<u32> = (0..tied).collect();
            let line = vec![[0.001, f32::NAN, 0.0]; points];
            let view = view(stage, &rows, &line);
            assert!(view.report.as_ref().is_some_and(|r| path_length(r) <= points));
            let mut props = Props::default();
            props.lay(&view, &Place::default());
            assert!(props.pieces.iter().flatten().all(|n| n.is_finite()));
        }
    }
}

#[test]
fn the_pieces_of_a_line_join_from_the_last_point_to_the_needle() {
    let mut view = view(3, &[], &[LEFT, RIGHT, [0.004, 0.0, 0.03], [0.01, 0.0, 0.05]]);
    let mut servo = ServoState::EMPTY;
    servo.devices[0].present = 1;
    servo.devices[0].position_m = [0.01, 0.0, 0.05];
    servo.devices[0].force_n = [0.0, 0.0, -1.0];
    view.servo = Some(servo);
    let mut props = Props::default();
    props.lay(&view, &Place::default());
    let breaks = props.pieces.windows(2).filter(|w| w[0][4..7] != w[1][0..3]).count();
    assert_eq!(breaks, 0, "the way through the wound ends where the free part begins");
    let end = props.pieces.last().map_or([0.0; 3], |p| [p[4], p[5], p[6]]);
    let hand = [0.01, 0.0, 0.05];
    assert!(end.iter().zip(hand).all(|(a, b)| (a - b).abs() < 0.006), "{end:?}");
    let shapes: Vec<Shape> = props.bodies.iter().map(|(shape, _)| *shape).collect();
    assert_eq!(shapes, [Shape::Holder, Shape::Needle, Shape::Rod, Shape::Cone]);
}
