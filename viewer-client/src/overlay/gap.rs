//! Distance of the pair at work over time: it sinks while the line is pulled, and stands when the stitch is tied.

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
    match history::gap(view) {
        Some(gap) => {
            let title = format!("Gap of pair {}", gap.pair + 1);
            style::title(ui, &title, &format!("{:.2} mm", gap.distance_m * MM), style::RED);
        }
        None => style::title(ui, "Gap", "no pair at work", style::WEAK),
    }
    plot::over_time(ui, HEIGHT, &history.gap, MM, LEAST_MM, style::RED);
}
