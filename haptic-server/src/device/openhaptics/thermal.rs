//! Motor temperature: the force is taken back before the library complains.
//!
//! From 0.7 on the limit sinks by 0.1 % per tick (1 kHz) to the continuous force, and rises by as much once the motors
//! are below 0.5 again; from 0.9 on it goes to zero in proportion, reached at 1. When the library complains of warm motors
//! all the same, the limit sinks by 1 % per tick to zero and stays there until the motors are below 0.5. The temperature is the
//! library's model, 0 cold to 1 hot; one that is not a number counts as hot. Newtons, seconds.

use sim_core::vector::Vec3;

/// The force is taken back from here on.
const WARM: f64 = 0.7;
/// And given again below this.
const COOL: f64 = 0.5;
/// From here on it goes to zero.
const HOT: f64 = 0.9;
/// Share per tick by which the limit moves.
const DRIFT: f64 = 1e-3;
/// Share per tick after a complaint.
const FADE: f64 = 1e-2;
/// Below this a limit is zero, newtons.
const NOTHING_N: f64 = 1e-3;

/// What the limit is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warmth {
    /// Nothing.
    Cold,
    /// The force is taken back.
    Reducing,
    /// The library complained: no force until cool.
    Resting,
}

/// The limit.
#[derive(Clone, Copy, Debug)]
pub struct Thermal {
    peak_n: f64,
    continuous_n: f64,
    limit_n: f64,
    warmth: Warmth,
}

impl Thermal {
    /// Cold motors.
    #[must_use]
    pub fn new(peak_n: f64, continuous_n: f64) -> Self {
        Self { peak_n, continuous_n, limit_n: peak_n, warmth: Warmth::Cold }
    }

    /// One tick with the hottest motor's temperature; `complained`: the library has said that the motors are too warm.
    /// Gives the new warmth when it has changed.
    pub fn tick(&mut self, temperature: f64, complained: bool) -> Option<Warmth> {
        let temperature = if temperature.is_finite() { temperature } else { 1.0 };
        let next = match self.warmth {
            _ if complained => Warmth::Resting,
            Warmth::Cold if temperature >= WARM => Warmth::Reducing,
            Warmth::Reducing | Warmth::Resting if temperature < COOL => Warmth::Cold,
            warmth => warmth,
        };
        self.limit_n = match next {
            Warmth::Cold => (self.limit_n.max(NOTHING_N) * (1.0 + DRIFT)).min(self.peak_n),
            Warmth::Reducing => (self.limit_n * (1.0 - DRIFT)).max(self.continuous_n.min(self.limit_n)),
            Warmth::Resting => self.limit_n * (1.0 - FADE),
        };
        self.limit_n = self.limit_n.min(self.peak_n * ((1.0 - temperature) / (1.0 - HOT)).clamp(0.0, 1.0));
        if next == Warmth::Resting && self.limit_n < NOTHING_N {
            self.limit_n = 0.0;
        }
        let changed = next != self.warmth;
        self.warmth = next;
        changed.then_some(next)
    }

    /// The limit, newtons.
    #[must_use]
    pub fn limit_n(&self) -> f64 {
        self.limit_n
    }

    /// A force within the limit.
    #[must_use]
    pub fn within(&self, force_n: Vec3) -> Vec3 {
        let size = force_n.norm();
        if size <= self.limit_n { force_n } else { force_n * (self.limit_n / size) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticked(thermal: &mut Thermal, temperature: f64, ticks: u32) {
        for _ in 0..ticks {
            thermal.tick(temperature, false);
        }
    }

    #[test]
    fn warm_motors_get_the_continuous_force_and_cool_ones_all_of_it() {
        let mut thermal = Thermal::new(3.3, 0.88);
        ticked(&mut thermal, 0.69, 1_000);
        assert_eq!(thermal.limit_n(), 3.3);
        assert_eq!(thermal.tick(0.7, false), Some(Warmth::Reducing));
        ticked(&mut thermal, 0.7, 99);
        assert!((thermal.limit_n() - 3.3 * 0.999_f64.powi(100)).abs() < 1e-12);
        ticked(&mut thermal, 0.7, 2_000);
        assert_eq!(thermal.limit_n(), 0.88);
        ticked(&mut thermal, 0.55, 100);
        assert_eq!(thermal.limit_n(), 0.88, "between the two nothing rises");
        assert_eq!(thermal.tick(0.49, false), Some(Warmth::Cold));
        ticked(&mut thermal, 0.49, 2_000);
        assert_eq!(thermal.limit_n(), 3.3);
        assert_eq!(thermal.within(Vec3::new(0.0, 4.0, 0.0)).y, 3.3);
    }

    #[test]
    fn hot_motors_get_nothing_before_the_library_complains() {
        let mut thermal = Thermal::new(3.3, 0.88);
        ticked(&mut thermal, 0.95, 1);
        assert!((thermal.limit_n() - 1.65).abs() < 1e-12);
        ticked(&mut thermal, 1.0, 1);
        assert_eq!(thermal.limit_n(), 0.0);
        let mut broken = Thermal::new(3.3, 0.88);
        broken.tick(f64::NAN, false);
        assert_eq!(broken.limit_n(), 0.0);
    }

    #[test]
    fn after_a_complaint_the_force_stays_away_until_the_motors_are_cool() {
        let mut thermal = Thermal::new(3.3, 0.88);
        assert_eq!(thermal.tick(0.6, true), Some(Warmth::Resting));
        ticked(&mut thermal, 0.6, 1_000);
        assert_eq!((thermal.limit_n(), thermal.within(Vec3::x())), (0.0, Vec3::zeros()));
        ticked(&mut thermal, 0.51, 10_000);
        assert_eq!(thermal.limit_n(), 0.0);
        ticked(&mut thermal, 0.4, 10_000);
        assert_eq!(thermal.limit_n(), 3.3);
    }
}
