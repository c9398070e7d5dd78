//! Relaxed Long Range Attachment (LRA) between a suture point and a surrounding node.
//!
//! `d_i = d_i⁰ + β · max(‖x_j − x_i‖ − d_i⁰, 0)` (Zhang et al., Eq. (1)), β ∈ [0, 1]: 0 is a hard one-sided
//! tether, 1 is no constraint. Lengths in metres, stiffness in newtons per metre.
//!
//! One projection per step makes β depend on the step: it acts as the stiffness
//! `K = (1 − β)(m + c·dt) / (β·dt²)`. [`stiffness_from_relaxation`] converts β once, at a named `dt_ref`.
//!
//! Deliberately absent: which nodes are attached, geodesic rest distances and the order of projections
//! (tissue regulation), and any memory of earlier radii: Eq. (1) is memoryless, a radius that is carried
//! over would creep.

use crate::vector::Vec3;

/// Why a relaxation parameter is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("relaxation beta = {beta} is outside 0 to 1: use 0 for a hard tether, 1 for none, or a value between")]
pub struct RelaxationError {
    /// The value given.
    pub beta: f64,
}

/// Accepts β in [0, 1] and nothing else.
///
/// # Errors
/// [`RelaxationError`] for values below 0, above 1, or not finite.
pub fn check_relaxation(beta: f64) -> Result<f64, RelaxationError> {
    if (0.0..=1.0).contains(&beta) { Ok(beta) } else { Err(RelaxationError { beta }) }
}

/// Eq. (1): the distance at which the relaxed attachment leaves a node that is `current_m` away.
#[must_use]
pub fn relaxed_distance(rest_m: f64, beta: f64, current_m: f64) -> f64 {
    rest_m + beta * (current_m - rest_m).max(0.0)
}

/// Projects a node that has left the sphere of radius `rest_m` onto the sphere of Eq. (1) around
/// `center`; a node inside, and one that coincides with the centre, stays bit for bit.
#[must_use]
pub fn project(center: Vec3, node: Vec3, rest_m: f64, beta: f64) -> Vec3 {
    let away = node - center;
    let current_m = away.norm();
    if current_m <= rest_m || current_m == 0.0 || beta == 1.0 {
        return node;
    }
    center + away * (relaxed_distance(rest_m, beta, current_m) / current_m)
}

/// The stiffness that one projection per `dt_ref` stands for on a node of mass `m` and drag `c`:
/// `(1 − β)(m + c·dt_ref) / (β·dt_ref²)`; 0 for β = 1, infinite for β = 0.
#[must_use]
pub fn stiffness_from_relaxation(beta: f64, mass_kg: f64, drag_n_s_per_m: f64, dt_ref_s: f64) -> f64 {
    if beta >= 1.0 {
        return 0.0;
    }
    if beta <= 0.0 {
        return f64::INFINITY;
    }
    (1.0 - beta) * (mass_kg + drag_n_s_per_m * dt_ref_s) / (beta * dt_ref_s * dt_ref_s)
}

