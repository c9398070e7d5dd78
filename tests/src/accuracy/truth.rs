//! What the runs are compared with: two references of each case, and whether they agree.
//!
//! Explicit: Verlet at `ω_max·dt ≤ 0.1`; waves of middle length it follows to second order only, so where that shows it is
//! extrapolated once with a run of twice the step. Implicit: midpoint with Newton to 1e-10, its step halved until the two
//! agree, extrapolated over its last steps, three at most (Romberg, order 4 from two, 6 from three). They share spring
//! forces (tested against the energy) and sampling, not the integration, and nothing with sim-core's stepping. A case on
//! which they differ by more than 1e-6 gets no table. The truth is the explicit one, and no better than they agree.

use super::cases::Case;
use super::cpu_clock::thread_cpu_s;
use super::section::{Progress, Row, Section};
use super::side_by_side::dearest_first;
use crate::reference::{Difference, Driven, ExplicitMethod, Samples, explicit_run, explicit_step_s, midpoint_run};
use serde_json::json;
use std::sync::atomic::AtomicBool;

/// Largest difference of the references, relative, of positions and of force.
pub(super) const AGREEMENT: f64 = 1e-6;
/// `ω_max·dt` of the explicit reference.
const WAVE_STEP: f64 = 0.1;
/// First, coarsest step of the midpoint rule, seconds.
const MIDPOINT_STEP_S: f64 = 2e-3;
/// Most halvings of it until the references agree.
const MAX_HALVINGS: usize = 6;
/// The midpoint rule has converged when a halving changes it by less than this part of the agreement.
const CONVERGED: f64 = 0.25;

/// What runs are compared with.
#[derive(Clone, Debug)]
pub(super) struct Truth {
    pub(super) samples: Samples,
    /// Larger relative difference of the references, of positions or of force: less than this the truth cannot tell.
    pub(super) floor: f64,
}

/// A case with its truth.
#[derive(Debug)]
pub(super) struct Judged<'a> {
    pub(super) case: &'a Case,
    /// `None` when the references could not be had or do not agree.
    pub(super) truth: Option<Truth>,
    pub(super) row: Row,
}

/// Both references of every case, two cases at a time. A case that was not begun when the report was stopped has no truth.
pub(super) fn judge<'a>(cases: &'a [Case], progress: &Progress<'_>) -> Vec<Judged<'a>> {
    let judged = dearest_first(cases, weight, |case| {
        (progress.say)(&format!("references of {} {}", case.scene, case.regime.name()));
        case.driven(|driven| judge_driven(driven, case, progress.stop))
    });
    cases.iter().zip(judged).map(|(case, (truth, row))| Judged { case, truth, row }).collect()
}

fn weight(case: &Case) -> f64 {
    let stiffest = case.network.springs.iter().map(|s| s.stiffness_n_per_m).fold(0.0, f64::max);
    let lightest = case.network.mass_kg.iter().copied().fold(f64::INFINITY, f64::min);
    case.network.springs.len() as f64 * (stiffest / lightest).sqrt()
}

fn close(off: Difference, part: f64) -> bool {
    off.position <= part * AGREEMENT && off.force <= part * AGREEMENT
}

/// The midpoint rule at falling steps with its extrapolations.
#[derive(Default)]
struct Romberg {
    dt_s: f64,
    plain: Option<Samples>,
    once: Option<Samples>,
    best: Option<Samples>,
    /// Change of the best by the last halving.
    change: Option<Difference>,
}

impl Romberg {
    /// Half the step; false when the run was stopped or Newton did not end.
    fn refine(&mut self, driven: &Driven<'_>, stop: &AtomicBool) -> bool {
        self.dt_s = if self.plain.is_some() { 0.5 * self.dt_s } else { MIDPOINT_STEP_S };
        let Some(plain) = midpoint_run(driven, self.dt_s, stop) else { return false };
        let once = self.plain.as_ref().map(|coarse| plain.clone().extrapolated(coarse, 2));
        let twice = once.as_ref().zip(self.once.as_ref()).map(|(fine, coarse)| fine.clone().extrapolated(coarse, 4));
        let best = twice.or_else(|| once.clone());
        self.change = best.as_ref().zip(self.best.as_ref()).map(|(new, old)| new.against(old, driven.start_m));
        (self.plain, self.once, self.best) = (Some(plain), once, best);
        true
    }

    fn converged(&self) -> bool {
        self.change.is_some_and(|change| close(change, CONVERGED))
    }
}

