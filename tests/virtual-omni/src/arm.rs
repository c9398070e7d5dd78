//! The arm: what encoders, kinematics and motors make of a position and a force. Device frame.
//!
//! Joints are whole counts (0.41120, 0.40803, 0.40749 mrad), the gimbal has steps of 1.27837 mrad. An arm that has
//! not been calibrated counts from a wrong zero: every joint angle is off by a constant, and the position jumps when
//! that is mended. Motors: torque τ = Jᵀ F, rounded to DAC steps of 0.43 mN·m (12 bits for 3.3 N at full reach; the
//! real scale is not public), so the force that arrives is J⁻ᵀ τ. Inside metres and newtons, outside millimetres.

use haptic_server::device::{encoder, omni};
use sim_core::vector::{Mat3, Vec3};

/// Joint angles of a stylus that stands in the inkwell, radians.
pub const INKWELL_JOINTS_RAD: [f64; 3] = [0.0, 0.268_889_55, -0.370_812_89];
/// Gimbal angles of a held stylus, radians: tip down and forward.
pub(crate) const HELD_GIMBAL_RAD: [f64; 3] = [0.0, 0.8, 0.0];
/// Step of a gimbal angle, radians.
const GIMBAL_STEP_RAD: f64 = 1.278_37e-3;
/// Torque of one DAC step, newton metres.
pub const TORQUE_STEP_NM: f64 = 3.3 * 2.0 * omni::LINK_LENGTH_M / 2047.0;
/// Zero error of the joints before calibration, radians: some tens of millimetres at the stylus.
pub(crate) const UNCALIBRATED_RAD: [f64; 3] = [0.06, -0.04, 0.05];
/// Below this determinant of J (m³) the arm is stretched or folded; full reach times a hundredth of a radian.
const SINGULAR_M3: f64 = 2e-5;

/// What the arm's sensors say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    /// Joint angles, radians.
    pub(crate) joints: Vec3,
    /// Gimbal angles, radians.
    pub(crate) gimbal: Vec3,
    /// Counts of joints and gimbal.
    pub(crate) counts: [i64; 6],
    /// Gimbal centre, metres.
    pub(crate) position_m: Vec3,
}

/// Reads an arm whose gimbal centre is at `position_m`, with `zero_error` on its joints.
pub(crate) fn read(position_m: Vec3, gimbal: Vec3, zero_error: Vec3) -> Reading {
    let joints = encoder::round_joints(omni::inverse(position_m) + zero_error);
    let gimbal = gimbal.map(|angle| (angle / GIMBAL_STEP_RAD).round() * GIMBAL_STEP_RAD);
    let mut counts = [0; 6];
    for i in 0..3 {
        counts[i] = (joints[i] / encoder::STEP_RAD[i]).round() as i64;
        counts[i + 3] = (gimbal[i] / GIMBAL_STEP_RAD).round() as i64;
    }
    Reading { joints, gimbal, counts, position_m: omni::forward(joints) }
}

/// Position of a stylus in the inkwell, metres.
pub(crate) fn inkwell_m() -> Vec3 {
    omni::forward(Vec3::from(INKWELL_JOINTS_RAD))
}

impl Reading {
    /// Position, millimetres.
    pub(crate) fn position_mm(&self) -> Vec3 {
        self.position_m * 1e3
    }

    /// Rotation and position (millimetres), column by column.
    pub(crate) fn transform(&self) -> [f64; 16] {
        let rotation = omni::stylus_rotation(self.joints, self.gimbal);
        let mut out = [0.0; 16];
        for column in 0..3 {
            for row in 0..3 {
                out[4 * column + row] = rotation[(row, column)];
            }
        }
        out[12..15].copy_from_slice(self.position_mm().as_slice());
        out[15] = 1.0;
        out
    }

    /// ∂p/∂θ, millimetres per radian, row by row.
    pub(crate) fn jacobian(&self) -> [f64; 9] {
        let j = omni::jacobian(self.joints) * 1e3;
        std::array::from_fn(|i| j[(i / 3, i % 3)])
    }

    /// The torque that the DACs give for a wanted one, newton metres.
    pub(crate) fn dac(torque: Vec3) -> Vec3 {
        torque.map(|t| (t / TORQUE_STEP_NM).round() * TORQUE_STEP_NM)
    }

    /// Joint torque of a force, newton metres.
    pub(crate) fn torque(&self, force_n: Vec3) -> Vec3 {
        omni::joint_torque(self.joints, force_n)
    }

