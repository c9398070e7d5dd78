//! V4: a vein of 10 mm under 5 to 10 mmHg.
//!
//! Thin wall: u = p R²/(E t), with E t = 4k/3 of one layer (and k for a ring of links alone). Thick wall, free ends (Lamé):
//! u = (p r_i/E)((r_o² + r_i²)/(r_o² − r_i²) + ν) at the inside. Distension in life: 0.3 to 2 %. The product's tube has
//! three layers with radial and diagonal springs; they add hoop stiffness, and its edge layers count whole.

use super::lattice::tube;
use super::{Finding, Outcome, Verdict};
use crate::accuracy::section::Effort;
use crate::accuracy::statics::Statics;
use crate::closed_forms::{lattice_membrane_n_per_m, thin_ring_displacement_m};
use sim_core::scene::presets;
use sim_core::tissue::load::NodeForce;
use std::f64::consts::TAU;

/// Inner radius, metres.
const RADIUS_M: f64 = 0.005;
/// Wall of the vessel preset, metres.
const WALL_M: f64 = 0.0015;
/// Pressures, pascals: 5 and 10 mmHg.
pub const PRESSURES_PA: [f64; 2] = [666.6, 1333.2];
/// Rule for the thin wall.
const TOLERANCE: f64 = 0.05;
/// Distension in life.
const DISTENSION: [f64; 2] = [0.003, 0.02];
/// Nodes around.
const AROUND: u32 = 32;
/// Rings of nodes along.
const RINGS: u32 = 9;

/// Widening of the inside of a tube of `layers` layers, metres; `None` when it finds no rest.
#[must_use]
pub fn widening_m(layers: u32, pressure_pa: f64) -> Option<f64> {
    let outermost = f64::from(layers - 1);
    let depth = |l: u32| if layers == 1 { 0.0 } else { WALL_M * (1.0 - f64::from(l) / outermost) };
    let radii: Vec<f64> = (0..layers).map(|l| RADIUS_M + depth(l)).collect();
    let arc_m = TAU * RADIUS_M / f64::from(AROUND);
    let k = presets::VESSEL.stiffness_n_per_mm * 1e3;
    let network = tube(&radii, AROUND, RINGS, arc_m, k).ok()?;
    let nodes = network.node_count() as u32;
    let inner = nodes - AROUND * RINGS;
    let whole_n = pressure_pa * arc_m * arc_m;
    let mut statics = Statics::new(network, 1e-6 * whole_n);
    for node in inner..nodes {
        let ring = (node - inner) / AROUND;
        let share = if ring == 0 || ring + 1 == RINGS { 0.5 } else { 1.0 };
        let mut out = statics.position_m[node as usize];
        out.z = 0.0;
        statics.loads.nodes.push(NodeForce { node, force_n: out.normalize() * (share * whole_n) });
    }
    if !statics.rest() {
        return None;
    }
    let middle = inner + AROUND * (RINGS / 2);
    let radius = |n: u32| statics.position_m[n as usize].xy().norm();
    Some((middle..middle + AROUND).map(radius).sum::<f64>() / f64::from(AROUND) - RADIUS_M)
}

/// Lamé's widening at the inside of a thick tube with free ends, metres.
#[must_use]
pub fn lame_m(pressure_pa: f64, modulus_pa: f64, poisson: f64) -> f64 {
    let (inner, outer) = (RADIUS_M * RADIUS_M, (RADIUS_M + WALL_M).powi(2));
    pressure_pa * RADIUS_M / modulus_pa * ((outer + inner) / (outer - inner) + poisson)
}

/// Thin wall of one layer, metres.
#[must_use]
pub fn thin_wall_m(pressure_pa: f64) -> f64 {
    let membrane = lattice_membrane_n_per_m(presets::VESSEL.stiffness_n_per_mm * 1e3);
    thin_ring_displacement_m(pressure_pa, RADIUS_M, membrane)
}

pub(super) fn measure(_effort: Effort) -> Outcome {
    let mut findings = Vec::new();
    let mut push = |quantity: String, figure: f64, unit, target: String, verdict, reason: String| {
        let rule = "one layer against p R²/(E t) within 5 %; distension 0.3–2 %; several layers against Lamé reported";
        findings.push(Finding { case: "V4", quantity, figure, unit, target, rule, verdict, reason });
    };
    let layer_n_per_m = lattice_membrane_n_per_m(presets::VESSEL.stiffness_n_per_mm * 1e3);
    for pressure in PRESSURES_PA {
        let mmhg = (pressure / 133.322).round();
        for layers in [1, 3, 5] {
            let Some(u) = widening_m(layers, pressure) else { continue };
            let (thin, thick) =
                (thin_wall_m(pressure), lame_m(pressure, f64::from(layers) * layer_n_per_m / WALL_M, 1.0 / 3.0));
            let (target, verdict, reason) = if layers == 1 {
                let close = (u / thin - 1.0).abs() <= TOLERANCE;
                (thin, Verdict::of(close), format!("{:+.2} % from p R²/(E t)", 100.0 * (u / thin - 1.0)))
            } else {
                let off = 100.0 * (1.0 - u / thick);
                let why = "radial and diagonal springs carry hoop load too, and the edge layers count whole";
                (thick, Verdict::Report, format!("widens {off:.0} % less than Lamé: {why}"))
            };
            push(
                format!("widening, {layers} layer(s), {mmhg} mmHg"),
                u * 1e6,
                "µm",
                format!("{:.1}", target * 1e6),
                verdict,
                reason,
            );
            if layers <= 3 {
                let share = u / RADIUS_M;
                let inside = (DISTENSION[0]..=DISTENSION[1]).contains(&share);
                let reason = if inside { "as a vein in life" } else { "stiffer than a vein in life" };
                push(
                    format!("distension, {layers} layer(s), {mmhg} mmHg"),
                    share * 100.0,
                    "%",
                    "0.3 to 2".to_owned(),
                    Verdict::of(inside),
                    reason.to_owned(),
                );
            }
        }
    }
    Outcome { findings, figures: Vec::new() }
}
