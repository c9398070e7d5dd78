//! Results with a formula, to which the simulation is compared. SI units throughout.
//!
//! | case | formula |
//! |---|---|
//! | spring, mass, drag | m ẍ + c ẋ + k x = 0, solved in its three regimes |
//! | chain | ω_j = 2 √(k/m) sin(jπ / 2n) for n links between fixed ends |
//! | hanging chain | the tension of a link is the weight below it |
//! | catenary | L/2 = a sinh(s/2a), sag = a (cosh(s/2a) − 1) |
//! | ring under pressure | u = p R² / (E t), and its discrete form with N links |
//! | square lattice | E t = 4k/3, ν = 1/3 with diagonals of k/2 |
//!
//! Absent: anything that needs a computer to sum or to iterate, but for the catenary's one unknown.

use std::f64::consts::PI;

/// A mass on a spring with viscous drag.
#[derive(Clone, Copy, Debug)]
pub struct SpringMassDamper {
    /// Kilograms.
    pub mass_kg: f64,
    /// Newton seconds per metre.
    pub drag_n_s_per_m: f64,
    /// Newtons per metre.
    pub stiffness_n_per_m: f64,
}

impl SpringMassDamper {
    /// Displacement at `t_s` after release at `x0_m` with velocity `v0_m_per_s`.
    #[must_use]
    pub fn displacement_m(&self, x0_m: f64, v0_m_per_s: f64, t_s: f64) -> f64 {
        let decay = self.drag_n_s_per_m / (2.0 * self.mass_kg);
        let square = self.stiffness_n_per_m / self.mass_kg - decay * decay;
        let slope = v0_m_per_s + decay * x0_m;
        let envelope = (-decay * t_s).exp();
        if square > 0.0 {
            let omega = square.sqrt();
            envelope * (x0_m * (omega * t_s).cos() + slope / omega * (omega * t_s).sin())
        } else if square < 0.0 {
            let rate = (-square).sqrt();
            let (slow, fast) = ((rate - decay) * t_s, (-rate - decay) * t_s);
            0.5 * ((x0_m + slope / rate) * slow.exp() + (x0_m - slope / rate) * fast.exp())
        } else {
            envelope * (x0_m + slope * t_s)
        }
    }
}

/// Angular frequency of longitudinal mode `mode` (from 1) of a chain of `links` equal links between fixed ends.
#[must_use]
pub fn chain_frequency(stiffness_n_per_m: f64, mass_kg: f64, links: usize, mode: usize) -> f64 {
    2.0 * (stiffness_n_per_m / mass_kg).sqrt() * (mode as f64 * PI / (2.0 * links as f64)).sin()
}

/// Tension of each link of a chain hanging from its first node; `weights_n` are those of the nodes below it.
#[must_use]
pub fn hanging_tensions_n(weights_n: &[f64]) -> Vec<f64> {
    (0..weights_n.len()).map(|link| weights_n[link..].iter().sum()).collect()
}

