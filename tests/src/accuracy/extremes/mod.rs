//! Extreme and stiff cases: each must end correct, clamped and counted, or refused with the reason. Wrong is a bug.
//!
//! Energy rule: without input power E(t) ≤ E(0)(1 + 1e-6) where drag dissipates, E = E_kin + E_spring; without drag the
//! mean of E over 1000 steps must not drift by more than the method's own ripple. [`nets::EnergyWatch`] checks it wherever a
//! case lets a tissue go. Nothing that is not finite may reach a device command, a port, a frame, a report or a file: the
//! rig checks each of them in every tick and step.
//!
//! A case is a function without arguments that uses scenes, solver and servo as their users do. A panic is wrong too.
//! Deliberately absent: wall-clock limits; where time is the claim, work is counted.

mod attachments;
mod conservation;
mod counts;
mod geometry;
mod loads;
pub mod nets;
mod outputs;
pub mod rig;
mod servo;
mod servo_alone;
mod stiffness;
mod time;

use crate::accuracy::section::{Effort, Progress, Row, Section};
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The answer is right within the stated limit.
    Correct,
    /// A limit acted, was counted, and the state is sound.
    Clamped,
    /// Nothing was started; the message names the reason.
    Refused,
    /// None of the three.
    Wrong,
}

impl Ending {
    /// Word in the rows.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Correct => "correct",
            Self::Clamped => "clamped",
            Self::Refused => "refused",
            Self::Wrong => "wrong",
        }
    }
}

/// How a case ended, and what was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// What was checked, and the words of a refusal or of what is wrong.
    pub note: String,
    /// The figure that decides; it must not exceed the limit.
    pub figure: f64,
    /// Its limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Outcome {
    /// An ending that holds if the figure is within its limit, else wrong.
    #[must_use]
    pub fn measured(ending: Ending, note: impl Into<String>, figure: f64, limit: f64, unit: &'static str) -> Self {
        let held = if figure <= limit { ending } else { Ending::Wrong };
        Self { ending: held, note: note.into(), figure, limit, unit }
    }

    /// A refusal whose words must hold `reason`.
    #[must_use]
    pub fn refusal(words: Option<String>, reason: &str) -> Self {
        let (found, note) = match words {
            Some(words) => (words.contains(reason), shortened(&words)),
            None => (false, format!("was not refused (a refusal with “{reason}” was expected)")),
        };
        Self::measured(Ending::Refused, note, f64::from(u8::from(!found)), 0.0, "missing reasons")
    }

    /// A further condition; the case is wrong where it does not hold.
    #[must_use]
    pub fn require(mut self, holds: bool, what: &str) -> Self {
        if !holds {
            self.ending = Ending::Wrong;
            self.note = format!("{}; VIOLATED: {what}", self.note);
        }
        self
    }

    /// Both must end well; the ending, figure and limit are those of this one.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        self.note =
            format!("{}; {} ({:.3e} of {:.3e} {})", self.note, other.note, other.figure, other.limit, other.unit);
        if other.ending == Ending::Wrong {
            self.ending = Ending::Wrong;
        }
        self
    }
}

/// The words of a refusal, cut where a number fills hundreds of digits.
fn shortened(words: &str) -> String {
    const MOST: usize = 240;
    if words.chars().count() <= MOST {
        return words.to_owned();
    }
    words.chars().take(MOST).chain(['…']).collect()
}

/// One case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// What it belongs to.
    pub group: &'static str,
    /// What is extreme about it.
    pub name: &'static str,
    run: fn() -> Outcome,
}

impl Case {
    /// Runs the case. A panic is caught and is wrong.
    #[must_use]
    pub fn run(&self) -> Outcome {
        catch_unwind(AssertUnwindSafe(self.run)).unwrap_or_else(|panic| {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without words");
            Outcome::measured(Ending::Wrong, format!("panicked: {words}"), 1.0, 0.0, "panics")
        })
    }
}

/// A case with its name.
type Named = (&'static str, fn() -> Outcome);
/// A group of cases with its name.
type Group = (&'static str, &'static [Named]);

/// All groups.
const GROUPS: [Group; 10] = [
    ("stiffness and mass", stiffness::CASES),
    ("time", time::CASES),
    ("geometry", geometry::CASES),
    ("counts", counts::CASES),
    ("loads and wounds", loads::CASES),
    ("attachments", attachments::CASES),
    ("conservation", conservation::CASES),
    ("servo", servo::CASES),
    ("servo", servo_alone::CASES),
    ("outputs", outputs::CASES),
];

/// All cases in order.
pub fn cases() -> impl Iterator<Item = Case> {
    GROUPS.iter().flat_map(|(group, cases)| cases.iter().map(|&(name, run)| Case { group, name, run }))
}

/// Runs every case: rows of `case, outcome`, and what was checked.
#[must_use]
pub fn measure(_effort: Effort, progress: &Progress<'_>) -> Section {
    let mut rows: Vec<Row> = Vec::new();
    let mut counts = [0_usize; 4];
    for case in cases() {
        if progress.stopped() {
            break;
        }
        (progress.say)(&format!("extreme case: {}", case.name));
        let outcome = case.run();
        counts[outcome.ending as usize] += 1;
        rows.push(vec![
            ("case", json!(case.name)),
            ("group", json!(case.group)),
            ("outcome", json!(outcome.ending.word())),
            ("figure", json!(outcome.figure)),
            ("limit", json!(outcome.limit)),
            ("unit", json!(outcome.unit)),
            ("checked", json!(outcome.note)),
        ]);
    }
    let [correct, clamped, refused, wrong] = counts;
    Section {
        key: "extremes",
        title: "Extreme and stiff cases".to_owned(),
        words: vec![
            format!(
                "{} cases: {correct} correct, {clamped} clamped and counted, {refused} refused with the reason, {wrong} wrong.",
                rows.len()
            ),
            "Energy rule: without input power the energy may not grow by more than a millionth where drag dissipates; \
             without drag it may not drift beyond the ripple of the method. It is checked in every case that lets a tissue go. \
             In every case that runs a servo, each tick's force, each port, frame and report was checked to be finite and \
             within its limits."
                .to_owned(),
        ],
        figures: Vec::new(),
        rows,
    }
}
