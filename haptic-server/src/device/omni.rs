//! Exact kinematics of the PHANTOM Omni (and Touch): joint angles ↔ gimbal centre.
//!
//! Device frame (OpenHaptics): +x right, +y up, +z to the user; metres and radians.
//! `r = L₁ cos θ₂ + L₂ sin θ₃`, `p = (−r sin θ₁, c_y − L₂ cos θ₃ + L₁ sin θ₂, r cos θ₁ − c_z)`;
//! θ₃ is absolute (forearm against the vertical), not relative to the upper arm.
//! `R = Ry(−θ₁) Rx(−θ₃) Ry(γ₁) Rx(−γ₂) Rz(−γ₃)`; joint torque = `Jᵀ F`.
//! The constants were fitted to a device's own joint angles and positions and checked against the
//! recordings of the tests. Deliberately absent: joint limits, the tip (39 mm along −z of the stylus).

use sim_core::vector::{Mat3, Vec3};

/// Length of the upper arm and of the forearm, metres.
pub const LINK_LENGTH_M: f64 = 0.133_35;
/// Height of the shoulder above the frame's origin, metres.
const SHOULDER_HEIGHT_M: f64 = 0.023_35;
/// Distance of the shoulder behind the frame's origin, metres.
const SHOULDER_DEPTH_M: f64 = 0.168_35;
/// Largest distance of the gimbal centre from the shoulder, metres.
const REACH_M: f64 = 2.0 * LINK_LENGTH_M;

/// Gimbal centre for the joint angles (θ₁, θ₂, θ₃).
#[must_use]
pub fn forward(joints: Vec3) -> Vec3 {
    let (s1, c1) = joints.x.sin_cos();
    let (s2, c2) = joints.y.sin_cos();
    let (s3, c3) = joints.z.sin_cos();
    let r = LINK_LENGTH_M * (c2 + s3);
    Vec3::new(-r * s1, SHOULDER_HEIGHT_M - LINK_LENGTH_M * c3 + LINK_LENGTH_M * s2, r * c1 - SHOULDER_DEPTH_M)
}

/// Joint angles that put the gimbal centre at `position_m`; a point out of reach is first brought to
/// the sphere of full reach (the arm is then stretched towards it).
#[must_use]
pub fn inverse(position_m: Vec3) -> Vec3 {
    let shoulder = Vec3::new(0.0, SHOULDER_HEIGHT_M, -SHOULDER_DEPTH_M);
    let mut arm = position_m - shoulder;
    let distance = arm.norm();
    if distance > REACH_M {
        arm *= REACH_M / distance;
    }
    let r = arm.x.hypot(arm.z);
    let h = arm.y;
    let l = LINK_LENGTH_M;
    let d = ((r * r + h * h - 2.0 * l * l) / (2.0 * l * l)).clamp(-1.0, 1.0).asin();
    let a = l + l * d.sin();
    let b = l * d.cos();
    let t2 = (h * a + r * b).atan2(r * a - h * b);
    Vec3::new((-arm.x).atan2(arm.z), t2, t2 + d)
}

/// `∂p/∂θ`, metres per radian; `det = −L₁ L₂ r cos(θ₂ − θ₃)`.
#[must_use]
pub fn jacobian(joints: Vec3) -> Mat3 {
    let (s1, c1) = joints.x.sin_cos();
    let (s2, c2) = joints.y.sin_cos();
    let (s3, c3) = joints.z.sin_cos();
    let l = LINK_LENGTH_M;
    let r = l * (c2 + s3);
    Mat3::new(-r * c1, l * s1 * s2, -l * s1 * c3, 0.0, l * c2, l * s3, -r * s1, -l * c1 * s2, l * c1 * c3)
}

/// Joint torques `Jᵀ F` (newton metres) that render the force at the gimbal centre.
#[must_use]
pub fn joint_torque(joints: Vec3, force_n: Vec3) -> Vec3 {
    jacobian(joints).transpose() * force_n
}

/// `device_from_stylus` for joint and gimbal angles; the stylus' tip lies along its −z.
#[must_use]
pub fn stylus_rotation(joints: Vec3, gimbal: Vec3) -> Mat3 {
    turn_y(-joints.x) * turn_x(-joints.z) * turn_y(gimbal.x) * turn_x(-gimbal.y) * turn_z(-gimbal.z)
}

