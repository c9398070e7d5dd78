//! V3: a strip of skin pulled along one direction.
//!
//! Closed form: the square lattice with diagonals of k/2 is a membrane of E·t = 4k/3, ν = 1/3. The strip is loaded at its
//! ends and free at its sides. Published skin: initial slope 1.18 ± 0.88 MPa, modulus 83.3 ± 34.9 MPa (Ni Annaidh et al.
//! 2012, excised human back skin, 0.012/s); by all methods 5 kPa to 140 MPa. These are reported, not judged.

use super::{Finding, Outcome, Verdict};
use crate::accuracy::section::Effort;
use crate::accuracy::statics::Statics;
use crate::closed_forms::lattice_membrane_n_per_m;
use crate::generators::sheet;
use sim_core::scene::presets;
use sim_core::tissue::load::NodeForce;
use sim_core::vector::Vec3;

/// Columns and rows of the strip.
const NODES: [usize; 2] = [41, 11];
/// Cell, metres.
const CELL_M: f64 = 0.0025;
/// Thickness of the skin preset, metres.
const THICKNESS_M: f64 = 0.00175;
/// Rule.
const TOLERANCE: f64 = 1e-3;

/// What a pulled strip shows.
#[derive(Clone, Copy, Debug)]
pub struct Pulled {
    /// Strain along the pull.
    pub strain: f64,
    /// Strain across it.
    pub across: f64,
}

/// Pulls the strip with a force per width, newtons per metre; `None` when it finds no rest.
#[must_use]
pub fn pull_strip(line_force_n_per_m: f64) -> Option<Pulled> {
    let [columns, rows] = NODES;
    let k = presets::SKIN.stiffness_n_per_mm * 1e3;
    let network = sheet(columns, rows, CELL_M, k, 1e-5, 0.0);
    // A ten-millionth of the load of one node.
    let mut statics = Statics::new(network, 1e-7 * line_force_n_per_m * CELL_M);
    for r in 0..rows {
        let share = if r == 0 || r + 1 == rows { 0.5 } else { 1.0 };
        let force_n = Vec3::x() * (share * line_force_n_per_m * CELL_M);
        statics.loads.nodes.push(NodeForce { node: (r * columns) as u32, force_n: -force_n });
        statics.loads.nodes.push(NodeForce { node: (r * columns + columns - 1) as u32, force_n });
    }
    if !statics.rest() {
        return None;
    }
    let x = |c: usize, r: usize| statics.position_m[r * columns + c];
    let strain = (x(columns - 1, rows / 2) - x(0, rows / 2)).x / (CELL_M * (columns - 1) as f64) - 1.0;
    let across = (x(columns / 2, rows - 1) - x(columns / 2, 0)).y / (CELL_M * (rows - 1) as f64) - 1.0;
    Some(Pulled { strain, across })
}

pub(super) fn measure(_effort: Effort) -> Outcome {
    let k = presets::SKIN.stiffness_n_per_mm * 1e3;
    let expected = lattice_membrane_n_per_m(k);
    let row = |quantity: &str, figure: f64, unit, target: String, verdict, reason: &str| Finding {
        case: "V3",
        quantity: quantity.to_owned(),
        figure,
        unit,
        target,
        rule: "E t = 4k/3 to 1e-3; skin bands reported only",
        verdict,
        reason: reason.to_owned(),
    };
    let mut findings = Vec::new();
    // The strain is the size of the geometric nonlinearity: a tenth of the tolerance.
    let small_n_per_m = 0.1 * TOLERANCE * expected;
    if let Some(p) = pull_strip(small_n_per_m) {
        let membrane = small_n_per_m / p.strain;
        let close = (membrane / expected - 1.0).abs() <= TOLERANCE;
        findings.push(row("E t", membrane, "N/m", format!("{expected:.2}"), Verdict::of(close), "closed form 4k/3"));
        let poisson = -p.across / p.strain;
        let close = (poisson * 3.0 - 1.0).abs() <= TOLERANCE;
        findings.push(row("Poisson ratio", poisson, "1", "0.3333".to_owned(), Verdict::of(close), "closed form 1/3"));
        let modulus_mpa = membrane / THICKNESS_M * 1e-6;
        findings.push(row(
            "E at small strain, 1.75 mm thick",
            modulus_mpa,
            "MPa",
            "1.18 ± 0.88 (initial slope); 0.005 to 140 (all methods)".to_owned(),
            Verdict::Report,
            "Table 2's k is a tenth of the initial slope of excised skin, and inside the band of all methods",
        ));
    }
    // 54 % is the published failure strain.
    let large_n_per_m = 0.5 * expected;
    if let (Some(p), Some(q)) = (pull_strip(large_n_per_m), pull_strip(1.02 * large_n_per_m)) {
        let tangent_mpa = 0.02 * large_n_per_m / (q.strain - p.strain) / THICKNESS_M * 1e-6;
        findings.push(row(
            &format!("tangent modulus at {:.0} % strain", 100.0 * p.strain),
            tangent_mpa,
            "MPa",
            "83.3 ± 34.9".to_owned(),
            Verdict::Report,
            "linear springs do not stiffen: no J-shaped curve",
        ));
    }
    Outcome { findings, figures: Vec::new() }
}
