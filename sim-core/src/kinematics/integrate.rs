//! The time step of a suture point and its closed-form limits.
//!
//! `v⁺ = v + a·Δt, x⁺ = x + v⁺·Δt` (Zhang et al., Eq. (2)); SI units. Two ways to take the drag of Eq. (3):
//! - literal, `−c·v` at time t: stable while `K·Δt² + 2c·Δt < 4m`;
//! - implicit, `−c·v⁺`, so `v⁺ = (v + Δt·F/m)/(1 + c·Δt/m)`: stable while `K·Δt² < 4m + 2c·Δt`.
//!
//! `K` is the largest stiffness that the point (or, with `m` and `c` alike everywhere, the whole net) sees.
//! Both limits follow from Jury's test on the characteristic polynomial of the linear problem.
//!
//! Deliberately absent: forces (see `suture_point`), stiffness taken implicitly (see `port_tick`).

use crate::vector::Vec3;

/// Position and velocity of one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeState {
    /// Position, metres.
    pub position_m: Vec3,
    /// Velocity, metres per second.
    pub velocity_m_per_s: Vec3,
}

/// How the drag of Eq. (3) is taken in Eq. (2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KinematicsForm {
    /// At the end of the step, with the stiffness.
    #[default]
    ImplicitDrag,
    /// At its start, as printed; sub-stepped where it must be.
    Literal,
}

/// Eq. (2) as printed: `acceleration` holds every force of Eq. (3) at time t, the damping included.
#[must_use]
pub fn step_literal(state: NodeState, acceleration_m_per_s2: Vec3, dt_s: f64) -> NodeState {
    let velocity_m_per_s = state.velocity_m_per_s + acceleration_m_per_s2 * dt_s;
    NodeState { position_m: state.position_m + velocity_m_per_s * dt_s, velocity_m_per_s }
}

/// Eq. (2) with the drag taken at the end of the step; `force_n` is every force of Eq. (3) but the damping.
#[must_use]
pub fn step_implicit_drag(state: NodeState, force_n: Vec3, mass_kg: f64, drag_n_s_per_m: f64, dt_s: f64) -> NodeState {
    let velocity_m_per_s = (state.velocity_m_per_s * mass_kg + force_n * dt_s) / (mass_kg + drag_n_s_per_m * dt_s);
    NodeState { position_m: state.position_m + velocity_m_per_s * dt_s, velocity_m_per_s }
}

/// Literal drag: `(K·Δt² + 2c·Δt)/(4m)`, stable below 1.
#[must_use]
pub fn literal_stability_number(stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    (stiffness_n_per_m * dt_s * dt_s + 2.0 * drag_n_s_per_m * dt_s) / (4.0 * mass_kg)
}

/// Implicit drag: `S = K·Δt²/(4m + 2c·Δt)`, stable below 1.
#[must_use]
pub fn implicit_stability_number(stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    stiffness_n_per_m * dt_s * dt_s / (4.0 * mass_kg + 2.0 * drag_n_s_per_m * dt_s)
}

/// Literal drag: the mass at the limit, `c·Δt/2 + K·Δt²/4`.
#[must_use]
pub fn literal_min_mass_kg(stiffness_n_per_m: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    drag_n_s_per_m * dt_s / 2.0 + stiffness_n_per_m * dt_s * dt_s / 4.0
}

/// Implicit drag: the mass at the limit, `K·Δt²/4 − c·Δt/2`, or 0 where every mass is stable.
#[must_use]
pub fn implicit_min_mass_kg(stiffness_n_per_m: f64, drag_n_s_per_m: f64, dt_s: f64) -> f64 {
    (stiffness_n_per_m * dt_s * dt_s / 4.0 - drag_n_s_per_m * dt_s / 2.0).max(0.0)
}

