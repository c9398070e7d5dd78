//! One run of sim-core's tissue solver on a case, and what its steps cost.
//!
//! One step per period, so that the handle is exactly where the way says at every step. Errors come from whole runs, which may
//! share the machine; costs from a stretch in the middle of the pull, alone, where every step of an explicit form costs the
//! same (BDF2: the whole way). Processor time of this thread for the steps, the least of the repeats; wall time of every
//! single step of every repeat for the percentiles and the missed periods.

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
/// Steps of a timed stretch, or those of one sample time if that has more.
const TIMED_STEPS: usize = 1000;
/// Samples before the timed stretch: at its end the pull is fastest.
const TIMED_FROM: usize = 6;
/// A stretch is repeated until it has taken so much processor time, seconds.
const TIMED_FOR_S: f64 = 0.015;
/// Most repeats.
const MAX_REPEATS: usize = 10;

/// The handle that pulls.
pub(super) const HANDLE: HandleSlot = HandleSlot(0);

/// What steps cost.
#[derive(Clone, Debug, Default)]
pub(super) struct Cost {
    /// Processor time over simulated time.
    pub(super) cpu_per_sim: f64,
    /// Wall time of each step, nanoseconds, ascending.
    pub(super) step_ns: Vec<u64>,
    /// Solver periods of the scene, and those in which the steps took longer than the period.
    pub(super) periods: u64,
    pub(super) missed: u64,
}

/// What a run gave.
#[derive(Clone, Debug)]
pub(super) struct TissueRun {
    pub(super) samples: Samples,
    pub(super) cost: Cost,
    pub(super) steps: usize,
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

/// Part of the way, in samples, and whether they are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stretch {
    /// All, sampled.
    Whole,
    /// Steps only.
    Timed { first: usize, count: usize },
}

/// Samples of the whole way.
fn whole() -> usize {
    (END_S / SAMPLE_S).round() as usize
}

/// Runs a case with `per_sample` steps between samples; `None` when stopped.
pub(super) fn run(
    case: &Case,
    integrator: Integrator,
    per_sample: usize,
    extras: &Extras<'_>,
    stop: &AtomicBool,
) -> Result<Option<TissueRun>, SolverError> {
    drive(case, integrator, per_sample, extras, Stretch::Whole, stop)
}

/// What the steps of a run cost; `None` when stopped.
pub(super) fn time(
    case: &Case,
    integrator: Integrator,
    per_sample: usize,
    stop: &AtomicBool,
) -> Result<Option<Cost>, SolverError> {
    let count = TIMED_STEPS.div_ceil(per_sample).min(whole() - TIMED_FROM);
    let stretch = match integrator {
        Integrator::Bdf2 => Stretch::Timed { first: 0, count: whole() },
        _ => Stretch::Timed { first: TIMED_FROM, count },
    };
    let (mut cost, mut spent_s): (Option<Cost>, f64) = (None, 0.0);
    for _ in 0..MAX_REPEATS {
        let Some(again) = drive(case, integrator, per_sample, &Extras::none(), stretch, stop)? else { return Ok(None) };
        spent_s += again.cost.cpu_per_sim * again.steps as f64 * SAMPLE_S / per_sample as f64;
        cost = Some(match cost {
            Some(before) => before.pooled(again.cost),
            None => again.cost,
        });
        if spent_s > TIMED_FOR_S {
            break;
        }
    }
    Ok(cost)
}

fn drive(
    case: &Case,
    integrator: Integrator,
    per_sample: usize,
    extras: &Extras<'_>,
    stretch: Stretch,
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
    let (first, count) = match stretch {
        Stretch::Whole => (0, whole()),
        Stretch::Timed { first, count } => (first, count),
    };
    // A stretch begins at rest wherever on the way it lies.
    let (from_s, home) = (first as f64 * SAMPLE_S, home - case.way(first as f64 * SAMPLE_S));
    let (mut samples, mut cpu_s, mut step_ns) = (Samples::default(), 0.0, Vec::with_capacity(count * per_sample));
    let (mut linear_iterations, mut contained) = (0, 0);
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
            solver.lead(HANDLE, home + case.way(from_s + (index + 1) as f64 * dt));
            // Wall clock: the time of each step is what the report measures.
            let tick = Instant::now();
            let report = solver.step(&mut stages);
            step_ns.push(tick.elapsed().as_nanos() as u64);
            linear_iterations += u64::from(report.linear_iterations);
            contained += u64::from(report.contained);
        }
        cpu_s += thread_cpu_s() - begun;
        if stretch == Stretch::Whole {
            let state = solver.state();
            probe.record(&state.position_m, &state.velocity_m_per_s, &mut samples);
            if let Some(force) = samples.force_n.last_mut() {
                add_reactions(case, &stages, force);
            }
        }
    }
    let steps = step_ns.len();
    let cost = Cost::of(cpu_s / (count as f64 * SAMPLE_S), step_ns, dt, case.period_s);
    Ok(Some(TissueRun { samples, cost, steps, linear_iterations, contained }))
}

impl Cost {
    fn of(cpu_per_sim: f64, mut step_ns: Vec<u64>, dt_s: f64, period_s: f64) -> Self {
        let per_period = (period_s / dt_s).round().max(1.0) as usize;
        let limit_ns = (dt_s * per_period as f64 * 1e9) as u64;
        let periods = || step_ns.chunks_exact(per_period);
        let missed = periods().filter(|period| period.iter().sum::<u64>() > limit_ns).count() as u64;
        let periods = periods().len() as u64;
        step_ns.sort_unstable();
        Self { cpu_per_sim, step_ns, periods, missed }
    }

    /// Of two repeats: the lesser processor time, and all the steps and periods of both.
    fn pooled(mut self, again: Self) -> Self {
        self.cpu_per_sim = self.cpu_per_sim.min(again.cpu_per_sim);
        self.step_ns.extend(again.step_ns);
        self.step_ns.sort_unstable();
        Self { periods: self.periods + again.periods, missed: self.missed + again.missed, ..self }
    }

    /// Wall time of the step that this share of the steps does not exceed, nanoseconds.
    pub(super) fn step_percentile_ns(&self, share: f64) -> Option<u64> {
        let last = self.step_ns.len().checked_sub(1)?;
        self.step_ns.get((share * last as f64).round() as usize).copied()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_pool_their_steps_and_keep_the_least_cost() {
        // Periods of two steps of 1 µs; the second repeat is cheaper, the first has the slow step and the miss.
        let slow = Cost::of(0.4, vec![900, 5000, 800, 700], 1e-6, 2e-6);
        let both = slow.pooled(Cost::of(0.3, vec![600, 500], 1e-6, 2e-6));
        assert_eq!((both.cpu_per_sim, both.periods, both.missed), (0.3, 3, 1));
        assert_eq!(both.step_ns, [500, 600, 700, 800, 900, 5000]);
        assert_eq!(both.step_percentile_ns(1.0), Some(5000));
    }
}