    /// The force at the stylus of a joint torque; `None` where the arm is singular.
    pub(crate) fn force(&self, torque: Vec3) -> Option<Vec3> {
        let transposed: Mat3 = omni::jacobian(self.joints).transpose();
        if transposed.determinant().abs() < SINGULAR_M3 {
            return None;
        }
        transposed.try_inverse().map(|inverse| inverse * torque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Reference vectors carry nine decimals of a millimetre.
    const PRINTED_MM: f64 = 1e-6;

    fn reading(joints: [f64; 3], gimbal: [f64; 3]) -> Reading {
        let joints = Vec3::from(joints);
        Reading { joints, gimbal: Vec3::from(gimbal), counts: [0; 6], position_m: omni::forward(joints) }
    }

    #[test]
    fn the_reference_poses_come_out_in_the_interface_s_layout() {
        let neutral = reading([0.0; 3], [0.0; 3]);
        assert!((neutral.position_mm() - Vec3::new(0.0, -110.0, -35.0)).amax() < PRINTED_MM);
        let inkwell = inkwell_m() * 1e3;
        // Its joint angles are printed to 5e-9 rad, which is 1.3e-6 mm at two arms of 133 mm.
        assert!((inkwell - Vec3::new(0.0, -65.510_711, -88.114_197)).amax() < 2.0 * PRINTED_MM, "{inkwell}");
        let posed = reading([0.3, 0.7, 0.2], [0.2, -0.4, 0.6]);
        let expected = [
            0.810_394_88,
            -0.585_092_035,
            -0.030_454_043,
            0.0,
            0.575_560_849,
            0.785_324_895,
            0.228_023_065,
            0.0,
            -0.109_498_161,
            -0.202_316_879,
            0.973_179_343,
            0.0,
            -37.969_695_345,
            -21.435_449_562,
            -45.604_297_250,
            1.0,
        ];
        for (i, (got, wanted)) in posed.transform().into_iter().zip(expected).enumerate() {
            assert!((got - wanted).abs() < PRINTED_MM, "element {i}: {got} against {wanted}");
        }
        let torque = posed.torque(Vec3::new(1.0, 2.0, 3.0)) * 1e3;
        assert!((torque - Vec3::new(-236.654_788_784, -16.838_140_776, 388.927_179_784)).amax() < PRINTED_MM);
    }

    #[test]
    fn an_arm_that_is_not_calibrated_is_off_until_it_is() {
        let place = Vec3::new(0.01, 0.02, 0.0);
        let before = read(place, Vec3::zeros(), Vec3::from(UNCALIBRATED_RAD));
        let after = read(place, Vec3::zeros(), Vec3::zeros());
        assert!((after.position_m - place).norm() < 1e-4, "half a count of each joint");
        assert!((before.position_m - place).norm() > 5e-3, "the jump is one that the servo would refuse");
    }

    proptest! {
        #[test]
        fn a_force_arrives_within_half_a_dac_step(x in -0.07..0.07, y in -0.05..0.05, z in -0.03..0.03,
                                                   fx in -3.0..3.0, fy in -3.0..3.0, fz in -3.0..3.0) {
            let arm = read(Vec3::new(x, y, z), Vec3::zeros(), Vec3::zeros());
            let force = Vec3::new(fx, fy, fz);
            let arrived = arm.force(Reading::dac(arm.torque(force))).expect("the workspace has no singular pose");
            prop_assert!((arm.torque(arrived - force)).amax() <= 0.5 * TORQUE_STEP_NM * (1.0 + 1e-9));
            // The worst lever of the workspace is 0.08 m: half a step of three motors is below 10 mN.
            prop_assert!((arrived - force).norm() < 0.01);
        }

        #[test]
        fn the_jacobian_is_the_slope_of_the_position(t1 in -0.9..0.9, t2 in 0.1..1.1, t3 in -0.4..0.9) {
            let arm = reading([t1, t2, t3], [0.0; 3]);
            let step = 1e-6;
            for column in 0..3 {
                let mut moved = [t1, t2, t3];
                moved[column] += step;
                let slope = (reading(moved, [0.0; 3]).position_mm() - arm.position_mm()) / step;
                for row in 0..3 {
                    prop_assert!((slope[row] - arm.jacobian()[3 * row + column]).abs() < 1e-3);
                }
            }
        }

        #[test]
        fn neighbouring_counts_are_one_step_apart(x in -0.07..0.07, y in -0.05..0.05, z in -0.03..0.03) {
            let arm = read(Vec3::new(x, y, z), Vec3::zeros(), Vec3::zeros());
            for i in 0..3 {
                prop_assert!((arm.joints[i] - arm.counts[i] as f64 * encoder::STEP_RAD[i]).abs() < 1e-12);
            }
        }
    }
}
