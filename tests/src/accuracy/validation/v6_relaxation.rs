//! V6: what is left of the tension of a held stitch after a minute.
//!
//! Sutures in tissue lose tension in three steps, the fast one within the first minute (BMC Surgery 2011, 11:36). A
//! network of linear springs with drag to ground has none: once the drag has let the tissue follow, the force stands. This
//! is measured, on the product's solver with the skin's Table 2 drag, and stated as a limit; no rule can be passed.

use super::{Finding, Outcome, Verdict};
use crate::accuracy::plot::{Axis, Level, Panel, Series, nth_style, panels_svg};
use crate::accuracy::section::{Effort, Figure};
use crate::generators::{on_rim, sheet, with_fixed};
use sim_core::scene::presets;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;

/// Nodes along a side of the sheet, odd; 2 mm apart.
const SIDE: usize = 15;
/// Solver period, seconds.
const PERIOD_S: f64 = 5e-3;
/// The pull, metres, and how long it takes, seconds.
const PULL: (f64, f64) = (0.003, 0.2);

/// Time and force of a point that is pulled and then held, seconds and newtons; `None` when the solver is refused.
#[must_use]
pub fn held_force(seconds: f64) -> Option<Vec<(f64, f64)>> {
    let middle = (SIDE * SIDE / 2) as u32;
    let skin = presets::SKIN;
    let network = sheet(SIDE, SIDE, 0.002, skin.stiffness_n_per_mm * 1e3, 8e-6, skin.drag_n_s_per_m);
    let network = with_fixed(network, |i| on_rim(i, SIDE, SIDE));
    let patch = [middle - SIDE as u32, middle - 1, middle, middle + 1, middle + SIDE as u32];
    let patches = PatchSet::new(network.node_count(), [(&patch[..], &[0.2; 5][..])]).ok()?;
    let mut solver = TissueSolver::new(network, patches, SolverParams::with_period(PERIOD_S)).ok()?;
    let hand = HandleSlot(0);
    solver.grasp(hand, PatchId(0)).ok()?;
    let start = solver.handle(hand)?.1;
    let mut force = Vec::new();
    for step in 1..=(seconds / PERIOD_S).round() as usize {
        let time_s = step as f64 * PERIOD_S;
        solver.lead(hand, start + Vec3::x() * (PULL.0 * (time_s / PULL.1).min(1.0)));
        solver.step(&mut Stages::default());
        force.push((time_s, solver.port(hand, &Stages::default())?.force_n.norm()));
    }
    Some(force)
}

pub(super) fn measure(_effort: Effort) -> Outcome {
    let Some(force) = held_force(60.0) else { return Outcome::default() };
    let at = |t: f64| force[((t / PERIOD_S).round() as usize - 1).min(force.len() - 1)].1;
    let row = |quantity: &str, figure: f64, verdict, reason: &str| Finding {
        case: "V6",
        quantity: quantity.to_owned(),
        figure,
        unit: "%",
        target: "fast loss within the first minute".to_owned(),
        rule: "none: stated as a limit",
        verdict,
        reason: reason.to_owned(),
    };
    let loss = |from: f64, to: f64| 100.0 * (1.0 - at(to) / at(from));
    let limit = "linear springs with drag to ground relax only while the tissue follows the pull; then the force stands for ever";
    let drag =
        "the drag of Table 2 lets go, within a second, of what the fast pull had built up: not a property of tissue";
    Outcome {
        findings: vec![
            row("loss of force, end of pull to 5 s", loss(PULL.1, 5.0), Verdict::Report, drag),
            row("loss of force, 5 s to 60 s", loss(5.0, 60.0), Verdict::Fail, limit),
        ],
        figures: vec![figure(&force)],
    }
}

fn figure(force: &[(f64, f64)]) -> Figure {
    // The curve is smooth: every twentieth of a second, then every second.
    let shown = force.iter().enumerate().filter(|(i, p)| if p.0 < 2.0 { i % 10 == 9 } else { i % 200 == 199 });
    let panel = Panel {
        title: "3 mm pull, then held".to_owned(),
        x: Axis::log("time (s)"),
        y: Axis::linear("force (N)"),
        series: vec![Series::new("held suture point", nth_style(0), shown.map(|(_, p)| *p).collect())],
        levels: vec![Level::X(PULL.1, "end of the pull".to_owned())],
    };
    Figure {
        name: "v6_relaxation".to_owned(),
        caption: "V6. Force on a held suture point over a minute: what the drag had built up goes in a second, the rest stands. \
                  Tissue goes on relaxing."
            .to_owned(),
        svg: panels_svg("Tension over a minute", &[panel], 1),
    }
}
