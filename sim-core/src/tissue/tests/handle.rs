//! Handles, limits and containment: what the hand and bad numbers may do to a tissue.
//!
//! A held patch moves rigidly in straight sub-steps; a node moves half a spacing per period at most;
//! the state stays finite whatever comes in. Deliberately absent: the servo's own limits.

use super::{SKIN, even_patches};
use crate::tissue::handle::{GraspError, HandleSlot};
use crate::tissue::integrator::Integrator;
use crate::tissue::load::{Loads, NodeForce, PatchForce};
use crate::tissue::patch_set::PatchId;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use crate::vector::Vec3;

const SLOT: HandleSlot = HandleSlot(0);

/// All that run this net at 5 ms; the printed form would have to be refused.
const SOUND: [Integrator; 4] = [Integrator::SemiImplicit, Integrator::Verlet, Integrator::Bdf2, Integrator::Xpbd];

fn solver(integrator: Integrator, period_s: f64, substeps: SubstepPolicy) -> TissueSolver {
    let network = SKIN.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(4, 5), SKIN.plus(5, 5), SKIN.plus(8, 8)]);
    let params = SolverParams { integrator, substeps, ..SolverParams::with_period(period_s) };
    TissueSolver::new(network, patches, params).unwrap()
}

fn skin() -> TissueSolver {
    skin_with(Integrator::SemiImplicit)
}

fn skin_with(integrator: Integrator) -> TissueSolver {
    solver(integrator, 5e-3, SubstepPolicy::Automatic { max: 64 })
}

#[test]
fn a_held_patch_keeps_its_shape_and_goes_where_it_is_led() {
    let mut solver = skin();
    solver.grasp(SLOT, PatchId(0)).unwrap();
    let before = solver.state().position_m.clone();
    let start = solver.handle(SLOT).unwrap().1;
    let way = Vec3::new(1e-3, -2e-3, 3e-3);
    assert!(solver.lead(SLOT, start + way));
    let report = solver.step(&mut Stages::default());
    assert_eq!(report.handles_cut, 0);
    for &node in solver.patches().nodes(PatchId(0)) {
        let node = node as usize;
        // Offsets are taken off the centre and put back: rounding of two sums.
        assert!((solver.state().position_m[node] - before[node] - way).norm() < 1e-16);
        assert!((solver.state().velocity_m_per_s[node] - way / 5e-3).norm() < 1e-13);
    }
    assert_eq!(solver.handle(SLOT).unwrap().1, start + way);
    solver.release(SLOT);
    assert_eq!(solver.handle(SLOT), None);
    solver.step(&mut Stages::default());
    // Free again, it springs back.
    assert!((solver.patches().mean(PatchId(0), &solver.state().position_m) - start).norm() < way.norm());
}

#[test]
fn grasps_that_make_no_sense_are_refused() {
    let mut solver = skin();
    assert_eq!(solver.grasp(HandleSlot(4), PatchId(0)), Err(GraspError::Slot(4)));
    assert_eq!(solver.grasp(SLOT, PatchId(9)), Err(GraspError::Patch(9)));
    solver.grasp(SLOT, PatchId(0)).unwrap();
    assert_eq!(solver.grasp(SLOT, PatchId(2)), Err(GraspError::Slot(0)));
    assert_eq!(solver.grasp(HandleSlot(1), PatchId(1)), Err(GraspError::Overlap(1)));
    assert_eq!(solver.grasp(HandleSlot(1), PatchId(2)), Ok(()));
    assert!(!solver.lead(HandleSlot(3), Vec3::zeros()));
    assert!(!solver.lead(SLOT, Vec3::new(f64::NAN, 0.0, 0.0)));
    let start = solver.handle(SLOT).unwrap().1;
    solver.step(&mut Stages::default());
    assert_eq!(solver.handle(SLOT).unwrap().1, start);
}

