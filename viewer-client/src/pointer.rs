//! The mouse as the hand: where the stylus is to go for a place of the pointer in the picture.
//!
//! The stylus stays on the plane through it that faces the camera: with the line of sight o + t d, the camera's direction f and
//! the plane's depth z, x = o + d · z/(d·f). The wheel moves the plane; over a suture point the plane goes through that
//! point by itself, since depth is what a mouse cannot show. Buttons are those of the stylus. What is sent is a wish: the
//! server limits its speed and its room. Metres. Deliberately absent: sending (`hand_thread.rs`).

use nalgebra::{Point3, Vector3};

/// The wheel moves the plane by this part of its depth per notch.
const NOTCH: f32 = 0.006;
/// A suture point nearer to the pointer than this part of the depth draws the plane to itself.
const CATCH: f32 = 0.012;

/// One of the stylus' buttons, as a bit of the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Button {
    /// Front: takes and releases.
    Front = 1,
    /// Back.
    Back = 2,
}

/// Whether a button is down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Press {
    /// Down.
    Down,
    /// Up.
    Up,
}

/// A camera as the hand needs it: eye and direction, the line of sight under the pointer.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Where the line of sight begins.
    pub origin_m: Point3<f32>,
    /// Its direction.
    pub direction: Vector3<f32>,
    /// The camera's direction, length 1.
    pub forward: Vector3<f32>,
}

impl Sight {
    fn depth_of(&self, point: &Point3<f32>) -> f32 {
        (point - self.origin_m).dot(&self.forward)
    }

    /// The point of the line of sight at this depth.
    fn at_depth(&self, depth_m: f32) -> Option<Point3<f32>> {
        let along = self.direction.dot(&self.forward);
        (along > 1e-3 && depth_m > 0.0).then(|| self.origin_m + self.direction * (depth_m / along))
    }

    /// Distance of a point from the line of sight.
    fn distance_to(&self, point: &Point3<f32>) -> f32 {
        let away = point - self.origin_m;
        let along = self.direction * (away.dot(&self.direction) / self.direction.norm_squared());
        (away - along).norm()
    }
}

/// Where the stylus is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    target_m: Point3<f32>,
    buttons: u32,
}

impl Pointer {
    /// Begins where the stylus is.
    #[must_use]
    pub fn at(stylus_m: [f64; 3]) -> Self {
        Self { target_m: Point3::from(stylus_m.map(|c| c as f32)), buttons: 0 }
    }

    /// Where the stylus is to go, metres.
    #[must_use]
    pub fn target_m(&self) -> [f64; 3] {
        self.target_m.coords.cast::<f64>().into()
    }

    /// Buttons that are down, as bits.
    #[must_use]
    pub fn buttons(&self) -> u32 {
        self.buttons
    }

    /// Follows the pointer; `catching` are suture points that draw the plane while no button is down.
    pub fn follow(&mut self, sight: &Sight, catching: impl Iterator<Item = [f32; 3]>) {
        let mut depth = sight.depth_of(&self.target_m);
        if self.buttons == 0 {
            let near = catching
                .map(Point3::from)
                .filter(|p| sight.distance_to(p) < CATCH * sight.depth_of(p))
                .min_by(|a, b| sight.distance_to(a).total_cmp(&sight.distance_to(b)));
            depth = near.map_or(depth, |p| sight.depth_of(&p));
        }
        self.go(sight, depth);
    }

    /// Moves the plane away from the eye, or towards it for negative notches.
    pub fn wheel(&mut self, sight: &Sight, notches: f32) {
        if notches.is_finite() {
            let depth = sight.depth_of(&self.target_m);
            self.go(sight, depth * (1.0 + NOTCH * notches.clamp(-20.0, 20.0)));
        }
    }

    /// A button of the stylus.
    pub fn press(&mut self, button: Button, press: Press) {
        match press {
            Press::Down => self.buttons |= button as u32,
            Press::Up => self.buttons &= !(button as u32),
        }
    }

    fn go(&mut self, sight: &Sight, depth_m: f32) {
        if let Some(target) = sight.at_depth(depth_m).filter(|p| p.coords.iter().all(|c| c.is_finite())) {
            self.target_m = target;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, FixedView};

    /// Single precision at a decimetre.
    const ROUNDING_M: f32 = 1e-6;

    fn sight(camera: &Camera, x: f32, y: f32) -> Sight {
        let (origin_m, direction) = camera.ray(x, y, 1.5);
        Sight { origin_m, direction, forward: camera.forward() }
    }

    #[test]
    fn the_stylus_stays_on_the_plane_and_under_the_pointer() {
        for view in [FixedView::Top, FixedView::Surgeon, FixedView::Side] {
            let mut camera = Camera::default();
            camera.fixed(view);
            let mut pointer = Pointer::at([0.003, -0.002, 0.004]);
            let before = camera.forward().dot(&pointer.target_m.coords);
            for (x, y) in [(0.0, 0.0), (0.4, -0.3), (-0.7, 0.8)] {
                pointer.follow(&sight(&camera, x, y), std::iter::empty());
                assert!((camera.forward().dot(&pointer.target_m.coords) - before).abs() < ROUNDING_M);
                let clip = camera.view_projection(1.5) * pointer.target_m.to_homogeneous();
                assert!((clip.x / clip.w - x).abs() < 1e-4 && (clip.y / clip.w - y).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn the_wheel_goes_along_the_line_of_sight() {
        let camera = Camera::default();
        let sight = sight(&camera, 0.2, 0.1);
        let mut pointer = Pointer::at([0.0; 3]);
        pointer.follow(&sight, std::iter::empty());
        let before = pointer.target_m;
        pointer.wheel(&sight, 3.0);
        assert!(sight.depth_of(&pointer.target_m) > sight.depth_of(&before));
        assert!(sight.distance_to(&pointer.target_m) < ROUNDING_M);
        pointer.wheel(&sight, f32::NAN);
        pointer.wheel(&sight, -3.0);
        // (1 + n)(1 − n) differs from 1 in the second order.
        assert!((pointer.target_m - before).norm() < 1e-3 * camera.distance_m());
    }

    #[test]
    fn a_suture_point_under_the_pointer_draws_the_plane_unless_a_button_is_down() {
        let mut camera = Camera::default();
        camera.fixed(FixedView::Top);
        let point = [0.0, 0.0, -0.006];
        let over = sight(&camera, 0.0, 0.0);
        let mut pointer = Pointer::at([0.0, 0.0, 0.01]);
        pointer.press(Button::Front, Press::Down);
        pointer.follow(&over, [point].into_iter());
        assert!((pointer.target_m.z - 0.01).abs() < ROUNDING_M);
        pointer.press(Button::Front, Press::Up);
        pointer.follow(&sight(&camera, 0.5, 0.0), [point].into_iter());
        assert!((pointer.target_m.z - 0.01).abs() < ROUNDING_M);
        pointer.follow(&over, [point].into_iter());
        assert!((pointer.target_m.z + 0.006).abs() < ROUNDING_M);
    }

    #[test]
    fn buttons_are_bits() {
        let mut pointer = Pointer::at([0.0; 3]);
        pointer.press(Button::Front, Press::Down);
        pointer.press(Button::Back, Press::Down);
        assert_eq!(pointer.buttons(), 3);
        pointer.press(Button::Front, Press::Up);
        assert_eq!(pointer.buttons(), 2);
    }
}
