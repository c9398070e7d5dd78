//! One run of sim-core's tissue solver on a case, timed.
//!
//! One step per period, so that the handle is exactly where the way says at every step. Processor time of this thread for
//! the steps alone (sampling is outside), the least of the repeats; wall time of every single step for the percentiles.

use super::cases::{Case, END_S, SAMPLE_S};
use super::cpu_clock::thread_cpu_s;
use crate::reference::{Probe, Samples};
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::network::TissueState;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Nodes are not cut to a limit here: the limit is a net under the product, and would hide an instability.
const NO_LIMIT_SPACINGS: f64 = 1e6;
/// A repeat that costs more processor time than this is not made.
const REPEAT_BELOW_S: f64 = 0.15;
/// Most repeats.
const MAX_REPEATS: usize = 3;

/// The handle that pulls.
pub(super) const HANDLE: HandleSlot = HandleSlot(0);

/// What a run gave.
#[derive(Clone, Debug)]
pub(super) struct TissueRun {
    pub(super) samples: Samples,
    /// Processor time, seconds.
    pub(super) cpu_s: f64,
    /// Wall time of each step, nanoseconds, ascending.
    pub(super) step_ns: Vec<u64>,
    /// Solver periods of the scene, and those in which the steps took longer than the period.
    pub(super) periods: u64,
    pub(super) missed: u64,
    pub(super) linear_iterations: u64,
    /// Values that were not finite, and forces on nodes cut to a limit.
    pub(super) contained: u64,
}

/// What is switched on at a time, seconds.
pub(super) type Event = (f64, fn(&TissueSolver, &mut Stages));

/// What acts besides the springs, and when it is switched on.
pub(super) struct Extras<'a> {
    pub(super) stages: Stages,
    /// Called before the first step at or after each time.
    pub(super) events: &'a [Event],
}

impl Extras<'_> {
    /// Springs only.
    pub(super) fn none() -> Self {
        Self { stages: Stages::default(), events: &[] }
    }
}

/// Runs a case with `per_sample` steps between samples; `None` when stopped.
pub(super) fn run(
    case: &Case,
    integrator: Integrator,
    per_sample: usize,
    extras: &Extras<'_>,
    stop: &AtomicBool,
) -> Result<Option<TissueRun>, SolverError> {
    let Some(mut best) = run_once(case, integrator, per_sample, extras, stop)? else { return Ok(None) };
    for _ in 1..MAX_REPEATS {
        if best.cpu_s > REPEAT_BELOW_S {
            break;
        }
        let Some(again) = run_once(case, integrator, per_sample, extras, stop)? else { break };
        if again.cpu_s < best.cpu_s {
            best = again;
        }
    }
    Ok(Some(best))
}

fn run_once(
    case: &Case,
    integrator: Integrator,
    per_sample: usize,
    extras: &Extras<'_>,
    stop: &AtomicBool,
) -> Result<Option<TissueRun>, SolverError> {
    let dt = SAMPLE_S / per_sample as f64;
    let params = SolverParams {
        integrator,
        substeps: SubstepPolicy::Demanded(1),
        displacement_limit_spacings: NO_LIMIT_SPACINGS,
        handle_limit_spacings: NO_LIMIT_SPACINGS,
        ..SolverParams::with_period(dt)
    };
    let mut solver = TissueSolver::new(case.network.clone(), case.patches.clone(), params)?;
    let still = vec![Vec3::zeros(); case.start_m.len()];
    solver.reset(&TissueState { position_m: case.start_m.clone(), velocity_m_per_s: still })?;
    // The patch exists and no handle is in use: this cannot fail.
    let _ = solver.grasp(HANDLE, case.patch);
    let Some((_, home)) = solver.handle(HANDLE) else { return Ok(None) };
    let mut stages = extras.stages.clone();
    let mut events = extras.events.iter();
    let mut next = events.next();
    let mut probe = Probe::new(&case.network, case.patches.nodes(case.patch));
    let count = (END_S / SAMPLE_S).round() as usize;
    let mut result = TissueRun {
        samples: Samples::default(),
        cpu_s: 0.0,
        step_ns: Vec::with_capacity(count * per_sample),
        periods: 0,
        missed: 0,
        linear_iterations: 0,
        contained: 0,
    };
    for sample in 0..count {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let begun = thread_cpu_s();
        for step in 0..per_sample {
            let index = sample * per_sample + step;
            while let Some((_, act)) = next.filter(|(at, _)| index as f64 * dt >= at - 1e-12) {
                act(&solver, &mut stages);
                next = events.next();
            }
            solver.lead(HANDLE, home + case.way((index + 1) as f64 * dt));
            // Wall clock: the time of each step is what the report measures.
            let tick = Instant::now();
            let report = solver.step(&mut stages);
            result.step_ns.push(tick.elapsed().as_nanos() as u64);
            result.linear_iterations += u64::from(report.linear_iterations);
            result.contained += u64::from(report.contained);
        }
        result.cpu_s += thread_cpu_s() - begun;
        let state = solver.state();
        probe.record(&state.position_m, &state.velocity_m_per_s, &mut result.samples);
        if let Some(force) = result.samples.force_n.last_mut() {
            add_reactions(case, &stages, force);
        }
    }
    let per_period = (case.period_s / dt).round().max(1.0) as usize;
    let limit_ns = (dt * per_period as f64 * 1e9) as u64;
    for period in result.step_ns.chunks_exact(per_period) {
        result.periods += 1;
        result.missed += u64::from(period.iter().sum::<u64>() > limit_ns);
    }
    result.step_ns.sort_unstable();
    Ok(Some(result))
}

/// What attachments and pairs add to the force on the held patch.
fn add_reactions(case: &Case, stages: &Stages, force: &mut [f64; 3]) {
    let attachments = stages.attachments.as_ref();
    let attached = attachments.and_then(|a| a.of_patch(case.patch).map(|index| a.reaction_n(index)));
    let paired = stages.pairs.as_ref().map(|p| p.force_on(case.patch));
    for reaction in [attached, paired].into_iter().flatten() {
        for (f, r) in force.iter_mut().zip(reaction.iter()) {
            *f += r;
        }
    }
}

impl TissueRun {
    /// Wall time of the step that this share of the steps does not exceed, nanoseconds.
    pub(super) fn step_percentile_ns(&self, share: f64) -> Option<u64> {
        let last = self.step_ns.len().checked_sub(1)?;
        self.step_ns.get((share * last as f64).round() as usize).copied()
    }
}