/// Sag of an inextensible line of `length_m` between two supports at one height, `span_m` apart.
#[must_use]
pub fn catenary_sag_m(length_m: f64, span_m: f64) -> f64 {
    let excess = |a: f64| 2.0 * a * (span_m / (2.0 * a)).sinh() - length_m;
    let (mut low, mut high) = (span_m * 1e-3, span_m * 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high * ((span_m / (2.0 * high)).cosh() - 1.0)
}

/// Radial displacement of a thin ring: `p R² / (E t)` with `E t` the membrane stiffness.
#[must_use]
pub fn thin_ring_displacement_m(pressure_pa: f64, radius_m: f64, membrane_n_per_m: f64) -> f64 {
    pressure_pa * radius_m * radius_m / membrane_n_per_m
}

/// Radial displacement of `links` nodes on a ring, joined by springs, each pushed outward by `force_n`.
#[must_use]
pub fn spring_ring_displacement_m(force_n: f64, stiffness_n_per_m: f64, links: usize) -> f64 {
    let half_angle = PI / links as f64;
    let tension_n = force_n / (2.0 * half_angle.sin());
    tension_n / stiffness_n_per_m / (2.0 * half_angle.sin())
}

/// Membrane stiffness `E t` of a square lattice of springs `k` with both diagonals of `k/2`.
#[must_use]
pub fn lattice_membrane_n_per_m(stiffness_n_per_m: f64) -> f64 {
    4.0 / 3.0 * stiffness_n_per_m
}

/// Stiffness that an attachment with β per step shows: `(1 − β)(m + c dt) / (β dt²)`.
#[must_use]
pub fn attachment_stiffness_n_per_m(beta: f64, mass_kg: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    (1.0 - beta) * (mass_kg + drag_n_s_per_m * dt_s) / (beta * dt_s * dt_s)
}

/// Smallest mass for the printed explicit Eq. (2)–(3): `λ dt² + 2c dt < 4m`.
#[must_use]
pub fn explicit_mass_limit_kg(lambda_n_per_m: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    0.25 * lambda_n_per_m * dt_s * dt_s + 0.5 * drag_n_s_per_m * dt_s
}

/// Largest stable step with implicit drag: `λ dt² < 4m + 2c dt`.
#[must_use]
pub fn implicit_drag_step_limit_s(lambda_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> f64 {
    (drag_n_s_per_m + (drag_n_s_per_m * drag_n_s_per_m + 4.0 * mass_kg * lambda_n_per_m).sqrt()) / lambda_n_per_m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central differences of a smooth function at this width are good to about 1e-7 of its scale.
    const WIDTH_S: f64 = 1e-4;

    #[test]
    fn each_regime_of_the_damper_solves_its_equation() {
        for drag in [0.0, 0.5, 4.0, 9.0] {
            let system = SpringMassDamper { mass_kg: 1.0, drag_n_s_per_m: drag, stiffness_n_per_m: 4.0 };
            let x = |t| system.displacement_m(0.3, -0.7, t);
            assert!((x(0.0) - 0.3).abs() < 1e-15 && ((x(WIDTH_S) - x(-WIDTH_S)) / (2.0 * WIDTH_S) + 0.7).abs() < 1e-6);
            for t in [0.1, 1.0, 3.0] {
                let speed = (x(t + WIDTH_S) - x(t - WIDTH_S)) / (2.0 * WIDTH_S);
                let acceleration = (x(t + WIDTH_S) - 2.0 * x(t) + x(t - WIDTH_S)) / (WIDTH_S * WIDTH_S);
                let rest = acceleration + drag * speed + 4.0 * x(t);
                assert!(rest.abs() < 1e-6, "drag {drag}, t {t}: {rest}");
            }
        }
    }

    #[test]
    fn catenary_has_the_length_it_was_given() {
        let (length, span) = (1.2, 1.0);
        let sag = catenary_sag_m(length, span);
        // From L and sag alone: a = (L²/4 − sag²) / (2 sag).
        let a = (length * length / 4.0 - sag * sag) / (2.0 * sag);
        assert!((2.0 * a * (span / (2.0 * a)).sinh() - length).abs() < 1e-9);
    }

    #[test]
    fn spring_ring_tends_to_the_thin_ring() {
        let (radius, stiffness, pressure) = (0.005, 300.0, 1000.0);
        let error = |links: usize| {
            let arc = 2.0 * PI * radius / links as f64;
            // A band of unit width per link: E t / arc is the stiffness of one link.
            let band = spring_ring_displacement_m(pressure * arc, stiffness / arc, links);
            band / thin_ring_displacement_m(pressure, radius, stiffness) - 1.0
        };
        assert!(error(32).abs() < 1e-2);
        assert!((error(32) / error(64) - 4.0).abs() < 0.05, "order 2");
    }

    #[test]
    fn both_step_limits_are_roots_of_their_inequality() {
        let (lambda, drag, dt) = (1000.0, 3.0, 1e-3);
        let mass = explicit_mass_limit_kg(lambda, drag, dt);
        assert!((lambda * dt * dt + 2.0 * drag * dt - 4.0 * mass).abs() < 1e-15);
        let limit = implicit_drag_step_limit_s(lambda, 1e-5, drag);
        assert!((lambda * limit * limit - 4e-5 - 2.0 * drag * limit).abs() < 1e-15);
    }
}
