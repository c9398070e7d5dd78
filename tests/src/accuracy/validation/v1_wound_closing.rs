//! V1: the force that closes the middle of an elliptical skin wound (Čapek et al. 2012).
//!
//! Čapek's finite elements: 30 × 5 mm 0.5 N, 30 × 15 mm 1.5 N; in vivo: 36 × 5 mm 1.1 N, 46 × 13 mm 3.2 N. Here: a sheet of
//! 160 × 120 mm, rim clamped, k and pre-strain of the skin preset. The force is proportional to k, so one fitted k is
//! 160 N/m times the geometric mean of published over measured.

use super::closing::open_wound;
use super::{Finding, Outcome, Verdict};
use crate::accuracy::plot::{Axis, Panel, Series, nth_style, panels_svg};
use crate::accuracy::section::{Effort, Figure};
use sim_core::scene::presets;

/// A published wound.
#[derive(Clone, Copy, Debug)]
pub struct Wound {
    /// Length and width, millimetres.
    pub size_mm: [f64; 2],
    /// Published force of the middle stitch, newtons.
    pub published_n: f64,
    /// Where the force comes from.
    pub source: &'static str,
}

const FINITE_ELEMENTS: &str = "finite elements";
const IN_VIVO: &str = "in vivo";

/// The four wounds in the order of their published forces.
pub const WOUNDS: [Wound; 4] = [
    Wound { size_mm: [30.0, 5.0], published_n: 0.5, source: FINITE_ELEMENTS },
    Wound { size_mm: [36.0, 5.0], published_n: 1.1, source: IN_VIVO },
    Wound { size_mm: [30.0, 15.0], published_n: 1.5, source: FINITE_ELEMENTS },
    Wound { size_mm: [46.0, 13.0], published_n: 3.2, source: IN_VIVO },
];
/// Largest factor between measured and published force, untuned.
const FACTOR: f64 = 3.0;
/// Largest relative error after one fitted k.
const FITTED: f64 = 0.30;
/// Pre-strain of the skin preset.
pub const PRE_STRAIN: f64 = 0.05;

/// Cell of the sheet: the skin preset's, or finer.
pub(super) fn spacing_m(effort: Effort) -> f64 {
    match effort {
        Effort::Quick => 0.002,
        Effort::Full => 0.00125,
    }
}

/// One wound closed.
#[derive(Clone, Debug)]
pub struct Closed {
    /// Length and width after relaxation, metres.
    pub size_m: [f64; 2],
    /// Gap and force along the way, metres and newtons.
    pub path: Vec<(f64, f64)>,
    /// Largest force, newtons.
    pub peak_n: f64,
}

/// Closes all four wounds at one pre-strain.
#[must_use]
pub fn close_all(spacing_m: f64, pre_strain: f64, steps: u32) -> Vec<Option<Closed>> {
    let k = presets::SKIN.stiffness_n_per_mm * 1e3;
    let close = |size_mm: [f64; 2]| {
        let mut wound = open_wound(size_mm.map(|s| s * 1e-3), spacing_m, pre_strain, k)?;
        let stitch = wound.stitch_at(0.0);
        let path = wound.close(&stitch, steps);
        let peak_n = path.iter().map(|p| p.1).fold(0.0, f64::max);
        Some(Closed { size_m: wound.size_m, path, peak_n })
    };
    WOUNDS.iter().map(|w| close(w.size_mm)).collect()
}

/// Whether values rise from each to the next.
#[must_use]
pub fn rises(values: &[f64]) -> bool {
    values.windows(2).all(|w| w[1] > w[0])
}

/// Values of the wounds of one source.
#[must_use]
pub fn of_source(values: &[f64], source: &str) -> Vec<f64> {
    WOUNDS.iter().zip(values).filter(|(w, _)| w.source == source).map(|(_, v)| *v).collect()
}

/// The one factor on k that fits all ratios of published over measured best, and the worst relative error it leaves.
#[must_use]
pub fn fit(ratios: &[f64]) -> (f64, f64) {
    let factor = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    (factor, ratios.iter().map(|r| (factor / r - 1.0).abs()).fold(0.0, f64::max))
}

const RULE: &str = "order of all four; each within a factor 3 untuned; after one fitted k within 30 %";

fn row(quantity: String, figure: f64, unit: &'static str, target: String, verdict: Verdict, reason: String) -> Finding {
    Finding { case: "V1", quantity, figure, unit, target, rule: RULE, verdict, reason }
}

