//! What is painted into the scene itself: a number at each sample point, and the tip of the stylus while the mouse is the hand.

use super::history::norm;
use super::situation::{HandMode, Situation};
use super::style;
use crate::feed::View;
use egui::{Align2, Color32, Painter, Pos2, Rect, Stroke, vec2};

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
        painter.circle_filled(at + vec2(11.0, -11.0), 7.0, Color32::from_black_alpha(170));
        painter.text(at + vec2(11.0, -11.0), Align2::CENTER_CENTER, index + 1, style::small(), colour);
    }
    if let (HandMode::Hand, Some(servo)) = (situation.hand, &view.servo) {
        let tip_m = servo.devices[0].position_m;
        if let Some(at) = place(tip_m.map(|c| c as f32)) {
            cross(painter, at, nearest_point_m(view, tip_m));
        }
    }
}

/// Where the tip of the stylus is, which the tool hides, and how far the next suture point is from it.
fn cross(painter: &Painter, at: Pos2, away_m: Option<f64>) {
    for (width, colour) in [(3.5, Color32::from_black_alpha(150)), (1.5, Color32::WHITE)] {
        for (near, far) in [(vec2(4.0, 0.0), vec2(12.0, 0.0)), (vec2(0.0, 4.0), vec2(0.0, 12.0))] {
            painter.line_segment([at + near, at + far], Stroke::new(width, colour));
            painter.line_segment([at - near, at - far], Stroke::new(width, colour));
        }
    }
    if let Some(away_m) = away_m {
        let text = format!("{:.1} mm to a suture point", 1e3 * away_m);
        let galley = painter.layout_no_wrap(text, style::small(), style::TEXT);
        let corner = at + vec2(16.0, 12.0);
        painter.rect_filled(Rect::from_min_size(corner, galley.size()).expand2(vec2(4.0, 2.0)), 3.0, style::PANEL);
        painter.galley(corner, galley, style::TEXT);
    }
}

/// From the stylus to the nearest suture point.
fn nearest_point_m(view: &View, tip_m: [f64; 3]) -> Option<f64> {
    let pairs = view.outline_of_frame()?.pairs;
    let places = pairs.iter().filter_map(|node| view.frame.elements.get(*node as usize)).map(|n| n.position_m);
    places.map(|p| norm(&[0, 1, 2].map(|k| f64::from(p[k]) - tip_m[k]))).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::example;

    #[test]
    fn the_nearest_suture_point_is_that_of_the_frame() {
        let view = example::view();
        // The example's points lie at x = ±5 mm, y = 0, 10, 20, 30 mm.
        let away = nearest_point_m(&view, [0.006, 0.011, 0.0]).expect("points");
        assert!((away - 0.001 * 2.0_f64.sqrt()).abs() < 1e-7, "{away}");
        assert_eq!(nearest_point_m(&View::default(), [0.0; 3]), None);
    }
}
