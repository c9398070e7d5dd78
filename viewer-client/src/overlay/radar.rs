//! Radar chart of the stitches (Zhang et al., Fig. 8): one axis per stitch, red the original distance `D_o`, blue the current
//! distance `D_c`, dashed where Algorithm 2 begins to act: at `D_o + 0.1 · max(D_o, D_floor)` with control on, on both sides of
//! `D_o` as printed in the paper, nowhere with control off or where the server has not told `D_floor`.
//!
//! The rim is a tenth beyond the largest distance. One or two stitches make no polygon: they are drawn as points on their axes.

use super::style;
use super::table::{BAND, rows};
use crate::feed::View;
use egui::{Align2, Color32, Painter, Pos2, Sense, Shape, Stroke, Ui, vec2};
use protocol::wound_report::{LedgerRow, WoundReport};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Height of the chart, points.
const HEIGHT: f32 = 168.0;
/// Room for the labels at the rim.
const LABELS: f32 = 18.0;

/// Where points of the chart lie.
struct Chart {
    centre: Pos2,
    radius: f32,
    axes: usize,
    rim_m: f64,
}

impl Chart {
    fn at(&self, axis: usize, distance_m: f64) -> Pos2 {
        let angle = TAU * axis as f32 / self.axes as f32 - FRAC_PI_2;
        let r = self.radius * (distance_m / self.rim_m).clamp(0.0, 1.3) as f32;
        self.centre + vec2(r * angle.cos(), r * angle.sin())
    }

    fn ring(&self, distances_m: impl Iterator<Item = f64>) -> Vec<Pos2> {
        distances_m.enumerate().map(|(axis, d)| self.at(axis, d)).collect()
    }
}

/// On which sides of `D_o` the control of this report begins to act, as signs.
fn sides(report: &WoundReport) -> &'static [f64] {
    match report.control {
        1 if report.distance_floor_m > 0.0 => &[1.0],
        2 if report.distance_floor_m > 0.0 => &[1.0, -1.0],
        _ => &[],
    }
}

/// The distance of a stitch at which the control begins to act on this side, metres.
fn limit_m(report: &WoundReport, row: &LedgerRow, side: f64) -> f64 {
    let original_m = row.original_distance_m;
    (original_m + side * BAND * original_m.max(report.distance_floor_m)).max(0.0)
}

pub(super) fn show(ui: &mut Ui, view: &View) {
    let Some(report) = &view.report else { return };
    let count = rows(report).count();
    if count == 0 {
        return;
    }
    style::title(ui, "Distances (Fig. 8)", "", style::TEXT);
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let own = rows(report).map(|r| r.original_distance_m.max(r.current_distance_m));
    let outer = sides(report).iter().flat_map(|side| rows(report).map(move |r| limit_m(report, r, *side)));
    let largest = own.chain(outer).fold(1e-6, f64::max);
    let radius = response.rect.height().min(response.rect.width()) / 2.0 - LABELS;
    let chart = Chart { centre: response.rect.center(), radius, axes: count, rim_m: 1.1 * largest };
    for (axis, row) in rows(report).enumerate() {
        painter.line_segment([chart.centre, chart.at(axis, chart.rim_m)], Stroke::new(1.0, style::GRID));
        let label = chart.at(axis, 1.14 * chart.rim_m);
        painter.text(label, Align2::CENTER_CENTER, row.pair + 1, style::small(), style::WEAK);
    }
    for part in [0.5, 1.0] {
        painter.circle_stroke(chart.centre, chart.radius * part, Stroke::new(1.0, style::GRID));
    }
    for side in sides(report) {
        let mut band = chart.ring(rows(report).map(|r| limit_m(report, r, *side)));
        band.extend(band.first().copied());
        painter.extend(Shape::dashed_line(&band, Stroke::new(1.0, style::RED.gamma_multiply(0.6)), 2.0, 3.0));
    }
    distances(&painter, chart.ring(rows(report).map(|r| r.original_distance_m)), style::RED);
    distances(&painter, chart.ring(rows(report).map(|r| r.current_distance_m)), style::BLUE);
    legend(&painter, response.rect.left_bottom(), &format!("rim {:.1} mm", 1e3 * chart.rim_m));
}

fn distances(painter: &Painter, points: Vec<Pos2>, colour: Color32) {
    for point in &points {
        painter.circle_filled(*point, 2.5, colour);
    }
    if points.len() > 2 {
        painter.add(Shape::closed_line(points, Stroke::new(1.5, colour)));
    }
}

fn legend(painter: &Painter, corner: Pos2, rim: &str) {
    for (row, (text, colour)) in [(rim, style::WEAK), ("D_c", style::BLUE), ("D_o", style::RED)].into_iter().enumerate()
    {
        let at = corner + vec2(0.0, -12.0 * row as f32);
        painter.text(at, Align2::LEFT_BOTTOM, text, style::small(), colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fig8_the_first_axis_points_up_and_the_rim_is_the_radius() {
        let chart = Chart { centre: egui::pos2(10.0, 20.0), radius: 8.0, axes: 4, rim_m: 0.004 };
        let near = |a: Pos2, b: Pos2| a.distance(b) < 1e-4;
        assert!(near(chart.at(0, 0.004), egui::pos2(10.0, 12.0)));
        assert!(near(chart.at(1, 0.002), egui::pos2(14.0, 20.0)));
        assert_eq!(chart.ring([0.001, 0.002, 0.003, 0.004].into_iter()).len(), 4);
    }

    #[test]
    fn algorithm2_the_dashed_line_is_where_the_control_begins_to_act() {
        let mut report = crate::overlay::example::view().report.expect("a report");
        let limits = |report: &WoundReport| -> Vec<f64> {
            let row = &report.rows[0];
            // Nanometres.
            sides(report).iter().map(|side| (limit_m(report, row, *side) * 1e9).round()).collect()
        };
        // D_o = 1.2 mm lies under the floor of 2 mm.
        assert_eq!(limits(&report), [1_400_000.0]);
        report.control = 2;
        assert_eq!(limits(&report), [1_400_000.0, 1_000_000.0]);
        report.rows[0].original_distance_m = 0.004;
        assert_eq!(limits(&report), [4_400_000.0, 3_600_000.0]);
        report.control = 0;
        assert!(limits(&report).is_empty());
        (report.control, report.distance_floor_m) = (1, 0.0);
        assert!(limits(&report).is_empty());
    }
}
