//! Pull of the suture line: stylus d → right point r → (below the tissue) → left point l.
//!
//! `L = |x_d − x_r| + |x_r − x_l|`, `T = max(0, k·(L − L₀) + b·L̇)`. On the right point
//! `F_hand = T·û(r→d)` and `F_link = ρT·û(r→l)`, on the left point `−ρT·û(r→l)`, on the device `−F_hand`
//! (Zhang et al., Eq. (3) and Fig. 3; an impedance device measures no force, so the tension comes from the
//! positions). `ρ = e^{−μθs}` is what friction leaves of the tension (`capstan`); ρ = 1 is the paper's `|F_link| = |F_hand|`. SI units.
//!
//! Below [`SOFT_LENGTH_M`] a segment's length is rounded off quadratically, so that length, direction and
//! tension stay continuous where two points meet. Deliberately absent: the free part of the line (Follow the
//! Leader), stitches already tied.

use crate::kinematics::capstan::{capstan_ratio, sliding_direction, wrap_angle_rad};
use crate::kinematics::coupling::StylusState;
use crate::kinematics::integrate::NodeState;
use crate::vector::Vec3;

/// Segments shorter than this lose their direction gradually: twice the encoder step of an Omni (55 µm), so that
/// quantisation cannot flip a force.
pub const SOFT_LENGTH_M: f64 = 1.1e-4;

/// The pulled line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineParams {
    /// Stiffness between stylus and left point, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// Damping along the line, newton seconds per metre.
    pub damping_n_s_per_m: f64,
    /// Rest length `L₀`: the length at capture, metres.
    pub rest_length_m: f64,
    /// Friction μ of the line in the right point, at least 0; 0 is the paper's case.
    pub friction: f64,
}

/// What one point sees of the line's stiffness and damping at most: `|∂L/∂x_r|² + |∂L/∂x_l|² ≤ 4 + 1`.
pub const LINE_STIFFNESS_SHARE: f64 = 5.0;

/// Length and directions of the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineGeometry {
    /// `L`, metres.
    pub length_m: f64,
    /// `û(r→d)`, unit, shorter near coincidence.
    pub towards_stylus: Vec3,
    /// `û(r→l)`, unit, shorter near coincidence.
    pub towards_left: Vec3,
    /// θ: how far the line bends at the right point, radians.
    pub wrap_rad: f64,
    /// How fast `û(r→d)` turns with its ends: at most this, per metre.
    pub turn_above_per_m: f64,
    /// How fast `û(r→l)` turns with its ends: at most this, per metre.
    pub turn_below_per_m: f64,
}

/// Forces of the line, newtons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineForces {
    /// `F_hand` on the right point; the device gets the opposite.
    pub hand_n: Vec3,
    /// `F_link` on the right point; the left point gets the opposite.
    pub link_n: Vec3,
}

/// Length of a segment, its gradient with respect to the far end, and the norm of its second derivative.
fn soft_segment(from: Vec3, to: Vec3) -> (f64, Vec3, f64) {
    let along = to - from;
    let distance = along.norm();
    if distance < SOFT_LENGTH_M {
        (distance * distance / (2.0 * SOFT_LENGTH_M) + SOFT_LENGTH_M / 2.0, along / SOFT_LENGTH_M, 1.0 / SOFT_LENGTH_M)
    } else {
        (distance, along / distance, 1.0 / distance)
    }
}

/// Measures the line between stylus, right and left point.
#[must_use]
pub fn measure(stylus_m: Vec3, right_m: Vec3, left_m: Vec3) -> LineGeometry {
    let (above_m, towards_stylus, turn_above_per_m) = soft_segment(right_m, stylus_m);
    let (below_m, towards_left, turn_below_per_m) = soft_segment(right_m, left_m);
    let (length_m, wrap_rad) = (above_m + below_m, wrap_angle_rad(stylus_m, right_m, left_m));
    LineGeometry { length_m, towards_stylus, towards_left, wrap_rad, turn_above_per_m, turn_below_per_m }
}

impl LineGeometry {
    /// `∂L/∂x_r`.
    #[must_use]
    pub fn gradient_right(&self) -> Vec3 {
        -(self.towards_stylus + self.towards_left)
    }

