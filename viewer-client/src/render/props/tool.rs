//! Needle holder and needle at the device's pose, the proxy at the suture point in hand, the force on the hand.

use super::points::{handles, nearest};
use super::{Finish, Props, single};
use crate::feed::View;
use crate::render::meshes::swage_m;
use crate::render::solids::Shape;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Length of the arrow for a newton, in metres at the tool's true size.
const ARROW_M_PER_N: f32 = 0.012;
/// A longer arrow leaves the picture, metres.
const LONGEST_M: f32 = 0.045;
/// A smaller force is not shown, newtons.
const LEAST_N: f32 = 0.04;

const STEEL: Finish = Finish { colour: [0.66, 0.68, 0.71], gloss: 0.95, sharpness: 120.0, glow: 0.0 };
const NEEDLE: Finish = Finish { colour: [0.78, 0.79, 0.82], gloss: 1.0, sharpness: 160.0, glow: 0.0 };
const PROXY: Finish = Finish { colour: [1.0, 0.80, 0.22], gloss: 0.5, sharpness: 70.0, glow: 0.45 };
const FORCE: Finish = Finish { colour: [1.0, 0.45, 0.08], gloss: 0.2, sharpness: 30.0, glow: 0.55 };

/// Where the line leaves each needle; none without a device.
pub(super) fn lay(props: &mut Props, view: &View, scale: f32, point_m: f32) -> Option<Vector3<f32>> {
    let mut first = None;
    let servo = view.servo.as_ref()?;
    for device in servo.devices.iter().filter(|d| d.present != 0) {
        let at_m = single(device.position_m);
        let turn = orientation(device.orientation);
        let axes = turn.to_rotation_matrix().into_inner() * scale;
        props.add(Shape::Holder, &axes, at_m, STEEL);
        props.add(Shape::Needle, &axes, at_m, NEEDLE);
        first = first.or(Some(at_m + axes * Vector3::from(swage_m())));
        arrow(props, at_m, single(device.force_n), scale, point_m);
    }
    for handle in handles(view) {
        let at_m = single(handle.position_m);
        let on_surface = props.pairs.get(handle.pair as usize).and_then(|pair| nearest(pair, at_m));
        let shown_m = on_surface.map_or(at_m, |(_, at_m)| at_m);
        props.add(Shape::Ball, &(Matrix3::identity() * (1.35 * point_m)), shown_m, PROXY);
    }
    first
}

/// The tool's axes in the scene. A device that knows no orientation holds its tool obliquely, as a hand would.
fn orientation([x, y, z, w]: [f64; 4]) -> UnitQuaternion<f32> {
    let quaternion = Quaternion::new(w as f32, x as f32, y as f32, z as f32);
    let unknown = [x, y, z].iter().all(|c| c.abs() < 1.0e-9);
    match UnitQuaternion::try_new(quaternion, 1.0e-6) {
        Some(turn) if !unknown => turn,
        _ => UnitQuaternion::face_towards(&Vector3::new(0.66, -0.30, 0.68), &Vector3::z()),
    }
}

fn arrow(props: &mut Props, at_m: Vector3<f32>, force_n: Vector3<f32>, scale: f32, point_m: f32) {
    let size_n = force_n.norm();
    if !size_n.is_finite() || size_n < LEAST_N {
        return;
    }
    let along = force_n / size_n;
    let length_m = (size_n * ARROW_M_PER_N).min(LONGEST_M) * scale;
    let head_m = (0.35 * length_m).min(5.0 * point_m);
    let aside = if along.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let u = along.cross(&aside).normalize();
    let v = along.cross(&u);
    let axes = |radius_m: f32, long_m: f32| Matrix3::from_columns(&[u * radius_m, v * radius_m, along * long_m]);
    props.add(Shape::Rod, &axes(0.45 * point_m, length_m - head_m), at_m, FORCE);
    props.add(Shape::Cone, &axes(1.1 * point_m, head_m), at_m + along * (length_m - head_m), FORCE);
}
