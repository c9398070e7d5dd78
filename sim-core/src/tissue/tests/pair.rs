//! Pairs against the closed form of springs in series, alone and together with attachments.
//!
//! Two patches on anchor springs `k_a`, `k_b`, held at distance `D` by stiffness `K`: tension
//! `T = (L − D)/(1/k_a + 1/k_b + 1/K)`, whatever the step.

use super::{SKIN, even_patches};
use crate::tissue::constraint::{PairConstraint, PairSense, Pairs};
use crate::tissue::handle::HandleSlot;
use crate::tissue::network::{Spring, SpringFamily, SpringNetwork};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::regulation::{AttachmentSpec, Attachments, Engagement, RegulationMode};
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::SolverParams;
use crate::vector::Vec3;

const STITCH: PairConstraint = PairConstraint {
    a: PatchId(0),
    b: PatchId(1),
    target_m: 2e-3,
    stiffness_n_per_m: 500.0,
    max_force_n: 100.0,
    sense: PairSense::PullOnly,
};

/// Two nodes 10 mm apart, each on a spring of zero rest length to a held anchor at its place.
fn anchored(drag_n_s_per_m: f64) -> (SpringNetwork, PatchSet) {
    let (left, right) = (Vec3::zeros(), Vec3::new(0.01, 0.0, 0.0));
    let anchor = |a, b, k| Spring { a, b, stiffness_n_per_m: k, rest_length_m: 0.0, family: SpringFamily::Structural };
    let springs = vec![anchor(0, 2, 100.0), anchor(1, 3, 300.0)];
    let x = vec![left, right, left, right];
    let network = SpringNetwork::new(x, vec![1e-3; 4], vec![drag_n_s_per_m; 4], vec![0, 0, 1, 1], springs).unwrap();
    (network, even_patches(4, &[vec![0], vec![1]]))
}

fn stitched(patches: &PatchSet, constraint: PairConstraint) -> Stages {
    let mut pairs = Pairs::with_capacity(1);
    pairs.push(patches, constraint).unwrap();
    Stages { pairs: Some(pairs), ..Stages::default() }
}

/// Tension and distance after the net has come to rest.
fn at_rest(constraint: PairConstraint, period_s: f64) -> (f64, f64) {
    let (network, patches) = anchored(3.0);
    let mut stages = stitched(&patches, constraint);
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(period_s)).unwrap();
    for _ in 0..(1.0 / period_s) as usize {
        solver.step(&mut stages);
    }
    let x = &solver.state().position_m;
    (stages.pairs.map_or(0.0, |p| p.tension_n(0)), (x[1] - x[0]).norm())
}

#[test]
fn static_tension_is_that_of_springs_in_series_at_any_step() {
    for stiffness_n_per_m in [50.0, 500.0, 5e4, f64::INFINITY] {
        let expected = 8e-3 / (1.0 / 100.0 + 1.0 / 300.0 + 1.0 / stiffness_n_per_m);
        for period in [5e-3, 1e-3, 2e-4] {
            let (tension, distance) = at_rest(PairConstraint { stiffness_n_per_m, ..STITCH }, period);
            // After 30 time constants of c/k = 30 ms: e^-30 and rounding.
            assert!((tension - expected).abs() < 1e-9, "{stiffness_n_per_m} {period}: {tension} / {expected}");
            let open = 0.01 - expected / 100.0 - expected / 300.0;
            assert!((distance - open).abs() < 1e-11, "{stiffness_n_per_m} {period}: {distance} / {open}");
        }
    }
}

#[test]
fn the_holding_force_is_the_limit() {
    let (tension, distance) = at_rest(PairConstraint { max_force_n: 0.2, ..STITCH }, 1e-3);
    assert_eq!(tension, 0.2);
    assert!((distance - (0.01 - 0.2 / 100.0 - 0.2 / 300.0)).abs() < 1e-11, "{distance}");
}

#[test]
fn a_stitch_never_pushes_and_a_two_sided_hold_does() {
    let wide = PairConstraint { target_m: 0.015, ..STITCH };
    let (tension, distance) = at_rest(wide, 1e-3);
    assert_eq!((tension, distance), (0.0, 0.01));
    let (tension, _) = at_rest(PairConstraint { sense: PairSense::TwoSided, ..wide }, 1e-3);
    let expected = -5e-3 / (1.0 / 100.0 + 1.0 / 300.0 + 1.0 / 500.0);
    assert!((tension - expected).abs() < 1e-9, "{tension} / {expected}");
}

