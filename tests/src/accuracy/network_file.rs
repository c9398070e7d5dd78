//! Any spring network from a file: every integrator at several steps beside another program's result.
//!
//! Displacement error: relative L2 of the node displacements at the file's end time against the positions in the file. An
//! own Runge–Kutta run stands beside them, so that reference and reader are checked as well. Costs are processor time of
//! one thread.

use super::cpu_clock::thread_cpu_s;
use super::networks::NetworkFile;
use super::section::{Effort, Progress, Row, Section};
use crate::reference::{Driven, ExplicitMethod, explicit_run, explicit_step_s};
use serde_json::json;
use sim_core::tissue::integrator::{Integrator, NodeFactors, advance};
use sim_core::tissue::load::{Loads, NodeForce};
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use sim_core::tissue::sweep::dispatch::KernelLevel;
use sim_core::tissue::sweep::{KernelPath, Precision, SpringSweep};
use sim_core::vector::Vec3;
use std::sync::atomic::{AtomicBool, Ordering};

/// Steps, as parts of the step that the file names: five times as long to a fiftieth.
const STEP_FACTORS: [f64; 8] = [5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02];
/// Nodes are not cut to a limit here.
const NO_LIMIT_SPACINGS: f64 = 1e6;
/// Repeats of a run without the solver around it; the least time counts.
const BARE_REPEATS: usize = 3;
/// A run that is off by more than the whole displacement follows nothing.
const LOST: f64 = 1.0;

/// Most processor time per simulated time of one run.
const fn dearest(effort: Effort) -> f64 {
    match effort {
        Effort::Quick => 30.0,
        Effort::Full => 400.0,
    }
}

struct Outcome {
    error: f64,
    cpu_s: f64,
    steps: usize,
    contained: u64,
}

/// The section, or none without files.
pub(super) fn measure(files: &[NetworkFile], effort: Effort, progress: &Progress<'_>) -> Vec<Section> {
    if files.is_empty() {
        return vec![];
    }
    let mut rows = Vec::new();
    for file in files {
        rows.extend(reference_row(file, progress));
        rows.extend(path_rows(file, progress));
        let sweep = SpringSweep::new(&file.network);
        let path = format!("automatic ({}, {})", path_name(sweep.path()), sweep.level().taken());
        for integrator in Integrator::ALL {
            let mut before: Option<(f64, f64, f64)> = None;
            for factor in STEP_FACTORS {
                let steps = (file.end_s / (file.time_step_s * factor) - 1e-9).ceil().max(1.0) as usize;
                let dt_s = file.end_s / steps as f64;
                let expected = before.map_or(0.0, |(cost, dt, _)| cost * dt / dt_s);
                if progress.stopped() || expected > dearest(effort) {
                    break;
                }
                (progress.say)(&format!("{} {} at {dt_s:.1e} s", file.name, integrator.name()));
                let outcome = match run(file, integrator, steps, progress.stop) {
                    Ok(Some(outcome)) => Ok(outcome),
                    Ok(None) => break,
                    Err(refusal) => Err(refusal.to_string()),
                };
                rows.push(row(file, (integrator, "f64", &path), dt_s, &outcome, before));
                before = outcome.ok().map(|o| (o.cpu_s / file.end_s, dt_s, o.error));
            }
        }
    }
    vec![Section {
        key: "network",
        title: "Spring networks from files".into(),
        words: vec![
            "Each network is stepped from rest under its load to the end time in its file. The displacement error is the \
             relative L2 norm of the node displacements against the positions that the file brings from another program. The row \
             runge_kutta_reference is an own reference at small steps on the same file: what it is off by is what the file and this \
             report do not have in common."
                .into(),
        ],
        figures: vec![],
        rows,
    }]
}

fn row(
    file: &NetworkFile,
    (integrator, precision, path): (Integrator, &str, &str),
    dt_s: f64,
    outcome: &Result<Outcome, String>,
    before: Option<(f64, f64, f64)>,
) -> Row {
    let good = outcome.as_ref().ok();
    let unstable = good.is_none_or(|o| o.error.is_nan() || o.error > LOST || o.contained > 0);
    let error = good.filter(|_| !unstable).map(|o| o.error);
    let order = before.zip(error).map(|((_, dt, coarser), error)| (coarser / error).ln() / (dt / dt_s).ln());
    let work = |o: &Outcome| o.cpu_s * 1e9 / (o.steps as f64 * file.network.springs.len() as f64);
    vec![
        ("file", json!(file.name)),
        ("integrator", json!(integrator.name())),
        ("precision", json!(precision)),
        ("path", json!(path)),
        ("dt_s", json!(dt_s)),
        ("displacement_error", json!(error)),
        ("observed_order", json!(order.filter(|o| o.is_finite()))),
        ("ns_per_spring_step", json!(good.map(work))),
        ("cpu_per_sim", json!(good.map(|o| o.cpu_s / file.end_s))),
        ("unstable", json!(unstable)),
        ("note", json!(outcome.as_ref().err().cloned().unwrap_or_default())),
    ]
}

fn run(
    file: &NetworkFile,
    integrator: Integrator,
    steps: usize,
    stop: &AtomicBool,
) -> Result<Option<Outcome>, SolverError> {
    let params = SolverParams {
        integrator,
        substeps: SubstepPolicy::Demanded(1),
        displacement_limit_spacings: NO_LIMIT_SPACINGS,
        ..SolverParams::with_period(file.end_s / steps as f64)
    };
    let mut solver = TissueSolver::new(file.network.clone(), PatchSet::default(), params)?;
    let nodes = file.loads.iter().map(|&(node, force_n)| NodeForce { node, force_n }).collect();
    let mut stages = Stages { loads: Some(Loads { nodes, patches: vec![] }), ..Stages::default() };
    let begun = thread_cpu_s();
    let mut contained = 0;
    for _ in 0..steps {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        contained += u64::from(solver.step(&mut stages).contained);
    }
    let cpu_s = thread_cpu_s() - begun;
    let error = displacement_error(file, solver.state().position_m.iter().copied());
    Ok(Some(Outcome { error, cpu_s, steps, contained }))
}

