//! Dry friction of the suture line in a suture point that it runs through.
//!
//! `T_below = T_above·e^{−μθs}` with the bend θ of the line at the point and `s = tanh(v/v₀)`, `v` the speed at which the line
//! slides through the point towards the hand. The line gives the bodies at its ends the power
//! `−T_above·L̇ − (1 − e^{−μθs})·T_above·v`: friction takes `(1 − e^{−μθs})·T·v ≥ 0` whichever way the line slides, so a gap
//! that recoils gains nothing. At rest `s = 0`; a line that is held creeps with less than `v₀`, which stands for sticking.
//! SI units. Zhang et al. have μ = 0: `s` then is without effect and the tension is the same everywhere.
//!
//! Deliberately absent: the solution for `s` together with the motion (`port_tick`), a static friction above the sliding one.

use crate::vector::Vec3;

/// `v₀`: a line slower than this counts as held, metres per second. A gap of 1 mm that friction holds takes ten seconds to
/// creep open at it, and a hand that sutures pulls a hundred times as fast.
pub const HELD_SPEED_M_PER_S: f64 = 1e-4;

/// Capstan ratio `ρ = e^{−μθ}`: what is left of the tension behind a point that the line wraps by θ.
#[must_use]
pub fn capstan_ratio(friction: f64, wrap_rad: f64) -> f64 {
    (-friction * wrap_rad).exp()
}

/// `s`: 1 for a line that slides towards the hand, −1 for one that is drawn back, continuous between.
#[must_use]
pub fn sliding_direction(speed_m_per_s: f64) -> f64 {
    (speed_m_per_s / HELD_SPEED_M_PER_S).tanh()
}

/// Angle by which a line that comes from `before` and goes to `after` turns at `at`: 0 straight through, π doubled
/// back, 0 where two of the points coincide.
#[must_use]
pub fn wrap_angle_rad(before: Vec3, at: Vec3, after: Vec3) -> f64 {
    let (incoming, outgoing) = (at - before, after - at);
    if incoming == Vec3::zeros() || outgoing == Vec3::zeros() {
        return 0.0;
    }
    incoming.cross(&outgoing).norm().atan2(incoming.dot(&outgoing))
}

/// Halvings of the bracket of `s`: down to 1e-12.
const BISECTIONS: usize = 40;

/// The `s` in −1 to 1 that belongs to the sliding speed which it causes itself, `s = tanh(v(ρ(s))/v₀)`, as its ratio ρ; 1 without
/// friction. `speed_at` gives the speed at the end of the tick for a ratio; more friction never makes the line faster.
pub(super) fn self_consistent_ratio(friction: f64, wrap_rad: f64, speed_at: impl Fn(f64) -> f64) -> f64 {
    if friction == 0.0 {
        return 1.0;
    }
    let ratio = |s: f64| capstan_ratio(friction * s, wrap_rad);
    let (mut low, mut high) = (-1.0, 1.0);
    for _ in 0..BISECTIONS {
        let s = 0.5 * (low + high);
        if s < sliding_direction(speed_at(ratio(s))) {
            low = s;
        } else {
            high = s;
        }
    }
    ratio(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn wrap_angle_of_straight_and_doubled_back() {
        let [a, b, c] = [0.0, 1.0, 2.0].map(|x| Vec3::new(x, 0.0, 0.0));
        assert_eq!(wrap_angle_rad(a, b, c), 0.0);
        assert!((wrap_angle_rad(a, b, a) - PI).abs() < 1e-15);
        assert_eq!(wrap_angle_rad(a, a, c), 0.0);
    }

    #[test]
    fn the_direction_is_odd_and_full_far_above_the_held_speed() {
        assert_eq!(sliding_direction(0.0), 0.0);
        assert_eq!((sliding_direction(0.01), sliding_direction(-0.01)), (1.0, -1.0));
        assert_eq!(sliding_direction(3e-5), -sliding_direction(-3e-5));
    }

    #[test]
    fn the_ratio_belongs_to_the_speed_that_it_causes() {
        // A point of drag c that the line draws with T against a force F: v = (ρT − F)/c.
        let (friction, wrap, tension, drag) = (0.3, 1.5, 2.0, 27.0);
        for force in [0.5, 1.2, 1.9, 2.0, 2.3, 3.5] {
            let speed = |ratio: f64| (ratio * tension - force) / drag;
            let ratio = self_consistent_ratio(friction, wrap, speed);
            let expected = capstan_ratio(friction * sliding_direction(speed(ratio)), wrap);
            // 1e-12 of s, and a slope of T μθ/(c v₀) ≈ 330 from s to tanh.
            assert!((ratio - expected).abs() < 1e-9, "{force} N: {ratio} against {expected}");
            // Forces within the cone e^{±μθ} are held: slower than a few v₀.
            let held = (force / tension).ln().abs() < 0.9 * friction * wrap;
            assert_eq!(held, speed(ratio).abs() < 2.0 * HELD_SPEED_M_PER_S, "{force} N: {} m/s", speed(ratio));
        }
        assert_eq!(self_consistent_ratio(0.0, wrap, |_| 1.0), 1.0);
    }
}
