//! What converges when the mesh gets finer, and what does not.
//!
//! Sheet of 100 mm, rim clamped, k of the skin. A rigid square patch of 6.25 mm has a limit; a single node has none: its
//! compliance grows as `(1 + ν)(3 − ν)/(4π E t) · ln(1/h)` (Kelvin's point force in a plane). The slowest motion of a sheet
//! with drag c per node takes `τ ≥ c/(h² (π/L)² (C₁₁ + C₆₆))` (Rayleigh), four times as long at half the spacing; with c per
//! area it keeps its time.

use super::plot::{Axis, Panel, Series, nth_style, panels_svg};
use super::section::{Effort, Figure, Progress, Row, Section};
use super::statics::Statics;
use crate::closed_forms::lattice_membrane_n_per_m;
use crate::generators::{on_rim, sheet, with_fixed};
use serde_json::{Value, json};
use sim_core::scene::presets;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;
use std::f64::consts::PI;

/// Side of the sheet, metres.
const SIDE_M: f64 = 0.1;
/// Half side of the rigid patch, metres: one cell of the coarsest mesh that has it.
const PATCH_HALF_M: f64 = 0.003_125;
/// The pull, metres: small beside every cell, so that the answer is linear.
const PULL_M: f64 = 1e-5;
/// Force that may be left on a node. At 1e-9 N the finest meshes, of which each node carries least, were not at rest.
const TOLERANCE_N: f64 = 1e-10;
/// Spacing at which c per node and c per area agree, metres.
const REFERENCE_M: f64 = 0.003_125;

/// How c of Table 2 is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drag {
    /// The same on every node.
    PerNode,
    /// In proportion to the area of a node.
    PerArea,
}

fn stiffness_n_per_m() -> f64 {
    presets::SKIN.stiffness_n_per_mm * 1e3
}

fn clamped(cells: usize, drag_n_s_per_m: f64) -> SpringNetwork {
    let (n, h) = (cells + 1, SIDE_M / cells as f64);
    // Areal mass of the skin preset: 1100 kg/m³ of 1.75 mm.
    let network = sheet(n, n, h, stiffness_n_per_m(), 1.925 * h * h, drag_n_s_per_m);
    with_fixed(network, |i| on_rim(i, n, n))
}

fn pull_n_per_m(cells: usize, inside: impl Fn(Vec3) -> bool) -> Option<f64> {
    let middle = Vec3::new(0.5 * SIDE_M, 0.5 * SIDE_M, 0.0);
    let mut statics = Statics::new(clamped(cells, 0.0), TOLERANCE_N);
    let rest = &statics.network.rest_m;
    let held: Vec<u32> = (0..rest.len()).filter(|i| inside(rest[*i] - middle)).map(|i| i as u32).collect();
    statics.hold(&held);
    statics.shift(&held, Vec3::x() * PULL_M);
    statics.rest().then(|| -statics.force_on(|n| held.contains(&n)).x / PULL_M)
}

/// Stiffness of the rigid square patch, newtons per metre; `None` when the sheet finds no rest.
#[must_use]
pub fn patch_stiffness(cells: usize) -> Option<f64> {
    let reach = PATCH_HALF_M * (1.0 + 1e-9);
    pull_n_per_m(cells, |d| d.x.abs() <= reach && d.y.abs() <= reach)
}

/// Stiffness of the single node in the middle, newtons per metre; `None` when the sheet finds no rest.
#[must_use]
pub fn node_stiffness(cells: usize) -> Option<f64> {
    pull_n_per_m(cells, |d| d.norm() < 1e-9)
}

/// Growth of the compliance of a single node per unit of ln(1/h), metres per newton.
#[must_use]
pub fn kelvin_slope() -> f64 {
    let poisson = 1.0 / 3.0;
    (1.0 + poisson) * (3.0 - poisson) / (4.0 * PI * lattice_membrane_n_per_m(stiffness_n_per_m()))
}

fn node_drag(cells: usize, drag: Drag) -> f64 {
    let h = SIDE_M / cells as f64;
    match drag {
        Drag::PerNode => presets::SKIN.drag_n_s_per_m,
        Drag::PerArea => presets::SKIN.drag_n_s_per_m * (h / REFERENCE_M).powi(2),
    }
}

/// Rayleigh's bound on the slowest relaxation time, seconds: the mode sin·sin in one direction.
#[must_use]
pub fn rayleigh_time_s(cells: usize, drag: Drag) -> f64 {
    let (membrane, poisson, h) = (lattice_membrane_n_per_m(stiffness_n_per_m()), 1.0 / 3.0, SIDE_M / cells as f64);
    let moduli = membrane / (1.0 - poisson * poisson) + membrane / (2.0 * (1.0 + poisson));
    node_drag(cells, drag) / (h * h * (PI / SIDE_M).powi(2) * moduli)
}

