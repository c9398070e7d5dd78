//! What each scene paid for: stages × items, bytes, nanoseconds, instructions, and the proof that an absent stage costs none.
//!
//! A stage's cost is that of a step with it less that of a step without it. Instructions are counted by callgrind on
//! `count-steps` (`crate::instructions`), nanoseconds are processor time in this process, the least of interleaved repeats.
//! Bytes are elements × size of their type, items what one step touches. Absent: what the sweep's own layout takes.

use super::cpu_clock::thread_cpu_s;
use super::section::{Effort, Progress, Row, Section};
use crate::instructions::callgrind::{NotCounted, count};
use crate::instructions::{Absence, COARSE, PROGRAM, SCENES, Stage, Step, prepare, stages};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Steps that are counted; more change nothing, equal steps give equal counts.
const COUNTED_STEPS: u32 = 4;
/// Steps per timed stretch, and stretches per case.
const TIMED_STEPS: u32 = 10;
const STRETCHES: usize = 7;

/// Measures every stage of every scene.
pub(super) fn measure(effort: Effort, scenes: &[String], progress: &Progress<'_>) -> Section {
    let mesh = match effort {
        Effort::Quick => COARSE,
        Effort::Full => "preset",
    };
    let wanted = |s: &&str| scenes.is_empty() || scenes.iter().any(|w| w == s);
    let table: Vec<Stage> = SCENES.into_iter().filter(wanted).flat_map(|scene| stages(scene, mesh)).collect();
    let mut cases: Vec<String> = table.iter().flat_map(Stage::cases).cloned().collect();
    cases.sort_unstable();
    cases.dedup();
    (progress.say)("instructions of each stage");
    let counted = if progress.stopped() {
        Err(NotCounted::Failed("stopped".to_owned()))
    } else {
        program().and_then(|program| count(&program, COUNTED_STEPS, &cases))
    };
    (progress.say)("times of each stage");
    let ns = time(&cases, progress);
    let instructions: BTreeMap<&str, f64> =
        counted.iter().flatten().zip(&cases).map(|(n, case)| (case.as_str(), *n)).collect();
    let rows = table.iter().map(|stage| row(stage, &instructions, &ns)).collect();
    Section {
        key: "paid",
        title: "What each scene paid for".to_owned(),
        words: words(mesh, counted.err()),
        figures: Vec::new(),
        rows,
    }
}

/// `count-steps` stands beside this program, or one folder up where this is a test.
fn program() -> Result<PathBuf, NotCounted> {
    let own = std::env::current_exe().map_err(|e| NotCounted::Failed(e.to_string()))?;
    let beside = own.with_file_name(PROGRAM);
    let up = own.parent().and_then(|folder| folder.parent()).map(|folder| folder.join(PROGRAM));
    Ok(up.filter(|path| !beside.is_file() && path.is_file()).unwrap_or(beside))
}

fn words(mesh: &str, missing: Option<NotCounted>) -> Vec<String> {
    let mut words = vec![
        format!(
            "Costs of one solver step ({mesh} mesh; {COUNTED_STEPS} steps counted), each stage as the difference of a scene with it \
             and the same scene without it; the recording per five ticks of the servo. A stage that is present costs \
             `instructions`. `absent_instructions` is what is left of it in a scene without: the count of the preset with no \
             optional stage, less that of the same scene in a build whose code has none of them; `absent_share` is that \
             difference as a share of the step. One comparison covers all five stages together (attachments, line, control, \
             inner layers, sleep), on the skin, under the semi-implicit integrator: its rows repeat one number."
        ),
        "Nanoseconds are processor time on a shared machine, the least of repeats: differences below a few hundred \
         nanoseconds are noise, and may be negative."
            .to_owned(),
    ];
    if let Some(reason) = missing {
        words.push(format!("Instructions are missing: {reason}."));
    }
    words
}

fn row(stage: &Stage, instructions: &BTreeMap<&str, f64>, ns: &BTreeMap<&str, f64>) -> Row {
    let cost = |of: &BTreeMap<&str, f64>, [more, less]: &[String; 2]| {
        let less = if less.is_empty() { Some(0.0) } else { of.get(less.as_str()).copied() };
        Some(of.get(more.as_str())? - less?)
    };
    let absence = stage.absence.as_ref().and_then(|Absence { without, bare, .. }| {
        Some((*instructions.get(without.as_str())?, *instructions.get(bare.as_str())?))
    });
    let rounded = |v: Option<f64>| v.map_or(Value::Null, |v| json!(v.round()));
    let present = stage.present;
    let paid = |of| if present { cost(of, &stage.cost) } else { None };
    let absent = absence.map(|(without, bare)| without - bare);
    vec![
        ("scene", json!(stage.scene)),
        ("stage", json!(stage.name)),
        ("present", json!(present)),
        ("items", json!(stage.items)),
        ("bytes", json!(stage.bytes)),
        ("nanoseconds", rounded(paid(ns))),
        ("instructions", rounded(if present { paid(instructions) } else { absent })),
        ("absent_instructions", rounded(absent)),
        ("absent_share", absence.map_or(Value::Null, |(without, bare)| json!(Absence::share(without, bare)))),
    ]
}

/// Processor nanoseconds per step of each case, the least of the stretches; cases that are refused are left out.
fn time<'a>(cases: &'a [String], progress: &Progress<'_>) -> BTreeMap<&'a str, f64> {
    let mut ready: Vec<(&str, Step, f64)> = Vec::new();
    for case in cases {
        if progress.stopped() {
            break;
        }
        ready.extend(prepare(case).map(|step| (case.as_str(), step, f64::INFINITY)));
    }
    for _ in 0..STRETCHES {
        for (_, step, least) in &mut ready {
            let begun = thread_cpu_s();
            (0..TIMED_STEPS).for_each(|_| step());
            *least = least.min((thread_cpu_s() - begun) * 1e9 / f64::from(TIMED_STEPS));
        }
    }
    ready.into_iter().map(|(case, _, least)| (case, least)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn every_stage_has_its_row_and_absent_ones_cost_nothing() {
        let stop = AtomicBool::new(false);
        let progress = Progress { stop: &stop, say: &|_| {} };
        let section = measure(Effort::Quick, &["skin".to_owned()], &progress);
        let value = |row: &Row, name: &str| row.iter().find(|(n, _)| *n == name).map(|(_, v)| v.clone());
        let find = |stage: &str| section.rows.iter().find(|r| value(r, "stage") == Some(json!(stage))).expect(stage);
        let springs = find("springs");
        assert_eq!(value(springs, "present"), Some(json!(true)));
        assert!(value(springs, "nanoseconds").and_then(|v| v.as_f64()).is_some_and(|ns| ns > 0.0));
        assert_eq!(value(find("inner layers"), "items"), Some(json!(0)));
        // Without valgrind, or without the program beside this test, the counts are null and the reason is told.
        let counted = value(springs, "instructions").is_some_and(|v| !v.is_null());
        assert_eq!(section.words.iter().any(|w| w.starts_with("Instructions are missing")), !counted);
    }
}
