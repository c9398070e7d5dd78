//! The parts of the report in the order in which they are measured and printed.
//!
//! One line per part. A part gives one section or several that belong together.

use super::awake;
use super::cases::Subject;
use super::extremes;
use super::kernels;
use super::network_file;
use super::networks::NetworkFile;
use super::paid;
use super::rates;
use super::section::{Effort, Progress, Section};
use super::work_precision;
use super::{curves, deviations, refinement, stability_map, validation, wound_figures};

/// What was asked for.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) effort: Effort,
    /// Scenes; the presets when none was asked for.
    pub(super) scenes: Vec<Subject>,
    /// Names of the scenes that were asked for; empty for all.
    pub(super) kept: Vec<String>,
    /// Files of spring networks.
    pub(super) networks: Vec<NetworkFile>,
    /// Keys of the parts that shall be measured; empty for all.
    pub(super) only: Vec<String>,
}

type Measure = fn(&Request, &Progress<'_>) -> Vec<Section>;

/// One part.
pub(super) struct Part {
    /// Keys of its sections.
    pub(super) keys: &'static [&'static str],
    /// Measures it.
    pub(super) measure: Measure,
}

/// The parts that a request asks for.
pub(super) fn parts(request: &Request) -> Vec<Part> {
    let wanted = |part: &Part| {
        request.only.is_empty() || part.keys.iter().any(|key| request.only.iter().any(|only| only == key))
    };
    all().into_iter().filter(wanted).collect()
}

/// Keys of all parts.
pub(super) fn keys() -> Vec<&'static str> {
    all().iter().flat_map(|part| part.keys).copied().collect()
}

fn all() -> Vec<Part> {
    vec![
        Part {
            keys: &["reference_agreement", "work_precision", "choice", "non_smooth"],
            measure: |r, p| work_precision::measure(r.effort, &r.scenes, p),
        },
        Part { keys: &["rates"], measure: |_, p| vec![rates::measure(p)] },
        Part { keys: &["network"], measure: |r, p| network_file::measure(&r.networks, r.effort, p) },
        Part { keys: &["kernels"], measure: |r, p| vec![kernels::measure(r.effort, p)] },
        Part { keys: &["awake"], measure: |r, p| vec![awake::measure(r.effort, p)] },
        Part { keys: &["stability"], measure: |r, p| vec![stability_map::measure(r.effort, p)] },
        Part { keys: &["extremes"], measure: |r, p| vec![extremes::measure(r.effort, p)] },
        Part { keys: &["refinement"], measure: |r, p| vec![refinement::measure(r.effort, p)] },
        Part { keys: &["curves"], measure: |r, p| vec![curves::measure(r.effort, p)] },
        Part { keys: &["wound_control"], measure: |r, p| vec![wound_figures::measure(r.effort, p)] },
        Part { keys: &["deviations"], measure: |r, p| vec![deviations::measure(r.effort, p)] },
        Part { keys: &["paid"], measure: |r, p| vec![paid::measure(r.effort, &r.kept, p)] },
        Part { keys: &["validation"], measure: |r, p| vec![validation::measure(r.effort, p)] },
    ]
}

/// Rows of scenes that were not asked for are dropped; rows that name no scene stay.
pub(super) fn keep_scenes(section: &mut Section, scenes: &[String]) {
    if scenes.is_empty() {
        return;
    }
    section.rows.retain(|row| {
        let scene = row.iter().find(|(name, _)| *name == "scene").and_then(|(_, value)| value.as_str());
        scene.is_none_or(|scene| scenes.iter().any(|s| s == scene))
    });
}
