//! Algorithm 1: the regulation of the nodes around a suture point, as printed and in its compliant reading.

use crate::tissue_rig::{HAND, POINT, solver_at};
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::regulation::{AttachmentSpec, Attachments, Engagement, ProjectedVelocity, RegulationMode};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;
use suture_tests::generators::{on_rim, sheet, with_fixed};

const N: usize = 11;
const SPACING_M: f64 = 0.005;
const MIDDLE: usize = N * N / 2;
/// Attachment radius, metres.
const RADIUS_M: f64 = 0.011;
/// Table 2, skin.
const BETA: f64 = 0.8;
const PAPER: RegulationMode = RegulationMode::Paper(ProjectedVelocity::Corrected);
const COMPLIANT: RegulationMode = RegulationMode::Compliant { reference_step_s: 1.0 / 60.0 };

fn skin() -> SpringNetwork {
    with_fixed(sheet(N, N, SPACING_M, 160.0, 5e-5, 3.0), |i| on_rim(i, N, N))
}

/// Free nodes within the radius and their distance.
fn followers(network: &SpringNetwork) -> Vec<(u32, f64)> {
    let away = |i: usize| (network.rest_m[i] - network.rest_m[MIDDLE]).norm();
    let near = (0..N * N).filter(|i| *i != MIDDLE && !on_rim(*i, N, N) && away(*i) <= RADIUS_M);
    near.map(|i| (i as u32, away(i))).collect()
}

fn rig(period_s: f64, beta: f64, mode: RegulationMode, engagement: Engagement) -> (TissueSolver, Stages) {
    let network = skin();
    let specs = [AttachmentSpec { patch: POINT, followers: followers(&network) }];
    let mut solver = solver_at(network, MIDDLE as u32, SolverParams::with_period(period_s));
    let attachments = Attachments::new(solver.network(), solver.patches(), &specs, beta, mode);
    let mut attachments = attachments.expect("valid by the choice of the test");
    attachments.engage(0, engagement);
    solver.grasp(HAND, POINT).expect("the middle is free");
    (solver, Stages { attachments: Some(attachments), ..Stages::default() })
}

/// Leads the suture point in the plane at 10 mm/s and holds it.
fn pull(solver: &mut TissueSolver, stages: &mut Stages, way_m: f64, seconds: f64) {
    let start = skin().rest_m[MIDDLE];
    let period_s = solver.params().period_s;
    for step in 1..=(seconds / period_s).round() as usize {
        let way = (0.01 * step as f64 * period_s).min(way_m);
        assert!(solver.lead(HAND, start + Vec3::new(way, 0.3 * way, 0.0)));
        solver.step(stages);
    }
}

#[test]
fn algorithm1_starts_when_the_suture_begins() {
    let state = |engagement: Engagement, beta: f64| {
        let (mut solver, mut stages) = rig(1e-3, beta, PAPER, engagement);
        pull(&mut solver, &mut stages, 0.01, 0.3);
        solver.state().clone()
    };
    let (mut plain, mut none) = (rig(1e-3, BETA, PAPER, Engagement::Idle).0, Stages::default());
    pull(&mut plain, &mut none, 0.01, 0.3);
    assert_eq!(&state(Engagement::Idle, BETA), plain.state(), "before the suture: bit for bit a plain network");
    assert_eq!(&state(Engagement::Engaged, 1.0), plain.state(), "beta 1: bit for bit a plain network");
    assert_ne!(&state(Engagement::Engaged, BETA), plain.state());
}

