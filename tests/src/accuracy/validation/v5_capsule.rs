//! V5: a strip of liver capsule.
//!
//! Closed form: a lattice of equilateral triangles of springs k is a membrane of E·t = 2k/√3, ν = 1/3. Published: porcine
//! capsule 8.22 ± 3.42 MPa at small strain (Umale et al. 2011), taken as 0.1 mm thick: 0.82 ± 0.34 N/mm; failure at
//! 47 ± 29 % strain and 0.3 ± 0.3 N/mm (Brunon et al. 2010). The strip is loaded at its ends; strain is read in its middle third.

use super::lattice::triangle_strip;
use super::{Finding, Outcome, Verdict};
use crate::accuracy::section::Effort;
use crate::accuracy::statics::Statics;
use sim_core::scene::presets;
use sim_core::tissue::load::NodeForce;
use sim_core::vector::Vec3;

/// Nodes along and across.
const NODES: [u32; 2] = [61, 11];
/// Side of a triangle, metres.
const CELL_M: f64 = 0.0025;
/// Thickness that makes a membrane of Umale's modulus, metres.
const CAPSULE_M: f64 = 1e-4;
/// Rule: the load comes in at the ends; what is left of that in the middle third is below this.
const TOLERANCE: f64 = 0.01;
/// Failure strain.
const FAILURE_STRAIN: f64 = 0.47;

/// Strain in the middle third under a force per width, newtons per metre; `None` when it finds no rest.
#[must_use]
pub fn strain_under(line_force_n_per_m: f64) -> Option<f64> {
    let [columns, rows] = NODES;
    let network = triangle_strip(columns, rows, CELL_M, presets::LIVER.stiffness_n_per_mm * 1e3).ok()?;
    let width_m = CELL_M * 0.75_f64.sqrt() * f64::from(rows - 1);
    let whole_n = line_force_n_per_m * width_m / f64::from(rows - 1);
    let mut statics = Statics::new(network, 1e-6 * whole_n);
    for row in 0..rows {
        let share = if row == 0 || row + 1 == rows { 0.5 } else { 1.0 };
        let force_n = Vec3::x() * (share * whole_n);
        statics.loads.nodes.push(NodeForce { node: row * columns, force_n: -force_n });
        statics.loads.nodes.push(NodeForce { node: row * columns + columns - 1, force_n });
    }
    if !statics.rest() {
        return None;
    }
    let third = (columns - 1) / 3;
    let at = |column: u32| (0..rows).map(|r| statics.position_m[(r * columns + column) as usize].x).sum::<f64>();
    let gauge_m = (at(2 * third) - at(third)) / f64::from(rows);
    Some(gauge_m / (CELL_M * f64::from(third)) - 1.0)
}

/// Closed form of the membrane stiffness, newtons per metre.
#[must_use]
pub fn membrane_n_per_m() -> f64 {
    2.0 * presets::LIVER.stiffness_n_per_mm * 1e3 / 3.0_f64.sqrt()
}

pub(super) fn measure(_effort: Effort) -> Outcome {
    let expected = membrane_n_per_m();
    let row = |quantity: &str, figure: f64, unit, target: String, verdict, reason: String| Finding {
        case: "V5",
        quantity: quantity.to_owned(),
        figure,
        unit,
        target,
        rule: "E t = 2k/√3 within 1 %; inside the published bands",
        verdict,
        reason,
    };
    let mut findings = Vec::new();
    let small_n_per_m = 1e-4 * expected;
    if let Some(strain) = strain_under(small_n_per_m) {
        let membrane = small_n_per_m / strain;
        let close = (membrane / expected - 1.0).abs() <= TOLERANCE;
        findings.push(row(
            "E t",
            membrane,
            "N/m",
            format!("{expected:.1}"),
            Verdict::of(close),
            "closed form 2k/√3".to_owned(),
        ));
        let published = 8.22e6 * CAPSULE_M;
        let inside = (membrane - published).abs() <= 3.42e6 * CAPSULE_M;
        let reason = format!(
            "Table 2's k = 0.18 N/mm is {:.1} times as soft as a capsule of 0.1 mm; the paper gives the shell for the whole liver",
            published / membrane
        );
        findings.push(row("E t against Umale", membrane, "N/m", "822 ± 342".to_owned(), Verdict::of(inside), reason));
    }
    // Secant steps to the line force at the failure strain; the strip is nearly linear.
    let mut force = FAILURE_STRAIN * expected;
    let mut reached = None;
    for _ in 0..3 {
        let Some(strain) = strain_under(force) else { break };
        reached = Some((force, strain));
        force *= FAILURE_STRAIN / strain;
    }
    if let Some((force, strain)) = reached {
        let inside = (0.0..=0.6).contains(&(force * 1e-3));
        let reason = "inside one standard deviation, which begins at zero: a weak test".to_owned();
        let quantity = format!("line force at {:.0} % strain against Brunon", 100.0 * strain);
        findings.push(row(&quantity, force * 1e-3, "N/mm", "0.3 ± 0.3".to_owned(), Verdict::of(inside), reason));
    }
    Outcome { findings, figures: Vec::new() }
}
