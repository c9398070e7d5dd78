//! Tension of a taut suture line, and what it does to the suture points it runs through.
//!
//! `T = EA/L·max(0, d − L)` (a spring that only pulls), from the held end on `T_{k+1} = T_k·e^{−μθ_k s}` at each suture point the
//! line turns at by θ_k (capstan; s: which way it slides), force on that point `T_k·û(to k−1) + T_{k+1}·û(to k+1)`. Metres, newtons,
//! radians. μ = 0 is the case of Zhang et al.: "force magnitude on the same line is identical everywhere".
//!
//! Deliberately absent: which part of the line is free (`line`), the 1 kHz pull of the hand (`kinematics::line_pull`),
//! a speed that differs from point to point. Scenes report this tension and do not apply it to
//! the tissue: there the servo's pull and the tied stitches act.

use crate::kinematics::capstan::{capstan_ratio, sliding_direction, wrap_angle_rad};
use crate::vector::Vec3;

/// From this extension on a line is drawn straight: Follow the Leader would need hundreds of sweeps there.
pub const STRAIGHT_RATIO: f64 = 0.98;

/// Extension `d / L`; infinite for a line without length between separate points, 0 between coinciding ones.
#[must_use]
pub fn extension_ratio(distance_m: f64, length_m: f64) -> f64 {
    if length_m > 0.0 {
        distance_m / length_m
    } else if distance_m > 0.0 {
        f64::INFINITY
    } else {
        0.0
    }
}

/// `T = EA/L·max(0, d − L)`, newtons; 0 for a line without length.
#[must_use]
pub fn axial_tension_n(axial_stiffness_n: f64, length_m: f64, distance_m: f64) -> f64 {
    if length_m > 0.0 { axial_stiffness_n / length_m * (distance_m - length_m).max(0.0) } else { 0.0 }
}

/// Length of a polyline, metres.
#[must_use]
pub fn path_length_m(path: &[Vec3]) -> f64 {
    path.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// Adds to `force_n[k]` what a line along `path` does to its point `k`, pulled with `tension_n` at `path[0]`, and returns the tension
/// in its last segment. The line slides through its points towards the hand with `speed_m_per_s`; below 0 it is drawn back. The first point is the hand's, the last one the line is fixed to; of two lists of different length the
/// longer one's rest is left alone.
pub fn add_line_forces(path: &[Vec3], friction: f64, speed_m_per_s: f64, tension_n: f64, force_n: &mut [Vec3]) -> f64 {
    let friction = friction * sliding_direction(speed_m_per_s);
    let count = path.len().min(force_n.len());
    let mut tension = tension_n;
    for k in 1..count {
        if k > 1 {
            tension *= capstan_ratio(friction, wrap_angle_rad(path[k - 2], path[k - 1], path[k]));
        }
        let segment = path[k] - path[k - 1];
        let Some(along) = segment.try_normalize(0.0) else { continue };
        force_n[k - 1] += along * tension;
        force_n[k] -= along * tension;
    }
    tension
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    const ROUND_N: f64 = 1e-14;
    /// A line on its way to the hand, metres per second.
    const PULLED: f64 = 0.01;

    #[test]
    fn tension_only_pulls_is_continuous_and_linear() {
        assert_eq!(axial_tension_n(100.0, 0.2, 0.1), 0.0);
        assert_eq!(axial_tension_n(100.0, 0.2, 0.2), 0.0);
        assert!((axial_tension_n(100.0, 0.2, 0.202) - 1.0).abs() < 1e-12);
        assert_eq!(axial_tension_n(100.0, 0.0, 0.1), 0.0);
        assert_eq!(extension_ratio(0.1, 0.2), 0.5);
        assert_eq!((extension_ratio(0.1, 0.0), extension_ratio(0.0, 0.0)), (f64::INFINITY, 0.0));
    }

    #[test]
    fn capstan_reduces_the_tension_by_the_total_turning() {
        // A zigzag of three right angles.
        let path = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (2.0, 1.0), (2.0, 0.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let mut force = [Vec3::zeros(); 5];
        let last = add_line_forces(&path, 0.3, PULLED, 2.0, &mut force);
        assert!((last - 2.0 * (-0.3 * 3.0 * FRAC_PI_2).exp()).abs() < ROUND_N);
        // Doubled back over one point: e^{−μπ}.
        let back = [path[0], path[1], path[0]];
        let at = |speed: f64| add_line_forces(&back, 0.2, speed, 1.0, &mut [Vec3::zeros(); 3]);
        assert!((at(PULLED) - (-0.2 * PI).exp()).abs() < ROUND_N);
        assert!((at(-PULLED) - (0.2 * PI).exp()).abs() < ROUND_N);
        assert_eq!(at(0.0), 1.0);
    }

    #[test]
    fn eq3_without_friction_the_tension_is_the_same_everywhere_and_forces_sum_to_zero() {
        let path =
            [(0.0, 0.0, 3.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (2.0, 2.0, 0.5)].map(|(x, y, z)| Vec3::new(x, y, z));
        for friction in [0.0, 0.4] {
            let mut force = [Vec3::zeros(); 4];
            let last = add_line_forces(&path, friction, PULLED, 1.5, &mut force);
            assert_eq!(last == 1.5, friction == 0.0);
            assert!(force.iter().sum::<Vec3>().norm() < ROUND_N);
            assert!((force[0].norm() - 1.5).abs() < ROUND_N && (force[3].norm() - last).abs() < ROUND_N);
        }
    }

    #[test]
    fn coinciding_points_carry_no_force_and_no_nan() {
        let path = [Vec3::zeros(), Vec3::zeros(), Vec3::x()];
        let mut force = [Vec3::zeros(); 3];
        add_line_forces(&path, 0.3, PULLED, 1.0, &mut force);
        assert_eq!(force[0], Vec3::zeros());
        assert!(force.iter().all(|f| f.iter().all(|x| x.is_finite())));
    }
}
