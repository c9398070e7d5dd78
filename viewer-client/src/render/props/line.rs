//! The suture line as round tubes: tied stitches with their knots, the way from stitch to stitch, the pair in work, and
//! the free part up to the needle.

use super::points::{path_length, rows_of_scene};
use super::{Finish, Props, linear, single};
use crate::feed::View;
use crate::render::solids::Shape;
use nalgebra::{Matrix3, Vector3};

/// Polypropylene blue.
const BLUE: [f32; 3] = [0.10, 0.23, 0.66];
/// Parts of a piece between two reported points.
const PARTS: u16 = 4;
/// How often the bends of the free part are evened out.
const EVENED: usize = 24;

pub(super) fn lay(props: &mut Props, view: &View, work: Option<usize>, needle_m: Option<Vector3<f32>>, radius_m: f32) {
    let Some(report) = &view.report else { return };
    let line = report.line_m.get(..report.line_point_count as usize).unwrap_or(&report.line_m);
    let path = path_length(report);
    // A suture point on the surface, or what the wire says when there is none.
    let point = |props: &Props, pair: Option<usize>, side: usize, said: [f64; 3]| {
        pair.and_then(|p| props.pairs.get(p)?[side]).unwrap_or_else(|| single(said))
    };
    // Where the line last came out of the tissue.
    let mut out = None;
    for row in rows_of_scene(report) {
        let pair = Some(row.pair as usize);
        let left = point(props, pair, 0, row.left_current_m);
        let right = point(props, pair, 1, row.right_current_m);
        if let Some(before) = out {
            over(props, before, left, radius_m);
        }
        stitch(props, left, right, radius_m);
        out = Some(right);
    }
    let in_work = line.get(..path).unwrap_or(&[]).get(2 * rows_of_scene(report).count()..).unwrap_or(&[]);
    if let Some(left) = in_work.first().map(|said| point(props, work, 0, *said)) {
        if let Some(before) = out {
            over(props, before, left, radius_m);
        }
        out = Some(left);
        if let Some(right) = in_work.get(1).map(|said| point(props, work, 1, *said)) {
            under(props, left, right, radius_m);
            out = Some(right);
        }
    }
    free(props, line.get(path.saturating_sub(1)..).unwrap_or(&[]), [out, needle_m], radius_m);
}

/// A tied stitch: over the wound, down on both sides, a knot with two short ends.
fn stitch(props: &mut Props, left: Vector3<f32>, right: Vector3<f32>, radius_m: f32) {
    let across = right - left;
    let rise_m = 0.10 * across.norm() + 1.8 * radius_m;
    let at = |share: f32| {
        let up = rise_m * (4.0 * share * (1.0 - share)).sqrt() - 1.5 * radius_m * (2.0 * share - 1.0).abs();
        left + across * share + Vector3::z() * up
    };
    props.curve.clear();
    props.curve.extend((0..=16).map(|k| at(k as f32 / 16.0)));
    tube(props, radius_m);
    let knot = at(0.3);
    let u = across.try_normalize(1.0e-9).unwrap_or_else(Vector3::x);
    let v = Vector3::z().cross(&u);
    let finish = Finish { colour: BLUE, gloss: 0.32, sharpness: 40.0, glow: 0.0 };
    for (along, aside) in [(0.9, 0.5), (-0.9, -0.4), (0.0, 0.0)] {
        let shift = u * (along * radius_m) + v * (aside * radius_m) + Vector3::z() * (0.7 * radius_m);
        props.add(Shape::Ball, &(Matrix3::identity() * (1.75 * radius_m)), knot + shift, finish);
    }
    for (along, aside) in [(0.5, 1.0), (-0.9, 0.8)] {
        let way = (u * along + v * aside) * (9.0 * radius_m);
        props.curve.clear();
        props.curve.extend((0..=6).map(|k| {
            let share = k as f32 / 6.0;
            knot + way * share + Vector3::z() * (radius_m * (0.8 + 3.6 * share - 2.0 * share * share))
        }));
        tube(props, radius_m);
    }
}

/// From a stitch to the next, lying on the tissue.
fn over(props: &mut Props, from: Vector3<f32>, to: Vector3<f32>, radius_m: f32) {
    props.curve.clear();
    props.curve.extend((0..=8).map(|k| {
        let share = k as f32 / 8.0;
        from + (to - from) * share + Vector3::z() * (radius_m * (10.0 * share * (1.0 - share) - 0.6))
    }));
    tube(props, radius_m);
}

