//! One period of a tissue: what the scheme does between two sub-steps' ends, in fixed order.
//!
//! Explicit: forces at the start, nodes moved (`integrator::advance`), handles placed, attachments and pairs at the
//! end of the sub-step. Verlet: the same on velocities of half steps. XPBD: loads, nodes moved, handles placed,
//! springs projected, attachments and pairs. BDF2: handles placed, then one implicit solve with everything in it.
//! Deliberately absent: the formulas, which are in the files of the schemes.

use super::{Stages, StepReport, TissueSolver};
use crate::absent::{SLEEP, Stage};
use crate::tissue::bdf2::Surroundings;
use crate::tissue::constraint::PatchResponse;
use crate::tissue::handle::MAX_HANDLES;
use crate::tissue::integrator::{AdvanceCounts, advance};
use crate::tissue::link_solve::{Correction, StepView};
use crate::tissue::network::TissueState;
use crate::tissue::patch_set::PatchId;
use crate::tissue::regulation::RegulationMode;
use crate::tissue::scheme::Scheme;
use crate::tissue::sleep::Sleep;
use crate::vector::Vec3;

/// Where a handle's period begins and where it ends.
type Way = (Vec3, Vec3);

impl TissueSolver {
    /// One period.
    pub fn step(&mut self, stages: &mut Stages) -> StepReport {
        let substeps = self.stability.substeps;
        let h = self.stability.substep_s();
        let limit_m = self.params.displacement_limit_spacings * self.spacing_m / f64::from(substeps);
        let handle_limit_m = self.params.handle_limit_spacings * self.spacing_m;
        let mut report = StepReport { substeps, ..StepReport::default() };
        let mut ways = [(Vec3::zeros(), Vec3::zeros()); MAX_HANDLES];
        for (way, handle) in ways.iter_mut().zip(&self.handles) {
            if let Some(handle) = handle {
                let (stop, cut) = handle.next_stop(handle_limit_m);
                *way = (handle.position_m, stop);
                report.handles_cut += u32::from(cut);
            }
        }
        if let Scheme::Verlet(staggered) = &mut self.scheme {
            staggered.open(&mut self.state);
        }
        for substep in 1..=substeps {
            let fraction = f64::from(substep) / f64::from(substeps);
            let counts = match self.scheme {
                Scheme::Explicit => {
                    self.gather(stages, &mut report);
                    let Self { factors, force_n, state, sleep, .. } = self;
                    match resting(sleep) {
                        None => advance(factors, force_n, state, h, limit_m),
                        Some(sleep) => sleep.advance(factors, force_n, state, h, limit_m),
                    }
                }
                Scheme::Verlet(_) => {
                    self.gather(stages, &mut report);
                    let Self { scheme: Scheme::Verlet(staggered), sleep, .. } = self else { continue };
                    let resting = resting(sleep);
                    if substep == substeps {
                        staggered.remember(&self.state.velocity_m_per_s, resting);
                    }
                    staggered.advance(&self.factors, &self.force_n, &mut self.state, (h, limit_m), resting)
                }
                Scheme::Xpbd(_) => self.project_springs(stages, h, limit_m, &ways, fraction),
                Scheme::Bdf2(_) => {
                    self.place_handles(&ways, fraction);
                    self.solve_implicit(stages, h, limit_m, &mut report);
                    continue;
                }
            };
            report.saturated += counts.saturated;
            report.contained += counts.contained;
            self.place_handles(&ways, fraction);
            if stages.attachments.is_some() || stages.pairs.is_some() {
                self.constrain(stages, h, limit_m, &mut report);
            }
        }
        if let Scheme::Verlet(staggered) = &mut self.scheme {
            staggered.close(&self.factors, &mut self.state, resting(&self.sleep));
        }
        report.awake_nodes = self.awake_nodes().unwrap_or(self.network.node_count()) as u32;
        self.close_sleep();
        report
    }

    /// Lets tiles that have been quiet fall asleep.
    fn close_sleep(&mut self) {
        let Self { sleep: Some(sleep), scheme, factors, force_n, state, .. } = self else { return };
        match scheme {
            Scheme::Verlet(staggered) => sleep.close_period(factors, force_n, state, |node| staggered.still(node)),
            _ => sleep.close_period(factors, force_n, state, |_| {}),
        }
    }

    /// Spring forces and loads at the current positions.
    fn gather(&mut self, stages: &Stages, report: &mut StepReport) {
        let Self { springs, network, patches, state, factors, force_n, sleep, .. } = self;
        if let Some(sleep) = sleep {
            stages.loads.iter().for_each(|loads| sleep.touch_loaded(loads, patches));
            report.half_springs += sleep.wake_neighbours(network, factors, &state.position_m);
            let visited = sleep.forces(springs, network, &state.position_m, force_n);
            report.coincident = visited.coincident;
            report.half_springs += visited.half_springs;
        } else {
            report.coincident = springs.sweep(&state.position_m, force_n);
            report.half_springs += network.half_edges.neighbour.len() as u64;
        }
        if let Some(loads) = &stages.loads {
            report.contained += loads.add(&self.patches, &mut self.force_n);
        }
    }

    /// Puts the held nodes where the handles are at a fraction of the period.
    fn place_handles(&mut self, ways: &[Way; MAX_HANDLES], fraction: f64) {
        for ((from, stop), handle) in ways.iter().zip(&mut self.handles) {
            if let Some(handle) = handle {
                let center = if fraction == 1.0 { *stop } else { from + (stop - from) * fraction };
                handle.place(&self.patches, &mut self.state, center, (stop - from) / self.params.period_s);
                self.sleep.iter_mut().for_each(|sleep| sleep.touch_patch(&self.patches, handle.patch));
            }
        }
    }