    /// `∂L/∂x_l`.
    #[must_use]
    pub fn gradient_left(&self) -> Vec3 {
        self.towards_left
    }

    /// `L̇` of moving ends, metres per second.
    #[must_use]
    pub fn rate_m_per_s(&self, stylus_v: Vec3, right_v: Vec3, left_v: Vec3) -> f64 {
        self.towards_stylus.dot(&stylus_v) + self.gradient_right().dot(&right_v) + self.gradient_left().dot(&left_v)
    }

    /// Speed at which the line slides through the right point towards the hand: how fast the segment below shortens, metres
    /// per second.
    #[must_use]
    pub fn sliding_speed_m_per_s(&self, right_v: Vec3, left_v: Vec3) -> f64 {
        self.towards_left.dot(&(right_v - left_v))
    }

    /// Force on the right point per newton of tension: `û(r→d) + ρ·û(r→l)`.
    #[must_use]
    pub fn right_direction(&self, capstan_ratio: f64) -> Vec3 {
        self.towards_stylus + self.towards_left * capstan_ratio
    }

    /// Force on the left point per newton of tension: `−ρ·û(r→l)`.
    #[must_use]
    pub fn left_direction(&self, capstan_ratio: f64) -> Vec3 {
        self.towards_left * -capstan_ratio
    }

    /// Stiffness that the turning of the line's directions puts on right and left point, both moving, at most; newtons
    /// per metre.
    #[must_use]
    pub fn turning_stiffness_n_per_m(&self, tension_n: f64, capstan_ratio: f64) -> (f64, f64) {
        let below = 2.0 * capstan_ratio * self.turn_below_per_m;
        (tension_n * (self.turn_above_per_m + below), tension_n * below)
    }

    /// The forces that a tension stands for.
    #[must_use]
    pub fn forces(&self, tension_n: f64, capstan_ratio: f64) -> LineForces {
        LineForces { hand_n: self.towards_stylus * tension_n, link_n: self.towards_left * (tension_n * capstan_ratio) }
    }
}

/// `T = max(0, k·(L − L₀) + b·L̇)`, newtons: a line never pushes.
#[must_use]
pub fn tension_n(line: &LineParams, length_m: f64, rate_m_per_s: f64) -> f64 {
    (line.stiffness_n_per_m * (length_m - line.rest_length_m) + line.damping_n_s_per_m * rate_m_per_s).max(0.0)
}

