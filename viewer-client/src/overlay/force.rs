//! Force at the hand: its size, its direction as the camera sees it, its components, and the last seconds of it.

use super::history::{History, norm};
use super::situation::Situation;
use super::{plot, style};
use crate::feed::View;
use egui::{Align2, Sense, Stroke, Ui, Vec2, vec2};

/// Radius of the dial, points.
const DIAL: f32 = 27.0;
/// Force that fills the dial, newtons: what an Omni can give.
const FULL_N: f64 = 3.3;
/// Height of the curve, points.
const HEIGHT: f32 = 64.0;
/// A plot shows at least this much, newtons.
const LEAST_N: f64 = 0.2;

pub(super) fn show(ui: &mut Ui, view: &View, situation: &Situation<'_>, history: &History) {
    // The device that is pushed back hardest speaks for the hand.
    let device =
        view.servo.iter().flat_map(|s| &s.devices).max_by(|a, b| norm(&a.force_n).total_cmp(&norm(&b.force_n)));
    let Some(device) = device else {
        style::title(ui, "Force", "no servo yet", style::WEAK);
        return;
    };
    let size = norm(&device.force_n);
    let clipped = norm(&device.unclipped_force_n) > size + 0.01 && view.servo.as_ref().is_some_and(|s| s.mode == 4);
    let colour = if clipped { style::WATCH } else { style::BLUE };
    style::title(ui, "Force at the hand", &format!("{size:.2} N"), colour);
    ui.horizontal(|ui| {
        dial(ui, seen(&device.force_n, &situation.axes), size);
        ui.vertical(|ui| {
            ui.set_width(ui.available_width());
            for (name, value) in ["x", "y", "z"].iter().zip(device.force_n) {
                style::row(ui, name, &format!("{value:+.3} N"), style::TEXT);
            }
            if clipped {
                let wanted = norm(&device.unclipped_force_n);
                style::row(ui, "limited from", &format!("{wanted:.2} N"), style::WATCH);
            } else {
                let peak = history.force.range().map_or(0.0, |r| r[1]);
                style::row(ui, "peak shown", &format!("{peak:.2} N"), style::WEAK);
            }
        });
    });
    plot::over_time(ui, HEIGHT, &history.force, 1.0, LEAST_N, style::BLUE);
}

/// Along the camera's right, up and forward.
fn seen(force_n: &[f64; 3], axes: &[[f32; 3]; 3]) -> [f64; 3] {
    axes.map(|axis| (0..3).map(|k| f64::from(axis[k]) * force_n[k]).sum())
}

fn dial(ui: &mut Ui, seen_n: [f64; 3], size: f64) {
    let (response, painter) = ui.allocate_painter(Vec2::splat(2.0 * DIAL + 4.0), Sense::hover());
    let centre = response.rect.center();
    painter.circle(centre, DIAL, style::PLOT, Stroke::new(1.0, style::GRID));
    painter.circle_stroke(centre, DIAL / 2.0, Stroke::new(1.0, style::GRID));
    let scale = DIAL / FULL_N as f32;
    let mut arrow = vec2(seen_n[0] as f32, -seen_n[1] as f32) * scale;
    if arrow.length() > DIAL {
        arrow *= DIAL / arrow.length();
    }
    if arrow.length() > 2.0 {
        painter.arrow(centre, arrow, Stroke::new(2.0, style::BLUE));
    }
    // Towards the camera a dot, away from it a ring, as on paper.
    if size > 0.02 {
        let depth = (seen_n[2].abs() as f32 * scale).clamp(0.0, 6.0);
        if seen_n[2] < 0.0 {
            painter.circle_filled(centre, depth.max(1.5), style::BLUE);
        } else {
            painter.circle_stroke(centre, depth.max(1.5), Stroke::new(1.2, style::BLUE));
        }
    }
    painter.text(
        centre + vec2(0.0, DIAL - 1.0),
        Align2::CENTER_BOTTOM,
        "3.3 N",
        egui::FontId::proportional(8.5),
        style::WEAK,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dial_sees_the_force_along_the_camera() {
        let axes = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        assert_eq!(seen(&[1.0, 2.0, 3.0], &axes), [2.0, 3.0, 1.0]);
    }
}
