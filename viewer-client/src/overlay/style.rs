//! Colours, sizes and frames of the panels: dark, translucent, one size of text, colour only where it says something.

use egui::{Color32, Context, CornerRadius, FontFamily, FontId, Frame, Margin, RichText, Stroke, TextStyle, Ui};

/// Behind a panel.
pub(super) const PANEL: Color32 = Color32::from_rgba_unmultiplied_const(16, 20, 26, 205);
/// Behind a plot.
pub(super) const PLOT: Color32 = Color32::from_rgba_unmultiplied_const(255, 255, 255, 8);
/// Lines of a grid.
pub(super) const GRID: Color32 = Color32::from_rgba_unmultiplied_const(255, 255, 255, 26);
/// Text.
pub(super) const TEXT: Color32 = Color32::from_rgb(226, 230, 235);
/// Text of second rank.
pub(super) const WEAK: Color32 = Color32::from_rgb(150, 160, 172);
/// Fine.
pub(super) const GOOD: Color32 = Color32::from_rgb(110, 200, 140);
/// To be watched.
pub(super) const WATCH: Color32 = Color32::from_rgb(240, 190, 90);
/// Wrong.
pub(super) const BAD: Color32 = Color32::from_rgb(240, 96, 88);
/// Force, and the current distance `D_c` (blue in Zhang et al., Fig. 8).
pub(super) const BLUE: Color32 = Color32::from_rgb(98, 170, 245);
/// Gap, and the original distance `D_o` (red in Zhang et al., Fig. 8).
pub(super) const RED: Color32 = Color32::from_rgb(235, 120, 105);
/// Colours of sample points, in the order of picking.
pub(super) const SAMPLES: [Color32; 4] = [
    Color32::from_rgb(255, 200, 87),
    Color32::from_rgb(120, 220, 190),
    Color32::from_rgb(205, 150, 250),
    Color32::from_rgb(150, 205, 110),
];
/// Width of a column of panels, points.
pub(super) const COLUMN: f32 = 226.0;
/// From the rim of the picture, and between panels.
pub(super) const GAP: f32 = 8.0;
/// Small text.
pub(super) const SMALL: f32 = 10.5;

/// The whole look, once per context.
pub(super) fn apply(ctx: &Context) {
    ctx.global_style_mut(|style| {
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles.insert(TextStyle::Body, font(12.0));
        style.text_styles.insert(TextStyle::Button, font(11.5));
        style.text_styles.insert(TextStyle::Small, font(SMALL));
        style.visuals.override_text_color = Some(TEXT);
        style.spacing.item_spacing = egui::vec2(6.0, 2.0);
        style.spacing.button_padding = egui::vec2(6.0, 2.0);
        style.spacing.interact_size.y = 15.0;
        style.interaction.selectable_labels = false;
        // Fading and sliding would keep a picture moving in which nothing happens.
        style.animation_time = 0.0;
    });
}

/// Frame of a panel.
pub(super) fn panel() -> Frame {
    Frame::new().fill(PANEL).corner_radius(CornerRadius::same(5)).inner_margin(Margin::symmetric(9, 7))
}

/// Frame of something that must be seen.
pub(super) fn alarm(colour: Color32) -> Frame {
    panel().fill(Color32::from_rgb(70, 16, 16)).stroke(Stroke::new(1.5, colour)).inner_margin(Margin::symmetric(14, 10))
}

/// Small font for the numbers in plots.
pub(super) fn small() -> FontId {
    FontId::new(SMALL, FontFamily::Proportional)
}

/// Title on the left, the number that matters on the right.
pub(super) fn title(ui: &mut Ui, text: &str, value: &str, colour: Color32) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(text).color(WEAK));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new(value).color(colour).strong());
        });
    });
}

/// Name on the left, value on the right, small.
pub(super) fn row(ui: &mut Ui, name: &str, value: &str, colour: Color32) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(name).color(WEAK).size(SMALL));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new(value).color(colour).size(SMALL));
        });
    });
}
