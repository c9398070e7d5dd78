//! What a step costs when nodes at rest sleep: items and time against awake nodes, on sheets of three sizes.
//!
//! One clamped sheet of the skin's springs and Table 2's drag, asleep, is pulled in its middle: the disturbance is the same
//! on all three and spreads by diffusion. Per period: awake nodes, half-springs visited, processor time of the step (least
//! of repeats; the same work each time). Fit by least squares: `cost = a + b · awake`, over periods with less than half of
//! the nodes awake; beyond, the ordinary sweep over all runs. Absent: what sleeping changes in the results (tests of
//! `sim_core::tissue`).

use super::cpu_clock::thread_cpu_s;
use super::plot::{Axis, Panel, Series, nth_style, panels_svg};
use super::section::{Effort, Figure, Progress, Row, Section};
use crate::generators::{on_rim, sheet, with_fixed};
use serde_json::json;
use sim_core::scene::presets;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::sleep::params::{QUIET_PERIODS, SleepParams};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;

const SLOT: HandleSlot = HandleSlot(0);
/// Spacing of the sheets, metres.
const SPACING_M: f64 = 2e-3;
/// Areal mass of the skin preset, kg/m²: 1100 kg/m³ of 1.75 mm.
const AREAL_MASS: f64 = 1.925;
/// Period, seconds: one sub-step.
const PERIOD_S: f64 = 2e-3;
/// The pull, metres, and the periods in which it is reached.
const PULL_M: f64 = 5e-4;
const PULL_PERIODS: u32 = 20;
/// Periods watched.
const PERIODS: u32 = 120;
/// How far a node at rest may be from where its springs want it, metres: ten times the default, so that the smallest sheet is
/// not awake at once. All figures of the section are from this tolerance.
const TOLERANCE_M: f64 = 1e-8;

/// Cost of one period.
#[derive(Clone, Copy, Debug)]
struct Cost {
    awake: f64,
    half_springs: f64,
    ns: f64,
}

/// `cost = fixed + per_node · awake`.
#[derive(Clone, Copy, Debug)]
struct Fit {
    fixed: f64,
    per_node: f64,
}

/// Measures the part.
pub(super) fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let (sides, repeats) = match effort {
        Effort::Quick => ([65, 129, 257], 5),
        Effort::Full => ([129, 257, 385], 20),
    };
    let (mut rows, mut work, mut time) = (Vec::new(), Vec::new(), Vec::new());
    for (index, side) in sides.into_iter().enumerate() {
        if progress.stopped() {
            break;
        }
        (progress.say)(&format!("awake nodes on a sheet of {side} x {side}"));
        let Some(asleep) = solver(side, Some(TOLERANCE_M)) else { continue };
        let Some(plain) = solver(side, None) else { continue };
        let all = (side * side) as f64;
        let costs: Vec<Cost> = pull(&asleep, repeats).into_iter().filter(|c| 2.0 * c.awake < all).collect();
        let name = format!("{side} x {side}");
        rows.push(row(side, &costs, &pull(&plain, repeats.min(3))));
        work.push(Series::new(&name, nth_style(index), costs.iter().map(|c| (c.awake, c.half_springs)).collect()));
        time.push(Series::new(&name, nth_style(index), costs.iter().map(|c| (c.awake, c.ns * 1e-3)).collect()));
    }
    let panel = |title: &str, label: &str, series: Vec<Series>| Panel {
        title: title.to_owned(),
        x: Axis::linear("awake nodes"),
        y: Axis::linear(label),
        series,
        levels: Vec::new(),
    };
    let panels = [panel("items per step", "half-springs", work), panel("time per step", "microseconds", time)];
    Section {
        key: "awake",
        title: "Nodes at rest sleep".to_owned(),
        words: vec![
            "Sheets of skin, asleep (tolerance 10 nm, ten times the default), pulled by 0.5 mm in their middle: per period of 2 ms the nodes that are awake, the \
             half-springs that a step visits, and its processor time; straight lines by least squares. The fixed part a is what \
             the border between awake and sleeping tiles costs beyond its share per node, not what the mesh costs: it must not \
             grow with the mesh. The last columns are the same pull with nobody asleep."
                .to_owned(),
        ],
        figures: vec![Figure {
            name: "awake-nodes".to_owned(),
            caption: "Work and time of a step against awake nodes. The sheets differ in nodes by an order of magnitude; their \
                      points lie on one line."
                .to_owned(),
            svg: panels_svg("Cost of a step against awake nodes", &panels, 2),
        }],
        rows,
    }
}

