//! The affine port against dense linear algebra and against differences of energy and of steps.
//!
//! `S`: dense Schur complement of `M/H² + C/H + K`, and the change of force over one converged implicit
//! Euler step when the handle is shifted. `f*`: minus the derivative of the stored energy. Bracket:
//! static stiffness ≤ S ≤ one-ring stiffness, and fewer rings never give less.

use super::{Net, SKIN, even_patches};
use crate::tissue::constraint::{PairConstraint, PairSense, Pairs};
use crate::tissue::energy::spring_j;
use crate::tissue::force::{gather, spring_stiffness};
use crate::tissue::handle::HandleSlot;
use crate::tissue::network::SpringNetwork;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::port::{Port, PortParams};
use crate::tissue::regulation::{AttachmentSpec, Attachments, Engagement, RegulationMode};
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::SolverParams;
use crate::vector::{Mat3, Vec3};
use nalgebra::DMatrix;

const SLOT: HandleSlot = HandleSlot(0);
const PERIOD_S: f64 = 5e-3;
/// A net with little drag, so that the step stiffness is far below the one-ring stiffness, and so much
/// pre-stretch that no spring is compressed: there `S` is the exact tangent.
const NET: Net = Net { side: 9, drag_n_s_per_m: 0.3, mass_kg: 1e-3, rest_ratio: 1.0 / 1.3, ..SKIN };

fn precise(rings: u32) -> PortParams {
    PortParams { rings, refresh_steps: 1, tolerance: 1e-12, max_iterations: 1000, ..PortParams::default() }
}

/// The net with its middle pulled by a handle in two steps of a millimetre or two.
fn pulled(port: PortParams, stages: &mut Stages) -> TissueSolver {
    let network = NET.build();
    let patches = even_patches(network.node_count(), &[NET.plus(4, 4)]);
    let mut solver =
        TissueSolver::new(network, patches, SolverParams { port, ..SolverParams::with_period(PERIOD_S) }).unwrap();
    solver.grasp(SLOT, PatchId(0)).unwrap();
    let start = solver.handle(SLOT).unwrap().1;
    for step in 1..=2 {
        solver.lead(SLOT, start + Vec3::new(0.8e-3, 0.3e-3, 1.1e-3) * f64::from(step));
        solver.step(stages);
    }
    solver
}

fn port(solver: &mut TissueSolver, stages: &Stages) -> Port {
    solver.port(SLOT, stages).unwrap()
}

/// Dense matrix of the springs' tangents plus `own` on the diagonal, and the free nodes.
fn dense(network: &SpringNetwork, x: &[Vec3], own: f64) -> DMatrix<f64> {
    let n = network.node_count();
    let mut a = DMatrix::identity(3 * n, 3 * n) * own;
    for s in &network.springs {
        let (i, j) = (3 * s.a as usize, 3 * s.b as usize);
        let k = spring_stiffness(&x[s.a as usize], &x[s.b as usize], s.stiffness_n_per_m, s.rest_length_m);
        for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            let mut block = a.fixed_view_mut::<3, 3>(row, column);
            block += k * sign;
        }
    }
    a
}

/// Schur complement onto the shifts of the patch, the patch's own diagonal left out.
fn dense_schur(network: &SpringNetwork, patches: &PatchSet, x: &[Vec3], own: f64) -> Mat3 {
    let a = dense(network, x, own);
    let members = patches.nodes(PatchId(0));
    let dofs = |nodes: Vec<usize>| nodes.into_iter().flat_map(|n| 3 * n..3 * n + 3).collect::<Vec<_>>();
    let p = dofs(members.iter().map(|&n| n as usize).collect());
    let free = |n: &usize| network.fixed[*n] == 0 && !members.contains(&(*n as u32));
    let r = dofs((0..network.node_count()).filter(free).collect());
    let shifts = DMatrix::from_fn(p.len(), 3, |i, j| f64::from(i % 3 == j));
    let (pp, rp, rr) = (
        a.select_rows(&p).select_columns(&p),
        a.select_rows(&r).select_columns(&p) * &shifts,
        a.select_rows(&r).select_columns(&r),
    );
    let inside = shifts.transpose() * pp * &shifts - DMatrix::identity(3, 3) * (own * members.len() as f64);
    let schur = inside - rp.transpose() * rr.cholesky().expect("the step matrix is definite").solve(&rp);
    schur.fixed_view::<3, 3>(0, 0).into_owned()
}

