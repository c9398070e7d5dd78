//! One run of one point: stable, limit cycle or overflow.
//!
//! Every scheme here loses stability through an eigenvalue that leaves the unit circle at −1: the sign flips in each step.
//! The measure is the parity amplitude P_n = ‖x_n − 2x_{n−1} + x_{n−2}‖/4, which leaves slow motion and mechanisms out.
//! Small: P of late windows of steps against earlier ones, from a disturbance of 1e-6 spacings. Large: what has grown
//! goes on until it is 1000 spacings out or not finite (overflow), or stays bounded (limit cycle).

use crate::accuracy::section::Effort;
use sim_core::vector::Vec3;

/// Something that is stepped.
pub trait Motion {
    /// One step.
    fn step(&mut self);
    /// Where its nodes are, metres.
    fn position_m(&self) -> &[Vec3];
    /// Where they rest, metres.
    fn rest_m(&self) -> &[Vec3];
    /// Distance of neighbours, metres.
    fn spacing_m(&self) -> f64;
}

/// How a point of a map ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// A small disturbance does not grow.
    Stable,
    /// It grows and stays bounded.
    LimitCycle,
    /// It grows without bound.
    Overflow,
}

/// Disturbance, in spacings.
pub const DISTURBANCE: f64 = 1e-6;
/// Steps of a window over which the largest parity amplitude is taken.
const WINDOW: usize = 50;
/// Windows of the search for growth at a cell of a map: growth of less than a thousandth per step is on the line there.
const CELL_WINDOWS: usize = 12;
/// Smaller than this share of the first window: it has died away.
const DEAD: f64 = 1e-5;
/// Larger than this multiple of the disturbance: it has grown.
const GROWN: f64 = 1e3;
/// Steps given to what has grown.
const LARGE_STEPS: usize = 1_000;
/// Farther out than this, spacings: overflow.
const OVERFLOW: f64 = 1e3;
/// What has grown and ends below this, spacings, has come to rest elsewhere.
const AT_REST: f64 = 1e-3;

/// Width of a bisected edge: a quarter of what the boundaries may be off, and finer for the full report.
#[must_use]
pub fn edge_width(effort: Effort) -> f64 {
    match effort {
        Effort::Quick => 5e-3,
        Effort::Full => 1e-3,
    }
}

/// The last two positions, for the parity amplitude.
struct Parity {
    last: Vec<Vec3>,
    before: Vec<Vec3>,
}

impl Parity {
    fn new(motion: &dyn Motion) -> Self {
        let now = motion.position_m().to_vec();
        Self { before: now.clone(), last: now }
    }

    /// Steps once; gives the parity amplitude, metres.
    fn step(&mut self, motion: &mut dyn Motion) -> f64 {
        motion.step();
        let now = motion.position_m();
        let mut sum = 0.0;
        for ((x, y), z) in now.iter().zip(&self.last).zip(&mut self.before) {
            sum += (x - y * 2.0 + *z).norm_squared();
            *z = *y;
        }
        self.last.copy_from_slice(now);
        0.25 * sum.sqrt()
    }

    /// Largest amplitude of a window; infinite as soon as one is not finite.
    fn window(&mut self, motion: &mut dyn Motion, steps: usize) -> f64 {
        let mut largest: f64 = 0.0;
        for _ in 0..steps {
            let amplitude = self.step(motion);
            if !amplitude.is_finite() {
                return f64::INFINITY;
            }
            largest = largest.max(amplitude);
        }
        largest
    }
}

/// Windows of the search for growth where an edge is bisected.
#[must_use]
pub fn edge_windows(effort: Effort) -> usize {
    match effort {
        Effort::Quick => 24,
        Effort::Full => 60,
    }
}

