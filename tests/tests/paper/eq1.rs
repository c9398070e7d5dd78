//! Eq. (1): `d_i = d_i⁰ + β · max(‖x_j − x_i‖ − d_i⁰, 0)`, and what one projection per step makes of it.

use proptest::prelude::*;
use sim_core::kinematics::attachment::{
    attachment_force, check_relaxation, project, relaxed_distance, stiffness_from_relaxation,
};
use sim_core::vector::Vec3;
use suture_tests::closed_forms::attachment_stiffness_n_per_m;

/// Rounding of a norm and a division at lengths of millimetres.
const LENGTH_ROUNDING_M: f64 = 1e-15;

/// A settled node differs from its fixed point by less than this share.
const SETTLED: f64 = 1e-6;

fn direction() -> impl Strategy<Value = Vec3> {
    (0.1..3.0, 0.0..6.2).prop_map(|(polar, azimuth): (f64, f64)| {
        Vec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
    })
}

proptest! {
    #[test]
    fn eq1_leaves_the_printed_share_of_the_excess(
        rest in 1e-4..0.05_f64, stretch in 0.2..3.0_f64, beta in 0.0..=1.0_f64, ray in direction(),
    ) {
        let center = Vec3::new(0.01, -0.02, 0.03);
        let node = center + ray * (rest * stretch);
        let moved = project(center, node, rest, beta);
        let distance = (moved - center).norm();
        // Two cases written out instead of the max of the paper.
        let expected = if stretch > 1.0 { (1.0 - beta) * rest + beta * rest * stretch } else { rest * stretch };
        prop_assert!((distance - expected).abs() < LENGTH_ROUNDING_M * 100.0, "{distance} {expected}");
        prop_assert!((moved - center).cross(&ray).norm() < LENGTH_ROUNDING_M * 100.0, "left its ray");
        if stretch > 1.0 {
            prop_assert!((relaxed_distance(rest, beta, rest * stretch) - expected).abs() < LENGTH_ROUNDING_M * 100.0);
        }
    }
}

#[test]
fn eq1_spheres_of_fig2_are_its_two_limits() {
    let (center, node) = (Vec3::zeros(), Vec3::new(0.0, 0.013, 0.0));
    assert_eq!(project(center, node, 0.01, 0.0).y, 0.01, "beta 0: the dashed sphere");
    assert_eq!(project(center, node, 0.01, 1.0), node, "beta 1: no constraint, bit for bit");
    for beta in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
        assert!(check_relaxation(beta).is_err(), "{beta}");
    }
}

/// Excess of a node under a constant pull after many steps of implicit drag, velocity from displacement.
fn steady_excess_m(pull_n: f64, mass: f64, drag: f64, dt: f64, mut hold: impl FnMut(f64) -> (f64, f64)) -> f64 {
    let (mut excess, mut velocity) = (0.0, 0.0);
    for _ in 0..(3.0 / dt) as usize {
        let (force, share) = hold(excess);
        let before = excess;
        velocity = (mass * velocity + dt * (pull_n + force)) / (mass + drag * dt);
        excess = (excess + dt * velocity) * share;
        velocity = if share == 1.0 { velocity } else { (excess - before) / dt };
    }
    excess
}

#[test]
fn eq1_per_step_is_a_spring_that_stiffens_with_the_rate_and_converted_once_it_does_not() {
    let (rest, pull, mass, drag) = (0.01, 0.2, 1e-4, 3.0);
    let away = |excess: f64| Vec3::new(rest + excess, 0.0, 0.0);
    let converted = stiffness_from_relaxation(0.8, mass, drag, 1.0 / 60.0);
    assert!((converted / attachment_stiffness_n_per_m(0.8, mass, drag, 1.0 / 60.0) - 1.0).abs() < 1e-12);
    for dt in [4e-3, 1e-3, 2.5e-4] {
        let literal = steady_excess_m(pull, mass, drag, dt, |excess| {
            let left = project(Vec3::zeros(), away(excess), rest, 0.8).x - rest;
            (0.0, if excess > 0.0 { left / excess } else { 1.0 })
        });
        // The projection comes after the step: the spring is seen by the excess that is left.
        let formula = attachment_stiffness_n_per_m(0.8, mass, drag, dt);
        assert!((pull / literal / formula - 1.0).abs() < 1e-3, "dt {dt}: {} against {formula}", pull / literal);
        let compliant = steady_excess_m(pull, mass, drag, dt, |excess| {
            (attachment_force(Vec3::zeros(), away(excess), rest, converted).x, 1.0)
        });
        assert!((pull / compliant / converted - 1.0).abs() < SETTLED, "dt {dt}: {}", pull / compliant);
    }
}
