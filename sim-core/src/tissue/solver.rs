//! One tissue, stepped: forces, Eq. (2), handles, attachments, pairs, in fixed order.
//!
//! A period of `H` seconds is `n` sub-steps of `h = H/n`. Each: spring forces and loads → velocity and
//! position (integrator) → handles prescribed → attachments and pairs, implicit → patches and followers
//! moved, with velocities `+ Δx/h`. A stage that a scene does not need is `None`: no loop, no memory.
//! Nothing is allocated in a step. A free node moves at most half a mesh spacing per period by Eq. (2), and as
//! much again by the constraints: the limit is per stage, and cuts are counted.
//! Deliberately absent: clocks, what the handles do, when stitches are tied (scene, wound).

use crate::absent::{ATTACHMENTS, Keep, SLEEP, Stage};
use crate::tissue::choice::Choice;
use crate::tissue::constraint::{Pairs, PatchResponse};
use crate::tissue::crew::Crew;
use crate::tissue::handle::{GraspError, Handle, HandleSlot, MAX_HANDLES};
use crate::tissue::integrator::NodeFactors;
use crate::tissue::load::Loads;
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::port::{Port, PortSolver, PortView};
use crate::tissue::regulation::Attachments;
use crate::tissue::scheme::Scheme;
use crate::tissue::sleep::Sleep;
use crate::tissue::solver_params::{self, SolverError, SolverParams};
use crate::tissue::stability::Stability;
use crate::tissue::sweep::dispatch::KernelLevel;
use crate::tissue::sweep::{Precision, SpringSweep};
use crate::vector::Vec3;
use std::sync::Arc;

mod step;

/// Stages of a step that a scene may do without.
#[derive(Clone, Debug, Default)]
pub struct Stages {
    /// Relaxed attachments (Algorithm 1).
    pub attachments: Option<Stage<Attachments, ATTACHMENTS>>,
    /// Stitches and holds.
    pub pairs: Option<Pairs>,
    /// Forces from outside.
    pub loads: Option<Loads>,
}

/// What happened in a step, summed over its sub-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Sub-steps.
    pub substeps: u32,
    /// Half-springs visited.
    pub half_springs: u64,
    /// Half-springs whose ends coincide, in the last sub-step.
    pub coincident: u32,
    /// Attachment links that pulled, in the last sub-step.
    pub links: u32,
    /// Pairs that pulled or pushed, in the last sub-step.
    pub pairs: u32,
    /// Node moves cut to the displacement limit.
    pub saturated: u32,
    /// Handles whose way was cut to the displacement limit.
    pub handles_cut: u32,
    /// Values that were not finite and were replaced by the last good ones.
    pub contained: u32,
    /// Nodes that were worked on in the last sub-step; all of them where none may sleep.
    pub awake_nodes: u32,
    /// Iterations of the linear solver; 0 for integrators that solve nothing.
    pub linear_iterations: u32,
}

/// A tissue with its integrator.
#[derive(Clone, Debug)]
pub struct TissueSolver {
    network: SpringNetwork,
    springs: SpringSweep,
    crew: Option<Arc<dyn Crew>>,
    patches: PatchSet,
    params: SolverParams,
    stability: Stability,
    choice: Option<Choice>,
    spacing_m: f64,
    state: TissueState,
    force_n: Vec<Vec3>,
    factors: Vec<NodeFactors>,
    mobility_m_per_n: Vec<f64>,
    patch_mobility_m_per_n: Vec<f64>,
    responses: Vec<PatchResponse>,
    handles: [Option<Handle>; MAX_HANDLES],
    ports: [PortSolver; MAX_HANDLES],
    scheme: Scheme,
    sleep: Option<Stage<Sleep, SLEEP>>,
}

impl TissueSolver {
    /// Takes a network at rest in its built shape and chooses the sub-steps.
    ///
    /// # Errors
    /// [`SolverError`]: parameters not usable, a patch beyond the network, or an integrator that must
    /// blow up, with what it would need in words.
    pub fn new(network: SpringNetwork, patches: PatchSet, params: SolverParams) -> Result<Self, SolverError> {
        params.check()?;
        let count = network.node_count();
        if (0..patches.len()).any(|p| patches.nodes(PatchId(p as u32)).iter().any(|&n| n as usize >= count)) {
            return Err(SolverError::Patches(count));
        }
        let state = network.rest_state();
        let (params, choice) = solver_params::decide(&network, &state.position_m, params);
        let stability = solver_params::assess(&network, &state.position_m, &params)?;
        let mut solver = Self {
            spacing_m: solver_params::mean_spacing_m(&network),
            force_n: vec![Vec3::zeros(); count],
            factors: vec![NodeFactors::default(); count],
            mobility_m_per_n: vec![0.0; count],
            patch_mobility_m_per_n: vec![0.0; patches.len()],
            responses: vec![PatchResponse::free(0.0); patches.len()],
            handles: std::array::from_fn(|_| None),
            ports: std::array::from_fn(|_| PortSolver::new(count)),
            springs: SpringSweep::automatic(&network, params.sweep_precision(), KernelLevel::Best),
            crew: None,
            scheme: Scheme::new(params.integrator, &network),
            sleep: sleep_of(&network, &params),
            network,
            patches,
            params,
            stability,
            choice,
            state,
        };
        solver.refresh_mobility();
        Ok(solver)
    }