fn own() -> f64 {
    NET.mass_kg / (PERIOD_S * PERIOD_S) + NET.drag_n_s_per_m / PERIOD_S
}

#[test]
fn step_stiffness_is_the_dense_schur_complement() {
    let mut stages = Stages::default();
    let mut solver = pulled(precise(20), &mut stages);
    let port = port(&mut solver, &stages);
    let expected = dense_schur(solver.network(), solver.patches(), &solver.state().position_m, own());
    // The solves end at 1e-12.
    assert!((port.step_stiffness_n_per_m - expected).norm() < 1e-9 * expected.norm(), "{port:?} {expected}");
}

#[test]
fn step_stiffness_lies_between_the_static_and_the_one_ring_stiffness_and_falls_with_rings() {
    let mut stages = Stages::default();
    let least = |m: Mat3| m.symmetric_eigenvalues().min();
    let mut last: Option<Mat3> = None;
    for rings in [0, 1, 2, 3, 20] {
        let mut solver = pulled(precise(rings), &mut stages);
        let port = port(&mut solver, &stages);
        let (s, ring) = (port.step_stiffness_n_per_m, port.one_ring_n_per_m);
        let fixed = dense_schur(solver.network(), solver.patches(), &solver.state().position_m, 1e-6);
        // Rounding of stiffnesses of some hundred newtons per metre.
        assert!(least(ring - s) > -1e-9 && least(s - fixed) > -1e-9, "{rings} rings: {fixed} {s} {ring}");
        if let Some(fewer) = last {
            assert!(least(fewer - s) > -1e-9, "{rings} rings: {fewer} {s}");
        } else {
            assert_eq!(s, ring, "without rings everything is held");
        }
        last = Some(s);
    }
    let mut rough = pulled(PortParams { rings: 20, tolerance: 0.1, ..precise(20) }, &mut stages);
    let early = port(&mut rough, &stages).step_stiffness_n_per_m;
    let exact = last.unwrap();
    assert!(least(early - exact) > -1e-9, "an early end over-estimates: {early} {exact}");
    assert!((early - exact).norm() < 0.02 * exact.norm());
}

/// One implicit Euler step by Newton's method with dense matrices; the patch ends at `shift` from
/// where it is. Returns the spring force of the others on the patch.
fn implicit_step_force(solver: &TissueSolver, shift: Vec3) -> Vec3 {
    let (network, patches) = (solver.network(), solver.patches());
    let members = patches.nodes(PatchId(0));
    let start = solver.state();
    let mut x = start.position_m.clone();
    for &n in members {
        x[n as usize] += shift;
    }
    let moves = |n: usize| network.fixed[n] == 0 && !members.contains(&(n as u32));
    let mut force = vec![Vec3::zeros(); x.len()];
    for _ in 0..30 {
        gather(network, &x, &mut force);
        let mut a = dense(network, &x, own());
        let mut b = DMatrix::zeros(3 * x.len(), 1);
        for n in 0..x.len() {
            let mut row = b.fixed_view_mut::<3, 1>(3 * n, 0);
            if moves(n) {
                let done = x[n] - start.position_m[n];
                let inertia = (done - start.velocity_m_per_s[n] * PERIOD_S) * (NET.mass_kg / PERIOD_S.powi(2));
                row += force[n] - inertia - done * (NET.drag_n_s_per_m / PERIOD_S);
            } else {
                for k in 3 * n..3 * n + 3 {
                    a.row_mut(k).fill(0.0);
                    a[(k, k)] = 1.0;
                }
            }
        }
        let dx = a.lu().solve(&b).expect("the step matrix is regular");
        x.iter_mut().enumerate().for_each(|(n, x)| *x += dx.fixed_view::<3, 1>(3 * n, 0));
    }
    gather(network, &x, &mut force);
    members.iter().fold(Vec3::zeros(), |sum, &n| sum + force[n as usize])
}

