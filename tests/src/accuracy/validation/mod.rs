//! Validation against published tissue figures and closed forms: cases V1 to V6.
//!
//! | case | what | rule |
//! |---|---|---|
//! | V1 | closing four elliptical wounds (Čapek 2012) | order of all four; each within a factor 3 untuned; after one fitted k within 30 % |
//! | V2 | running suture of seven stitches (Horeman 2013) | force in stitch 2 falls monotone by 67 ± 15 %, flat after stitch 4 |
//! | V3 | uniaxial strip | E·t = 4k/3 to 1e-3; skin bands reported |
//! | V4 | vein under pressure | p R²/(E t) within 5 %, distension 0.3–2 %; several layers against Lamé reported |
//! | V5 | capsule strip (Umale 2011, Brunon 2010) | E·t = 2k/√3 to 1 %; bands |
//! | V6 | loss of tension over a minute | none: a mass-spring model has none, and says so |
//!
//! No parameter is tuned to a case; k, bite, patch and pre-strain are those of the presets. A fail stays a fail, with its reason.

mod closing;
mod lattice;
mod sheet;
pub mod v1_wound_closing;
pub mod v2_seven_stitches;
pub mod v3_strip;
pub mod v4_vein;
pub mod v5_capsule;
pub mod v6_relaxation;

use super::section::{Effort, Figure, Progress, Row, Section};
use super::side_by_side::side_by_side;
use serde_json::{Value, json};

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The rule is met.
    Pass,
    /// It is not.
    Fail,
    /// There is no rule; the figure is for the reader.
    Report,
}

/// One figure of a case.
#[derive(Clone, Debug)]
pub struct Finding {
    /// V1 to V6.
    pub case: &'static str,
    /// What was measured.
    pub quantity: String,
    /// The figure.
    pub figure: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What it is compared with.
    pub target: String,
    /// The rule.
    pub rule: &'static str,
    /// The outcome.
    pub verdict: Verdict,
    /// Why.
    pub reason: String,
}

impl Verdict {
    /// Pass or fail.
    #[must_use]
    pub fn of(pass: bool) -> Self {
        if pass { Self::Pass } else { Self::Fail }
    }

    fn json(self) -> Value {
        match self {
            Self::Pass => json!(true),
            Self::Fail => json!(false),
            Self::Report => Value::Null,
        }
    }
}

impl Finding {
    fn row(&self) -> Row {
        vec![
            ("case", json!(self.case)),
            ("quantity", json!(self.quantity)),
            ("figure", json!(self.figure)),
            ("unit", json!(self.unit)),
            ("target", json!(self.target)),
            ("rule", json!(self.rule)),
            ("pass", self.verdict.json()),
            ("reason", json!(self.reason)),
        ]
    }
}

/// What a case hands over.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Rows.
    pub findings: Vec<Finding>,
    /// Figures.
    pub figures: Vec<Figure>,
}

/// Runs all cases.
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    type Case = (&'static str, fn(Effort) -> Outcome);
    let cases: [Case; 6] = [
        ("V1 wound closing", v1_wound_closing::measure),
        ("V2 seven stitches", v2_seven_stitches::measure),
        ("V3 strip of skin", v3_strip::measure),
        ("V4 vein under pressure", v4_vein::measure),
        ("V5 strip of capsule", v5_capsule::measure),
        ("V6 tension over a minute", v6_relaxation::measure),
    ];
    let found = side_by_side(&cases, |&(name, run)| {
        if progress.stopped() {
            return Outcome::default();
        }
        (progress.say)(name);
        run(effort)
    });
    let mut all = Outcome::default();
    for outcome in found {
        all.findings.extend(outcome.findings);
        all.figures.extend(outcome.figures);
    }
    Section {
        key: "validation",
        title: "Validation against published figures".to_owned(),
        words: WORDS.map(str::to_owned).to_vec(),
        figures: all.figures,
        rows: all.findings.iter().map(Finding::row).collect(),
    }
}

const WORDS: [&str; 3] = [
    "Each case compares a figure of the model with a published one or a closed form, under a rule that was fixed before. \
     Stiffness, bite, patch and pre-strain are those of the presets; nothing is tuned to a case. A row without a verdict has no rule.",
    "The force curves that the paper compares itself with were recorded in a hospital and are not public. The figures here are what \
     the literature offers instead.",
    "A network of linear springs has no J-shaped stress–strain curve, no loss of tension over time and no puncture; where a published \
     figure needs one of these, the case fails and says so.",
];