/// Whether a small disturbance grows, looked for over so many windows: the last one against the one two thirds of the way.
pub fn grows(motion: &mut dyn Motion, windows: usize) -> bool {
    let mut parity = Parity::new(motion);
    // A fast growth may have ended in its cycle before the first window does: the disturbance itself is the measure.
    let start = parity.window(motion, 2).max(DISTURBANCE * motion.spacing_m());
    let first = parity.window(motion, WINDOW).max(f64::MIN_POSITIVE);
    if first > GROWN * start {
        return true;
    }
    let mut amplitudes = vec![first];
    for _ in 1..windows {
        let now = parity.window(motion, WINDOW);
        if now > GROWN * start {
            return true;
        }
        if now < DEAD * first {
            return false;
        }
        amplitudes.push(now);
    }
    amplitudes[amplitudes.len() - 1] > amplitudes[2 * amplitudes.len() / 3 - 1]
}

/// How a point ends.
pub fn classify(motion: &mut dyn Motion) -> Verdict {
    if !grows(motion, CELL_WINDOWS) {
        return Verdict::Stable;
    }
    let spacing_m = motion.spacing_m();
    let out = |motion: &dyn Motion| {
        let off = motion.position_m().iter().zip(motion.rest_m()).map(|(x, r)| (x - r).norm());
        off.fold(0.0, |most: f64, d| if d <= most { most } else { d }) / spacing_m
    };
    let mut parity = Parity::new(motion);
    let mut late = 0.0;
    for _ in 0..LARGE_STEPS / WINDOW {
        late = parity.window(motion, WINDOW) / spacing_m;
        let far = out(motion);
        if !(late.is_finite() && far < OVERFLOW) {
            return Verdict::Overflow;
        }
    }
    if late < AT_REST && out(motion) < AT_REST {
        // Still small after all these steps: more of them decide.
        let later = parity.window(motion, 10 * LARGE_STEPS) / spacing_m;
        return if later.is_finite() && out(motion) < OVERFLOW { Verdict::LimitCycle } else { Verdict::Overflow };
    }
    Verdict::LimitCycle
}

/// The edge between `low` and `high`, by halving the ratio until it is known to `width`; `None` where both ends agree.
pub fn bisect(low: f64, high: f64, width: f64, mut unstable: impl FnMut(f64) -> bool) -> Option<f64> {
    let (at_low, at_high) = (unstable(low), unstable(high));
    if at_low == at_high {
        return None;
    }
    let (mut low, mut high) = (low, high);
    while high / low > 1.0 + width {
        let middle = (low * high).sqrt();
        if unstable(middle) == at_low { low = middle } else { high = middle }
    }
    Some((low * high).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x ← −g x until the amplitude reaches the cap.
    struct Flip {
        x: Vec<Vec3>,
        growth: f64,
        cap_m: f64,
    }

    impl Motion for Flip {
        fn step(&mut self) {
            let grown = self.x[0] * -self.growth;
            self.x[0] = if grown.norm() > self.cap_m { -self.x[0] } else { grown };
        }
        fn position_m(&self) -> &[Vec3] {
            &self.x
        }
        fn rest_m(&self) -> &[Vec3] {
            const REST: [Vec3; 1] = [Vec3::new(0.0, 0.0, 0.0)];
            &REST
        }
        fn spacing_m(&self) -> f64 {
            1.0
        }
    }

    fn flip(growth: f64, cap_m: f64) -> Flip {
        Flip { x: vec![Vec3::new(DISTURBANCE, 0.0, 0.0)], growth, cap_m }
    }

    #[test]
    fn the_three_classes_are_told_apart() {
        assert_eq!(classify(&mut flip(0.999, 1.0)), Verdict::Stable);
        assert_eq!(classify(&mut flip(1.001, 0.5)), Verdict::LimitCycle);
        assert_eq!(classify(&mut flip(1.5, 0.5)), Verdict::LimitCycle);
        assert_eq!(classify(&mut flip(1.5, f64::INFINITY)), Verdict::Overflow);
    }

    #[test]
    fn an_edge_is_found_whichever_side_is_unstable() {
        for flipped in [false, true] {
            let edge = bisect(1e-6, 1.0, 1e-3, |v| (v > 0.0123) != flipped).expect("an edge");
            assert!((edge / 0.0123 - 1.0).abs() < 1e-3, "{edge}");
        }
        assert_eq!(bisect(1.0, 2.0, 1e-3, |_| false), None);
    }
}
