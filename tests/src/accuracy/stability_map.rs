//! Stability maps: where each integrator is stable, sits in a limit cycle, or overflows, beside the closed forms.
//!
//! Explicit drag K·dt² + 2c·dt < 4m, implicit drag K·dt² < 4m + 2c·dt, Verlet K·dt² < 4m; K is the largest eigenvalue of
//! the tangent stiffness. Each point of a map is a run ([`probe`]); each boundary is bisected by runs and then divided by
//! the formula. Stability is judged by the growth of one-step parity oscillation, never by a number that is not one: an
//! unstable net may sit in a bounded cycle for ever. All nodes of a net have the same m and c here, so that the scalar
//! forms are exact for it. Deliberately absent: the choice of sub-steps, which the solver makes from the same numbers.

mod attachment;
mod boundary;
mod maps;
mod motion;
pub mod probe;
mod servo_node;
pub mod topology;

pub use boundary::{Boundary, TABLE_2_EDGES, boundaries, edge_mass};

use crate::accuracy::section::{Effort, Progress, Section};
use serde_json::json;

/// Largest distance of a measured boundary from its formula, relative.
pub const AGREEMENT: f64 = 0.02;

/// Maps, and rows of `topology, integrator, boundary_measured, boundary_formula, ratio`.
#[must_use]
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let nets = topology::all();
    let mut found: Vec<Boundary> = Vec::new();
    for net in &nets {
        if progress.stopped() {
            break;
        }
        (progress.say)(&format!("stability boundary: {}", net.name));
        found.extend(boundaries(net, effort));
    }
    if !progress.stopped() {
        (progress.say)("stability boundary: attachments and servo node");
        found.extend(attachment::boundaries(effort));
        found.extend(servo_node::boundaries(effort));
    }
    let with_formula = found.iter().filter_map(Boundary::ratio);
    let worst = with_formula.clone().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
    let count = with_formula.count();
    let rows = found.iter().map(Boundary::row).collect();
    Section {
        key: "stability",
        title: "Stability maps".to_owned(),
        words: vec![
            "Every cell is a run of a net disturbed by a millionth of its spacing. Stable: the disturbance dies away. Limit \
             cycle: it grows, then stays, flipping its sign in every step; a check for numbers that are not finite would pass \
             it, and a hand would feel it as buzzing. Overflow: it grows without bound. Lines are the closed forms."
                .to_owned(),
            format!(
                "{count} boundaries were bisected by runs; the farthest from its formula is off by {:.2} %. K is the largest \
                 eigenvalue of the net's tangent stiffness, by Lanczos iteration.",
                worst * 100.0
            ),
            "With Table 2's drag and the masses of tissue, the printed explicit form needs steps of some ten microseconds; \
             implicit drag allows milliseconds. Verlet does not profit from drag. A servo node that is solved implicitly has no \
             boundary at all. An attachment projected in each step (β) never lowers the limit of the spring beside it."
                .to_owned(),
        ],
        figures: maps::figures(&nets, effort, progress),
        rows,
    }
}

impl Boundary {
    fn row(&self) -> crate::accuracy::section::Row {
        vec![
            ("topology", json!(self.topology)),
            ("integrator", json!(self.integrator)),
            ("at", json!(self.at)),
            ("quantity", json!(self.quantity)),
            ("boundary_measured", json!(self.measured)),
            ("boundary_formula", json!(self.formula)),
            ("ratio", json!(self.ratio())),
        ]
    }
}