/// A sheet with a plus-shaped patch in its middle; asleep where it may.
fn solver(side: usize, tolerance_m: Option<f64>) -> Option<TissueSolver> {
    let table = presets::SKIN;
    let mass_kg = AREAL_MASS * SPACING_M * SPACING_M;
    let network = sheet(side, side, SPACING_M, table.stiffness_n_per_mm * 1e3, mass_kg, table.drag_n_s_per_m);
    let network = with_fixed(network, |i| on_rim(i, side, side));
    let middle = (side / 2 * side + side / 2) as u32;
    let nodes = [middle, middle - 1, middle + 1, middle - side as u32, middle + side as u32];
    let patches = PatchSet::new(network.node_count(), [(&nodes[..], &[0.2; 5][..])]).ok()?;
    let params = SolverParams {
        integrator: Integrator::SemiImplicit,
        sleep: tolerance_m.map(|tolerance_m| SleepParams { tolerance_m }),
        ..SolverParams::with_period(PERIOD_S)
    };
    let mut solver = TissueSolver::new(network, patches, params).ok()?;
    for _ in 0..=QUIET_PERIODS {
        solver.step(&mut Stages::default());
    }
    Some(solver)
}

/// Costs of the periods of the pull, least time of `repeats`.
fn pull(start: &TissueSolver, repeats: u32) -> Vec<Cost> {
    let mut costs: Vec<Cost> = Vec::new();
    for _ in 0..repeats {
        let mut solver = start.clone();
        let Ok(()) = solver.grasp(SLOT, PatchId(0)) else { return costs };
        let Some((_, from)) = solver.handle(SLOT) else { return costs };
        for period in 1..=PERIODS {
            let share = f64::from(period.min(PULL_PERIODS)) / f64::from(PULL_PERIODS);
            solver.lead(SLOT, from + Vec3::x() * (PULL_M * share));
            let begun_s = thread_cpu_s();
            let report = solver.step(&mut Stages::default());
            let substeps = f64::from(report.substeps);
            let ns = (thread_cpu_s() - begun_s) * 1e9 / substeps;
            let (awake, half_springs) = (f64::from(report.awake_nodes), report.half_springs as f64 / substeps);
            match costs.get_mut(period as usize - 1) {
                Some(cost) => cost.ns = cost.ns.min(ns),
                None => costs.push(Cost { awake, half_springs, ns }),
            }
        }
    }
    costs
}

fn row(side: usize, costs: &[Cost], plain: &[Cost]) -> Row {
    let items = fit(costs, |c| c.half_springs);
    let time = fit(costs, |c| c.ns);
    let most = costs.iter().map(|c| c.awake).fold(0.0, f64::max);
    let all_ns = plain.iter().map(|c| c.ns).fold(f64::INFINITY, f64::min);
    vec![
        ("sheet", json!(format!("{side} x {side}"))),
        ("nodes", json!(side * side)),
        ("periods", json!(costs.len())),
        ("most_awake", json!(most)),
        ("half_springs_a", json!(items.fixed)),
        ("half_springs_b", json!(items.per_node)),
        ("ns_a", json!(time.fixed)),
        ("ns_b", json!(time.per_node)),
        ("half_springs_nobody_asleep", json!(plain.first().map_or(0.0, |c| c.half_springs))),
        ("ns_nobody_asleep", json!(all_ns)),
    ]
}

/// Least squares.
fn fit(costs: &[Cost], of: impl Fn(&Cost) -> f64) -> Fit {
    let n = costs.len() as f64;
    let mean = |value: &dyn Fn(&Cost) -> f64| costs.iter().map(value).sum::<f64>() / n;
    let (x, y) = (mean(&|c| c.awake), mean(&of));
    let spread = |value: &dyn Fn(&Cost) -> f64| costs.iter().map(|c| (c.awake - x) * value(c)).sum::<f64>();
    let per_node = spread(&|c| of(c) - y) / spread(&|c| c.awake - x);
    Fit { fixed: y - per_node * x, per_node }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_found() {
        let costs: Vec<Cost> =
            (1..9).map(|i| Cost { awake: f64::from(i), half_springs: 7.0 + 3.0 * f64::from(i), ns: 0.0 }).collect();
        let found = fit(&costs, |c| c.half_springs);
        // Rounding of eight small integers.
        assert!((found.fixed - 7.0).abs() < 1e-12 && (found.per_node - 3.0).abs() < 1e-12, "{found:?}");
    }
}