#[test]
fn step_stiffness_is_the_difference_of_implicit_steps() {
    let mut stages = Stages::default();
    let mut solver = pulled(precise(20), &mut stages);
    let s = port(&mut solver, &stages).step_stiffness_n_per_m;
    // The tissue is expanded where it will be at the end of the step, not where it was: springs turn
    // and stretch on the way by some per cent. The step from rest in the equilibrium has no such shift.
    let settled = solver.state().clone();
    let mut solver = pulled(precise(20), &mut stages);
    let mut rest = settled;
    crate::tissue::settle::settle(
        &{
            let mut held = solver.network().clone();
            solver.patches().nodes(PatchId(0)).iter().for_each(|&n| held.fixed[n as usize] = 1);
            held
        },
        None,
        &mut rest.position_m,
        &crate::tissue::settle::SettleParams { tolerance_n: 1e-12, max_iterations: 100_000 },
    );
    rest.velocity_m_per_s.fill(Vec3::zeros());
    solver.reset(&rest).unwrap();
    solver.grasp(SLOT, PatchId(0)).unwrap();
    let at_rest = port(&mut solver, &stages).step_stiffness_n_per_m;
    let step = 1e-6;
    let measured = Mat3::from_columns(&[Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
        (implicit_step_force(&solver, -axis * step) - implicit_step_force(&solver, axis * step)) / (2.0 * step)
    }));
    // Differences of second order at 1 µm on a 5 mm mesh; compressed springs count as 0 across in S.
    assert!((at_rest - measured).norm() < 2e-3 * measured.norm(), "{at_rest} {measured}");
    assert!((s - measured).norm() < 0.2 * measured.norm(), "{s} {measured}");
}

fn attached() -> Stages {
    let network = NET.build();
    let patches = even_patches(network.node_count(), &[NET.plus(4, 4)]);
    let specs = [AttachmentSpec { patch: PatchId(0), followers: NET.followers(4, 4, 11e-3) }];
    let mode = RegulationMode::Compliant { reference_step_s: 1e-3 };
    let mut attachments = Attachments::new(&network, &patches, &specs, 0.8, mode).unwrap();
    attachments.engage(0, Engagement::Engaged);
    Stages { attachments: Some(attachments), ..Stages::default() }
}

#[test]
fn port_force_is_minus_the_derivative_of_the_stored_energy() {
    for mut stages in [Stages::default(), attached()] {
        let with_links = stages.attachments.is_some();
        let mut solver = pulled(precise(3), &mut stages);
        let force = port(&mut solver, &stages).force_n;
        let (m, c) = (NET.mass_kg, NET.drag_n_s_per_m);
        let link_stiffness = 0.2 * (m + c * 1e-3) / (0.8 * 1e-6);
        let members = solver.patches().nodes(PatchId(0)).to_vec();
        let followers = NET.followers(4, 4, 11e-3);
        let energy = |shift: Vec3| {
            let mut x = solver.state().position_m.clone();
            members.iter().for_each(|&n| x[n as usize] += shift);
            let center = solver.patches().mean(PatchId(0), &x);
            let links = followers.iter().filter(|(n, _)| with_links && !members.contains(n));
            let excess = links.map(|(n, rest)| ((x[*n as usize] - center).norm() - rest).max(0.0));
            spring_j(solver.network(), &x) + excess.map(|e| 0.5 * link_stiffness * e * e).sum::<f64>()
        };
        let step = 1e-7;
        let slope = Vec3::from_fn(|axis, _| {
            let mut shift = Vec3::zeros();
            shift[axis] = step;
            (energy(-shift) - energy(shift)) / (2.0 * step)
        });
        // Energies of 1e-4 J known to 1e-19 J: differences over 1e-7 m to 1e-11 N, plus curvature. The
        // tensions are those along the directions before the last correction: a per mille.
        let tolerance = if with_links { 2e-3 * slope.norm() } else { 1e-7 };
        assert!((force - slope).norm() < tolerance, "links {with_links}: {force} {slope}");
    }
}

