//! What is painted into the scene itself: a number at each sample point, and the force as an arrow at the stylus.

use super::history::norm;
use super::situation::Situation;
use super::style;
use crate::feed::View;
use egui::{Align2, Color32, Painter, Pos2, Rect, Stroke, vec2};

/// Length of the arrow, metres of the scene per newton.
const LENGTH_M_PER_N: f64 = 0.008;
/// A smaller force has no arrow, newtons.
const LEAST_N: f64 = 0.03;

pub(super) fn paint(painter: &Painter, picture: Rect, view: &View, situation: &Situation<'_>) {
    let place = |at_m: [f32; 3]| -> Option<Pos2> {
        let [x, y] = situation.on_picture(at_m)?;
        Some(picture.lerp_inside(vec2(x, y)))
    };
    for (index, (sample, colour)) in situation.samples.all().iter().zip(style::SAMPLES).enumerate() {
        let node = view.frame.elements.get(sample.node() as usize);
        let Some(at) = node.and_then(|n| place(n.position_m)) else { continue };
        painter.circle_stroke(at, 5.0, Stroke::new(3.0, Color32::from_black_alpha(140)));
        painter.circle_stroke(at, 5.0, Stroke::new(1.6, colour));
        painter.text(at + vec2(8.0, -6.0), Align2::LEFT_BOTTOM, index + 1, style::small(), colour);
    }
    for device in view.servo.iter().flat_map(|s| &s.devices).filter(|d| d.present != 0) {
        if norm(&device.force_n) < LEAST_N {
            continue;
        }
        let tip = [0, 1, 2].map(|k| (device.position_m[k] + LENGTH_M_PER_N * device.force_n[k]) as f32);
        if let (Some(from), Some(to)) = (place(device.position_m.map(|c| c as f32)), place(tip)) {
            painter.arrow(from, to - from, Stroke::new(3.5, Color32::from_black_alpha(120)));
            painter.arrow(from, to - from, Stroke::new(2.0, style::BLUE));
        }
    }
}