/// Literal drag: the step at the limit, `(√(c² + 4mK) − c)/K`, written so that small `K` loses no digits.
/// Infinite without spring and drag.
#[must_use]
pub fn literal_max_dt_s(stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> f64 {
    let root = (drag_n_s_per_m * drag_n_s_per_m + 4.0 * mass_kg * stiffness_n_per_m).sqrt();
    4.0 * mass_kg / (root + drag_n_s_per_m)
}

/// Implicit drag: the step at the limit, `(c + √(c² + 4mK))/K`; infinite without a spring.
#[must_use]
pub fn implicit_max_dt_s(stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> f64 {
    let root = (drag_n_s_per_m * drag_n_s_per_m + 4.0 * mass_kg * stiffness_n_per_m).sqrt();
    if stiffness_n_per_m <= 0.0 { f64::INFINITY } else { (drag_n_s_per_m + root) / stiffness_n_per_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps after which a point 2 % beyond the limit must have grown and one 2 % inside must not.
    const STEPS: usize = 4000;
    /// Distance from the limit at which the verdict is asked.
    const MARGIN: f64 = 0.02;
    /// A start of 1 µm that has come this far has grown beyond doubt.
    const BLOWN_UP_M: f64 = 1.0;

    fn literal_amplitude(k: f64, m: f64, c: f64, dt: f64) -> f64 {
        let mut s = NodeState { position_m: Vec3::new(1e-6, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
        for _ in 0..STEPS {
            let a = (-k * s.position_m - c * s.velocity_m_per_s) / m;
            s = step_literal(s, a, dt);
            if s.position_m.norm() > BLOWN_UP_M {
                break;
            }
        }
        s.position_m.norm() / 1e-6
    }

    fn implicit_amplitude(k: f64, m: f64, c: f64, dt: f64) -> f64 {
        let mut s = NodeState { position_m: Vec3::new(1e-6, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
        for _ in 0..STEPS {
            s = step_implicit_drag(s, -k * s.position_m, m, c, dt);
            if s.position_m.norm() > BLOWN_UP_M {
                break;
            }
        }
        s.position_m.norm() / 1e-6
    }

    /// (K, c) of the three tissues of Table 2 for a node of valence 4: K = 2k.
    const TABLE_2_NODES: [(f64, f64); 3] = [(320.0, 3.0), (360.0, 3.0), (540.0, 2.0)];

    #[test]
    fn eq2_velocity_first_then_position_with_the_new_velocity() {
        let s = NodeState { position_m: Vec3::new(1.0, 2.0, 3.0), velocity_m_per_s: Vec3::new(0.5, 0.0, -0.5) };
        let out = step_literal(s, Vec3::new(2.0, 4.0, 0.0), 0.25);
        assert_eq!(out.velocity_m_per_s, Vec3::new(1.0, 1.0, -0.5));
        assert_eq!(out.position_m, Vec3::new(1.25, 2.25, 2.875));
        let drag = step_implicit_drag(s, Vec3::new(2.0, 4.0, 0.0), 1.0, 4.0, 0.25);
        assert_eq!(drag.velocity_m_per_s, Vec3::new(0.5, 0.5, -0.25));
        assert_eq!(drag.position_m, Vec3::new(1.125, 2.125, 2.9375));
    }

    #[test]
    fn eq2_literal_minimum_mass_of_the_skin_point_is_1_58_grams_at_1_ms() {
        for (dt, grams) in [(1e-3, 1.58), (2e-3, 3.32), (5e-3, 9.5)] {
            assert!((literal_min_mass_kg(320.0, 3.0, dt) * 1e3 - grams).abs() < 6e-3 * grams, "{dt}");
        }
        assert_eq!(implicit_min_mass_kg(320.0, 3.0, 1e-3), 0.0);
        // 0.055 g per node: 36 µs as printed, although the spring alone would allow nearly a millisecond.
        assert!((literal_max_dt_s(320.0, 5.5e-5, 3.0) * 1e6 - 36.0).abs() < 1.0);
    }

    #[test]
    fn eq2_literal_limit_separates_growth_from_decay() {
        for (k, c) in TABLE_2_NODES {
            for dt in [0.25e-3, 1e-3, 5e-3] {
                let m = literal_min_mass_kg(k, c, dt);
                assert!(literal_amplitude(k, m * (1.0 + MARGIN), c, dt) < 1.0, "K {k} c {c} dt {dt} heavier");
                assert!(literal_amplitude(k, m * (1.0 - MARGIN), c, dt) > 10.0, "K {k} c {c} dt {dt} lighter");
            }
        }
    }

    #[test]
    fn eq2_implicit_limit_separates_growth_from_decay() {
        for (k, c) in TABLE_2_NODES {
            // Steps at which the implicit form has a limit at all: K·Δt > 2c.
            for dt in [0.025, 0.05] {
                let m = implicit_min_mass_kg(k, c, dt);
                assert!(m > 0.0);
                assert!(implicit_amplitude(k, m * (1.0 + MARGIN), c, dt) < 1.0, "K {k} c {c} dt {dt} heavier");
                assert!(implicit_amplitude(k, m * (1.0 - MARGIN), c, dt) > 10.0, "K {k} c {c} dt {dt} lighter");
            }
        }
    }

    #[test]
    fn eq2_implicit_drag_is_stable_at_1_khz_for_every_mass() {
        for (k, c) in TABLE_2_NODES {
            for exponent in -9..=0 {
                let m = 10_f64.powi(exponent);
                assert!(implicit_amplitude(k, m, c, 1e-3) <= 1.0, "K {k} m {m}");
            }
        }
    }

    #[test]
    fn limits_agree_with_each_other() {
        for (k, c) in TABLE_2_NODES {
            for m in [1e-5, 1e-3, 1e-1] {
                let literal = literal_max_dt_s(k, m, c);
                let implicit = implicit_max_dt_s(k, m, c);
                assert!((literal_min_mass_kg(k, c, literal) / m - 1.0).abs() < 1e-9);
                assert!((implicit_min_mass_kg(k, c, implicit) / m - 1.0).abs() < 1e-9);
                assert!((literal_stability_number(k, m, c, literal) - 1.0).abs() < 1e-12);
                assert!((implicit_stability_number(k, m, c, implicit) - 1.0).abs() < 1e-12);
            }
        }
        assert_eq!(implicit_max_dt_s(0.0, 1e-3, 3.0), f64::INFINITY);
        assert_eq!(literal_max_dt_s(0.0, 1e-3, 4.0), 2.0 * 1e-3 / 4.0);
    }
}