    /// XPBD: loads and inertia, then the springs as constraints.
    fn project_springs(
        &mut self,
        stages: &Stages,
        h: f64,
        limit_m: f64,
        ways: &[Way; MAX_HANDLES],
        fraction: f64,
    ) -> AdvanceCounts {
        self.force_n.fill(Vec3::zeros());
        let unusable = stages.loads.as_ref().map_or(0, |loads| loads.add(&self.patches, &mut self.force_n));
        if let Scheme::Xpbd(springs) = &mut self.scheme {
            springs.remember(&self.state.position_m);
        }
        let mut counts = advance(&self.factors, &self.force_n, &mut self.state, h, limit_m);
        counts.contained += unusable;
        self.place_handles(ways, fraction);
        let Self { scheme: Scheme::Xpbd(springs), network, mobility_m_per_n, state, params, .. } = self else {
            return counts;
        };
        springs.project(network, mobility_m_per_n, &mut state.position_m, params.xpbd_iterations);
        let end = springs.close(mobility_m_per_n, state, h, limit_m);
        let (saturated, contained) = (counts.saturated + end.saturated, counts.contained + end.contained);
        AdvanceCounts { saturated, contained }
    }

    /// BDF2: springs, loads, attachments and pairs in one solve; literal attachments are projected after it.
    fn solve_implicit(&mut self, stages: &mut Stages, h: f64, limit_m: f64, report: &mut StepReport) {
        self.force_n.fill(Vec3::zeros());
        if let Some(loads) = &stages.loads {
            report.contained += loads.add(&self.patches, &mut self.force_n);
        }
        let Self { scheme: Scheme::Bdf2(bdf2), network, springs, patches, mobility_m_per_n, state, params, .. } = self
        else {
            return;
        };
        let (spacing_m, params) = (self.spacing_m, &params.newton);
        let around = Surroundings { network, patches, mobility_m_per_n, params, h, limit_m, spacing_m };
        let (counts, solved) = bdf2.step(&around, springs, state, &mut self.force_n, stages);
        report.saturated += counts.saturated;
        report.contained += counts.contained;
        report.coincident = solved.coincident;
        report.half_springs += network.half_edges.neighbour.len() as u64 * u64::from(solved.sweeps);
        report.linear_iterations += solved.linear_iterations;
        (report.links, report.pairs) = (solved.active.links, solved.active.pairs);
        if let Some(attachments) = &mut stages.attachments
            && matches!(attachments.mode(), RegulationMode::Paper(_))
        {
            let view = StepView { patches, mobility_m_per_n, h, limit_m };
            let done = attachments.close(&view, state, &self.responses);
            report.links = done.acting;
            report.saturated += done.saturated;
            report.contained += done.contained;
            if done.acting > 0 {
                bdf2.forget();
            }
        }
    }

    /// Attachments and pairs at the end of a sub-step.
    fn constrain(&mut self, stages: &mut Stages, h: f64, limit_m: f64, report: &mut StepReport) {
        let Self { patches, mobility_m_per_n, patch_mobility_m_per_n, responses, state, sleep, .. } = self;
        for (response, &mobility) in responses.iter_mut().zip(patch_mobility_m_per_n.iter()) {
            *response = PatchResponse::free(mobility);
        }
        let view = StepView { patches, mobility_m_per_n, h, limit_m };
        if let Some(attachments) = &mut stages.attachments {
            attachments.open(&view, state, responses);
        }
        if let Some(pairs) = &mut stages.pairs {
            report.pairs = pairs.solve(patches, &state.position_m, responses);
        }
        let mut done = move_patches(&view, state, responses, patch_mobility_m_per_n);
        report.saturated += done.saturated;
        report.contained += done.contained;
        if let Some(attachments) = &mut stages.attachments {
            done = attachments.close(&view, state, responses);
            report.links = done.acting;
            report.saturated += done.saturated;
            report.contained += done.contained;
        }
        if let Some(sleep) = sleep {
            for (patch, response) in (0..).map(PatchId).zip(responses.iter()) {
                if response.shift_m != Vec3::zeros() {
                    sleep.touch_patch(patches, patch);
                }
            }
            let pulled = stages.attachments.iter().flat_map(|a| a.follower_forces());
            pulled.filter(|(_, tension_n)| *tension_n > 0.0).for_each(|(node, _)| sleep.touch(node));
        }
    }
}

/// Who is awake, where not everyone is.
fn resting(sleep: &Option<Stage<Sleep, SLEEP>>) -> Option<&Sleep> {
    sleep.as_ref().map(|s| s as &Sleep).filter(|sleep| !sleep.all_awake())
}

/// Spreads the displacement of each free patch over its nodes, as the force behind it does.
fn move_patches(
    view: &StepView<'_>,
    state: &mut TissueState,
    responses: &[PatchResponse],
    patch_mobility_m_per_n: &[f64],
) -> Correction {
    let mut done = Correction::default();
    for (index, (response, &mobility)) in responses.iter().zip(patch_mobility_m_per_n).enumerate() {
        if mobility == 0.0 || response.shift_m == Vec3::zeros() {
            continue;
        }
        let force = response.shift_m / mobility;
        let patch = PatchId(index as u32);
        for (&node, &w) in view.patches.nodes(patch).iter().zip(view.patches.weights(patch)) {
            let node = node as usize;
            done.apply(view, state, node, force * (w * view.mobility_m_per_n[node]), 1.0 / view.h);
        }
    }
    done
}
