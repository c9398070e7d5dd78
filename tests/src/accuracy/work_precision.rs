//! Error against run time: nine smooth cases, every integrator, a ladder of steps.
//!
//! Errors against the reference (`truth`), root mean square over nodes and sample times, relative to the motion and to the
//! force on the hand. Refused and diverged runs stay in the table, marked unstable, and in the figures as ×. A ladder ends
//! where a run would cost more than the effort allows.

use super::cases::{Case, Regime, SAMPLE_S, Subject};
use super::choice::{self, Chosen};
use super::non_smooth;
use super::plot::{Axis, Level, Panel, Series, integrator_style, panels_svg};
use super::section::{Effort, Figure, Progress, Row, Section};
use super::side_by_side::dearest_first;
use super::tissue_run::{Cost, Extras, TissueRun, run, time};
use super::truth::{self, Judged, Truth};
use crate::reference::Difference;
use serde_json::{Value, json};
use sim_core::tissue::integrator::Integrator;

/// Steps between two samples: 10 ms down to 1 µs.
const LADDER: [usize; 13] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];
/// A run whose positions are off by more than its motion follows nothing.
const LOST: f64 = 1.0;
/// An error counts as measured from this many times the difference of the references on.
const RESOLVED: f64 = 3.0;

/// One point of the diagram.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) integrator: Integrator,
    pub(super) dt_s: f64,
    /// `None` when the run was refused.
    pub(super) run: Option<TissueRun>,
    pub(super) off: Option<Difference>,
    pub(super) note: String,
}

impl Point {
    pub(super) fn unstable(&self) -> bool {
        let follows = |d: Difference| d.position <= LOST && d.force.is_finite();
        !self.off.is_some_and(follows) || self.run.as_ref().is_some_and(|r| r.contained > 0)
    }

    /// Processor time per simulated time.
    pub(super) fn cpu_per_sim(&self) -> Option<f64> {
        self.run.as_ref().map(|r| r.cost.cpu_per_sim)
    }
}

/// Most processor time per simulated time of one run.
const fn dearest(effort: Effort) -> f64 {
    match effort {
        Effort::Quick => 0.5,
        Effort::Full => 6.0,
    }
}

/// All sections of this part.
pub(super) fn measure(effort: Effort, subjects: &[Subject], progress: &Progress<'_>) -> Vec<Section> {
    let (mut cases, mut refused) = (Vec::new(), Vec::new());
    for subject in subjects {
        match Case::of_scene(subject) {
            Ok(built) => cases.extend(built),
            Err(error) => refused.push(format!("{} could not be built: {error}", subject.name)),
        }
    }
    let judged = truth::judge(&cases, progress);
    let mut section = Section {
        key: "work_precision",
        title: "Error against run time".into(),
        words: words(effort),
        figures: Vec::new(),
        rows: Vec::new(),
    };
    section.words.extend(refused);
    let mut choices = Vec::new();
    for Subject { name, .. } in subjects {
        let mut panels = Vec::new();
        for Judged { case, truth, .. } in judged.iter().filter(|j| j.case.scene == *name) {
            let Some(truth) = truth else { continue };
            let points = ladder(case, truth, effort, progress);
            section.rows.extend(rows(name, case.regime.name(), &points, Some(truth.floor)));
            let chosen = choice::measure(case, truth, progress);
            choices.extend(chosen.as_ref().map(|chosen| choice::row(case, chosen, &points, truth.floor)));
            panels.push((case.regime, points, chosen));
        }
        if !panels.is_empty() {
            section.figures.push(figure(name, &panels));
        }
    }
    vec![truth::section(&judged), section, choice::section(choices), non_smooth::measure(subjects, progress)]
}

fn words(effort: Effort) -> Vec<String> {
    let mesh = match effort {
        Effort::Quick => "coarser meshes than the presets",
        Effort::Full => "the meshes of the presets",
    };
    vec![
        format!(
            "One suture patch is pulled 7 mm, held and let back within 0.45 s, on {mesh}. Cost is processor time of one \
             thread over simulated time: left of the dashed line a run keeps up with real time on this machine. Each curve is one \
             integrator with falling steps; × marks steps at which it is refused or loses the motion."
        ),
        "Read a figure from the bottom left: the lowest point left of the real-time line is the most accurate setting that \
         still keeps up. Errors of a few per cent of the force are below what a hand can tell (the 5 % line)."
            .into(),
        "An error below three times the difference of the two references (`resolved_from`) is not told from none: such rows \
         say `below_reference`, have no order, and the table writes “<” there."
            .into(),
    ]
}

