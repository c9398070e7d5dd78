//! Relaxed attachments at their ends: β outside 0 … 1, β = 1, β = 0, tethers that contradict each other, lost momentum.

use super::nets::{self, NODE_KG, SKIN_C, SKIN_K, SPACING_M, farthest_m, network, skin_sheet};
use super::rig::{SessionRig, small_skin};
use super::{Ending, Named, Outcome};
use sim_core::scene::config::SceneConfig;
use sim_core::scene::step::Scene;
use sim_core::tissue::energy::momentum_n_s;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::regulation::{AttachmentSpec, Attachments, Engagement, ProjectedVelocity, RegulationMode};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("β < 0, β > 1, β not a number", bad_beta),
    ("β = 1 against no attachments, to the bit", beta_one),
    ("β = 0 with suture points in any order", beta_zero_in_any_order),
    ("two hard attachments that contradict each other", infeasible),
    ("attachments on a free body held at one point", lost_momentum),
    ("compliant attachment at 5, 2, 1 and 0.5 ms", step_invariance),
];

/// The default: β as a stiffness, converted at 1 ms here.
const COMPLIANT: RegulationMode = RegulationMode::Compliant { reference_step_s: 1e-3 };

fn bad_beta() -> Outcome {
    let ask = |beta: f64| {
        let mut config = small_skin();
        config.attachment.as_mut().expect("the preset has attachments").beta = beta;
        Scene::new(&config, None).err().map(|e| e.to_string())
    };
    let first = Outcome::refusal(ask(-0.1), "attachment.beta is -0.1");
    [1.1, f64::NAN, f64::INFINITY]
        .into_iter()
        .fold(first, |all, beta| all.and(&Outcome::refusal(ask(beta), "allowed is 0 (hard) to 1 (none)")))
}

fn beta_one() -> Outcome {
    let pulled = |config: &SceneConfig| {
        let mut rig = SessionRig::new(config).expect("the scene loads");
        rig.hold_left();
        rig.pull(Vec3::new(-0.004, 0.0, 0.002), 100);
        rig.run(100);
        rig.tissue_bits()
    };
    let mut config = small_skin();
    config.attachment.as_mut().expect("the preset has attachments").beta = 1.0;
    let with = pulled(&config);
    config.attachment = None;
    let without = pulled(&config);
    let differing = with.iter().zip(&without).filter(|(a, b)| a != b).count();
    Outcome::measured(Ending::Correct, "numbers that differ after a pull of 4 mm", differing as f64, 0.0, "numbers")
        .require(with.len() == without.len(), "the same tissue")
}

fn single_patches(node_count: usize, nodes: &[u32]) -> PatchSet {
    let each: Vec<[u32; 1]> = nodes.iter().map(|n| [*n]).collect();
    PatchSet::new(node_count, each.iter().map(|n| (&n[..], &[1.0][..]))).expect("single nodes are patches")
}

/// Attachments of the given specs, all engaged.
fn engaged(
    network: &SpringNetwork,
    patches: &PatchSet,
    specs: &[AttachmentSpec],
    beta: f64,
    mode: RegulationMode,
) -> Stages {
    let mut attachments = Attachments::new(network, patches, specs, beta, mode).expect("usable attachments");
    (0..specs.len()).for_each(|a| attachments.engage(a, Engagement::Engaged));
    Stages { attachments: Some(attachments), ..Stages::default() }
}

/// All nodes within `radius_m` of a node as its followers.
fn followers(network: &SpringNetwork, of: usize, radius_m: f64) -> Vec<(u32, f64)> {
    let far = network.rest_m.iter().enumerate().map(|(i, x)| (i as u32, (x - network.rest_m[of]).norm()));
    far.filter(|(i, d)| *i as usize != of && *d <= radius_m).collect()
}

/// Two suture points with shared followers, drawn apart; the attachments given in either order.
fn beta_zero_in_any_order() -> Outcome {
    let side = 13;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let points = [side * 6 + 4, side * 6 + 8];
    let patches = single_patches(net.node_count(), &points.map(|p| p as u32));
    let drawn = |order: [usize; 2], mode: RegulationMode| {
        let spec = |p: usize| AttachmentSpec {
            patch: PatchId(p as u32),
            followers: followers(&net, points[p], 3.0 * SPACING_M),
        };
        let mut stages = engaged(&net, &patches, &order.map(spec), 0.0, mode);
        let mut solver =
            TissueSolver::new(net.clone(), patches.clone(), SolverParams::with_period(2e-3)).expect("stable");
        for slot in 0..2 {
            solver.grasp(HandleSlot(slot), PatchId(slot as u32)).expect("free");
        }
        for step in 1..=100 {
            for (slot, sign) in [(0, -1.0), (1, 1.0)] {
                let way = Vec3::new(0.0, sign, 0.2) * (6e-3 * f64::from(step) / 100.0);
                solver.lead(HandleSlot(slot), net.rest_m[points[slot]] + way);
            }
            solver.step(&mut stages);
        }
        solver.state().position_m.clone()
    };
    let off = farthest_m(&drawn([0, 1], COMPLIANT), &drawn([1, 0], COMPLIANT));
    let literal = RegulationMode::Paper(ProjectedVelocity::Corrected);
    let as_printed = farthest_m(&drawn([0, 1], literal), &drawn([1, 0], literal));
    let note =
        format!("largest difference of the two orders; one projection after the other, as printed: {as_printed:.1e} m");
    Outcome::measured(Ending::Correct, note, off, 1e-9, "m")
}

