//! A tissue solver on a small network, for the tests of this folder.

use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::load::{Loads, NodeForce};
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;

/// The only handle of these tests.
pub(crate) const HAND: HandleSlot = HandleSlot(0);

/// The only patch of these tests: one node.
pub(crate) const POINT: PatchId = PatchId(0);

/// A solver whose patch is the single node `point`.
pub(crate) fn solver_at(network: SpringNetwork, point: u32, params: SolverParams) -> TissueSolver {
    let nodes = [point];
    let patches = PatchSet::new(network.node_count(), [(&nodes[..], &[1.0][..])]).expect("a node is a patch");
    TissueSolver::new(network, patches, params).expect("stable by the choice of the test")
}

/// A solver without suture points.
pub(crate) fn solver(network: SpringNetwork, period_s: f64) -> TissueSolver {
    TissueSolver::new(network, PatchSet::default(), SolverParams::with_period(period_s))
        .expect("stable sub-steps exist")
}

/// Loads as a stage of a step.
pub(crate) fn loaded(forces: impl IntoIterator<Item = (usize, Vec3)>) -> Stages {
    let nodes = forces.into_iter().map(|(node, force_n)| NodeForce { node: node as u32, force_n }).collect();
    Stages { loads: Some(Loads { nodes, patches: Vec::new() }), ..Stages::default() }
}

/// Steps for `seconds`.
pub(crate) fn run(solver: &mut TissueSolver, stages: &mut Stages, seconds: f64) {
    let steps = (seconds / solver.params().period_s).round() as usize;
    for _ in 0..steps {
        let report = solver.step(stages);
        assert_eq!((report.contained, report.saturated), (0, 0), "a limit acted; the test would measure that limit");
    }
}
