//! An orbit camera: target, two angles, distance; z is up, the wound lies along y.
//!
//! View: right = (−sin α, cos α, 0), forward = −(cos ε cos α, cos ε sin α, sin ε), up = right × forward, so that
//! straight down is no special case. Projection: depth 0 at the near plane, 1 at the far plane, right-handed.
//! A stereo eye stands ±s/2 beside the camera with a sheared frustum, so that the target lies in the picture plane.
//! Metres and radians, scene frame.

use nalgebra::{Matrix4, Point3, Vector3, Vector4};

/// Opening of the picture from below to above.
const FIELD_OF_VIEW_RAD: f32 = 0.6;
/// Distances to the target, metres.
const DISTANCES_M: (f32, f32) = (2.0e-3, 20.0);
/// Near and far plane, as shares of the distance.
const PLANES: (f32, f32) = (0.04, 40.0);
/// Free border that framing leaves.
const BORDER: f32 = 1.08;
/// Distance between the eyes, as a share of the distance: less than life size, which strains at this range.
const EYE_SHARE: f32 = 0.05;

/// A view that needs no mouse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum FixedView {
    /// Along the wound, level.
    Front,
    /// Across the wound from the right, level.
    Side,
    /// Straight down, the wound upright.
    Top,
    /// From the surgeon's side, obliquely.
    #[default]
    Surgeon,
}

/// Which picture of a stereo pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// The only one.
    Middle,
    /// Left half.
    Left,
    /// Right half.
    Right,
}

/// Where one looks from.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    target_m: Point3<f32>,
    azimuth_rad: f32,
    elevation_rad: f32,
    distance_m: f32,
}

impl Default for Camera {
    fn default() -> Self {
        let mut camera = Self { target_m: Point3::origin(), azimuth_rad: 0.0, elevation_rad: 0.0, distance_m: 0.12 };
        camera.fixed(FixedView::Surgeon);
        camera
    }
}

impl Camera {
    /// Turns about the target: to the right and upwards.
    pub fn orbit(&mut self, dx_rad: f32, dy_rad: f32) {
        const STRAIGHT_UP: f32 = std::f32::consts::FRAC_PI_2;
        self.azimuth_rad = (self.azimuth_rad - finite(dx_rad)).rem_euclid(std::f32::consts::TAU);
        self.elevation_rad = (self.elevation_rad + finite(dy_rad)).clamp(-STRAIGHT_UP, STRAIGHT_UP);
    }

    /// Moves the picture to the right and upwards, in picture heights.
    pub fn pan(&mut self, dx: f32, dy: f32) {
        let height_m = 2.0 * self.distance_m * (0.5 * FIELD_OF_VIEW_RAD).tan();
        self.target_m -= (self.right() * finite(dx) + self.up() * finite(dy)) * height_m;
    }

    /// Goes nearer by a factor above 1, farther by one below.
    pub fn zoom(&mut self, factor: f32) {
        if factor.is_finite() && factor > 0.0 {
            self.distance_m = (self.distance_m / factor).clamp(DISTANCES_M.0, DISTANCES_M.1);
        }
    }

    /// Turns to a fixed view; target and distance stay.
    pub fn fixed(&mut self, view: FixedView) {
        let (azimuth_deg, elevation_deg) = match view {
            FixedView::Front => (-90.0_f32, 0.0_f32),
            FixedView::Side => (0.0, 0.0),
            FixedView::Top => (-90.0, 90.0),
            FixedView::Surgeon => (-64.0, 44.0),
        };
        (self.azimuth_rad, self.elevation_rad) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    }

    /// Looks at the middle of the points from so far that all are in the picture; without a point nothing changes.
    pub fn frame_all(&mut self, points: impl Iterator<Item = [f32; 3]>, aspect: f32) {
        let axes = [self.right(), self.up(), -self.forward()];
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for point in points.filter(|p| p.iter().all(|c| c.is_finite())) {
            for (axis, along) in axes.iter().map(|a| a.dot(&Vector3::from(point))).enumerate() {
                low[axis] = low[axis].min(along);
                high[axis] = high[axis].max(along);
            }
        }
        if low[0] > high[0] {
            return;
        }
        let half = |axis: usize| 0.5 * (high[axis] - low[axis]);
        let middle: Vector3<f32> = (0..3).map(|i| axes[i] * (low[i] + half(i))).sum();
        let slope = (0.5 * FIELD_OF_VIEW_RAD).tan();
        let wide = half(0) / (slope * aspect_or_one(aspect));
        self.target_m = Point3::from(middle);
        self.distance_m = (BORDER * wide.max(half(1) / slope) + half(2)).clamp(DISTANCES_M.0, DISTANCES_M.1);
    }

