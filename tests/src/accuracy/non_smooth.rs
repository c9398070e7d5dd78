//! What a switch does to the order: attachments and a stitch come into action in the middle of a run.
//!
//! The same pull as in the smooth cases; at 0.10 s the attachments of the pulled point are switched on, at 0.20 s a stitch
//! ties the next pair. Errors against the same solver with a step a tenth of the finest shown (semi-implicit): there is no
//! second program with these constraints, so this is self-convergence, and says so.

use super::cases::{Case, PULLED_PAIR, Regime, SAMPLE_S, Subject};
use super::section::{Progress, Section};
use super::tissue_run::{Event, Extras, run};
use super::work_precision::{Point, rows};
use sim_core::tissue::constraint::{PairConstraint, PairSense};
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::patch_set::PatchId;
use sim_core::tissue::regulation::Engagement;
use sim_core::tissue::solver::{Stages, TissueSolver};

/// Steps between two samples.
const LADDER: [usize; 6] = [1, 2, 5, 10, 20, 50];
/// Steps between two samples of the run that is taken as true.
const TRUTH: usize = 500;
/// Stiffness of the stitch, newtons per metre: that of the presets' line.
const STITCH_N_PER_M: f64 = 5000.0;
/// The stitch closes its pair to this part of the distance at which it begins.
const CLOSED_PART: f64 = 0.7;

/// What happens when.
const EVENTS: [Event; 2] = [(0.10, switch_attachments_on), (0.20, tie)];

fn switch_attachments_on(_: &TissueSolver, stages: &mut Stages) {
    if let Some(attachments) = &mut stages.attachments
        && let Some(index) = attachments.of_patch(PatchId(2 * PULLED_PAIR as u32))
    {
        attachments.engage(index, Engagement::Engaged);
    }
}

fn tie(solver: &TissueSolver, stages: &mut Stages) {
    let (a, b) = (PatchId(2 * PULLED_PAIR as u32 + 2), PatchId(2 * PULLED_PAIR as u32 + 3));
    let x = &solver.state().position_m;
    let apart = (solver.patches().mean(a, x) - solver.patches().mean(b, x)).norm();
    let stitch = PairConstraint {
        a,
        b,
        target_m: CLOSED_PART * apart,
        stiffness_n_per_m: STITCH_N_PER_M,
        max_force_n: f64::MAX,
        sense: PairSense::PullOnly,
    };
    if let Some(pairs) = &mut stages.pairs {
        // The presets have four pairs; numbers are in range.
        let _ = pairs.push(solver.patches(), stitch);
    }
}

/// The section.
pub(super) fn measure(subjects: &[Subject], progress: &Progress<'_>) -> Section {
    let mut section = Section {
        key: "non_smooth",
        title: "Error against run time when constraints switch".into(),
        words: vec![
            "At 0.10 s the long-range attachments of the pulled point begin to act, at 0.20 s a stitch draws the next pair \
             together at once. Every method falls to first order or below around such a switch, and constraint forces are solved \
             in the same way under every integrator. Truth is the same solver at 0.02 ms (semi-implicit): a self-comparison."
                .into(),
        ],
        figures: vec![],
        rows: vec![],
    };
    for subject in subjects {
        if let Err(why) = measure_scene(subject, progress, &mut section) {
            section.words.push(format!("{}: not measured: {why}.", subject.name));
        }
    }
    section
}

fn measure_scene(
    subject: &Subject,
    progress: &Progress<'_>,
    section: &mut Section,
) -> Result<(), Box<dyn std::error::Error>> {
    let (name, scene) = (&subject.name, subject.build()?);
    if scene.tissue().pairs.len() < PULLED_PAIR + 2 {
        return Err("it takes three pairs of suture points".into());
    }
    let cases = Case::of_scene(subject)?;
    let case = cases.iter().find(|c| c.regime == Regime::Table2).ok_or("there is no case with the drag of Table 2")?;
    let extras = Extras { stages: scene.stages().clone(), events: &EVENTS };
    (progress.say)(&format!("{name}: switched constraints, the run taken as true"));
    let Some(truth) = run(case, Integrator::SemiImplicit, TRUTH, &extras, progress.stop)? else {
        return Err("stopped".into());
    };
    let mut points = Vec::new();
    for integrator in Integrator::ALL {
        for per_sample in LADDER {
            if progress.stopped() {
                break;
            }
            let dt_s = SAMPLE_S / per_sample as f64;
            let point = match run(case, integrator, per_sample, &extras, progress.stop) {
                Ok(Some(run)) => {
                    let off = Some(run.samples.against(&truth.samples, &case.start_m));
                    Point { integrator, dt_s, run: Some(run), off, note: String::new() }
                }
                Ok(None) => break,
                Err(refusal) => Point { integrator, dt_s, run: None, off: None, note: refusal.to_string() },
            };
            points.push(point);
        }
    }
    section.rows.extend(rows(name, "switched", &points, None));
    Ok(())
}
