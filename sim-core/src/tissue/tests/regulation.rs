//! Algorithm 1 against its formula, and the compliant reading against closed forms.
//!
//! `K = (1 − β)(m + c Δt)/(β Δt²)`; forces of the compliant mode depend neither on the period nor on
//! the sub-steps; β = 1 changes no bit; infeasible hard links meet in the middle in any order.

use super::{Net, SKIN, dust, even_patches};
use crate::tissue::energy::momentum_n_s;
use crate::tissue::handle::HandleSlot;
use crate::tissue::load::{Loads, NodeForce};
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::regulation::{
    AttachmentError, AttachmentSpec, Attachments, Engagement, ProjectedVelocity, RegulationMode,
};
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::{SolverParams, SubstepPolicy};
use crate::vector::Vec3;

/// Share of the impulse exchanged that shared followers of two free points may lose or gain: the points are moved with the
/// tensions that each would have alone with its followers.
const SHARED_DEFECT: f64 = 0.05;

const LITERAL: RegulationMode = RegulationMode::Paper(ProjectedVelocity::Literal);
const PAPER: RegulationMode = RegulationMode::Paper(ProjectedVelocity::Corrected);
const COMPLIANT: RegulationMode = RegulationMode::Compliant { reference_step_s: 1e-3 };

fn engaged(
    network: &SpringNetwork,
    patches: &PatchSet,
    specs: &[AttachmentSpec],
    beta: f64,
    mode: RegulationMode,
) -> Stages {
    let mut attachments = Attachments::new(network, patches, specs, beta, mode).unwrap();
    (0..specs.len()).for_each(|a| attachments.engage(a, Engagement::Engaged));
    Stages { attachments: Some(attachments), ..Stages::default() }
}

/// A follower at 30 mm from the origin and a suture point at the origin that a handle holds.
struct OneFollower {
    solver: TissueSolver,
    stages: Stages,
}

impl OneFollower {
    fn new(beta: f64, mode: RegulationMode, period_s: f64, substeps: u32) -> Self {
        let network = dust(&[Vec3::zeros(), Vec3::new(0.03, 0.0, 0.0)], 1e-3, 3.0);
        let patches = even_patches(2, &[vec![0]]);
        let specs = [AttachmentSpec { patch: PatchId(0), followers: vec![(1, 0.02)] }];
        let stages = engaged(&network, &patches, &specs, beta, mode);
        let params = SolverParams {
            substeps: SubstepPolicy::Demanded(substeps),
            displacement_limit_spacings: 1.0,
            ..SolverParams::with_period(period_s)
        };
        let mut solver = TissueSolver::new(network, patches, params).unwrap();
        solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
        Self { solver, stages }
    }

    fn step(&mut self) {
        self.solver.step(&mut self.stages);
    }

    fn x(&self) -> f64 {
        self.solver.state().position_m[1].x
    }

    fn reaction_n(&self) -> f64 {
        self.stages.attachments.as_ref().map_or(0.0, |a| a.reaction_n(0).x)
    }
}

#[test]
fn algorithm1_one_projection_multiplies_the_excess_by_beta_without_a_ratchet() {
    for mode in [PAPER, LITERAL] {
        for beta in [0.0, 0.4, 0.8] {
            let mut one = OneFollower::new(beta, mode, 1e-3, 1);
            one.step();
            // The node stood still: only the projection moved it.
            assert!((one.x() - (0.02 + beta * 0.01)).abs() < 1e-15, "beta {beta}: {}", one.x());
            // Held out at 30 mm again and again it must come back to the same place; a radius that
            // is kept from the step before would creep outward: 28, 29.6, 29.92 mm for beta 0.8.
            let mut state = one.solver.state().clone();
            state.position_m[1].x = 0.03;
            state.velocity_m_per_s[1] = Vec3::zeros();
            for _ in 0..5 {
                one.solver.reset(&state).unwrap();
                one.solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
                one.step();
                assert!((one.x() - (0.02 + beta * 0.01)).abs() < 1e-15, "beta {beta}: {}", one.x());
            }
        }
    }
}

#[test]
fn algorithm1_velocity_is_corrected_or_left_as_asked() {
    for (mode, expected) in [(PAPER, -2.0), (LITERAL, 0.0), (COMPLIANT, -2.0)] {
        let mut one = OneFollower::new(0.8, mode, 1e-3, 1);
        one.step();
        // 2 mm in 1 ms.
        assert!((one.solver.state().velocity_m_per_s[1].x - expected).abs() < 1e-12, "{mode:?}");
    }
}