/// Through the depth of the wound from the left point to the right one.
fn under(props: &mut Props, left: Vector3<f32>, right: Vector3<f32>, radius_m: f32) {
    let deep_m = 0.22 * (right - left).norm();
    props.curve.clear();
    props.curve.extend((0..=12).map(|k| {
        let share = k as f32 / 12.0;
        left + (right - left) * share - Vector3::z() * (deep_m * (4.0 * share * (1.0 - share)).sqrt())
    }));
    tube(props, radius_m);
}

/// The part that hangs free, up to where the needle holds it. Follow the Leader folds what is slack into sharp bends; a
/// thread is too stiff for them, so they are evened out, and the rest is drawn as a curve (Catmull and Rom 1974).
fn free(props: &mut Props, points: &[[f64; 3]], ends: [Option<Vector3<f32>>; 2], radius_m: f32) {
    let Props { curve, bends, .. } = props;
    bends.clear();
    bends.extend(points.iter().map(|p| single(*p)).filter(|p| p.iter().all(|c| c.is_finite())));
    if let (Some(end), Some(held)) = (bends.last_mut(), ends[1]) {
        *end = held;
    }
    if let (Some(end), Some(held)) = (bends.first_mut(), ends[0]) {
        *end = held;
    }
    even(bends);
    spread(bends, curve);
    even(bends);
    let Some(last) = bends.len().checked_sub(1) else { return };
    curve.clear();
    for i in 0..last {
        let at = |i: usize| bends[i.min(last)];
        let [before, from, to, after] = [at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2)];
        for part in 0..PARTS {
            let t = f32::from(part) / f32::from(PARTS);
            let bent = from * 2.0
                + (to - before) * t
                + (before * 2.0 - from * 5.0 + to * 4.0 - after) * (t * t)
                + (from * 3.0 - before - to * 3.0 + after) * (t * t * t);
            curve.push(bent * 0.5);
        }
    }
    curve.push(bends[last]);
    tube(props, radius_m);
}

/// Moves every point but the ends towards the middle of its neighbours.
fn even(points: &mut [Vector3<f32>]) {
    for _ in 0..EVENED {
        for i in 1..points.len().saturating_sub(1) {
            points[i] = points[i] * 0.5 + (points[i - 1] + points[i + 1]) * 0.25;
        }
    }
}

/// Moves the points along their own line until they are equally far apart; `copy` is memory to work in.
fn spread(points: &mut [Vector3<f32>], copy: &mut Vec<Vector3<f32>>) {
    copy.clear();
    copy.extend_from_slice(points);
    let Some(last) = points.len().checked_sub(1).filter(|last| *last > 0) else { return };
    let whole_m: f32 = copy.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let (mut from, mut before_m) = (0, 0.0);
    for (i, point) in points.iter_mut().enumerate().take(last).skip(1) {
        let wanted_m = whole_m * i as f32 / last as f32;
        while from + 1 < last && before_m + (copy[from + 1] - copy[from]).norm() < wanted_m {
            before_m += (copy[from + 1] - copy[from]).norm();
            from += 1;
        }
        let side = copy[from + 1] - copy[from];
        let share = ((wanted_m - before_m) / side.norm().max(1.0e-9)).clamp(0.0, 1.0);
        *point = copy[from] + side * share;
    }
}

/// Makes the pieces of the curve.
fn tube(props: &mut Props, radius_m: f32) {
    let near = |a: &mut Vector3<f32>, b: &mut Vector3<f32>| (*a - *b).norm() < 0.05 * radius_m;
    props.curve.retain(|p| p.iter().all(|c| c.is_finite()));
    props.curve.dedup_by(near);
    let curve = &props.curve;
    let Some(last) = curve.len().checked_sub(1).filter(|last| *last > 0) else { return };
    let direction = |i: usize| {
        let change = curve[(i + 1).min(last)] - curve[i.saturating_sub(1)];
        change.try_normalize(1.0e-12).unwrap_or_else(Vector3::x)
    };
    let [r, g, b] = linear(BLUE);
    let mut length_m = 0.0;
    for i in 0..last {
        let (from, to) = (curve[i], curve[i + 1]);
        let before_m = length_m;
        length_m += (to - from).norm();
        let end = |p: Vector3<f32>, w: f32| [p.x, p.y, p.z, w];
        let ends =
            [end(from, radius_m), end(to, radius_m), end(direction(i), before_m), end(direction(i + 1), length_m)];
        let mut piece = [0.0; 20];
        piece.iter_mut().zip(ends.iter().flatten().chain(&[r, g, b, 0.0])).for_each(|(to, from)| *to = *from);
        props.pieces.push(piece);
    }
}