/// Two hard tethers of 20 mm to points 50 mm apart: the follower belongs in the middle and must rest there.
fn infeasible() -> Outcome {
    let places = [Vec3::zeros(), Vec3::new(0.05, 0.0, 0.0), Vec3::new(0.021, 0.0, 0.0)];
    let net = network(&places, 1e-3, SKIN_C, &[]);
    let patches = single_patches(3, &[0, 1]);
    let spec = |p| AttachmentSpec { patch: PatchId(p), followers: vec![(2, 0.02)] };
    let mut stages = engaged(&net, &patches, &[0, 1].map(spec), 0.0, COMPLIANT);
    let mut solver = TissueSolver::new(net, patches, SolverParams::with_period(1e-3)).expect("stable");
    for slot in 0..2 {
        solver.grasp(HandleSlot(slot), PatchId(slot as u32)).expect("free");
    }
    nets::run(&mut solver, &mut stages, 0.1);
    let mut late = Vec::new();
    for _ in 0..200 {
        solver.step(&mut stages);
        late.push(solver.state().position_m[2].x);
    }
    let (low, high) = late.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
    let note = format!("jitter over 200 steps; middle missed by {:.1e} m", (late[199] - 0.025).abs());
    Outcome::measured(Ending::Correct, note, high - low, 1e-6, "m")
        .require((late[199] - 0.025).abs() < 1e-6, "it rests in the middle")
}

/// A free dust of followers flies past a held suture point: what its tethers take from their momentum is the impulse that
/// the port reports to the hand.
fn lost_momentum() -> Outcome {
    let places: Vec<Vec3> = std::iter::once(Vec3::zeros())
        .chain((0..12).map(|i| {
            let angle = f64::from(i) * 0.5;
            Vec3::new(angle.cos(), angle.sin(), 0.1 * f64::from(i % 3)) * 0.01
        }))
        .collect();
    let mut worst: f64 = 0.0;
    for beta in [0.0, 0.4, 0.8] {
        let net = network(&places, 1e-3, 0.0, &[]);
        let patches = single_patches(13, &[0]);
        let spec = AttachmentSpec { patch: PatchId(0), followers: followers(&net, 0, 1.0) };
        let mut stages = engaged(&net, &patches, &[spec], beta, COMPLIANT);
        let params = SolverParams { displacement_limit_spacings: 1.0, ..SolverParams::with_period(1e-3) };
        let mut solver = TissueSolver::new(net.clone(), patches, params).expect("no spring, no limit");
        let mut state = solver.state().clone();
        state.velocity_m_per_s[1..].fill(Vec3::new(0.3, 0.1, -0.2));
        solver.reset(&state).expect("a state of this net");
        solver.grasp(HandleSlot(0), PatchId(0)).expect("free");
        let before = momentum_n_s(&net, solver.state());
        let mut impulse = Vec3::zeros();
        for _ in 0..200 {
            solver.step(&mut stages);
            let port = solver.port(HandleSlot(0), &stages).expect("held");
            impulse += port.force_n * 1e-3;
        }
        let lost = before - momentum_n_s(&net, solver.state());
        worst = worst.max((lost - impulse).norm() / before.norm());
    }
    let note = "momentum lost by the followers against the impulse that the port gives the hand, β = 0, 0.4, 0.8";
    Outcome::measured(Ending::Correct, note, worst, 1e-12, "relative difference")
}

/// A tethered node under a force: the held force must not know the step.
fn step_invariance() -> Outcome {
    let side = 9;
    let net = skin_sheet(side, SKIN_K, 1e-4, 0.05);
    let middle = side * side / 2;
    let felt = |period_s: f64| {
        let patches = single_patches(net.node_count(), &[middle as u32]);
        let spec = AttachmentSpec { patch: PatchId(0), followers: followers(&net, middle, 2.0 * SPACING_M) };
        let mut stages = engaged(&net, &patches, &[spec], 0.8, COMPLIANT);
        let params =
            SolverParams { substeps: SubstepPolicy::Automatic { max: 1000 }, ..SolverParams::with_period(period_s) };
        let mut solver = TissueSolver::new(net.clone(), patches, params).expect("stable");
        solver.grasp(HandleSlot(0), PatchId(0)).expect("free");
        for step in 1..=(1.0 / period_s) as u32 {
            let way = (f64::from(step) * period_s / 0.1).min(1.0) * 3e-3;
            solver.lead(HandleSlot(0), net.rest_m[middle] + Vec3::x() * way);
            solver.step(&mut stages);
        }
        solver.port(HandleSlot(0), &stages).expect("held").force_n.norm()
    };
    let forces = [5e-3, 2e-3, 1e-3, 5e-4].map(felt);
    let off = forces.iter().map(|f| (f / forces[3] - 1.0).abs()).fold(0.0, f64::max);
    let note = format!(
        "force of a held pull of 3 mm: {:.6}, {:.6}, {:.6}, {:.6} N",
        forces[0], forces[1], forces[2], forces[3]
    );
    Outcome::measured(Ending::Correct, note, off, 1e-6, "relative difference")
}