#[test]
fn a_far_target_is_reached_in_steps_of_the_limit() {
    let mut solver = skin();
    solver.grasp(SLOT, PatchId(0)).unwrap();
    let start = solver.handle(SLOT).unwrap().1;
    for far in [1e6, 1e200, 1e308] {
        assert!(solver.lead(SLOT, Vec3::new(0.0, 0.0, far)));
        let before = solver.handle(SLOT).unwrap().1;
        let report = solver.step(&mut Stages::default());
        assert_eq!((report.handles_cut, report.contained), (1, 0));
        let moved = (solver.handle(SLOT).unwrap().1 - before).norm();
        assert!(moved <= 2.0 * solver.spacing_m() * (1.0 + 1e-12), "{moved}");
    }
    assert!(solver.handle(SLOT).unwrap().1.z > start.z);
}

#[test]
fn a_meganewton_saturates_and_is_forgotten() {
    SOUND.into_iter().for_each(meganewton);
}

fn meganewton(integrator: Integrator) {
    let mut solver = skin_with(integrator);
    let node = SKIN.node(5, 5);
    let load = NodeForce { node, force_n: Vec3::new(0.0, 1e6, 1e6) };
    let mut stages = Stages { loads: Some(Loads { nodes: vec![load], patches: Vec::new() }), ..Stages::default() };
    for _ in 0..20 {
        let before = solver.state().position_m.clone();
        let report = solver.step(&mut stages);
        assert!(report.saturated > 0);
        assert_eq!(report.contained, 0);
        let moves = solver.state().position_m.iter().zip(&before).map(|(x, b)| (x - b).norm());
        assert!(moves.fold(0.0, f64::max) <= 0.5 * solver.spacing_m() * (1.0 + 1e-9));
    }
    stages.loads = None;
    for _ in 0..400 {
        solver.step(&mut stages);
    }
    let away = (solver.state().position_m[node as usize] - solver.network().rest_m[node as usize]).norm();
    assert!(away < 1e-3, "{}: 2 s later the node is {away} m away", integrator.name());
}

#[test]
fn values_that_are_not_finite_never_reach_the_state() {
    SOUND.into_iter().for_each(not_finite);
}

fn not_finite(integrator: Integrator) {
    let mut plain = skin_with(integrator);
    let mut solver = skin_with(integrator);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let loads = Loads {
            nodes: vec![NodeForce { node: 60, force_n: Vec3::new(bad, 0.0, 0.0) }],
            patches: vec![PatchForce { patch: PatchId(1), force_n: Vec3::new(0.0, bad, 0.0) }],
        };
        let mut stages = Stages { loads: Some(loads), ..Stages::default() };
        let report = solver.step(&mut stages);
        assert_eq!(report.contained, 2 * report.substeps);
        plain.step(&mut Stages::default());
        assert_eq!(solver.state(), plain.state(), "the tissue is untouched bit for bit");
    }
    let mut huge = Stages {
        loads: Some(Loads {
            nodes: vec![NodeForce { node: 60, force_n: Vec3::repeat(f64::MAX) }],
            patches: Vec::new(),
        }),
        ..Stages::default()
    };
    for _ in 0..10 {
        solver.step(&mut huge);
        let state = solver.state();
        let finite = state.position_m.iter().chain(&state.velocity_m_per_s).all(crate::finite::is_finite);
        assert!(finite, "{}", integrator.name());
    }
    let mut state = solver.state().clone();
    state.velocity_m_per_s[3].y = f64::NAN;
    assert!(matches!(solver.reset(&state), Err(SolverError::State(_))));
}

#[test]
fn stages_that_are_absent_cost_nothing() {
    let mut solver = skin();
    let report = solver.step(&mut Stages::default());
    let half_springs = solver.network().half_edges.neighbour.len() as u64 * u64::from(report.substeps);
    assert_eq!((report.half_springs, report.links, report.pairs), (half_springs, 0, 0));
}