/// One setting that shall be run: integrator, steps between samples, and what they cost, or why they are refused.
type Setting = (Integrator, usize, Result<Cost, String>);

/// Times one integrator after the other down the ladder, alone; then finds all errors, side by side.
fn ladder(case: &Case, truth: &Truth, effort: Effort, progress: &Progress<'_>) -> Vec<Point> {
    let mut settings: Vec<Setting> = Vec::new();
    for integrator in Integrator::ALL {
        let mut last: Option<(f64, usize)> = None;
        for per_sample in LADDER {
            let expected = last.map_or(0.0, |(cost, before)| cost * per_sample as f64 / before as f64);
            if progress.stopped() || expected > dearest(effort) {
                break;
            }
            (progress.say)(&format!(
                "{} {} {} at {:.0e} s",
                case.scene,
                case.regime.name(),
                integrator.name(),
                SAMPLE_S / per_sample as f64
            ));
            let cost = match time(case, integrator, per_sample, progress.stop) {
                Ok(Some(cost)) => {
                    last = Some((cost.cpu_per_sim, per_sample));
                    Ok(cost)
                }
                Ok(None) => return Vec::new(),
                Err(refusal) => Err(refusal.to_string()),
            };
            settings.push((integrator, per_sample, cost));
        }
    }
    let expected = |(_, _, cost): &Setting| cost.as_ref().map_or(0.0, |c| c.cpu_per_sim);
    dearest_first(&settings, expected, |setting| point(case, truth, setting, progress)).into_iter().flatten().collect()
}

/// The error of a setting whose cost is known; `None` when stopped.
pub(super) fn point(case: &Case, truth: &Truth, setting: &Setting, progress: &Progress<'_>) -> Option<Point> {
    let (integrator, per_sample, cost) = setting;
    let (integrator, dt_s) = (*integrator, SAMPLE_S / *per_sample as f64);
    let refused = |note: String| Point { integrator, dt_s, run: None, off: None, note };
    let cost = match cost {
        Ok(cost) => cost.clone(),
        Err(why) => return Some(refused(why.clone())),
    };
    match run(case, integrator, *per_sample, &Extras::none(), progress.stop) {
        Ok(run) => {
            let run = TissueRun { cost, ..run? };
            let off = Some(run.samples.against(&truth.samples, &case.start_m));
            Some(Point { integrator, dt_s, run: Some(run), off, note: String::new() })
        }
        Err(why) => Some(refused(why.to_string())),
    }
}

/// Rows of one case; `floor` is the difference of its references, where it has two.
pub(super) fn rows(scene: &str, case: &str, points: &[Point], floor: Option<f64>) -> Vec<Row> {
    let resolved_from = floor.map(|floor| RESOLVED * floor);
    let below = |off: Difference| resolved_from.is_some_and(|least| off.position.min(off.force) < least);
    let mut rows = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let coarser =
            i.checked_sub(1).map(|j| &points[j]).filter(|p| p.integrator == point.integrator && !p.unstable());
        let unstable = point.unstable();
        let off = point.off.filter(|_| !unstable);
        let value = |pick: fn(&Difference) -> f64| json!(off.as_ref().map(pick));
        let order = coarser
            .and_then(|c| c.off.filter(|off| !below(*off)))
            .zip(off.filter(|off| !below(*off)))
            .zip(coarser)
            .map(|((c, f), coarser)| (c.position / f.position).ln() / (coarser.dt_s / point.dt_s).ln());
        let run = point.run.as_ref();
        let percentile = |share| json!(run.and_then(|r| r.cost.step_percentile_ns(share)));
        let per_step = run.map(|r| r.linear_iterations as f64 / r.steps.max(1) as f64);
        rows.push(vec![
            ("scene", json!(scene)),
            ("case", json!(case)),
            ("integrator", json!(point.integrator.name())),
            ("dt_s", json!(point.dt_s)),
            ("position_error", value(|d| d.position)),
            ("force_error", value(|d| d.force)),
            ("force_error_max_n", value(|d| d.force_max_n)),
            ("below_reference", json!(off.is_some_and(below))),
            ("resolved_from", json!(resolved_from)),
            ("cpu_per_sim", json!(point.cpu_per_sim())),
            ("unstable", json!(unstable)),
            ("step_p50_ns", percentile(0.5)),
            ("step_p99_ns", percentile(0.99)),
            ("step_max_ns", percentile(1.0)),
            ("periods", json!(run.map(|r| r.cost.periods))),
            ("deadline_misses", json!(run.map(|r| r.cost.missed))),
            ("energy_drift", value(|d| d.energy)),
            ("linear_iterations_per_step", json!(per_step)),
            ("observed_order", order.map_or(Value::Null, |o| json!(o))),
            ("note", json!(point.note)),
        ]);
    }
    rows
}