pub(super) fn measure(effort: Effort) -> Outcome {
    let steps = if effort == Effort::Quick { 4 } else { 10 };
    let closed: Vec<Closed> = close_all(spacing_m(effort), PRE_STRAIN, steps).into_iter().flatten().collect();
    if closed.len() < WOUNDS.len() {
        let reason = "a sheet found no rest".to_owned();
        let none = row("wounds closed".to_owned(), closed.len() as f64, "1", "4".to_owned(), Verdict::Fail, reason);
        return Outcome { findings: vec![none], figures: Vec::new() };
    }
    let mut findings: Vec<Finding> = WOUNDS.iter().zip(&closed).map(|(w, c)| one(w, c)).collect();
    let peaks: Vec<f64> = closed.iter().map(|c| c.peak_n).collect();
    let ratios: Vec<f64> = WOUNDS.iter().zip(&peaks).map(|(w, p)| w.published_n / p).collect();
    let within = [FINITE_ELEMENTS, IN_VIVO].map(|source| rises(&of_source(&peaks, source)));
    let kept = f64::from(u8::from(rises(&peaks)));
    findings.push(row(
        "order of the four forces kept".to_owned(),
        kept,
        "1",
        "1".to_owned(),
        Verdict::of(rises(&peaks)),
        format!(
            "order within finite elements kept: {}, within in vivo: {}. Across the two sources it is not: at equal width a longer \
             wound is the softer one in any linear membrane, and the published 36 × 5 mm in vivo needs 2.2 times the force of the \
             computed 30 × 5 mm",
            within[0], within[1]
        ),
    ));
    findings.push(fitted("all four", &ratios, FitRule::Judged));
    for source in [FINITE_ELEMENTS, IN_VIVO] {
        findings.push(fitted(source, &of_source(&ratios, source), FitRule::Reported));
    }
    Outcome { findings, figures: vec![figure(&closed)] }
}

fn figure(closed: &[Closed]) -> Figure {
    let name = |w: &Wound| format!("{:.0} × {:.0} mm, {}", w.size_mm[0], w.size_mm[1], w.source);
    let curves = WOUNDS.iter().zip(closed).enumerate().map(|(i, (w, c))| {
        let points = c.path.iter().map(|(gap, force)| (gap * 1e3, *force)).collect();
        let mut series = Series::new(&name(w), nth_style(i), points);
        series.chosen.push((0.0, w.published_n));
        series
    });
    let panel = Panel {
        title: "middle stitch, k and pre-strain of the preset".to_owned(),
        x: Axis::linear("gap between the edges (mm)"),
        y: Axis::linear("force (N)").between(0.0, 3.5),
        series: curves.collect(),
        levels: Vec::new(),
    };
    Figure {
        name: "v1_wound_closing".to_owned(),
        caption: "V1. Force that closes the middle of four elliptical wounds, from the open wound to touching edges. Rings on the left: \
                  the published forces, in the order of the legend from below."
            .to_owned(),
        svg: panels_svg("Closing an elliptical wound", &[panel], 1),
    }
}

fn one(wound: &Wound, closed: &Closed) -> Finding {
    let factor = (wound.published_n / closed.peak_n).max(closed.peak_n / wound.published_n);
    let [length, width] = closed.size_m.map(|s| s * 1e3);
    row(
        format!("closing {:.0} × {:.0} mm, {}", wound.size_mm[0], wound.size_mm[1], wound.source),
        closed.peak_n,
        "N",
        format!("{}", wound.published_n),
        Verdict::of(factor <= FACTOR),
        format!("factor {factor:.2}; the wound is {length:.1} × {width:.1} mm at rest under 5 % pre-strain"),
    )
}

/// Whether a fit has a rule.
#[derive(Clone, Copy, PartialEq)]
enum FitRule {
    Judged,
    Reported,
}

/// Row of one fitted k: judged for all four, reported for each source by itself.
fn fitted(name: &str, ratios: &[f64], rule: FitRule) -> Finding {
    let (factor, worst) = fit(ratios);
    let k = presets::SKIN.stiffness_n_per_mm * 1e3 * factor;
    let verdict = if rule == FitRule::Judged { Verdict::of(worst <= FITTED) } else { Verdict::Report };
    let reason = format!("leaves errors up to {:.0} %", 100.0 * worst);
    row(format!("one fitted k, {name}"), k, "N/m", "errors up to 30 %".to_owned(), verdict, reason)
}