const fn path_name(path: KernelPath) -> &'static str {
    match path {
        KernelPath::Rows => "rows",
        KernelPath::Gather => "gather",
        KernelPath::Stencil => "stencil",
        KernelPath::Strips => "strips",
    }
}

/// Every kernel path in both precisions on every instruction set, at the step of the file: semi-implicit Euler on the bare sweep, without the
/// solver around it.
fn path_rows(file: &NetworkFile, progress: &Progress<'_>) -> Vec<Row> {
    let steps = (file.end_s / file.time_step_s - 1e-9).ceil().max(1.0) as usize;
    let dt_s = file.end_s / steps as f64;
    let mut rows = Vec::new();
    let paths = [KernelPath::Rows, KernelPath::Gather, KernelPath::Stencil, KernelPath::Strips];
    let ways = paths.iter().flat_map(|&path| [(path, Precision::Double, "f64"), (path, Precision::Single, "f32")]);
    for (path, precision, bits) in ways {
        let mut taken = Vec::new();
        for level in [KernelLevel::Best, KernelLevel::Avx2, KernelLevel::Portable] {
            // Where the best is no more than AVX2, the two are one.
            if progress.stopped() || taken.contains(&level.taken()) {
                continue;
            }
            taken.push(level.taken());
            (progress.say)(&format!("{} {} {bits} {}", file.name, path_name(path), level.taken()));
            let outcome = bare_run(file, SpringSweep::with(&file.network, path, precision, level), steps, dt_s);
            let name = format!("{} ({})", path_name(path), level.taken());
            rows.push(row(file, (Integrator::SemiImplicit, bits, &name), dt_s, &Ok(outcome), None));
        }
    }
    rows
}

fn bare_run(file: &NetworkFile, mut sweep: SpringSweep, steps: usize, dt_s: f64) -> Outcome {
    let network = &file.network;
    let nodes = network.mass_kg.iter().zip(&network.drag_n_s_per_m).zip(&network.fixed);
    let factors: Vec<NodeFactors> = nodes
        .map(
            |((m, c), fixed)| {
                if *fixed == 0 { Integrator::SemiImplicit.factors(*m, *c, dt_s) } else { NodeFactors::default() }
            },
        )
        .collect();
    let loads = file.loads.iter().map(|&(node, force_n)| NodeForce { node, force_n }).collect();
    let (loads, none) = (Loads { nodes: loads, patches: vec![] }, PatchSet::default());
    let mut least_s = f64::INFINITY;
    let (mut error, mut contained) = (f64::NAN, 0);
    for _ in 0..BARE_REPEATS {
        let mut state = network.rest_state();
        let mut force_n = state.velocity_m_per_s.clone();
        contained = 0;
        let begun = thread_cpu_s();
        for _ in 0..steps {
            sweep.sweep(&state.position_m, &mut force_n);
            contained += u64::from(loads.add(&none, &mut force_n));
            contained += u64::from(advance(&factors, &force_n, &mut state, dt_s, f64::MAX).contained);
        }
        least_s = least_s.min(thread_cpu_s() - begun);
        error = displacement_error(file, state.position_m.iter().copied());
    }
    Outcome { error, cpu_s: least_s, steps, contained }
}

fn displacement_error(file: &NetworkFile, position_m: impl Iterator<Item = Vec3>) -> f64 {
    let nodes = position_m.zip(&file.reference_m).zip(&file.network.rest_m);
    let (off, way) = nodes.fold((0.0, 0.0), |(off, way), ((x, reference), rest)| {
        (off + (x - reference).norm_squared(), way + (reference - rest).norm_squared())
    });
    (off / way).sqrt()
}

/// An own Runge–Kutta run at `ω_max·dt ≤ 0.1`.
fn reference_row(file: &NetworkFile, progress: &Progress<'_>) -> Option<Row> {
    (progress.say)(&format!("{}: own reference", file.name));
    let loads: Vec<(u32, [f64; 3])> = file.loads.iter().map(|(n, f)| (*n, [f.x, f.y, f.z])).collect();
    let driven = Driven {
        network: &file.network,
        start_m: &file.network.rest_m,
        held: &[],
        path: &|_| [0.0; 3],
        loads: &loads,
        end_s: file.end_s,
        sample_s: file.end_s,
    };
    let (dt_s, _) = explicit_step_s(&driven, ExplicitMethod::RungeKutta, 0.1);
    let begun = thread_cpu_s();
    let samples = explicit_run(&driven, ExplicitMethod::RungeKutta, dt_s, progress.stop)?;
    let cpu_s = thread_cpu_s() - begun;
    let end = samples.position_m.last()?.iter().map(|x| Vec3::new(x[0], x[1], x[2]));
    let error = displacement_error(file, end);
    let steps = (file.end_s / dt_s).ceil();
    Some(vec![
        ("file", json!(file.name)),
        ("integrator", json!("runge_kutta_reference")),
        ("precision", json!("f64")),
        ("path", json!("edge_list")),
        ("dt_s", json!(dt_s)),
        ("displacement_error", json!(error)),
        ("observed_order", json!(null)),
        ("ns_per_spring_step", json!(cpu_s * 1e9 / (steps * file.network.springs.len() as f64))),
        ("cpu_per_sim", json!(cpu_s / file.end_s)),
        ("unstable", json!(false)),
        ("note", json!("four force evaluations per step")),
    ])
}