#[test]
fn algorithm1_compliant_step_at_the_reference_step_is_the_projection() {
    for beta in [0.0, 0.4, 0.6, 0.8] {
        let mut one = OneFollower::new(beta, COMPLIANT, 1e-3, 1);
        one.step();
        assert!((one.x() - (0.02 + beta * 0.01)).abs() < 1e-15, "beta {beta}: {}", one.x());
    }
}

#[test]
fn algorithm1_effective_stiffness_is_the_formula() {
    let force = 0.5;
    let (m, c) = (1e-3, 3.0);
    for beta in [0.4, 0.6, 0.8] {
        for dt in [5e-3, 1e-3, 2.5e-4] {
            for (mode, at) in [(PAPER, dt), (COMPLIANT, 1e-3)] {
                let mut one = OneFollower::new(beta, mode, dt, 1);
                let load = NodeForce { node: 1, force_n: Vec3::new(force, 0.0, 0.0) };
                one.stages.loads = Some(Loads { nodes: vec![load], patches: Vec::new() });
                for _ in 0..2000 {
                    one.step();
                }
                let stiffness = (1.0 - beta) * (m + c * at) / (beta * at * at);
                let measured = force / (one.x() - 0.02);
                // A steady state after 2000 steps; rounding only.
                assert!((measured / stiffness - 1.0).abs() < 1e-9, "{mode:?} {beta} {dt}: {measured} / {stiffness}");
                assert!((one.reaction_n() - force).abs() < 1e-9, "{mode:?} {beta} {dt}: {}", one.reaction_n());
            }
        }
    }
}

#[test]
fn algorithm1_hard_tether_holds_the_sphere() {
    let mut one = OneFollower::new(0.0, COMPLIANT, 1e-3, 1);
    let load = NodeForce { node: 1, force_n: Vec3::new(2.0, 1.0, 0.0) };
    one.stages.loads = Some(Loads { nodes: vec![load], patches: Vec::new() });
    for _ in 0..3000 {
        one.step();
    }
    let x = one.solver.state().position_m[1];
    // It comes to rest in the direction of the load, at 20 mm; rounding of one step's predictor.
    assert!((x.norm() - 0.02).abs() < 1e-12, "{x}");
    assert!((x.y / x.x - 0.5).abs() < 1e-6, "{x}");
}

/// The skin net, pulled 5 mm sideways at its middle over 50 ms and held; force on the hand at 150 ms.
fn pulled_force(beta: f64, period_s: f64, substeps: SubstepPolicy, mode: RegulationMode) -> f64 {
    let network = SKIN.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(5, 5)]);
    let specs = [AttachmentSpec { patch: PatchId(0), followers: SKIN.followers(5, 5, 14e-3) }];
    let mut stages = engaged(&network, &patches, &specs, beta, mode);
    let params = SolverParams { substeps, ..SolverParams::with_period(period_s) };
    let mut solver = TissueSolver::new(network, patches, params).unwrap();
    solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
    let start = solver.handle(HandleSlot(0)).unwrap().1;
    for step in 1..=(0.15 / period_s).round() as u32 {
        let way = (f64::from(step) * period_s / 0.05).min(1.0) * 5e-3;
        assert!(solver.lead(HandleSlot(0), start + Vec3::new(way, 0.0, 0.0)));
        solver.step(&mut stages);
    }
    solver.port(HandleSlot(0), &stages).unwrap().force_n.norm()
}

#[test]
fn compliant_force_depends_neither_on_the_period_nor_on_the_substeps() {
    let auto = SubstepPolicy::Automatic { max: 64 };
    let reference = pulled_force(0.8, 2e-4, auto, COMPLIANT);
    assert!(reference > 0.3, "the pull must be felt: {reference} N");
    for (period, substeps) in [(1e-3, auto), (2e-3, auto), (5e-3, auto), (5e-3, SubstepPolicy::Demanded(8))] {
        let force = pulled_force(0.8, period, substeps, COMPLIANT);
        // One per cent: first-order error of the creep at 5 ms.
        assert!((force / reference - 1.0).abs() < 0.01, "{period} {substeps:?}: {force} N, reference {reference} N");
    }
    let paper = [pulled_force(0.8, 5e-3, auto, PAPER), pulled_force(0.8, 2e-4, auto, PAPER)];
    assert!((paper[0] / paper[1] - 1.0).abs() > 0.1, "the literal mode depends on the step: {paper:?} N");
}

