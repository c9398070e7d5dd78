//! What the colours of the tissue mean now: a ramp from zero to the largest value, with its unit.

use super::style;
use crate::colour::{ColourBy, Legend, ramp};
use egui::{Align2, Color32, Rect, RichText, Sense, Ui, pos2, vec2};

/// Stripes of the ramp.
const STRIPES: usize = 32;
/// Size of the ramp, points.
const SIZE: egui::Vec2 = vec2(170.0, 10.0);

pub(super) fn show(ui: &mut Ui, legend: Legend) {
    ui.label(RichText::new(format!("Colour: {}", legend.colour.name())).size(style::SMALL));
    if legend.colour == ColourBy::Tissue {
        return;
    }
    let (response, painter) = ui.allocate_painter(SIZE + vec2(0.0, 14.0), Sense::hover());
    let left = response.rect.left_top();
    let width = SIZE.x / STRIPES as f32;
    for stripe in 0..STRIPES {
        let colour = ramp(stripe as f32 / (STRIPES - 1) as f32).map(|c| (255.0 * c).round() as u8);
        let at = pos2(left.x + stripe as f32 * width, left.y);
        let rect = Rect::from_min_size(at, vec2(width + 0.5, SIZE.y));
        painter.rect_filled(rect, 0.0, Color32::from_rgb(colour[0], colour[1], colour[2]));
    }
    let (low, high) = ends(legend);
    let below = left + vec2(0.0, SIZE.y + 2.0);
    painter.text(below, Align2::LEFT_TOP, low, style::small(), style::WEAK);
    painter.text(below + vec2(SIZE.x, 0.0), Align2::RIGHT_TOP, high, style::small(), style::WEAK);
}

fn ends(legend: Legend) -> (String, String) {
    if legend.colour == ColourBy::Awake {
        return ("asleep".to_owned(), "awake".to_owned());
    }
    let decimals = if legend.end >= 10.0 { 0 } else { 2 };
    let unit = legend.colour.unit();
    (format!("0 {unit}"), format!("{:.decimals$} {unit}", legend.end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_carry_the_unit() {
        assert_eq!(ends(Legend { colour: ColourBy::Strain, end: 12.4 }).1, "12 %");
        assert_eq!(ends(Legend { colour: ColourBy::Force, end: 0.25 }).1, "0.25 N");
        assert_eq!(ends(Legend { colour: ColourBy::Awake, end: 1.0 }).1, "awake");
    }
}