    /// Positions and velocities.
    #[must_use]
    pub fn state(&self) -> &TissueState {
        &self.state
    }

    /// The network.
    #[must_use]
    pub fn network(&self) -> &SpringNetwork {
        &self.network
    }

    /// The patches.
    #[must_use]
    pub fn patches(&self) -> &PatchSet {
        &self.patches
    }

    /// Parameters.
    #[must_use]
    pub fn params(&self) -> &SolverParams {
        &self.params
    }

    /// The automatic choice and its reason; `None` where the integrator was demanded.
    #[must_use]
    pub fn choice(&self) -> Option<&Choice> {
        self.choice.as_ref()
    }

    /// Why this integrator with these sub-steps, in one sentence with the numbers.
    #[must_use]
    pub fn integrator_reason(&self) -> String {
        let reason = self.choice.as_ref().map_or_else(|| format!("demanded: {}", self.stability), ToString::to_string);
        match self.springs.precision() {
            Precision::Double => reason,
            Precision::Single => reason + "; forces in single precision",
        }
    }

    /// Sub-steps and stability number, for the log of the scene's load.
    #[must_use]
    pub fn stability(&self) -> &Stability {
        &self.stability
    }

    /// Mean length of the structural springs, metres.
    #[must_use]
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Nodes that move; `None` where none may sleep: not asked for, an integrator that solves for all
    /// at once, or single precision, whose rounding a sleeping node would take for a force.
    #[must_use]
    pub fn awake_nodes(&self) -> Option<usize> {
        self.sleep.as_ref().map(|s| s.awake_nodes())
    }

    /// Nodes that are at rest and left out of the steps; none where none may sleep.
    pub fn sleeping_nodes(&self) -> impl Iterator<Item = u32> {
        self.sleep.iter().flat_map(|s| s.asleep())
    }

    /// Sets the state and lets go of all handles.
    ///
    /// # Errors
    /// [`SolverError::State`] when the state has another length or a value that is not finite.
    pub fn reset(&mut self, state: &TissueState) -> Result<(), SolverError> {
        solver_params::check_state(state, self.network.node_count())?;
        self.state.clone_from(state);
        self.handles = std::array::from_fn(|_| None);
        self.sleep.iter_mut().for_each(|s| s.wake_all());
        self.refresh_mobility();
        Ok(())
    }

    /// From now on the spring forces are a crew's work, strip by strip: the same bits for any number of hands, and
    /// within rounding of those without a crew. Tiles that sleep are swept by one pair of hands still.
    pub fn share(&mut self, crew: Arc<dyn Crew>) {
        self.crew = Some(crew);
        self.lay_out(self.springs.precision());
    }

    fn lay_out(&mut self, precision: Precision) {
        let level = self.springs.level();
        self.springs = match &self.crew {
            Some(crew) => SpringSweep::shared(&self.network, precision, level, crew.clone()),
            None => SpringSweep::automatic(&self.network, precision, level),
        };
    }

    /// Chooses the sub-steps, and the integrator where that is automatic, again for the tangent at the current state.
    ///
    /// # Errors
    /// [`SolverError`] when the integrator must blow up here; the sub-steps then stay.
    pub fn reassess(&mut self) -> Result<(), SolverError> {
        let (params, choice) = solver_params::decide(&self.network, &self.state.position_m, self.params);
        self.stability = solver_params::assess(&self.network, &self.state.position_m, &params)?;
        if params.integrator != self.params.integrator {
            self.scheme = Scheme::new(params.integrator, &self.network);
            self.sleep = sleep_of(&self.network, &params);
            self.lay_out(params.sweep_precision());
        }
        (self.params, self.choice) = (params, choice);
        self.sleep.iter_mut().for_each(|s| s.wake_all());
        self.refresh_mobility();
        Ok(())
    }

