//! What the runs are compared with: two references of each case, and whether they agree.
//!
//! Explicit (Runge–Kutta, or Verlet where that would take too long) at `ω_max·dt ≤ 0.1`; implicit midpoint with Newton to
//! 1e-10 and one Richardson extrapolation. They share the list of springs and nothing else, and nothing with sim-core's
//! stepping. A case on which they differ by more than 1e-6 gets no table. The truth is the explicit one.

use super::cases::Case;
use super::cpu_clock::thread_cpu_s;
use super::section::{Effort, Progress, Row, Section};
use crate::reference::{Difference, Driven, ExplicitMethod, Samples, explicit_run, explicit_step_s, midpoint_run};
use serde_json::json;
use std::sync::atomic::AtomicBool;

/// Largest difference of the references, relative, of positions and of force.
pub(super) const AGREEMENT: f64 = 1e-6;
/// `ω_max·dt` of the explicit reference.
const WAVE_STEP: f64 = 0.1;
/// Most halvings of the midpoint step until the references agree.
const MAX_HALVINGS: usize = 3;

/// A case with its truth.
#[derive(Debug)]
pub(super) struct Judged {
    pub(super) case: Case,
    /// `None` when the references could not be had or do not agree.
    pub(super) truth: Option<Samples>,
    pub(super) row: Row,
}

/// Both references of every case, two cases at a time. Cases that were not begun when the report was stopped are left out.
pub(super) fn judge(cases: Vec<Case>, effort: Effort, progress: &Progress<'_>) -> Vec<Judged> {
    let queue = crossbeam::queue::SegQueue::new();
    let count = cases.len();
    // The dearest first, so that the two threads end together.
    let mut order: Vec<(usize, Case)> = cases.into_iter().enumerate().collect();
    order.sort_by(|a, b| weight(&b.1).total_cmp(&weight(&a.1)));
    order.into_iter().for_each(|entry| queue.push(entry));
    let done = crossbeam::queue::SegQueue::new();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((index, case)) = queue.pop() {
                    if progress.stopped() {
                        break;
                    }
                    (progress.say)(&format!("references, {} of {count} done", done.len()));
                    done.push((index, judge_one(case, effort, progress.stop)));
                }
            });
        }
    });
    let mut judged: Vec<(usize, Judged)> = done.into_iter().collect();
    judged.sort_by_key(|(index, _)| *index);
    judged.into_iter().map(|(_, judged)| judged).collect()
}

fn weight(case: &Case) -> f64 {
    let stiffest = case.network.springs.iter().map(|s| s.stiffness_n_per_m).fold(0.0, f64::max);
    let lightest = case.network.mass_kg.iter().copied().fold(f64::INFINITY, f64::min);
    case.network.springs.len() as f64 * (stiffest / lightest).sqrt()
}

fn judge_one(case: Case, effort: Effort, stop: &AtomicBool) -> Judged {
    let (truth, row) = case.driven(|driven| judge_driven(driven, case.scene, case.regime.name(), effort, stop));
    Judged { case, truth, row }
}

/// First, coarsest step of the midpoint rule, seconds.
const MIDPOINT_STEP_S: f64 = 1e-3;

/// Spring evaluations beyond which Verlet stands in for Runge–Kutta.
const fn most_evaluations(effort: Effort) -> f64 {
    match effort {
        Effort::Quick => 1.5e8,
        Effort::Full => 2e9,
    }
}

fn close(off: Difference) -> bool {
    off.position <= AGREEMENT && off.force <= AGREEMENT
}