#[test]
fn beta_one_changes_no_bit_and_an_idle_attachment_neither() {
    let network = SKIN.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(5, 5)]);
    let specs = [AttachmentSpec { patch: PatchId(0), followers: SKIN.followers(5, 5, 14e-3) }];
    let run = |mut stages: Stages| {
        let mut solver = TissueSolver::new(network.clone(), patches.clone(), SolverParams::with_period(2e-3)).unwrap();
        solver.grasp(HandleSlot(1), PatchId(0)).unwrap();
        let start = solver.handle(HandleSlot(1)).unwrap().1;
        for step in 0..40 {
            solver.lead(HandleSlot(1), start + Vec3::new(0.0, 1e-4, 1e-4) * f64::from(step));
            let report = solver.step(&mut stages);
            assert_eq!(report.links, 0);
        }
        solver.state().clone()
    };
    let plain = run(Stages::default());
    for mode in [COMPLIANT, PAPER, LITERAL] {
        assert_eq!(run(engaged(&network, &patches, &specs, 1.0, mode)), plain, "{mode:?}");
        let idle = Attachments::new(&network, &patches, &specs, 0.2, mode).unwrap();
        assert_eq!(run(Stages { attachments: Some(idle), ..Stages::default() }), plain, "{mode:?}");
    }
}

#[test]
fn infeasible_hard_links_meet_in_the_middle_in_any_order() {
    // Two suture points 50 mm apart, each allowing 20 mm: the follower belongs at 25 mm.
    let places = [Vec3::zeros(), Vec3::new(0.05, 0.0, 0.0), Vec3::new(0.021, 0.0, 0.0)];
    let run = |order: [u32; 2]| -> Vec<(TissueState, f64)> {
        let network = dust(&places, 1e-3, 3.0);
        let patches = even_patches(3, &[vec![0], vec![1]]);
        let spec = |p| AttachmentSpec { patch: PatchId(p), followers: vec![(2, 0.02)] };
        let mut stages = engaged(&network, &patches, &order.map(spec), 0.0, COMPLIANT);
        let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(1e-3)).unwrap();
        solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
        solver.grasp(HandleSlot(1), PatchId(1)).unwrap();
        let one = |_| {
            solver.step(&mut stages);
            let reaction_n = |a: usize| stages.attachments.as_ref().map_or(0.0, |t| t.reaction_n(a).norm());
            (solver.state().clone(), reaction_n(0).max(reaction_n(1)))
        };
        (0..200).map(one).collect()
    };
    let (states, swapped) = (run([0, 1]), run([1, 0]));
    let late: Vec<f64> = states[100..].iter().map(|s| s.0.position_m[2].x).collect();
    let spread = late.iter().fold(f64::MIN, |a, &b| a.max(b)) - late.iter().fold(f64::MAX, |a, &b| a.min(b));
    // No jitter above 1 µm; the middle to a micrometre too.
    assert!((late[99] - 0.025).abs() < 1e-6 && spread < 1e-6, "{} spread {spread}", late[99]);
    // Sums in another order: rounding, enlarged by the stiffness ratio of hard links.
    assert!((states[199].0.position_m[2] - swapped[199].0.position_m[2]).norm() < 1e-9);
    // Each link keeps 5 mm of overshoot, at most 100 times as stiff as the follower, 1/μ = (m + c h)/h².
    let most_n = 5e-3 * 100.0 * (1e-3 + 3.0 * 1e-3) / 1e-6;
    let held_n = states[199].1;
    assert!(held_n <= most_n * (1.0 + 1e-6) && held_n > 0.0, "{held_n} N, at most {most_n} N");
}