    /// Scene to clip space for the only eye.
    #[must_use]
    pub fn view_projection(&self, aspect: f32) -> Matrix4<f32> {
        self.eye_view_projection(aspect, Eye::Middle)
    }

    /// Scene to clip space for one picture of a pair; `aspect` is that picture's.
    #[must_use]
    pub fn eye_view_projection(&self, aspect: f32, eye: Eye) -> Matrix4<f32> {
        let (right, up, back) = (self.right(), self.up(), -self.forward());
        let eye_m = self.eye_m(eye).coords;
        let row = |axis: Vector3<f32>| [axis.x, axis.y, axis.z, -axis.dot(&eye_m)];
        let ([a, b, c, d], [e, f, g, h], [i, j, k, l]) = (row(right), row(up), row(back));
        let view = Matrix4::new(a, b, c, d, e, f, g, h, i, j, k, l, 0.0, 0.0, 0.0, 1.0);

        let cotangent = 1.0 / (0.5 * FIELD_OF_VIEW_RAD).tan();
        let across = cotangent / aspect_or_one(aspect);
        let shear = -across * self.eye_shift_m(eye) / self.distance_m;
        let (near, far) = (PLANES.0 * self.distance_m, PLANES.1 * self.distance_m);
        let depth = far / (near - far);
        let projection = Matrix4::from_columns(&[
            Vector4::new(across, 0.0, 0.0, 0.0),
            Vector4::new(0.0, cotangent, 0.0, 0.0),
            Vector4::new(shear, 0.0, depth, -1.0),
            Vector4::new(0.0, 0.0, near * depth, 0.0),
        ]);
        projection * view
    }

    /// The line of sight through a place of the picture (x to the right, y upwards, −1 to 1): where it begins, and
    /// its direction of length 1.
    #[must_use]
    pub fn ray(&self, x_ndc: f32, y_ndc: f32, aspect: f32) -> (Point3<f32>, Vector3<f32>) {
        let slope = (0.5 * FIELD_OF_VIEW_RAD).tan();
        let across = self.right() * (x_ndc * slope * aspect_or_one(aspect));
        (self.eye_m(Eye::Middle), (self.forward() + across + self.up() * (y_ndc * slope)).normalize())
    }

    /// To the right in the picture, length 1.
    #[must_use]
    pub fn right(&self) -> Vector3<f32> {
        Vector3::new(-self.azimuth_rad.sin(), self.azimuth_rad.cos(), 0.0)
    }

    /// Upwards in the picture, length 1.
    #[must_use]
    pub fn up(&self) -> Vector3<f32> {
        self.right().cross(&self.forward())
    }

    /// Into the picture, length 1.
    #[must_use]
    pub fn forward(&self) -> Vector3<f32> {
        let (level, rise) = (self.elevation_rad.cos(), self.elevation_rad.sin());
        -Vector3::new(level * self.azimuth_rad.cos(), level * self.azimuth_rad.sin(), rise)
    }

    /// What the camera turns about.
    #[must_use]
    pub fn target_m(&self) -> Point3<f32> {
        self.target_m
    }

    /// From the eye to the target.
    #[must_use]
    pub fn distance_m(&self) -> f32 {
        self.distance_m
    }

    /// Where an eye is.
    #[must_use]
    pub fn eye_m(&self, eye: Eye) -> Point3<f32> {
        self.target_m - self.forward() * self.distance_m + self.right() * self.eye_shift_m(eye)
    }

    fn eye_shift_m(&self, eye: Eye) -> f32 {
        let half = 0.5 * EYE_SHARE * self.distance_m;
        match eye {
            Eye::Middle => 0.0,
            Eye::Left => -half,
            Eye::Right => half,
        }
    }
}

fn finite(number: f32) -> f32 {
    if number.is_finite() { number } else { 0.0 }
}