/// Relaxation time that the product's solver shows, seconds; `None` when it refuses the sheet.
#[must_use]
pub fn relaxation_time_s(cells: usize, drag: Drag) -> Option<f64> {
    let network = clamped(cells, node_drag(cells, drag));
    let mut solver = TissueSolver::new(network, PatchSet::default(), SolverParams::with_period(0.01)).ok()?;
    let mut state = solver.state().clone();
    let rest = solver.network().rest_m.clone();
    let shape = |x: &Vec3| (PI * x.x / SIDE_M).sin() * (PI * x.y / SIDE_M).sin();
    for (x, r) in state.position_m.iter_mut().zip(&rest) {
        x.x += 1e-4 * shape(r);
    }
    solver.reset(&state).ok()?;
    let expected_s = rayleigh_time_s(cells, drag);
    let steps = (0.5 * expected_s / 0.01).ceil() as usize;
    let mut amplitude_after = |steps: usize| {
        for _ in 0..steps {
            solver.step(&mut Stages::default());
        }
        solver.state().position_m.iter().zip(&rest).map(|(x, r)| (x - r).x * shape(r)).sum::<f64>()
    };
    let (early, late) = (amplitude_after(steps), amplitude_after(steps));
    Some(0.01 * steps as f64 / (early / late).ln())
}

/// Observed order of three values at spacings that halve.
#[must_use]
pub fn observed_order(values: [f64; 3]) -> f64 {
    ((values[1] - values[0]) / (values[2] - values[1])).abs().log2()
}

fn row(experiment: &str, cells: usize, value: f64, unit: &str, reference: Option<f64>, order: Option<f64>) -> Row {
    vec![
        ("experiment", json!(experiment)),
        ("spacing_mm", json!(SIDE_M * 1e3 / cells as f64)),
        ("nodes", json!((cells + 1) * (cells + 1))),
        ("value", json!(value)),
        ("unit", json!(unit)),
        ("reference", reference.map_or(Value::Null, |r| json!(r))),
        ("order", order.map_or(Value::Null, |o| json!(o))),
    ]
}

/// Measures the refinement part.
#[must_use]
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let finest = if effort == Effort::Quick { 128 } else { 256 };
    let meshes: Vec<usize> =
        [16, 32, 64, 128, 256].into_iter().filter(|c| *c <= finest && !progress.stopped()).collect();
    (progress.say)("pulls of a patch and of a node");
    let spacing = |c: &usize| SIDE_M * 1e3 / *c as f64;
    let patch: Vec<(usize, f64)> =
        meshes.iter().filter(|c| **c >= 32).filter_map(|c| patch_stiffness(*c).map(|k| (*c, k))).collect();
    let node: Vec<(usize, f64)> = meshes.iter().filter_map(|c| node_stiffness(*c).map(|k| (*c, k))).collect();
    let mut rows = Vec::new();
    for (i, (cells, k)) in patch.iter().enumerate() {
        let order = (i >= 2).then(|| observed_order([patch[i - 2].1, patch[i - 1].1, *k]));
        rows.push(row("rigid patch of 6.25 mm, stiffness", *cells, *k, "N/m", None, order));
    }
    for (i, (cells, k)) in node.iter().enumerate() {
        rows.push(row("single node, stiffness", *cells, *k, "N/m", None, None));
        if i > 0 {
            let slope = (1.0 / k - 1.0 / node[i - 1].1) / 2.0_f64.ln();
            let name = "single node, growth of the compliance per ln(1/h)";
            rows.push(row(name, *cells, slope * 1e3, "mm/N", Some(kelvin_slope() * 1e3), None));
        }
    }
    (progress.say)("relaxation times");
    let mut times = Vec::new();
    for (drag, name) in [(Drag::PerNode, "relaxation time, c per node"), (Drag::PerArea, "relaxation time, c per area")]
    {
        let coarse = meshes.iter().filter(|c| **c <= if effort == Effort::Quick { 32 } else { 64 });
        let found: Vec<(usize, f64)> = coarse.filter_map(|c| relaxation_time_s(*c, drag).map(|t| (*c, t))).collect();
        for (cells, time) in &found {
            rows.push(row(name, *cells, *time, "s", Some(rayleigh_time_s(*cells, drag)), None));
        }
        times.push((name, found));
    }
    let points = |values: &[(usize, f64)]| values.iter().map(|(c, v)| (spacing(c), *v)).collect::<Vec<_>>();
    let panel = |title: &str, y: Axis, series: Vec<Series>| Panel {
        title: title.to_owned(),
        x: Axis::log("spacing (mm)"),
        y,
        series,
        levels: Vec::new(),
    };
    let panels = [
        panel(
            "stiffness of a pull",
            Axis::linear("N/m"),
            vec![
                Series::new("rigid patch of 6.25 mm", nth_style(0), points(&patch)),
                Series::new("single node", nth_style(1), points(&node)),
            ],
        ),
        panel(
            "slowest relaxation",
            Axis::log("s"),
            times.iter().zip(2..).map(|((name, t), i)| Series::new(name, nth_style(i), points(t))).collect(),
        ),
    ];
    Section {
        key: "refinement",
        title: "Finer meshes: what converges and what does not".to_owned(),
        words: WORDS.map(str::to_owned).to_vec(),
        figures: vec![Figure {
            name: "refinement".to_owned(),
            caption: "Left: a patch has a limit, a single node gets softer without end. Right: drag per node slows the tissue four \
                      times with each halving of the spacing, drag per area does not."
                .to_owned(),
            svg: panels_svg("Refinement of a sheet of 100 mm", &panels, 2),
        }],
        rows,
    }
}

const WORDS: [&str; 2] = [
    "A force on a single node has no limit under refinement: the compliance grows by the logarithm of the spacing, with the slope \
     of Kelvin's point force. A suture point is therefore a patch of stated size. Its corners keep the order below two.",
    "k of Table 2 belongs to a sheet and needs no scaling: E t = 4k/3 at every spacing. c per node does: read as printed, each \
     refinement makes the tissue four times slower. Scenes state c per area.",
];
