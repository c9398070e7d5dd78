//! Single precision beside double, over whole runs of the skin net: what the rounding of the forces comes to.

use super::{Net, SKIN, even_patches};
use crate::tissue::handle::HandleSlot;
use crate::tissue::integrator::Integrator;
use crate::tissue::patch_set::PatchId;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::SolverParams;
use crate::tissue::sweep::Precision;
use crate::vector::Vec3;

const PERIOD_S: f64 = 5e-3;
const PULL_M: f64 = 8e-3;
const STEPS: u32 = 100;
/// Difference of a run in single precision, as a share of the pull: forces are off by 4e-7 of `k (L + |d|)`, and a node
/// moves along with a handful of springs of that stiffness. A semi-implicit run is itself off by 1e-3.
const TOLERANCE: f64 = 2e-6;

/// The skin pulled at its middle, and its port force there.
fn pulled(integrator: Integrator, drag_n_s_per_m: f64, precision: Precision) -> (Vec<Vec3>, Vec3) {
    let network = Net { drag_n_s_per_m, ..SKIN }.build();
    let patches = even_patches(network.node_count(), &[SKIN.plus(5, 5)]);
    let params = SolverParams { integrator, precision, ..SolverParams::with_period(PERIOD_S) };
    let mut solver = TissueSolver::new(network, patches, params).unwrap();
    assert_eq!(solver.integrator_reason().contains("single"), params.sweep_precision() == Precision::Single);
    let mut stages = Stages::default();
    solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
    let (_, start) = solver.handle(HandleSlot(0)).unwrap();
    for step in 1..=STEPS {
        let way = PULL_M * (f64::from(step) / 50.0).min(1.0);
        solver.lead(HandleSlot(0), start + Vec3::new(0.3, 0.4, 0.5).normalize() * way);
        solver.step(&mut stages);
    }
    let force = solver.port(HandleSlot(0), &stages).unwrap().force_n;
    (solver.state().position_m.clone(), force)
}

#[test]
fn a_run_in_single_precision_keeps_its_tolerance() {
    for (integrator, drag) in [(Integrator::SemiImplicit, 3.0), (Integrator::Verlet, 0.05)] {
        let (double, force) = pulled(integrator, drag, Precision::Double);
        let (single, single_force) = pulled(integrator, drag, Precision::Single);
        let off = double.iter().zip(&single).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off > 0.0 && off <= TOLERANCE * PULL_M, "{integrator:?}: {off:e} m");
        let force_off = (force - single_force).norm() / force.norm();
        assert!(force_off <= TOLERANCE, "{integrator:?}: {force_off:e} of {} N", force.norm());
    }
}

#[test]
fn implicit_steps_stay_in_double_precision() {
    assert_eq!(pulled(Integrator::Bdf2, 3.0, Precision::Double), pulled(Integrator::Bdf2, 3.0, Precision::Single));
}