fn aspect_or_one(aspect: f32) -> f32 {
    if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Single precision, a handful of operations, numbers of size one.
    const ROUNDING: f32 = 2.0e-5;

    fn seen(camera: &Camera, point: [f32; 3], aspect: f32, eye: Eye) -> [f32; 3] {
        let clip = camera.eye_view_projection(aspect, eye) * Point3::from(point).to_homogeneous();
        [clip.x / clip.w, clip.y / clip.w, clip.z / clip.w]
    }

    fn near(a: f32, b: f32) -> bool {
        (a - b).abs() < ROUNDING
    }

    #[test]
    fn the_target_is_in_the_middle_for_every_eye_and_view() {
        for view in [FixedView::Front, FixedView::Side, FixedView::Top, FixedView::Surgeon] {
            let mut camera = Camera::default();
            camera.fixed(view);
            camera.pan(0.3, -0.2);
            let target = camera.target_m().into();
            for eye in [Eye::Middle, Eye::Left, Eye::Right] {
                let [x, y, z] = seen(&camera, target, 1.6, eye);
                assert!(near(x, 0.0) && near(y, 0.0) && (0.0..1.0).contains(&z), "{view:?} {eye:?}: {x} {y} {z}");
            }
        }
    }

    #[test]
    fn fixed_views_have_their_axes() {
        let mut camera = Camera::default();
        let axes = [(FixedView::Front, [1., 0., 0.], [0., 0., 1.]), (FixedView::Side, [0., 1., 0.], [0., 0., 1.])];
        for (view, right, up) in axes.into_iter().chain([(FixedView::Top, [1., 0., 0.], [0., 1., 0.])]) {
            camera.fixed(view);
            assert!((camera.right() - Vector3::from(right)).norm() < ROUNDING, "{view:?}");
            assert!((camera.up() - Vector3::from(up)).norm() < ROUNDING, "{view:?}");
        }
    }

    #[test]
    fn a_ray_meets_what_is_drawn_at_its_place() {
        let mut camera = Camera::default();
        camera.orbit(0.4, -0.3);
        camera.zoom(1.7);
        let point = [0.012, -0.007, 0.003];
        let [x, y, _] = seen(&camera, point, 1.5, Eye::Middle);
        let (eye, along) = camera.ray(x, y, 1.5);
        let off = (Point3::from(point) - eye).cross(&along).norm();
        assert!(off < ROUNDING * camera.distance_m(), "{off}");
    }

    #[test]
    fn framing_shows_every_point_and_wastes_little() {
        let points = [[-0.03, -0.02, 0.0], [0.03, 0.02, 0.0], [0.0, 0.0, 0.05], [0.01, -0.02, -0.004]];
        let mut camera = Camera::default();
        for aspect in [0.5, 1.0, 2.4] {
            camera.frame_all(points.into_iter(), aspect);
            let places = points.map(|p| seen(&camera, p, aspect, Eye::Middle));
            let reach = places.iter().flat_map(|p| [p[0].abs(), p[1].abs()]).fold(0.0, f32::max);
            assert!((0.6..1.0).contains(&reach), "aspect {aspect}: {reach}");
        }
        let before = camera.clone();
        camera.frame_all(std::iter::once([f32::NAN, 0.0, 0.0]), 1.0);
        assert_eq!(camera, before);
    }

    #[test]
    fn a_nearer_point_is_farther_apart_in_the_two_eyes() {
        let mut camera = Camera::default();
        camera.fixed(FixedView::Top);
        let apart = |z: f32| {
            let x = |eye| seen(&camera, [0.0, 0.0, z], 1.0, eye)[0];
            x(Eye::Left) - x(Eye::Right)
        };
        assert!(near(apart(0.0), 0.0) && apart(0.02) > 0.01 && apart(-0.02) < -0.005);
    }

    #[test]
    fn panning_moves_the_picture_by_its_height() {
        let mut camera = Camera::default();
        let point = camera.target_m().into();
        camera.pan(0.25, 0.1);
        let [x, y, _] = seen(&camera, point, 1.25, Eye::Middle);
        assert!(near(x, 2.0 * 0.25 / 1.25) && near(y, 0.2), "{x} {y}");
        camera.pan(f32::NAN, f32::INFINITY);
        camera.zoom(0.0);
        assert!(seen(&camera, point, 1.25, Eye::Middle).iter().all(|c| c.is_finite()));
    }
}
