//! Instructions per step as a gate: absent stages cost nothing, and no step has become dearer than its stored count.
//!
//! Counts do not feel a busy machine. They depend on compiler and optimisation: the stored ones name theirs (a table per
//! build that is used: whole crates in CI, incremental at a desk), and any other build passes with a notice. Without
//! valgrind, or without AVX2, there is nothing to compare.

use std::fmt::Write;
use std::path::Path;
use suture_tests::instructions::callgrind::count;
use suture_tests::instructions::{ABSENCE_TOLERANCE, Absence, SCENES, absences, coarse};

/// Growth of a count that fails the gate. Equal sources and compilers give equal counts to 1e-4; below this lie changes of
/// inlining by an edit elsewhere in a crate.
const GROWTH: f64 = 0.05;
/// Steps that are counted.
const STEPS: u32 = 4;
/// The least that a stage which is there adds (or, asleep, saves), as a share of the step.
const PRESENT_SHARE: f64 = 2.0 * ABSENCE_TOLERANCE;

/// The stored counts: for each build its line, a head, and `case,instructions`.
const BASELINE: &str = include_str!("baseline.csv");

/// The servo's two rooms are two instances of generic code. At this level the compiler inlines each as it happens to, which
/// makes 15 instructions a tick either way; optimised, they differ by 2 (`accuracy-report --only paid`).
const BY_CHANCE: (&str, Option<&str>) = ("servo", Some("1"));

fn counts(cases: &[String]) -> Option<Vec<f64>> {
    match count(Path::new(env!("CARGO_BIN_EXE_count-steps")), STEPS, cases) {
        Ok(counts) => Some(counts),
        Err(reason) if reason.is_of_the_machine() => {
            eprintln!("skipped: {reason}");
            None
        }
        Err(reason) => panic!("{reason}"),
    }
}

/// What counts depend on besides the source.
fn build() -> String {
    let of = |value: Option<&'static str>| value.unwrap_or("unknown");
    let (compiler, target) = (of(option_env!("SUTURE_COMPILER")), of(option_env!("SUTURE_TARGET")));
    let level = of(option_env!("SUTURE_OPT_LEVEL"));
    let units = if option_env!("CARGO_INCREMENTAL") == Some("0") { "whole" } else { "incremental" };
    format!("# {compiler}, opt-level {level}, {target}, {units}\n")
}

fn guarded() -> Vec<String> {
    let works = ["full/attachments+contact+line+control", "semi_implicit", "verlet", "bdf2", "xpbd"];
    SCENES
        .iter()
        .flat_map(|scene| works.map(|work| coarse(scene, work)))
        .chain(["servo/recording".to_owned()])
        .collect()
}

#[test]
fn a_scene_without_a_stage_costs_what_a_build_without_it_costs() {
    let all = absences();
    let cases: Vec<String> = all.iter().flat_map(Absence::cases).cloned().collect();
    let Some(counted) = counts(&cases) else { return };
    let of = |case: &String| counted[cases.iter().position(|c| c == case).expect("it was asked for")];
    for absence in &all {
        let (without, bare) = (of(&absence.without), of(&absence.bare));
        let share = Absence::share(without, bare);
        println!("{}: {without} with the code and without the stage, {bare} without both", absence.scene);
        if (absence.scene, option_env!("SUTURE_OPT_LEVEL")) == BY_CHANCE {
            println!("{}: {:+.3} %, judged in optimised builds only", absence.scene, share * 100.0);
        } else {
            assert!(share.abs() <= ABSENCE_TOLERANCE, "{}: {without} against {bare} instructions", absence.scene);
        }
        for [case, beside] in &absence.present {
            let more = Absence::share(of(case), of(beside));
            println!("{case}: {:+.2} % of {beside}", more * 100.0);
            assert!(more.abs() > PRESENT_SHARE, "{case} adds {more}: would this comparison notice a stage at all?");
        }
    }
}

#[test]
fn no_step_has_become_dearer() {
    let (build, cases) = (build(), guarded());
    let Some(counted) = counts(&cases) else { return };
    let mut now = format!("{build}case,instructions\n");
    for (case, count) in cases.iter().zip(&counted) {
        writeln!(now, "{case},{count:.0}").expect("a string takes all");
    }
    let Some((_, table)) = BASELINE.split_once(&build) else {
        eprintln!("skipped: no counts are stored for this build; its own are:\n{now}");
        return;
    };
    let row = |line: &'static str| line.split_once(',').map(|(case, n)| (case, n.parse().expect("a number")));
    let stored: Vec<(&str, f64)> =
        table.lines().skip(1).take_while(|line| !line.starts_with('#')).filter_map(row).collect();
    let dearer: Vec<String> = cases
        .iter()
        .zip(&counted)
        .filter_map(|(case, count)| {
            let before = stored.iter().find(|(name, _)| name == case).map_or(0.0, |(_, count)| *count);
            (*count > before * (1.0 + GROWTH)).then(|| format!("{case}: {count:.0} instead of {before:.0}"))
        })
        .collect();
    assert!(
        dearer.is_empty(),
        "dearer by more than {} %: {dearer:#?}\nwhere that is meant, store in tests/tests/instructions/baseline.csv:\n{now}",
        GROWTH * 100.0
    );
}
