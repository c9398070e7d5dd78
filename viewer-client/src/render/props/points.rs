//! Suture points: which are free, in work, tied or torn out.

use super::{Finish, Props, single};
use crate::feed::View;
use crate::render::solids::Shape;
use nalgebra::{Matrix3, Vector3};
use protocol::servo_state::HandleState;
use protocol::tissue_port::HANDLE_FREE;
use protocol::wound_report::WoundReport;

/// More pairs than a hand can tie are not drawn.
const MOST_PAIRS: usize = 1024;
/// Bit of a ledger row: the stitch was pulled through the tissue.
const PULLED_THROUGH: u32 = 8;

/// State of a suture point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::render) enum PointState {
    /// Nothing has happened to it.
    Free,
    /// The line goes through it, and the stitch is not tied.
    Taken,
    /// Its stitch is tied.
    Tied,
    /// Its stitch was pulled through the tissue.
    Torn,
}

impl PointState {
    fn finish(self) -> Finish {
        let colour = match self {
            Self::Free => [0.80, 0.89, 0.98],
            Self::Taken => [0.99, 0.76, 0.16],
            Self::Tied => [0.36, 0.78, 0.42],
            Self::Torn => [0.30, 0.06, 0.08],
        };
        Finish { colour, gloss: 0.35, sharpness: 60.0, glow: 0.25 }
    }
}

/// Number of points of the reported line that are suture points: two for a tied stitch, then those in work.
pub(super) fn path_length(report: &WoundReport) -> usize {
    let in_work = match report.stage {
        1 | 2 => 1,
        3 | 4 => 2,
        _ => 0,
    };
    (2 * rows_of_scene(report).count() + in_work).min(report.line_point_count as usize)
}

/// Rows of Table 1 that belong to the scene at work.
pub(super) fn rows_of_scene(report: &WoundReport) -> impl Iterator<Item = &protocol::wound_report::LedgerRow> {
    let rows = report.rows.get(..report.row_count as usize).unwrap_or(&report.rows);
    rows.iter().filter(|row| row.scene_index == report.scene_index)
}

/// Both points of a pair on the surface, left first.
pub(super) type Pair = [Option<Vector3<f32>>; 2];

/// Where the points of every pair are on the surface. The wire's positions are those of patches, which reach inside.
pub(super) fn on_surface(view: &View, pairs: &mut Vec<Pair>) {
    pairs.clear();
    if let Some(parts) = view.outline_of_frame() {
        let place = |node: u32| view.frame.elements.get(node as usize).map(|n| Vector3::from(n.position_m));
        pairs.extend(parts.pairs.as_chunks::<2>().0.iter().take(MOST_PAIRS).map(|pair| pair.map(place)));
    }
}

/// The point of a pair that is nearest to a place: on which side of the wound, and where.
pub(super) fn nearest(pair: &Pair, at_m: Vector3<f32>) -> Option<(usize, Vector3<f32>)> {
    let sides = pair.iter().enumerate().filter_map(|(side, p)| Some((side, (*p)?)));
    sides.min_by(|(_, a), (_, b)| (a - at_m).norm().total_cmp(&(b - at_m).norm()))
}

/// State of both points of every pair; returns the pair that the line in work goes through.
pub(super) fn survey(view: &View, pairs: &[Pair], states: &mut Vec<[PointState; 2]>) -> Option<usize> {
    states.clear();
    states.resize(pairs.len(), [PointState::Free; 2]);
    let report = view.report.as_ref()?;
    let in_work: &[usize] = match report.stage {
        1 | 2 => &[0],
        3 | 4 => &[0, 1],
        _ => &[],
    };
    let path = report.line_m.get(..path_length(report)).unwrap_or(&[]);
    let left = path.len().checked_sub(in_work.len().max(1)).filter(|_| !in_work.is_empty()).map(|at| single(path[at]));
    let distance = |pair: &Pair, to: Vector3<f32>| pair[0].map_or(f32::INFINITY, |p| (p - to).norm());
    let work = left.and_then(|left| {
        (0..pairs.len()).min_by(|&i, &j| distance(&pairs[i], left).total_cmp(&distance(&pairs[j], left)))
    });
    if let Some(pair) = work {
        in_work.iter().for_each(|side| states[pair][*side] = PointState::Taken);
    }
    for row in rows_of_scene(report) {
        if let Some(state) = states.get_mut(row.pair as usize) {
            *state = [if row.flags & PULLED_THROUGH != 0 { PointState::Torn } else { PointState::Tied }; 2];
        }
    }
    for handle in handles(view) {
        let found = pairs.get(handle.pair as usize).and_then(|pair| nearest(pair, single(handle.position_m)));
        if let Some((side, _)) = found {
            states[handle.pair as usize][side] = PointState::Taken;
        }
    }
    work
}

/// Handles that move a suture point.
pub(super) fn handles(view: &View) -> impl Iterator<Item = &HandleState> {
    let servo = view.servo.iter();
    servo.flat_map(|s| s.handles.iter().take(s.handle_count as usize)).filter(|h| h.mode != HANDLE_FREE)
}

pub(super) fn lay(props: &mut Props, radius_m: f32) {
    for i in 0..props.pairs.len() {
        for (at_m, state) in props.pairs[i].into_iter().zip(props.states[i]) {
            if let Some(at_m) = at_m {
                let raised = at_m + Vector3::z() * (0.3 * radius_m);
                props.add(Shape::Ball, &(Matrix3::identity() * radius_m), raised, state.finish());
            }
        }
    }
}