#[test]
fn a_pair_with_one_held_end_pulls_the_other_only() {
    let (network, patches) = anchored(3.0);
    let mut stages = stitched(&patches, STITCH);
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(1e-3)).unwrap();
    solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
    for _ in 0..1000 {
        solver.step(&mut stages);
    }
    let expected = 8e-3 / (1.0 / 300.0 + 1.0 / 500.0);
    let pairs = stages.pairs.as_ref().unwrap();
    assert!((pairs.tension_n(0) - expected).abs() < 1e-9);
    assert_eq!(solver.state().position_m[0], Vec3::zeros());
    let force = solver.port(HandleSlot(0), &stages).unwrap().force_n;
    // The stitch pulls the held patch towards the other; its own anchor spring has no length.
    assert!((force - Vec3::new(expected, 0.0, 0.0)).norm() < 1e-9, "{force}");
}

#[test]
fn patches_on_one_spot_give_no_direction_and_no_harm() {
    let (mut network, patches) = anchored(3.0);
    network.rest_m = vec![Vec3::zeros(); 4];
    for sense in [PairSense::PullOnly, PairSense::TwoSided] {
        let mut stages = stitched(&patches, PairConstraint { sense, ..STITCH });
        let mut solver = TissueSolver::new(network.clone(), patches.clone(), SolverParams::with_period(1e-3)).unwrap();
        solver.step(&mut stages);
        assert_eq!(solver.state().position_m, network.rest_m);
    }
}

/// Tension of a stitch between two suture points whose attachments are engaged, 200 ms after it was tied.
fn stitch_with_attachments(period_s: f64) -> f64 {
    let network = SKIN.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(3, 5), SKIN.plus(7, 5)]);
    let spec = |p, i| AttachmentSpec { patch: PatchId(p), followers: SKIN.followers(i, 5, 9e-3) };
    let mode = RegulationMode::Compliant { reference_step_s: 1e-3 };
    let mut attachments = Attachments::new(&network, &patches, &[spec(0, 3), spec(1, 7)], 0.6, mode).unwrap();
    attachments.engage(0, Engagement::Engaged);
    attachments.engage(1, Engagement::Engaged);
    let mut stages = stitched(&patches, PairConstraint { target_m: 16e-3, stiffness_n_per_m: 5e3, ..STITCH });
    stages.attachments = Some(attachments);
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(period_s)).unwrap();
    for _ in 0..(0.2 / period_s).round() as usize {
        solver.step(&mut stages);
    }
    stages.pairs.map_or(0.0, |p| p.tension_n(0))
}

#[test]
fn a_stitch_on_attached_points_pulls_alike_at_every_step() {
    let reference = stitch_with_attachments(2e-4);
    assert!(reference > 0.05, "{reference} N");
    for period in [1e-3, 2e-3, 5e-3] {
        let tension = stitch_with_attachments(period);
        // One per cent: first-order error of the creep at 5 ms.
        assert!((tension / reference - 1.0).abs() < 0.01, "{period}: {tension} N, reference {reference} N");
    }
}

#[test]
fn unusable_pairs_are_refused() {
    let (_, patches) = anchored(3.0);
    let mut pairs = Pairs::default();
    for bad in [
        PairConstraint { b: PatchId(0), ..STITCH },
        PairConstraint { b: PatchId(9), ..STITCH },
        PairConstraint { target_m: -1e-3, ..STITCH },
        PairConstraint { target_m: f64::NAN, ..STITCH },
        PairConstraint { stiffness_n_per_m: 0.0, ..STITCH },
        PairConstraint { stiffness_n_per_m: f64::NAN, ..STITCH },
        PairConstraint { max_force_n: -1.0, ..STITCH },
    ] {
        assert!(pairs.push(&patches, bad).is_err(), "{bad:?}");
    }
    assert!(pairs.set(&patches, 0, STITCH).is_err());
    assert_eq!(pairs.push(&patches, STITCH), Ok(0));
    assert!(pairs.set(&patches, 0, PairConstraint { target_m: 1e-3, ..STITCH }).is_ok());
    assert_eq!(pairs.constraint(0).map(|c| c.target_m), Some(1e-3));
}