fn judge_driven(
    driven: &Driven<'_>,
    scene: &'static str,
    regime: &'static str,
    effort: Effort,
    stop: &AtomicBool,
) -> (Option<Samples>, Row) {
    let cost = |method| explicit_step_s(driven, method, WAVE_STEP);
    let runge_kutta = cost(ExplicitMethod::RungeKutta);
    let begun = thread_cpu_s();
    let (mut method, mut explicit_dt) = (ExplicitMethod::RungeKutta, runge_kutta.0);
    if runge_kutta.1 > most_evaluations(effort) {
        (method, explicit_dt) = (ExplicitMethod::Verlet, cost(ExplicitMethod::Verlet).0);
    }
    let mut explicit = explicit_run(driven, method, explicit_dt, stop);
    let explicit_done = thread_cpu_s();
    let (mut implicit_dt, mut off, mut implicit) = (MIDPOINT_STEP_S, None, None);
    if let Some(explicit) = &explicit {
        let mut coarse = midpoint_run(driven, implicit_dt, stop);
        for _ in 0..MAX_HALVINGS {
            let (Some(known), Some(fine)) = (&coarse, midpoint_run(driven, 0.5 * implicit_dt, stop)) else { break };
            implicit_dt *= 0.5;
            let better = fine.clone().extrapolated(known, 2);
            off = Some(better.against(explicit, driven.start_m));
            implicit = Some(better);
            if off.is_some_and(close) {
                break;
            }
            coarse = Some(fine);
        }
    }
    let implicit_done = thread_cpu_s();
    // Waves of middle length are followed by Verlet to second order only; where that shows, Runge–Kutta decides.
    if let (Some(implicit), false, ExplicitMethod::Verlet) = (&implicit, off.is_some_and(close), method)
        && let Some(better) = explicit_run(driven, ExplicitMethod::RungeKutta, runge_kutta.0, stop)
    {
        off = Some(implicit.against(&better, driven.start_m));
        (method, explicit_dt, explicit) = (ExplicitMethod::RungeKutta, runge_kutta.0, Some(better));
    }
    let explicit_cpu_s = explicit_done - begun + thread_cpu_s() - implicit_done;
    let agree = off.is_some_and(close);
    let name = match method {
        ExplicitMethod::RungeKutta => "runge_kutta_4",
        ExplicitMethod::Verlet => "verlet",
    };
    let value = |pick: fn(&Difference) -> f64| json!(off.as_ref().map(pick));
    let row = vec![
        ("scene", json!(scene)),
        ("case", json!(regime)),
        ("nodes", json!(driven.network.mass_kg.len())),
        ("springs", json!(driven.network.springs.len())),
        ("explicit", json!(name)),
        ("explicit_dt_s", json!(explicit_dt)),
        ("implicit", json!("midpoint_richardson")),
        ("implicit_dt_s", json!(implicit_dt)),
        ("explicit_cpu_s", json!(explicit_cpu_s)),
        ("implicit_cpu_s", json!(implicit_done - explicit_done)),
        ("position_difference", value(|d| d.position)),
        ("force_difference", value(|d| d.force)),
        ("force_difference_max_n", value(|d| d.force_max_n)),
        ("tolerance", json!(AGREEMENT)),
        ("agree", json!(agree)),
    ];
    (explicit.filter(|_| agree), row)
}

/// The section that says whether the references agree.
pub(super) fn section(judged: &[Judged]) -> Section {
    let failed: Vec<String> = judged
        .iter()
        .filter(|j| j.truth.is_none())
        .map(|j| format!("{} ({})", j.case.scene, j.case.regime.title()))
        .collect();
    let verdict = if failed.is_empty() {
        "They agree on every case below.".to_owned()
    } else {
        format!("They do not agree, or could not be had, on: {}. No table is printed for these.", failed.join(", "))
    };
    Section {
        key: "reference_agreement",
        title: "Do two independent references agree?".into(),
        words: vec![
            "Every error of the next part is measured against a reference run of the same network. A reference is only worth \
             its independence: here are two, which share the list of springs and nothing else, neither with each other nor \
             with the simulator. One is explicit (classical Runge–Kutta, or Verlet where that would take too long) with steps of at \
             most a tenth of the stiffest wave's radian; the other is the implicit midpoint rule, each step solved by Newton to \
             1e-10, once extrapolated. Differences are root mean squares over nodes and sample times, relative to the motion and to the force; \
             the bar is 1e-6."
                .into(),
            verdict,
        ],
        figures: vec![],
        rows: judged.iter().map(|j| j.row.clone()).collect(),
    }
}