/// Force of the compliant attachment on the node (the suture point feels the opposite):
/// `−K · max(‖x_i − x_j‖ − d_i⁰, 0)` along the line from the suture point to the node.
#[must_use]
pub fn attachment_force(center: Vec3, node: Vec3, rest_m: f64, stiffness_n_per_m: f64) -> Vec3 {
    let away = node - center;
    let current_m = away.norm();
    if current_m <= rest_m || current_m == 0.0 {
        return Vec3::zeros();
    }
    away * (-stiffness_n_per_m * (current_m - rest_m) / current_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rounding of one multiply-add on lengths below a metre.
    const ROUND_M: f64 = 1e-15;

    #[test]
    fn eq1_relaxed_distance_is_the_rest_distance_plus_the_relaxed_excess() {
        // 10 mm rest, 15 mm now: the skin's β = 0.8 leaves 14 mm, the liver's 0.6 13 mm, the vessel's 0.4 12 mm.
        for (beta, expected_m) in [(0.8, 0.014), (0.6, 0.013), (0.4, 0.012), (0.0, 0.010), (1.0, 0.015)] {
            assert!((relaxed_distance(0.010, beta, 0.015) - expected_m).abs() < ROUND_M, "beta {beta}");
        }
        assert_eq!(relaxed_distance(0.010, 0.8, 0.004), 0.010);
    }

    #[test]
    fn eq1_projection_moves_the_node_along_its_ray_and_only_from_outside() {
        let center = Vec3::new(0.01, -0.02, 0.03);
        let ray = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let moved = project(center, center + ray * 0.015, 0.010, 0.8);
        assert!((moved - (center + ray * 0.014)).norm() < ROUND_M);
        let inside = center + ray * 0.009;
        assert_eq!(project(center, inside, 0.010, 0.0), inside);
        assert_eq!(project(center, center, 0.0, 0.0), center);
        let free = center + ray * 0.5;
        assert_eq!(project(center, free, 0.010, 1.0), free);
    }

    #[test]
    fn eq1_repeated_projection_multiplies_the_excess_and_does_not_ratchet_the_radius() {
        let (rest_m, beta, pulled_m) = (0.010, 0.8, 0.020);
        for _ in 0..10 {
            // The node is held out again each time: the memoryless radius stays, a ratcheting one creeps to 20 mm.
            let node = project(Vec3::zeros(), Vec3::new(pulled_m, 0.0, 0.0), rest_m, beta);
            assert!((node.x - 0.018).abs() < ROUND_M);
        }
        let mut node = Vec3::new(pulled_m, 0.0, 0.0);
        for step in 1..=5 {
            node = project(Vec3::zeros(), node, rest_m, beta);
            assert!((node.x - rest_m - 0.010 * beta.powi(step)).abs() < 1e-15);
        }
    }

    #[test]
    fn eq1_stiffness_matches_the_steady_state_of_repeated_projection() {
        // Literal loop on one node: a constant force moves it (implicit drag), the projection multiplies the excess by β
        // and the velocity follows the projected position. Steady state: force = K · excess.
        for (beta, mass, drag, dt) in [(0.8, 4.8e-5, 3.0, 1e-3), (0.6, 8e-5, 3.0, 5e-3), (0.4, 1.4e-3, 2.0, 1e-3)] {
            let (force, rest) = (0.5, 0.010);
            let (mut x, mut v) = (rest, 0.0_f64);
            for _ in 0..4000 {
                let start = x;
                v = (v + dt * force / mass) / (1.0 + drag * dt / mass);
                x = project(Vec3::zeros(), Vec3::new(x + dt * v, 0.0, 0.0), rest, beta).x;
                v = (x - start) / dt;
            }
            let k = stiffness_from_relaxation(beta, mass, drag, dt);
            // At the fixed point the excess after projection is e, before it e/β, so K counts the excess after projection.
            let measured = force / (x - rest);
            assert!((measured / k - 1.0).abs() < 1e-6, "beta {beta}: measured {measured}, formula {k}");
        }
    }

    #[test]
    fn stiffness_limits_and_range_check() {
        assert_eq!(stiffness_from_relaxation(1.0, 1e-3, 3.0, 1e-3), 0.0);
        assert_eq!(stiffness_from_relaxation(0.0, 1e-3, 3.0, 1e-3), f64::INFINITY);
        assert_eq!(check_relaxation(0.8), Ok(0.8));
        for bad in [-1e-9, 1.0 + 1e-9, f64::NAN, f64::INFINITY] {
            assert!(check_relaxation(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn compliant_force_is_one_sided_and_pulls_back() {
        let f = attachment_force(Vec3::zeros(), Vec3::new(0.0, 0.012, 0.0), 0.010, 750.0);
        assert!((f - Vec3::new(0.0, -1.5, 0.0)).norm() < 1e-12);
        assert_eq!(attachment_force(Vec3::zeros(), Vec3::new(0.0, 0.008, 0.0), 0.010, 750.0), Vec3::zeros());
    }

    proptest! {
        #[test]
        fn projection_stays_between_the_two_spheres(
            c in prop::array::uniform3(-1.0..1.0_f64), n in prop::array::uniform3(-1.0..1.0_f64),
            rest in 0.0..1.0_f64, beta in 0.0..=1.0_f64,
        ) {
            let (c, n) = (Vec3::from(c), Vec3::from(n));
            let out = project(c, n, rest, beta);
            let (before, after) = ((n - c).norm(), (out - c).norm());
            prop_assert!(out.iter().all(|v| v.is_finite()));
            prop_assert!(after <= before + 1e-12 && after + 1e-12 >= before.min(rest));
        }
    }
}
