//! Distance of the pair at work over time, and the distance at which it counts as closed: it sinks while the line is pulled, and stands when the stitch is tied.

use super::history::{self, History};
use super::{plot, style};
use crate::feed::View;
use egui::Ui;

/// Height of the curve, points.
const HEIGHT: f32 = 64.0;
/// A plot shows at least this much, millimetres.
const LEAST_MM: f64 = 2.0;
/// Millimetres in a metre.
const MM: f64 = 1e3;

pub(super) fn show(ui: &mut Ui, view: &View, history: &History) {
    let gap = history::gap(view);
    match &gap {
        Some(gap) => {
            let title = format!("Gap of pair {}", gap.pair + 1);
            style::title(ui, &title, &format!("{:.2} mm", gap.distance_m * MM), style::RED);
        }
        None => style::title(ui, "Gap", "no pair at work", style::WEAK),
    }
    let closed_mm = gap.map(|gap| gap.closed_m * MM);
    let least_mm = LEAST_MM.max(1.2 * closed_mm.unwrap_or(0.0));
    let plot = plot::over_time(ui, HEIGHT, &history.gap, MM, least_mm, style::RED);
    if let Some(closed_mm) = closed_mm {
        plot.level(closed_mm, &format!("closed {closed_mm:.2}"), style::GOOD);
    }
}