    /// Lets a handle take a patch where it is; its nodes are prescribed from now on.
    ///
    /// # Errors
    /// [`GraspError`]: handle not free, no such patch, or a node already held.
    pub fn grasp(&mut self, slot: HandleSlot, patch: PatchId) -> Result<(), GraspError> {
        if self.handles.get(slot.0).is_none_or(Option::is_some) {
            return Err(GraspError::Slot(slot.0));
        }
        if !self.patches.contains(patch) {
            return Err(GraspError::Patch(patch.0));
        }
        let nodes = self.patches.nodes(patch);
        let held = |h: &Handle| self.patches.nodes(h.patch).iter().any(|n| nodes.contains(n));
        if self.handles.iter().flatten().any(held) {
            return Err(GraspError::Overlap(patch.0));
        }
        let mut handle = Handle::grasp(patch, &self.patches, &self.state.position_m);
        let center = handle.position_m;
        handle.place(&self.patches, &mut self.state, center, Vec3::zeros());
        self.handles[slot.0] = Some(handle);
        self.sleep.iter_mut().for_each(|sleep| sleep.touch_patch(&self.patches, patch));
        self.refresh_mobility();
        Ok(())
    }

    /// Lets go of a patch; its nodes move freely again, with the velocity of the handle.
    pub fn release(&mut self, slot: HandleSlot) {
        if let Some(handle) = self.handles.get_mut(slot.0).and_then(Option::take) {
            self.sleep.iter_mut().for_each(|sleep| sleep.touch_patch(&self.patches, handle.patch));
            self.refresh_mobility();
        }
    }

    /// Patch and position of a handle in use.
    #[must_use]
    pub fn handle(&self, slot: HandleSlot) -> Option<(PatchId, Vec3)> {
        self.handles.get(slot.0)?.as_ref().map(|h| (h.patch, h.position_m))
    }

    /// Sets where a handle shall be at the end of the next step. Returns false, and changes nothing,
    /// when the handle is not in use or the target is not finite.
    pub fn lead(&mut self, slot: HandleSlot, target_m: Vec3) -> bool {
        self.handles.get_mut(slot.0).and_then(Option::as_mut).is_some_and(|h| h.lead(target_m))
    }

    /// Moves a patch at once, as the paper's control does; its velocity stays. Patches that a handle holds, patches that
    /// do not exist and shifts that are not finite are left alone.
    pub fn displace(&mut self, patch: PatchId, shift_m: Vec3) {
        let held = self.handles.iter().flatten().any(|h| h.patch == patch);
        if held || !self.patches.contains(patch) || !crate::finite::is_finite(&shift_m) {
            return;
        }
        for &node in self.patches.nodes(patch) {
            self.state.position_m[node as usize] += shift_m;
        }
        self.sleep.iter_mut().for_each(|sleep| sleep.touch_patch(&self.patches, patch));
        self.scheme.forget();
    }

    /// The tissue as a handle feels it until the next step; `None` for a handle not in use.
    pub fn port(&mut self, slot: HandleSlot, stages: &Stages) -> Option<Port> {
        let handle = self.handles.get(slot.0)?.as_ref()?;
        let params = &self.params;
        let substep_s = self.stability.substep_s();
        let view = PortView {
            network: &self.network,
            patches: &self.patches,
            position_m: &self.state.position_m,
            mobility_m_per_n: &self.mobility_m_per_n,
            attachments: stages.attachments.as_ref().map(|a| a as &Attachments),
            pairs: stages.pairs.as_ref(),
            resisting_s: params.integrator.resisting_step_s(params.period_s),
            substep_s,
        };
        Some(self.ports[slot.0].measure(handle, &view, &params.port))
    }

    /// Factors and mobilities of all nodes for the current sub-step and handles; the scheme starts again.
    fn refresh_mobility(&mut self) {
        let h = self.stability.substep_s();
        let resisting_s = self.params.integrator.resisting_step_s(h);
        for node in 0..self.network.node_count() {
            let (m, c) = (self.network.mass_kg[node], self.network.drag_n_s_per_m[node]);
            let moves = self.network.fixed[node] == 0;
            self.factors[node] =
                if moves { self.params.integrator.factors(m, c, resisting_s) } else { NodeFactors::default() };
        }
        for handle in self.handles.iter().flatten() {
            for &node in self.patches.nodes(handle.patch) {
                self.factors[node as usize] = NodeFactors::default();
            }
        }
        for (mobility, factors) in self.mobility_m_per_n.iter_mut().zip(&self.factors) {
            *mobility = factors.gain_s_per_kg * resisting_s;
        }
        for (patch, mobility) in self.patch_mobility_m_per_n.iter_mut().enumerate() {
            *mobility = self.patches.mobility(PatchId(patch as u32), &self.mobility_m_per_n);
        }
        self.ports.iter_mut().for_each(PortSolver::forget);
        self.scheme.restart(&self.network, &self.mobility_m_per_n, h);
    }
}

fn sleep_of(network: &SpringNetwork, params: &SolverParams) -> Option<Stage<Sleep, SLEEP>> {
    let able = params.integrator.lets_nodes_sleep() && params.sweep_precision() == Precision::Double;
    let wanted = params.sleep.filter(|_| able);
    wanted.and_then(|sleep| Keep::keep(Sleep::new(network, &sleep)))
}
