//! Smooth motion of a hand: minimum-jerk strokes, a braked pull, and a speed limit.
//!
//! Minimum jerk (Flash and Hogan): `s(τ) = 10τ³ − 15τ⁴ + 6τ⁵` from rest to rest; its peak speed is 15/8 of the
//! mean. Pull: speed that rises and falls by a bounded acceleration. Metres, seconds; no heap.

use sim_core::vector::Vec3;

/// Peak over mean speed of a minimum-jerk stroke.
const PEAK_OVER_MEAN: f64 = 15.0 / 8.0;
/// Shortest stroke, seconds.
const SHORTEST_STROKE_S: f64 = 0.15;

/// Duration of a stroke over `distance_m` that peaks at `peak_m_per_s`, seconds.
#[must_use]
pub fn stroke_duration_s(distance_m: f64, peak_m_per_s: f64) -> f64 {
    (PEAK_OVER_MEAN * distance_m / peak_m_per_s).max(SHORTEST_STROKE_S)
}

/// Share of the way after the share `tau` of the time.
#[must_use]
pub fn minimum_jerk(tau: f64) -> f64 {
    let t = tau.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// The wish, or as far towards it as the speed limit allows.
#[must_use]
pub fn limit_step(from_m: Vec3, wish_m: Vec3, limit_m_per_s: f64, dt_s: f64) -> Vec3 {
    let step = wish_m - from_m;
    let longest = limit_m_per_s * dt_s;
    let length = step.norm();
    if length > longest { from_m + step * (longest / length) } else { wish_m }
}

/// What the puller wants now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulling {
    /// On.
    Further,
    /// Brake and stand.
    Stop,
}

/// A pull along a line: how far, and how fast.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pull {
    /// Way so far, metres.
    pub way_m: f64,
    /// Speed, metres per second.
    pub speed_m_per_s: f64,
}

/// Bounds of a pull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PullBounds {
    /// Longest way, metres.
    pub way_m: f64,
    /// Speed, metres per second.
    pub speed_m_per_s: f64,
    /// Acceleration and braking, metres per second squared.
    pub acceleration_m_per_s2: f64,
}

impl Pull {
    /// One tick of pulling or braking; brakes in time for the longest way.
    pub fn step(&mut self, pulling: Pulling, bounds: &PullBounds, dt_s: f64) {
        let left_m = (bounds.way_m - self.way_m).max(0.0);
        let wanted = match pulling {
            Pulling::Further => bounds.speed_m_per_s.min((2.0 * bounds.acceleration_m_per_s2 * left_m).sqrt()),
            Pulling::Stop => 0.0,
        };
        let change = bounds.acceleration_m_per_s2 * dt_s;
        self.speed_m_per_s += (wanted - self.speed_m_per_s).clamp(-change, change);
        self.way_m += (self.speed_m_per_s * dt_s).min(left_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_starts_and_ends_at_rest_and_peaks_as_stated() {
        let (distance, peak) = (0.05, 0.1);
        let duration = stroke_duration_s(distance, peak);
        let speed = |tau: f64| (minimum_jerk(tau + 1e-6) - minimum_jerk(tau - 1e-6)) / 2e-6 * distance / duration;
        assert!((speed(0.5) - peak).abs() < 1e-9);
        assert!((0..=100).all(|i| speed(f64::from(i) * 0.01) <= peak + 1e-9));
        assert!(speed(0.0).abs() < 1e-9 && speed(1.0).abs() < 1e-9);
        assert_eq!((minimum_jerk(-1.0), minimum_jerk(2.0)), (0.0, 1.0));
        assert_eq!(stroke_duration_s(0.0, peak), SHORTEST_STROKE_S);
    }

    #[test]
    fn a_pull_keeps_its_bounds_and_stops() {
        let bounds = PullBounds { way_m: 0.02, speed_m_per_s: 0.03, acceleration_m_per_s2: 0.3 };
        let mut pull = Pull::default();
        let mut last = 0.0;
        for _ in 0..3000 {
            pull.step(Pulling::Further, &bounds, 1e-3);
            assert!(pull.speed_m_per_s <= 0.03 + 1e-12 && pull.way_m <= 0.02 + 1e-12);
            assert!((pull.speed_m_per_s - last).abs() <= 0.3e-3 + 1e-12);
            last = pull.speed_m_per_s;
        }
        // The last braking steps are cut short of the end by at most one tick of braking.
        assert!((pull.way_m - 0.02).abs() < 1e-5, "{}", pull.way_m);
        let mut braked = Pull { way_m: 0.0, speed_m_per_s: 0.03 };
        for _ in 0..200 {
            braked.step(Pulling::Stop, &bounds, 1e-3);
        }
        // v²/2a, and half a tick at the starting speed.
        assert!((braked.way_m - 0.0015).abs() < 2e-5 && braked.speed_m_per_s == 0.0, "{braked:?}");
    }

    #[test]
    fn the_speed_limit_keeps_the_direction() {
        let limited = limit_step(Vec3::zeros(), Vec3::new(3.0, 4.0, 0.0), 0.1, 1e-3);
        assert!((limited - Vec3::new(6e-5, 8e-5, 0.0)).amax() < 1e-18);
        assert_eq!(limit_step(Vec3::zeros(), Vec3::x() * 1e-5, 0.1, 1e-3), Vec3::x() * 1e-5);
    }
}