#[test]
fn algorithm1_as_printed_projects_every_follower_from_its_own_initial_distance() {
    let (mut printed, mut stages) = rig(1e-3, BETA, PAPER, Engagement::Engaged);
    let followers = followers(printed.network());
    let mut pulled = 0;
    for step in 1..=600 {
        // The same step without the regulation, then the loop of Algorithm 1 by hand.
        let (mut plain, _) = rig(1e-3, BETA, PAPER, Engagement::Idle);
        plain.release(HAND);
        plain.reset(printed.state()).expect("a state of this network");
        plain.grasp(HAND, POINT).expect("free");
        let target = skin().rest_m[MIDDLE] + Vec3::x() * (1e-5 * f64::from(step));
        assert!(plain.lead(HAND, target) && printed.lead(HAND, target));
        plain.step(&mut Stages::default());
        printed.step(&mut stages);
        let center = plain.state().position_m[MIDDLE];
        for &(node, initial) in &followers {
            let before = plain.state().position_m[node as usize];
            let distance = (before - center).norm();
            // d_i ← d_i⁰ in every call: a radius that is carried over would creep outward.
            let d = initial + BETA * (distance - initial).max(0.0);
            let wanted = if distance > initial { center + (before - center) * (d / distance) } else { before };
            pulled += usize::from(distance > initial);
            let got = printed.state().position_m[node as usize];
            assert!((got - wanted).norm() < 1e-15, "step {step}, node {node}: {got} {wanted}");
        }
    }
    assert!(pulled > 600, "only {pulled} projections: the test would show nothing");
}

/// Force on the suture point at the end of a 6 mm pull.
fn settled_force_n(period_s: f64, mode: RegulationMode) -> f64 {
    let (mut solver, mut stages) = rig(period_s, BETA, mode, Engagement::Engaged);
    pull(&mut solver, &mut stages, 0.006, 3.0);
    solver.port(HAND, &stages).expect("held").force_n.norm()
}

#[test]
fn algorithm1_force_is_the_same_at_every_step_when_beta_is_converted_once() {
    let reference = settled_force_n(1e-3, COMPLIANT);
    for period_s in [5e-3, 2e-3, 2.5e-4] {
        let force = settled_force_n(period_s, COMPLIANT);
        assert!((force / reference - 1.0).abs() < 0.01, "{period_s} s: {force} N against {reference} N");
    }
    // The literal reading stiffens with the rate; that is why it is not the default.
    let (slow, fast) = (settled_force_n(5e-3, PAPER), settled_force_n(5e-4, PAPER));
    assert!(fast > 1.05 * slow, "{slow} N at 5 ms, {fast} N at 0.5 ms");
}

#[test]
fn algorithm1_reaction_is_part_of_the_force_and_closes_the_balance() {
    let (mut solver, mut stages) = rig(1e-3, BETA, COMPLIANT, Engagement::Engaged);
    pull(&mut solver, &mut stages, 0.006, 3.0);
    let felt = solver.port(HAND, &stages).expect("held").force_n;
    let springs = {
        let (x, n) = (&solver.state().position_m, solver.network());
        n.half_edges.row(MIDDLE).fold(Vec3::zeros(), |sum, e| {
            let along = x[n.half_edges.neighbour[e] as usize] - x[MIDDLE];
            let stretch = along.norm() - n.half_edges.rest_length_m[e];
            sum + along.normalize() * (n.half_edges.stiffness_n_per_m[e] * stretch)
        })
    };
    let reaction = stages.attachments.as_ref().expect("there").reaction_n(0);
    assert!((felt - springs - reaction).norm() < 1e-9, "felt is springs plus reaction");
    assert!(felt.norm() > 1.2 * springs.norm(), "{} N felt, {} N of springs", felt.norm(), springs.norm());
    // At rest the rim must hold what the hand feels: Σ spring forces on fixed nodes = −felt.
    let (x, n) = (&solver.state().position_m, solver.network());
    let rim = n.springs.iter().fold(Vec3::zeros(), |sum, s| {
        let (a, b) = (s.a as usize, s.b as usize);
        let along = x[b] - x[a];
        let pull = along.normalize() * (s.stiffness_n_per_m * (along.norm() - s.rest_length_m));
        sum + pull * (f64::from(n.fixed[a]) - f64::from(n.fixed[b]))
    });
    assert!((rim + felt).norm() < 0.01 * felt.norm(), "rim {rim}, felt {felt}");
}
