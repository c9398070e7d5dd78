//! What the Omni's encoders leave of a position: joint angles are whole counts.
//!
//! One count of joint `i` is `2π·Rᵢ/2048` (reduction `Rᵢ`): 0.41120, 0.40803 and 0.40749 mrad, counted
//! from θ = 0; in the middle of the workspace 0.05–0.08 mm per axis. The reductions were fitted to a
//! Touch recording of 2,743 samples: with these three numbers its angles are whole counts to 1e-8 rad.
//! A position is measured by inverse kinematics, rounding, forward kinematics. Metres, radians, device frame.
//! Deliberately absent: interpolation between counts, non-atomic reads of the three joints.

use crate::device::omni;
use sim_core::vector::Vec3;

/// Gear reduction of each joint.
const REDUCTION: [f64; 3] = [0.134_03, 0.132_996, 0.132_82];
/// Counts of one encoder turn.
const COUNTS_PER_TURN: f64 = 2048.0;
/// Encoder step of each joint, radians.
pub const STEP_RAD: [f64; 3] = [
    std::f64::consts::TAU * REDUCTION[0] / COUNTS_PER_TURN,
    std::f64::consts::TAU * REDUCTION[1] / COUNTS_PER_TURN,
    std::f64::consts::TAU * REDUCTION[2] / COUNTS_PER_TURN,
];

/// Joint angles rounded to whole counts.
#[must_use]
pub fn round_joints(joints: Vec3) -> Vec3 {
    Vec3::from_fn(|i, _| (joints[i] / STEP_RAD[i]).round() * STEP_RAD[i])
}

/// What the device reports when its gimbal centre is at `position_m`: rounded joints and their position.
#[must_use]
pub fn measure(position_m: Vec3) -> Measurement {
    let joints = round_joints(omni::inverse(position_m));
    Measurement { joints, position_m: omni::forward(joints) }
}

/// Encoder reading and the position computed from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Joint angles, radians, whole counts.
    pub joints: Vec3,
    /// Gimbal centre of these angles, metres, device frame.
    pub position_m: Vec3,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_steps_are_the_published_ones() {
        for (step, published_mrad) in STEP_RAD.into_iter().zip([0.411_20, 0.408_03, 0.407_49]) {
            assert!((step * 1e3 - published_mrad).abs() < 5e-6, "published with five decimals: {step}");
        }
    }

    #[test]
    fn one_count_moves_the_middle_of_the_workspace_by_the_known_step() {
        let joints = round_joints(omni::inverse(Vec3::zeros()));
        for (axis, step) in STEP_RAD.into_iter().enumerate() {
            let mut next = joints;
            next[axis] += step;
            let moved_mm = (omni::forward(next) - omni::forward(joints)).norm() * 1e3;
            let expected_mm = omni::jacobian(joints).column(axis).norm() * step * 1e3;
            // Curvature over one count: L·step²/2 ≈ 1e-5 mm.
            assert!((moved_mm - expected_mm).abs() < 2e-5, "joint {axis}: {moved_mm} against {expected_mm}");
            assert!((0.05..0.085).contains(&moved_mm), "joint {axis} steps {moved_mm} mm");
        }
    }

    #[test]
    fn a_slow_sweep_shows_steps_not_a_line() {
        let mut distinct = 1;
        let mut last = measure(Vec3::zeros()).position_m;
        for i in 1..=1000 {
            let now = measure(Vec3::new(f64::from(i) * 1e-6, 0.0, 0.0)).position_m;
            distinct += usize::from(now != last);
            last = now;
        }
        // 1 mm of x at 168 mm from the axis is 5.94 mrad: 14.4 counts of the first joint, and few of the others.
        assert!((14..=20).contains(&distinct), "{distinct} distinct positions over 1 mm");
    }

    proptest! {
        #[test]
        fn rounding_errs_by_half_a_count_at_most_and_only_once(x in -0.08..0.08, y in -0.06..0.06, z in -0.035..0.035) {
            let position = Vec3::new(x, y, z);
            let measured = measure(position);
            let exact = omni::inverse(position);
            for (i, step) in STEP_RAD.into_iter().enumerate() {
                prop_assert!((measured.joints[i] - exact[i]).abs() <= 0.5 * step * (1.0 + 1e-9));
            }
            prop_assert!((measured.position_m - position).norm() < 1e-4);
            prop_assert!((measure(measured.position_m).position_m - measured.position_m).norm() < 1e-12);
        }
    }
}