fn figure(scene: &str, panels: &[(Regime, Vec<Point>, Option<Chosen>)]) -> Figure {
    let mut drawn = Vec::new();
    for (quantity, pick) in [
        ("position error (relative)", (|d: &Difference| d.position) as fn(&Difference) -> f64),
        ("force error (relative)", |d: &Difference| d.force),
    ] {
        for (regime, points, chosen) in panels {
            let mut levels = vec![Level::X(1.0, "real time".into())];
            if quantity.starts_with("force") {
                levels.push(Level::Y(0.05, "5 % of the force".into()));
            }
            drawn.push(Panel {
                title: regime.title().into(),
                x: Axis::log("processor time / simulated time"),
                y: Axis::log(quantity),
                series: series(points, chosen.as_ref(), pick),
                levels,
            });
        }
    }
    Figure {
        name: format!("work_precision_{scene}"),
        caption: format!(
            "Work and precision, {scene}: upper row position, lower row force at the hand. × on the upper rim: steps at which \
             the integrator is refused or loses the motion, at the cost that such a step would have. Circled: the automatic choice."
        ),
        svg: panels_svg(&format!("{scene}: error against run time"), &drawn, panels.len()),
    }
}

fn series(points: &[Point], chosen: Option<&Chosen>, pick: fn(&Difference) -> f64) -> Vec<Series> {
    let of = |integrator: Integrator| {
        let mine: Vec<&Point> = points.iter().filter(|p| p.integrator == integrator).collect();
        let good = mine.iter().filter(|p| !p.unstable());
        let drawn = good.filter_map(|p| Some((p.cpu_per_sim()?, pick(p.off.as_ref()?)))).collect();
        let mut series = Series::new(integrator.name(), integrator_style(integrator.name()), drawn);
        let mark = chosen.map(|c| &c.point).filter(|p| p.integrator == integrator);
        series.chosen.extend(mark.and_then(|p| Some((p.cpu_per_sim()?, pick(p.off.as_ref()?)))));
        // A refused step would have cost what the stable ones cost per step.
        let per_step = mine.iter().find_map(|p| Some(p.cpu_per_sim()? * p.dt_s));
        let unstable = mine.iter().filter(|p| p.unstable());
        series.unstable_at = unstable.filter_map(|p| p.cpu_per_sim().or(Some(per_step? / p.dt_s))).collect();
        series
    };
    Integrator::ALL.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_below_what_the_references_resolve_have_no_order() {
        let point = |dt_s: f64, error: f64| {
            let off = Difference { position: error, force: error, force_max_n: 0.0, energy: 0.0 };
            Point { integrator: Integrator::Verlet, dt_s, run: None, off: Some(off), note: String::new() }
        };
        let points = [point(4e-3, 1.6e-7), point(2e-3, 4e-8), point(1e-3, 1e-8)];
        let column = |floor, name: &str| -> Vec<Value> {
            let value = |row: Row| row.into_iter().find(|(n, _)| *n == name).map(|(_, v)| v);
            rows("skin", "low_drag", &points, floor).into_iter().filter_map(value).collect()
        };
        let told = |orders: &[Value]| orders.iter().map(|o| o.as_f64().map(f64::round)).collect::<Vec<_>>();
        assert_eq!(column(Some(1e-8), "below_reference"), [false, false, true].map(Value::Bool));
        assert_eq!(told(&column(Some(1e-8), "observed_order")), [None, Some(2.0), None]);
        assert_eq!(column(None, "below_reference"), [false; 3].map(Value::Bool));
        assert_eq!(told(&column(None, "observed_order")), [None, Some(2.0), Some(2.0)]);
    }
}
