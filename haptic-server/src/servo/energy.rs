//! Passivity observer on the device port.
//!
//! E_k = E_{k−1} + F_{k−1} · (x_k − x_{k−1}): the work of the force on the hand between two samples, joules; positive:
//! energy given to the hand. The force is the one that left safety; positions are the accepted samples.
//! Source: the usual discrete observer (numerics of the coupling); a coupling with Kvc and Bvc on tissue that
//! stores energy may lend and take back, but must not gain over time.
//! Deliberately absent: a passivity controller; it changed nothing that the coupling had not already settled.

use sim_core::vector::Vec3;

/// Work done on the hand so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyObserver {
    last: Option<(Vec3, Vec3)>,
    given_j: f64,
}

impl EnergyObserver {
    /// After a tick: the accepted position and the force that will act from here on.
    pub fn measure(&mut self, position_m: Vec3, force_n: Vec3) {
        if let Some((position, force)) = self.last {
            self.given_j += force.dot(&(position_m - position));
        }
        self.last = Some((position_m, force_n));
    }

    /// Energy given to the hand so far, joules.
    #[must_use]
    pub fn given_j(&self) -> f64 {
        self.given_j
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_takes_in_what_closed_form_says_and_gives_it_back() {
        // Hand pushes 10 mm into a 200 N/m spring and comes back: ½ k x² = 10 mJ taken, then returned.
        let mut observer = EnergyObserver::default();
        let steps = 10_000;
        let at = |i: i32| 0.01 * f64::from(i) / f64::from(steps);
        for i in (0..=steps).chain((0..steps).rev()) {
            let x = at(i);
            observer.measure(Vec3::new(x, 0.0, 0.0), Vec3::new(-200.0 * x, 0.0, 0.0));
            if i == steps {
                // The force held over a step is the one before it: k x dx / 2 less than the integral.
                assert!((observer.given_j() + 0.01).abs() < 2e-6, "{}", observer.given_j());
            }
        }
        assert!(observer.given_j().abs() < 4e-6);
        // A held force lags by one sample, so the round trip gives k x dx = 2 µJ, never less.
        assert!(observer.given_j() > 0.0);
    }
}
