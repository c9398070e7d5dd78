//! The last stage: the one file through which a force leaves for the device.
//!
//! finite → low-pass → slew limit → norm limit (continuous by I²t, and peak) → finite.
//! Filter: y += α (u − y), α = ω dt / (1 + ω dt), ω = 2π f_c. Slew: |F_k − F_{k−1}| ≤ slew · dt, dt at most two
//! periods, so that a gap buys no jump. Norm: Euclidean, never per axis (that would turn the force). I²t: heat
//! q += (|F|² − F_c²) dt in [0, Q], Q = (F_p² − F_c²) t_peak; over the last fifth of Q the limit falls from F_p
//! to F_c. The bounds hold for any input: whatever goes in, the force that comes out is finite, no longer than the
//! peak, and within the slew of the force before it. Forces in newtons, scene frame.
//! Deliberately absent: any knowledge of why a force is wanted.

use crate::device::DeviceCommand;
use crate::servo::params::SafetyParams;
use sim_core::vector::Vec3;

/// Share of the heat budget over which the limit falls from peak to continuous.
const HEAT_KNEE: f64 = 0.2;
/// Limits are kept with this relative margin, so that rounding can never cross them.
const ROUNDING_MARGIN: f64 = 1.0 - 1e-12;

/// A force on its way to zero is zero below this, newtons: the filter's tail never ends by itself.
const REST_N: f64 = 1e-6;

/// The continuous limit held the force back.
pub const CLIP_CONTINUOUS: u32 = 1;
/// The slew limit held the force back.
pub const CLIP_SLEW: u32 = 2;
/// The wanted force was not finite.
pub const CLIP_NOT_FINITE: u32 = 4;
/// The peak limit held the force back.
pub const CLIP_PEAK: u32 = 8;

/// What left, and what was held back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Released {
    /// For the device.
    pub command: DeviceCommand,
    /// `CLIP_…` bits.
    pub clips: u32,
    /// The wanted force has not been finite for too many ticks in a row.
    pub verdict: Verdict,
}

/// Whether the wanted forces can be worked with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Yes.
    Usable,
    /// Too many in a row were not finite.
    NotFinite,
}

/// State of the last stage.
#[derive(Clone, Copy, Debug)]
pub struct ForceStage {
    params: SafetyParams,
    longest_dt_s: f64,
    last_good: Vec3,
    filtered: Vec3,
    last: Vec3,
    heat: f64,
    bad_in_a_row: u32,
}

impl ForceStage {
    /// A cold stage at zero force.
    #[must_use]
    pub fn new(params: SafetyParams, period_s: f64) -> Self {
        Self {
            params,
            longest_dt_s: 2.0 * period_s,
            last_good: Vec3::zeros(),
            filtered: Vec3::zeros(),
            last: Vec3::zeros(),
            heat: 0.0,
            bad_in_a_row: 0,
        }
    }

    /// Takes the wanted force and gives what the device may render now.
    pub fn release(&mut self, wanted: Vec3, dt_s: f64) -> Released {
        let dt = if dt_s.is_finite() { dt_s.clamp(0.0, self.longest_dt_s) } else { 0.0 };
        let mut clips = 0;
        let mut target = self.contain(wanted, &mut clips);
        let limit = self.heat_limit();
        if target.norm() > limit {
            clips |= if limit < self.params.peak_force_n { CLIP_CONTINUOUS } else { CLIP_PEAK };
            target = within(target, limit);
        }
        let gain = std::f64::consts::TAU * self.params.filter_hz * dt;
        self.filtered += (target - self.filtered) * (gain / (1.0 + gain));

        let step = self.filtered - self.last;
        let reach = self.params.slew_n_per_s * dt;
        if step.norm() > reach {
            clips |= CLIP_SLEW;
        }
        let moved = self.last + within(step, reach);
        // Never shorter than the force before: a falling limit is reached by way of the target, at the slew.
        let force = within(moved, limit.max(self.last.norm()).min(self.params.peak_force_n));

        let is_resting = target == Vec3::zeros() && force.norm() < REST_N && self.last.norm() <= reach;
        if is_resting {
            self.filtered = Vec3::zeros();
        }
        self.last = if is_finite(force) && !is_resting { force } else { Vec3::zeros() };
        self.warm(dt_s);
        let verdict =
            if self.bad_in_a_row >= self.params.bad_force_ticks { Verdict::NotFinite } else { Verdict::Usable };
        Released { command: DeviceCommand { force_n: self.last }, clips, verdict }
    }

    /// The force that left last.
    #[must_use]
    pub fn last_force(&self) -> Vec3 {
        self.last
    }

    /// A force that is not finite is replaced by the last good one, after too many in a row by zero.
    fn contain(&mut self, wanted: Vec3, clips: &mut u32) -> Vec3 {
        if is_finite(wanted) {
            self.bad_in_a_row = 0;
            self.last_good = wanted;
            return wanted;
        }
        *clips |= CLIP_NOT_FINITE;
        self.bad_in_a_row = self.bad_in_a_row.saturating_add(1);
        if self.bad_in_a_row < self.params.bad_force_ticks { self.last_good } else { Vec3::zeros() }
    }