/// Tension and forces in the present state, nothing taken implicitly: what the literal form of Eq. (3) needs.
#[must_use]
pub fn pull(line: &LineParams, stylus: StylusState, right: NodeState, left: NodeState) -> (f64, LineForces) {
    let geometry = measure(stylus.position_m, right.position_m, left.position_m);
    let rate = geometry.rate_m_per_s(stylus.velocity_m_per_s, right.velocity_m_per_s, left.velocity_m_per_s);
    let tension = tension_n(line, geometry.length_m, rate);
    let sliding = sliding_direction(geometry.sliding_speed_m_per_s(right.velocity_m_per_s, left.velocity_m_per_s));
    (tension, geometry.forces(tension, capstan_ratio(line.friction * sliding, geometry.wrap_rad)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    const LINE: LineParams =
        LineParams { stiffness_n_per_m: 400.0, damping_n_s_per_m: 1.0, rest_length_m: 0.05, friction: 0.0 };

    fn at(x: f64, y: f64, z: f64) -> NodeState {
        NodeState { position_m: Vec3::new(x, y, z), velocity_m_per_s: Vec3::zeros() }
    }

    #[test]
    fn eq3_hand_and_link_have_one_magnitude_without_friction() {
        let stylus = StylusState { position_m: Vec3::new(0.02, 0.01, 0.05), velocity_m_per_s: Vec3::zeros() };
        let (tension, forces) = pull(&LINE, stylus, at(0.004, 0.0, 0.0), at(-0.004, 0.001, 0.0));
        assert!(tension > 1.0);
        assert!((forces.hand_n.norm() - tension).abs() < 1e-12);
        assert!((forces.link_n.norm() - forces.hand_n.norm()).abs() < 1e-12);
    }

    #[test]
    fn eq3_friction_leaves_the_capstan_share_below_the_tissue() {
        let (mu, theta) = (0.3, FRAC_PI_2);
        let line = LineParams { friction: mu, ..LINE };
        let stylus = StylusState { position_m: Vec3::new(0.004, 0.0, 0.06), velocity_m_per_s: Vec3::zeros() };
        let (mut right, left) = (at(0.004, 0.0, 0.0), at(-0.004, 0.0, 0.0));
        assert!((wrap_angle_rad(stylus.position_m, right.position_m, left.position_m) - theta).abs() < 1e-15);
        // Closing, at rest, recoiling.
        for (speed, sign) in [(0.01, 1.0), (0.0, 0.0), (-0.01, -1.0)] {
            right.velocity_m_per_s.x = -speed;
            let (_, forces) = pull(&line, stylus, right, left);
            assert!((forces.link_n.norm() / forces.hand_n.norm() - (-mu * theta * sign).exp()).abs() < 1e-12);
        }
    }

    #[test]
    fn slack_line_pulls_nothing() {
        let stylus = StylusState { position_m: Vec3::new(0.01, 0.0, 0.01), velocity_m_per_s: Vec3::zeros() };
        let (tension, forces) = pull(&LINE, stylus, at(0.004, 0.0, 0.0), at(-0.004, 0.0, 0.0));
        assert_eq!((tension, forces), (0.0, LineForces::default()));
    }

    #[test]
    fn length_gradients_match_finite_differences_also_inside_the_soft_zone() {
        let d = Vec3::new(0.01, 0.02, 0.05);
        for (r, l) in [
            (Vec3::new(0.004, 0.0, 0.0), Vec3::new(-0.004, 0.001, 0.0)),
            (Vec3::new(0.00002, 0.00003, 0.0), Vec3::new(0.0, 0.0, 0.00004)),
        ] {
            let g = measure(d, r, l);
            let step = 1e-8;
            for axis in 0..3 {
                let mut e = Vec3::zeros();
                e[axis] = step;
                let right = (measure(d, r + e, l).length_m - measure(d, r - e, l).length_m) / (2.0 * step);
                let left = (measure(d, r, l + e).length_m - measure(d, r, l - e).length_m) / (2.0 * step);
                // Rounding of a 60 mm length over 10 nm: 1e-17 / 1e-8.
                assert!((right - g.gradient_right()[axis]).abs() < 1e-7);
                assert!((left - g.gradient_left()[axis]).abs() < 1e-7);
            }
        }
    }

    proptest! {
        #[test]
        fn tension_is_continuous_and_never_pushes(
            d in prop::array::uniform3(-0.1..0.1_f64), r in prop::array::uniform3(-0.1..0.1_f64),
            l in prop::array::uniform3(-0.1..0.1_f64), nudge in prop::array::uniform3(-1e-6..1e-6_f64),
        ) {
            let (d, r, l, nudge) = (Vec3::from(d), Vec3::from(r), Vec3::from(l), Vec3::from(nudge));
            let still = |p| NodeState { position_m: p, velocity_m_per_s: Vec3::zeros() };
            let stylus = StylusState { position_m: d, velocity_m_per_s: Vec3::zeros() };
            let (t0, _) = pull(&LINE, stylus, still(r), still(l));
            let (t1, _) = pull(&LINE, stylus, still(r + nudge), still(l));
            prop_assert!(t0 >= 0.0);
            // |∂L/∂r| ≤ 2, so a nudge cannot change the tension by more than 2 k |nudge|.
            prop_assert!((t1 - t0).abs() <= 2.0 * 400.0 * nudge.norm() + 1e-12);
        }

        #[test]
        fn directions_are_continuous_where_the_points_meet(n in prop::array::uniform3(-1e-4..1e-4_f64)) {
            let n = Vec3::from(n);
            let here = measure(n, Vec3::zeros(), Vec3::zeros()).towards_stylus;
            let there = measure(n * 0.99, Vec3::zeros(), Vec3::zeros()).towards_stylus;
            prop_assert!((here - there).norm() <= 0.02);
            prop_assert!(here.norm() <= 1.0 + 1e-12);
        }
    }
}