#[test]
fn a_free_suture_point_takes_the_reaction_so_that_momentum_stays() {
    let net = Net { drag_n_s_per_m: 0.0, ..SKIN };
    let places: Vec<Vec3> = net.build().rest_m;
    let network = dust(&places, 1e-3, 0.0);
    let patches = even_patches(network.node_count(), &[net.plus(5, 5)]);
    let specs = [AttachmentSpec { patch: PatchId(0), followers: net.followers(5, 5, 14e-3) }];
    for beta in [0.0, 0.4, 0.8] {
        let mut stages = engaged(&network, &patches, &specs, beta, COMPLIANT);
        let mut solver = TissueSolver::new(network.clone(), patches.clone(), SolverParams::with_period(1e-3)).unwrap();
        let mut state = solver.state().clone();
        for &node in patches.nodes(PatchId(0)) {
            state.velocity_m_per_s[node as usize] = Vec3::new(0.3, 0.1, 0.2);
        }
        solver.reset(&state).unwrap();
        let before = momentum_n_s(&network, &state);
        let mut pulled = 0;
        for _ in 0..100 {
            pulled += solver.step(&mut stages).links;
        }
        let after = momentum_n_s(&network, solver.state());
        assert!(pulled > 100, "beta {beta}: only {pulled} link steps");
        // Rounding of some hundred corrections, relative to the momentum.
        assert!((after - before).norm() < 1e-11 * before.norm(), "beta {beta}: {before} became {after}");
    }
}

#[test]
fn followers_of_two_free_points_leave_a_bounded_momentum_defect() {
    // Two free points 20 mm apart, unlike in speed; their spheres of 14 mm overlap.
    let net = Net { drag_n_s_per_m: 0.0, ..SKIN };
    let network = dust(&net.build().rest_m, 1e-3, 0.0);
    let patches = even_patches(network.node_count(), &[net.plus(3, 5), net.plus(7, 5)]);
    let spec = |p: u32, i: usize| AttachmentSpec { patch: PatchId(p), followers: net.followers(i, 5, 14e-3) };
    let mut worst = 0.0_f64;
    for beta in [0.0, 0.4, 0.8] {
        let mut stages = engaged(&network, &patches, &[spec(0, 3), spec(1, 7)], beta, COMPLIANT);
        let mut solver = TissueSolver::new(network.clone(), patches.clone(), SolverParams::with_period(1e-3)).unwrap();
        let mut state = solver.state().clone();
        for (patch, speed) in [(0, Vec3::new(-0.3, 0.1, 0.2)), (1, Vec3::new(0.5, -0.1, 0.0))] {
            for &node in patches.nodes(PatchId(patch)) {
                state.velocity_m_per_s[node as usize] = speed;
            }
        }
        solver.reset(&state).unwrap();
        let before = momentum_n_s(&network, &state);
        let (mut impulse, mut last) = (0.0, state);
        for _ in 0..100 {
            solver.step(&mut stages);
            let changes = solver.state().velocity_m_per_s.iter().zip(&last.velocity_m_per_s);
            impulse += 0.5 * changes.map(|(v, u)| 1e-3 * (v - u).norm()).sum::<f64>();
            last = solver.state().clone();
        }
        let defect = (momentum_n_s(&network, &last) - before).norm() / impulse;
        println!("beta {beta}: {defect:.4} of the impulse exchanged");
        worst = worst.max(defect);
    }
    assert!(worst < SHARED_DEFECT, "{worst}");
}

#[test]
fn unusable_attachments_are_refused_and_useless_followers_skipped() {
    let network = SKIN.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(5, 5)]);
    let with = |followers: Vec<(u32, f64)>| [AttachmentSpec { patch: PatchId(0), followers }];
    for beta in [-0.1, 1.1, f64::NAN] {
        let refused = Attachments::new(&network, &patches, &with(vec![]), beta, COMPLIANT).err();
        assert!(matches!(refused, Some(AttachmentError::Relaxation(_))), "{beta}");
    }
    for reference_step_s in [0.0, f64::NAN, -1.0] {
        let mode = RegulationMode::Compliant { reference_step_s };
        assert!(Attachments::new(&network, &patches, &with(vec![]), 0.5, mode).is_err());
    }
    for bad in [vec![(9999, 0.01)], vec![(3, f64::NAN)], vec![(3, -0.01)], vec![(3, 0.01), (3, 0.02)]] {
        assert!(Attachments::new(&network, &patches, &with(bad.clone()), 0.5, COMPLIANT).is_err(), "{bad:?}");
    }
    let unknown = [AttachmentSpec { patch: PatchId(7), followers: vec![] }];
    assert!(Attachments::new(&network, &patches, &unknown, 0.5, COMPLIANT).is_err());
    // A fixed node, a member of the patch, and a node at distance 0 of rest: all pulled far out, none moves.
    let useless = with(vec![(0, 0.01), (SKIN.node(5, 4), 0.001), (SKIN.node(8, 8), 0.0)]);
    let mut stages = engaged(&network, &patches, &useless, 0.0, COMPLIANT);
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(1e-3)).unwrap();
    assert_eq!(solver.step(&mut stages).links, 0);
}