    /// I²t: the norm that the motors' heat allows now.
    fn heat_limit(&self) -> f64 {
        let (peak, continuous) = (self.params.peak_force_n, self.params.continuous_force_n);
        let span = peak * peak - continuous * continuous;
        let budget = span * self.params.peak_hold_s;
        if budget <= 0.0 {
            return continuous;
        }
        let room = ((budget - self.heat) / (HEAT_KNEE * budget)).clamp(0.0, 1.0);
        (continuous * continuous + span * room).sqrt().min(peak)
    }

    fn warm(&mut self, dt_s: f64) {
        let (peak, continuous) = (self.params.peak_force_n, self.params.continuous_force_n);
        let budget = (peak * peak - continuous * continuous) * self.params.peak_hold_s;
        let dt = if dt_s.is_finite() { dt_s.clamp(0.0, 1.0) } else { 0.0 };
        self.heat = (self.heat + (self.last.norm_squared() - continuous * continuous) * dt).clamp(0.0, budget);
    }
}

fn is_finite(v: Vec3) -> bool {
    v.iter().all(|c| c.is_finite())
}

/// `v`, shortened to `length` where it is longer; a length beyond the number range counts as no direction.
fn within(v: Vec3, length: f64) -> Vec3 {
    let norm = v.norm();
    if norm <= length * ROUNDING_MARGIN {
        v
    } else if norm.is_finite() && norm > 0.0 {
        v * (length * ROUNDING_MARGIN / norm)
    } else {
        Vec3::zeros()
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, clippy::disallowed_macros, reason = "a test runs outside the room")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f64 = 0.001;

    fn stage() -> ForceStage {
        ForceStage::new(SafetyParams::default(), DT)
    }

    #[test]
    fn a_step_is_slewed_and_reaches_its_target() {
        let mut stage = stage();
        let first = stage.release(Vec3::new(2.0, 0.0, 0.0), DT);
        assert!((first.command.force_n.x - 0.5).abs() < 1e-9);
        assert_eq!(first.clips & CLIP_SLEW, CLIP_SLEW);
        for _ in 0..20 {
            stage.release(Vec3::new(2.0, 0.0, 0.0), DT);
        }
        assert!((stage.last_force().x - 2.0).abs() < 1e-6);
    }

    #[test]
    fn the_norm_is_limited_not_each_axis() {
        let mut stage = stage();
        for _ in 0..50 {
            stage.release(Vec3::new(30.0, 40.0, 0.0), DT);
        }
        let force = stage.last_force();
        assert!((force.norm() - 3.3).abs() < 1e-6);
        assert!((force.y / force.x - 4.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn a_held_peak_sinks_to_the_continuous_force_after_its_budget() {
        let mut stage = stage();
        let mut peak_ticks = 0;
        for _ in 0..60_000 {
            let out = stage.release(Vec3::new(10.0, 0.0, 0.0), DT);
            peak_ticks += u32::from(out.command.force_n.x > 3.29);
        }
        // Four fifths of the 5 s budget are spent at the peak, the knee takes the rest.
        assert!((3_900..=4_200).contains(&peak_ticks), "{peak_ticks}");
        assert!((stage.last_force().x - 0.88).abs() < 0.02, "{}", stage.last_force().x);
    }

    #[test]
    fn a_force_that_is_not_finite_is_bridged_then_released_to_zero() {
        let mut stage = stage();
        for _ in 0..20 {
            stage.release(Vec3::new(1.0, 0.0, 0.0), DT);
        }
        let bridged = stage.release(Vec3::new(f64::NAN, 0.0, 0.0), DT);
        assert!((bridged.command.force_n.x - 1.0).abs() < 1e-3);
        assert_eq!(bridged.verdict, Verdict::Usable);
        for _ in 0..20 {
            stage.release(Vec3::new(f64::INFINITY, 0.0, 0.0), DT);
        }
        assert_eq!(stage.last_force(), Vec3::zeros());
        assert_eq!(stage.release(Vec3::new(0.0, f64::NAN, 0.0), DT).verdict, Verdict::NotFinite);
    }

    fn any_component() -> impl Strategy<Value = f64> {
        prop_oneof![4 => -10.0..10.0f64, 1 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(f64::MAX), 1 => Just(0.0)]
    }

    fn any_dt() -> impl Strategy<Value = f64> {
        prop_oneof![6 => Just(DT), 2 => 0.0..0.1f64, 1 => any::<f64>()]
    }

    proptest! {
        #[test]
        fn no_input_breaks_the_bounds(
            inputs in prop::collection::vec((any_component(), any_component(), any_component(), any_dt()), 1..400)
        ) {
            let mut stage = stage();
            let params = SafetyParams::default();
            let mut before = Vec3::zeros();
            for (x, y, z, dt) in inputs {
                let force = stage.release(Vec3::new(x, y, z), dt).command.force_n;
                prop_assert!(is_finite(force));
                prop_assert!(force.norm() <= params.peak_force_n);
                let slew_dt = if dt.is_finite() { dt.max(0.0) } else { 0.0 };
                // The difference of two stored forces carries one rounding of each.
                prop_assert!((force - before).norm() <= params.slew_n_per_s * slew_dt + 4.0 * f64::EPSILON * params.peak_force_n);
                before = force;
            }
        }
    }
}