#[test]
fn links_stiffen_the_port_and_a_hard_link_keeps_it_finite() {
    let mut plain_stages = Stages::default();
    let plain = port(&mut pulled(precise(3), &mut plain_stages), &plain_stages);
    let mut stages = attached();
    let linked = port(&mut pulled(precise(3), &mut stages), &stages);
    let pull = Vec3::new(0.8, 0.3, 1.1).normalize();
    let along = |m: &Mat3| pull.dot(&(m * pull));
    assert!(along(&linked.step_stiffness_n_per_m) > 1.05 * along(&plain.step_stiffness_n_per_m));
    assert!(along(&linked.one_ring_n_per_m) > along(&linked.step_stiffness_n_per_m));
    let few = port(&mut pulled(precise(1), &mut stages), &stages);
    assert!(along(&few.step_stiffness_n_per_m) >= along(&linked.step_stiffness_n_per_m));
    assert!(few.step_stiffness_n_per_m.iter().all(|v| v.is_finite()));
}

#[test]
fn mass_drag_and_place_are_those_of_the_patch_and_kept_stiffness_is_refreshed() {
    let mut stages = Stages::default();
    let mut solver = pulled(PortParams { refresh_steps: 3, ..precise(2) }, &mut stages);
    let first = port(&mut solver, &stages);
    assert!((first.mass_kg - 5.0 * NET.mass_kg).abs() < 1e-15 && (first.drag_n_s_per_m - 1.5).abs() < 1e-12);
    assert_eq!(Some(first.position_m), solver.handle(SLOT).map(|h| h.1));
    let mut seen = vec![first.step_stiffness_n_per_m];
    for _ in 0..3 {
        solver.lead(SLOT, first.position_m + Vec3::new(0.0, 0.0, 2e-3));
        solver.step(&mut stages);
        seen.push(port(&mut solver, &stages).step_stiffness_n_per_m);
    }
    assert!(seen[0] == seen[1] && seen[1] == seen[2] && seen[2] != seen[3], "{seen:?}");
    assert_eq!(solver.port(HandleSlot(1), &stages), None);
}

#[test]
fn kept_stiffness_is_dropped_as_soon_as_the_links_let_go() {
    let mut stages = attached();
    let mut solver = pulled(PortParams { refresh_steps: 1000, ..precise(2) }, &mut stages);
    let linked = port(&mut solver, &stages).one_ring_n_per_m;
    assert_eq!(port(&mut solver, &stages).one_ring_n_per_m, linked, "young and unchanged: kept");
    stages.attachments.as_mut().unwrap().engage(0, Engagement::Idle);
    let free = port(&mut solver, &stages).one_ring_n_per_m;
    assert!(free.trace() < linked.trace(), "{free} {linked}");
}

#[test]
fn two_ports_of_one_pair_bear_its_joint_stiffness() {
    // Two single nodes without springs, both held, 20 mm apart, pulled to 10 mm by a pair of 300 N/m.
    let stiffness_n_per_m = 300.0;
    let network = super::dust(&[Vec3::zeros(), Vec3::new(0.02, 0.0, 0.0)], 1e-3, 3.0);
    let patches = even_patches(2, &[vec![0], vec![1]]);
    let mut pairs = Pairs::with_capacity(1);
    let (a, b, sense) = (PatchId(0), PatchId(1), PairSense::PullOnly);
    let pair = PairConstraint { a, b, target_m: 0.01, stiffness_n_per_m, max_force_n: 100.0, sense };
    pairs.push(&patches, pair).unwrap();
    let mut stages = Stages { pairs: Some(pairs), ..Stages::default() };
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(PERIOD_S)).unwrap();
    let along = |slot: usize, solver: &mut TissueSolver, stages: &Stages| {
        let port = solver.port(HandleSlot(slot), stages).unwrap();
        (port.step_stiffness_n_per_m.m11, port.one_ring_n_per_m.m11)
    };
    solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
    solver.grasp(HandleSlot(1), PatchId(1)).unwrap();
    solver.step(&mut stages);
    // With both ends prescribed [[K, −K], [−K, K]] has the eigenvalue 2K: each port alone must bear it.
    for slot in 0..2 {
        let (step, held) = along(slot, &mut solver, &stages);
        assert!((step - 2.0 * stiffness_n_per_m).abs() < 1e-9, "{step}");
        assert!((held - 2.0 * stiffness_n_per_m).abs() < 1e-9, "{held}");
    }
}