fn turn_x(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    Mat3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

fn turn_y(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    Mat3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

fn turn_z(angle: f64) -> Mat3 {
    let (s, c) = angle.sin_cos();
    Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::encoder;
    use proptest::prelude::*;

    /// Computed reference vectors carry nine decimals of a millimetre.
    const COMPUTED_M: f64 = 1e-12;
    /// A device's own float32 angles and positions agree with the nominal lengths to 2.7e-6 mm in the median.
    const RECORDED_M: f64 = 3e-9;

    #[test]
    fn reference_positions_hold() {
        let cases = [
            (Vec3::zeros(), Vec3::new(0.0, -110.0, -35.0), COMPUTED_M),
            (Vec3::new(0.3, 0.7, 0.2), Vec3::new(-37.969_695_345, -21.435_449_562, -45.604_297_250), COMPUTED_M),
            (Vec3::new(0.0, 0.268_889_55, -0.370_812_89), Vec3::new(0.0, -65.510_711_67, -88.114_196_78), RECORDED_M),
        ];
        for (joints, millimetres, tolerance_m) in cases {
            assert!((forward(joints) - millimetres * 1e-3).amax() < tolerance_m, "{joints} → {}", forward(joints));
            assert!((inverse(forward(joints)) - joints).amax() < 1e-12, "the inverse undoes the forward map");
        }
    }

    #[test]
    fn reference_rotation_torque_and_jacobian_hold() {
        let joints = Vec3::new(0.3, 0.7, 0.2);
        let columns = Mat3::from_columns(&[
            Vec3::new(0.810_394_88, -0.585_092_035, -0.030_454_043),
            Vec3::new(0.575_560_849, 0.785_324_895, 0.228_023_065),
            Vec3::new(-0.109_498_161, -0.202_316_879, 0.973_179_343),
        ]);
        assert!((stylus_rotation(joints, Vec3::new(0.2, -0.4, 0.6)) - columns).amax() < 1e-8);
        let torque = joint_torque(joints, Vec3::new(1.0, 2.0, 3.0)) * 1e3;
        let expected = Vec3::new(-236.654_788_784, -16.838_140_776, 388.927_179_784);
        assert!((torque - expected).amax() < 1e-8, "{torque}");
        let neutral = Mat3::from_diagonal(&Vec3::new(-0.133_35, 0.133_35, 0.133_35));
        assert!((jacobian(Vec3::zeros()) - neutral).amax() < 1e-15);
    }

    #[test]
    fn a_point_out_of_reach_stretches_the_arm_towards_it() {
        let far = Vec3::new(1.0, 2.0, 3.0);
        let shoulder = Vec3::new(0.0, SHOULDER_HEIGHT_M, -SHOULDER_DEPTH_M);
        let reached = forward(inverse(far)) - shoulder;
        assert!((reached.norm() - REACH_M).abs() < 1e-9);
        assert!(reached.normalize().dot(&(far - shoulder).normalize()) > 1.0 - 1e-9);
    }

    #[test]
    fn a_recorded_touch_device_agrees() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/traces/touch_freehand_100hz.csv");
        let Ok(mut reader) = csv::Reader::from_path(path) else {
            println!("skipped: {path} is missing");
            return;
        };
        let mut errors_mm: Vec<f64> = reader
            .records()
            .map(|row| {
                let row = row.expect("the recording is well formed");
                let n = |i: usize| row[i].parse::<f64>().expect("a number");
                let joints = encoder::round_joints(Vec3::new(n(4), n(5), n(6)));
                (forward(joints) * 1e3 - Vec3::new(n(1), n(2), n(3))).norm()
            })
            .collect();
        errors_mm.sort_by(f64::total_cmp);
        let median = errors_mm[errors_mm.len() / 2];
        println!("median {median:e} mm over {} samples", errors_mm.len());
        // The file prints angles to 1e-6 rad, which is 1e-4 mm: the counts behind them are exact.
        assert!(median < 1e-5, "median {median} mm");
    }

    proptest! {
        #[test]
        fn jacobian_matches_finite_differences(t1 in -0.9..0.9, t2 in 0.1..1.1, t3 in -0.4..0.9) {
            let joints = Vec3::new(t1, t2, t3);
            let step = 1e-6;
            for axis in 0..3 {
                let mut up = joints;
                let mut down = joints;
                up[axis] += step;
                down[axis] -= step;
                let column = (forward(up) - forward(down)) / (2.0 * step);
                prop_assert!((column - jacobian(joints).column(axis)).amax() < 1e-9);
            }
            let r = LINK_LENGTH_M * (t2.cos() + t3.sin());
            let det = -LINK_LENGTH_M * LINK_LENGTH_M * r * (t2 - t3).cos();
            prop_assert!((jacobian(joints).determinant() - det).abs() < 1e-15);
            prop_assert!((inverse(forward(joints)) - joints).amax() < 1e-12);
        }
    }
}