/// Verlet at `ω_max·dt ≤ 0.1`, and later extrapolated from twice the step.
struct Explicit {
    dt_s: f64,
    samples: Option<Samples>,
    name: &'static str,
}

impl Explicit {
    fn run(driven: &Driven<'_>, stop: &AtomicBool) -> Self {
        let (asked_s, _) = explicit_step_s(driven, ExplicitMethod::Verlet, WAVE_STEP);
        // An even number of steps between samples, so that twice the step fits as well.
        let pairs = (0.5 * driven.sample_s / asked_s).ceil().max(1.0);
        let dt_s = 0.5 * driven.sample_s / pairs;
        Self { dt_s, samples: explicit_run(driven, ExplicitMethod::Verlet, dt_s, stop), name: "verlet" }
    }

    fn extrapolate(&mut self, driven: &Driven<'_>, stop: &AtomicBool) {
        let coarse = explicit_run(driven, ExplicitMethod::Verlet, 2.0 * self.dt_s, stop);
        self.samples = self.samples.take().zip(coarse).map(|(fine, coarse)| fine.extrapolated(&coarse, 2));
        self.name = "verlet_richardson";
    }
}

fn judge_driven(driven: &Driven<'_>, case: &Case, stop: &AtomicBool) -> (Option<Truth>, Row) {
    let begun = thread_cpu_s();
    let mut explicit = Explicit::run(driven, stop);
    let mut explicit_cpu_s = thread_cpu_s() - begun;
    let (mut implicit, mut off, mut implicit_cpu_s) = (Romberg::default(), None, 0.0);
    while explicit.samples.is_some() && implicit.dt_s != MIDPOINT_STEP_S / f64::from(1 << MAX_HALVINGS) {
        let begun = thread_cpu_s();
        let refined = implicit.refine(driven, stop);
        implicit_cpu_s += thread_cpu_s() - begun;
        if !refined {
            break;
        }
        let compare =
            |explicit: &Explicit| Some(implicit.best.as_ref()?.against(explicit.samples.as_ref()?, driven.start_m));
        off = compare(&explicit);
        // The implicit one has converged and they still differ: the explicit one is not good enough.
        if implicit.converged() && off.is_some_and(|off| !close(off, 1.0)) && explicit.name == "verlet" {
            let begun = thread_cpu_s();
            explicit.extrapolate(driven, stop);
            explicit_cpu_s += thread_cpu_s() - begun;
            off = compare(&explicit);
        }
        if off.is_some_and(|off| close(off, 1.0)) {
            break;
        }
    }
    let agree = off.is_some_and(|off| close(off, 1.0));
    let value = |pick: fn(&Difference) -> f64| json!(off.as_ref().map(pick));
    let row = vec![
        ("scene", json!(case.scene)),
        ("case", json!(case.regime.name())),
        ("nodes", json!(driven.network.mass_kg.len())),
        ("springs", json!(driven.network.springs.len())),
        ("explicit", json!(explicit.name)),
        ("explicit_dt_s", json!(explicit.dt_s)),
        ("implicit", json!("midpoint_romberg")),
        ("implicit_dt_s", json!(implicit.dt_s)),
        ("explicit_cpu_s", json!(explicit_cpu_s)),
        ("implicit_cpu_s", json!(implicit_cpu_s)),
        ("position_difference", value(|d| d.position)),
        ("force_difference", value(|d| d.force)),
        ("force_difference_max_n", value(|d| d.force_max_n)),
        ("implicit_last_change", json!(implicit.change.map(|d| d.position))),
        ("tolerance", json!(AGREEMENT)),
        ("agree", json!(agree)),
    ];
    let floor = off.filter(|off| close(*off, 1.0)).map(|off| off.position.max(off.force));
    (explicit.samples.zip(floor).map(|(samples, floor)| Truth { samples, floor }), row)
}

/// The section that says whether the references agree.
pub(super) fn section(judged: &[Judged<'_>]) -> Section {
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
             its independence: here are two, which share spring forces and sampling, not the integration, and neither shares \
             its stepping with the simulator. One is explicit, Verlet with steps of at most a tenth of the stiffest wave's radian, where needed \
             extrapolated once; the other is the implicit midpoint rule, each step solved by Newton to 1e-10, its step halved \
             until the two agree, extrapolated over its last steps (three at most). Differences are root mean squares over nodes and sample \
             times, relative to the motion and to the force; the bar is 1e-6."
                .into(),
            verdict,
        ],
        figures: vec![],
        rows: judged.iter().map(|j| j.row.clone()).collect(),
    }
}
