//! Small tissues of the extreme cases, their solver, and the energy rule. SI units.
//!
//! The sheet is skin of Table 2 (k = 160 N/m, sides and diagonals of k/2) on 17 × 17 nodes of 5 mm, held at its rim,
//! 5 % pre-stretched.

use crate::generators::{on_rim, pre_strained, sheet, with_fixed};
use sim_core::tissue::energy::{kinetic_j, spring_j};
use sim_core::tissue::load::{Loads, NodeForce};
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork, TissueState};
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::solver::{Stages, StepReport, TissueSolver};
use sim_core::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;

/// Spacing of the sheet, metres.
pub const SPACING_M: f64 = 5e-3;
/// k of skin, newtons per metre.
pub const SKIN_K: f64 = 160.0;
/// c of skin on a node, newton seconds per metre.
pub const SKIN_C: f64 = 3.0;
/// Mass of a node of skin at this spacing (1100 kg/m³, 1.75 mm), kilograms.
pub const NODE_KG: f64 = 4.8e-5;
/// The patch of these solvers: one node.
pub const POINT: PatchId = PatchId(0);

/// Skin sheet of `side` × `side` nodes with a held rim.
#[must_use]
pub fn skin_sheet(side: usize, stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> SpringNetwork {
    let flat = sheet(side, side, SPACING_M, stiffness_n_per_m, mass_kg, drag_n_s_per_m);
    pre_strained(with_fixed(flat, |i| on_rim(i, side, side)), 0.05)
}

/// A network of the given nodes and springs (a, b, k, rest length), nothing fixed.
///
/// # Panics
/// When the network is refused.
#[must_use]
pub fn network(x: &[Vec3], mass_kg: f64, drag_n_s_per_m: f64, springs: &[(u32, u32, f64, f64)]) -> SpringNetwork {
    let n = x.len();
    let spring = |&(a, b, stiffness_n_per_m, rest_length_m): &(u32, u32, f64, f64)| Spring {
        a,
        b,
        stiffness_n_per_m,
        rest_length_m,
        family: SpringFamily::Structural,
    };
    let springs = springs.iter().map(spring).collect();
    SpringNetwork::new(x.to_vec(), vec![mass_kg; n], vec![drag_n_s_per_m; n], vec![0; n], springs)
        .expect("a case of this suite builds a valid network")
}

/// Solver at a period with automatic sub-steps, up to a hundred thousand.
///
/// # Errors
/// What the solver says.
pub fn try_solver(network: SpringNetwork, period_s: f64) -> Result<TissueSolver, SolverError> {
    let most = SubstepPolicy::Automatic { max: 100_000 };
    let params = SolverParams { substeps: most, ..SolverParams::with_period(period_s) };
    TissueSolver::new(network, PatchSet::default(), params)
}

/// The same where it must be accepted.
///
/// # Panics
/// When it is refused.
#[must_use]
pub fn solver(network: SpringNetwork, period_s: f64) -> TissueSolver {
    try_solver(network, period_s).expect("sub-steps that are stable exist")
}

/// A solver whose only patch is one node.
///
/// # Panics
/// When it is refused.
#[must_use]
pub fn solver_at(network: SpringNetwork, node: u32, params: SolverParams) -> TissueSolver {
    let nodes = [node];
    let patches = PatchSet::new(network.node_count(), [(&nodes[..], &[1.0][..])]).expect("a node is a patch");
    TissueSolver::new(network, patches, params).expect("stable by the choice of the case")
}

/// Loads on single nodes.
#[must_use]
pub fn loaded(forces: impl IntoIterator<Item = (usize, Vec3)>) -> Stages {
    let nodes = forces.into_iter().map(|(node, force_n)| NodeForce { node: node as u32, force_n }).collect();
    Stages { loads: Some(Loads { nodes, patches: Vec::new() }), ..Stages::default() }
}

/// Steps for `seconds`; counts are summed.
pub fn run(solver: &mut TissueSolver, stages: &mut Stages, seconds: f64) -> StepReport {
    let steps = (seconds / solver.params().period_s).round() as usize;
    let mut sum = StepReport::default();
    for _ in 0..steps {
        let report = solver.step(stages);
        sum.saturated += report.saturated;
        sum.contained += report.contained;
        sum.handles_cut += report.handles_cut;
        sum.half_springs += report.half_springs;
        sum.coincident = sum.coincident.max(report.coincident);
    }
    sum
}

/// Largest distance between the nodes of two states, metres; not a number where either is not finite.
#[must_use]
pub fn farthest_m(a: &[Vec3], b: &[Vec3]) -> f64 {
    if !(is_sound(a) && is_sound(b)) {
        return f64::NAN;
    }
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Whether every number is finite.
#[must_use]
pub fn is_sound(vectors: &[Vec3]) -> bool {
    vectors.iter().flat_map(Vec3::iter).all(|x| x.is_finite())
}

/// Kinetic and elastic energy, joules.
#[must_use]
pub fn energy_j(network: &SpringNetwork, state: &TissueState) -> f64 {
    kinetic_j(network, state) + spring_j(network, &state.position_m)
}

/// Growth that the energy rule allows.
pub const ENERGY_GROWTH: f64 = 1e-6;

/// The energy rule: what a dissipative tissue without input power may not do.
#[derive(Clone, Copy, Debug)]
pub struct EnergyWatch {
    start_j: f64,
    largest_j: f64,
}

impl EnergyWatch {
    /// Begins with the energy of now.
    #[must_use]
    pub fn start(solver: &TissueSolver) -> Self {
        let start_j = energy_j(solver.network(), solver.state());
        Self { start_j, largest_j: start_j }
    }

    /// Looks again.
    pub fn look(&mut self, solver: &TissueSolver) {
        let now_j = energy_j(solver.network(), solver.state());
        // A value that is not a number must not be lost in a maximum.
        self.largest_j = if now_j <= self.largest_j { self.largest_j } else { now_j };
    }

    /// Largest growth so far, relative to the start.
    #[must_use]
    pub fn growth(&self) -> f64 {
        self.largest_j / self.start_j.max(f64::MIN_POSITIVE) - 1.0
    }
}

/// Lets a tissue go for `seconds`; gives the growth of its energy.
pub fn relax(solver: &mut TissueSolver, stages: &mut Stages, seconds: f64) -> f64 {
    let mut watch = EnergyWatch::start(solver);
    for _ in 0..(seconds / solver.params().period_s).round() as usize {
        solver.step(stages);
        watch.look(solver);
    }
    watch.growth()
}
