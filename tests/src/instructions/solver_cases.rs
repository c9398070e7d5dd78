//! The tissue alone: its force sweep, an integrator's step, and the step of its outer layer.
//!
//! The state is that of the settled scene; nothing is held and no optional stage is there.

use super::Step;
use super::cases::{Hand, Parts};
use super::full::scene_steps::{config, sutured};
use sim_core::scene::step::Scene;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::network::{Spring, SpringNetwork, TissueState};
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverParams, SubstepPolicy};
use sim_core::tissue::sweep::SpringSweep;
use sim_core::vector::Vec3;
use std::hint::black_box;

/// The scene of a case without optional stages.
pub(super) fn plain_scene(name: &str, mesh: &str) -> Result<Scene, String> {
    let config = config(name, mesh, &Parts::new("none")).ok_or_else(|| format!("there is no scene {name}"))?;
    sutured(&config, Hand::Away).map(|(scene, _)| scene)
}

/// The spring forces, once per sub-step of the scene.
pub(super) fn sweep(name: &str, mesh: &str) -> Result<Step, String> {
    let scene = plain_scene(name, mesh)?;
    let network = scene.solver().network();
    let mut springs = SpringSweep::new(network);
    let mut force_n = vec![Vec3::zeros(); network.node_count()];
    let position_m = scene.solver().state().position_m.clone();
    let substeps = scene.solver().stability().substeps;
    Ok(Box::new(move || {
        for _ in 0..substeps {
            black_box(springs.sweep(&position_m, &mut force_n));
        }
    }))
}

/// A step by one integrator, with the sub-steps that it needs here.
pub(super) fn tissue(name: &str, mesh: &str, integrator: Integrator) -> Result<Step, String> {
    let scene = plain_scene(name, mesh)?;
    let solver = scene.solver();
    let params = SolverParams {
        integrator,
        automatic: None,
        substeps: SubstepPolicy::Automatic { max: 1000 },
        ..*solver.params()
    };
    stepping(solver.network().clone(), solver.patches().clone(), params, solver.state())
}

/// A step of the outermost layer alone, with the integrator and sub-steps of the whole.
pub(super) fn outer(name: &str, mesh: &str) -> Result<Step, String> {
    let scene = plain_scene(name, mesh)?;
    let solver = scene.solver();
    let kept = kept_nodes(scene.tissue().layer.as_slice());
    let network = without_inner(solver.network(), &kept)?;
    let patches =
        PatchSet::new(network.node_count(), std::iter::empty::<(&[u32], &[f64])>()).map_err(|e| e.to_string())?;
    let stability = solver.stability();
    let params = SolverParams {
        integrator: stability.integrator,
        automatic: None,
        substeps: SubstepPolicy::Demanded(stability.substeps),
        ..*solver.params()
    };
    let pick = |all: &[Vec3]| kept.iter().zip(all).filter(|(k, _)| k.is_some()).map(|(_, v)| *v).collect();
    let state = TissueState {
        position_m: pick(&solver.state().position_m),
        velocity_m_per_s: pick(&solver.state().velocity_m_per_s),
    };
    stepping(network, patches, params, &state)
}

/// New index of each node of the outermost layer.
fn kept_nodes(layer: &[u8]) -> Vec<Option<u32>> {
    let mut next = 0;
    let number = |l: &u8| {
        (*l == 0).then(|| {
            next += 1;
            next - 1
        })
    };
    layer.iter().map(number).collect()
}

fn without_inner(whole: &SpringNetwork, kept: &[Option<u32>]) -> Result<SpringNetwork, String> {
    let moved = |s: &Spring| {
        let (a, b) = (kept[s.a as usize]?, kept[s.b as usize]?);
        Some(Spring { a, b, ..*s })
    };
    let springs = whole.springs.iter().filter_map(moved).collect();
    let of = |all: &[f64]| kept.iter().zip(all).filter(|(k, _)| k.is_some()).map(|(_, v)| *v).collect();
    let rest_m = kept.iter().zip(&whole.rest_m).filter(|(k, _)| k.is_some()).map(|(_, v)| *v).collect();
    let fixed = kept.iter().zip(&whole.fixed).filter(|(k, _)| k.is_some()).map(|(_, v)| *v).collect();
    SpringNetwork::new(rest_m, of(&whole.mass_kg), of(&whole.drag_n_s_per_m), fixed, springs).map_err(|e| e.to_string())
}

fn stepping(
    network: SpringNetwork,
    patches: PatchSet,
    params: SolverParams,
    state: &TissueState,
) -> Result<Step, String> {
    let mut solver = TissueSolver::new(network, patches, params).map_err(|e| e.to_string())?;
    solver.reset(state).map_err(|e| e.to_string())?;
    let mut stages = Stages::default();
    Ok(Box::new(move || {
        black_box(solver.step(&mut stages));
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outer_layer_keeps_its_springs_and_no_others() {
        let scene = plain_scene("vessel", "coarse").expect("the preset builds");
        let (network, layer) = (scene.solver().network(), &scene.tissue().layer);
        let kept = kept_nodes(layer);
        let outer = without_inner(network, &kept).expect("sound");
        assert_eq!(outer.node_count(), layer.iter().filter(|l| **l == 0).count());
        let own = |s: &&Spring| layer[s.a as usize] == 0 && layer[s.b as usize] == 0;
        assert_eq!(outer.springs.len(), network.springs.iter().filter(own).count());
        assert!(outer.node_count() < network.node_count() && !outer.springs.is_empty());
    }
}
