//! `scene_from_device`: the rigid transform between a haptic device's frame and the scene's.
//!
//! OpenHaptics frame: +x right, +y up, +z to the user. Scene frame: x right, y away from the user,
//! z up. So `x_s = x_d`, `y_s = −z_d`, `z_s = y_d`, and a translation that puts the middle of the
//! device's workspace (the origin of the OpenHaptics frame) on a point of the scene. Metres.
//! Deliberately absent: scale. A millimetre of the hand is a millimetre of the tissue, so that forces,
//! energies and stiffnesses need no conversion.

use sim_core::vector::{Mat3, Vec3};

/// A rigid transform from the device's frame to the scene's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneFromDevice {
    rotation: Mat3,
    translation_m: Vec3,
}

impl SceneFromDevice {
    /// The device stands in front of the scene and the middle of its workspace lies at `centre_m`.
    #[must_use]
    pub fn workspace_at(centre_m: Vec3) -> Self {
        let rotation = Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
        Self { rotation, translation_m: centre_m }
    }

    /// A point of the device in the scene, metres.
    #[must_use]
    pub fn point(&self, device_m: Vec3) -> Vec3 {
        self.rotation * device_m + self.translation_m
    }

    /// A point of the scene in the device's frame, metres.
    #[must_use]
    pub fn inverse_point(&self, scene_m: Vec3) -> Vec3 {
        self.rotation.transpose() * (scene_m - self.translation_m)
    }

    /// A force, velocity or direction of the scene in the device's frame.
    #[must_use]
    pub fn inverse_vector(&self, scene: Vec3) -> Vec3 {
        self.rotation.transpose() * scene
    }

    /// An orientation of the device as scene quaternion (x, y, z, w) of unit length.
    #[must_use]
    pub fn orientation(&self, device_from_stylus: &Mat3) -> [f64; 4] {
        let turn = nalgebra::Rotation3::from_matrix_unchecked(self.rotation * device_from_stylus);
        let q = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
        [q.i, q.j, q.k, q.w]
    }

    /// The rotation alone, for reports.
    #[must_use]
    pub fn rotation(&self) -> Mat3 {
        self.rotation
    }

    /// Where the middle of the device's workspace lies in the scene, metres.
    #[must_use]
    pub fn translation_m(&self) -> Vec3 {
        self.translation_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_the_stated_ones_and_stay_right_handed() {
        let frame = SceneFromDevice::workspace_at(Vec3::new(0.1, 0.2, 0.3));
        let turned = |v: Vec3| frame.point(v) - frame.point(Vec3::zeros());
        assert_eq!(turned(Vec3::x()), Vec3::x(), "right stays right");
        assert_eq!(turned(Vec3::y()), Vec3::z(), "up is z");
        assert_eq!(turned(Vec3::z()), -Vec3::y(), "to the user is against y");
        assert_eq!(frame.rotation().determinant(), 1.0);
    }

    #[test]
    fn points_vectors_and_orientations_go_there_and_back() {
        let frame = SceneFromDevice::workspace_at(Vec3::new(0.1, 0.2, 0.3));
        let p = Vec3::new(0.01, -0.02, 0.03);
        assert!((frame.inverse_point(frame.point(p)) - p).amax() < 1e-16);
        assert_eq!(frame.inverse_vector(Vec3::z()), Vec3::y());
        let q = frame.orientation(&Mat3::identity());
        assert!((q.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-12);
        let back = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]));
        assert!((back * Vec3::y() - Vec3::z()).amax() < 1e-12);
    }
}
