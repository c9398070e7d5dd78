//! The panels over the picture: columns left and right, a strip at the top, the tissue free in the middle.
//!
//! [`Overlay::take`] feeds the curves, [`Overlay::show`] lays everything out and says what was asked for by a button. It
//! knows no window and no GPU; `painter.rs` brings the result into a picture. A small picture gets fewer panels by itself.

mod answer;
mod banner;
mod curves;
#[cfg(test)]
pub(crate) mod example;
mod force;
mod gap;
mod health;
pub mod help;
pub mod history;
mod legend;
mod marks;
pub mod painter;
mod plot;
mod radar;
pub mod situation;
pub mod still;
mod style;
mod table;
mod timeline;
mod top;
pub mod wish;

use crate::feed::View;
use egui::{Align2, Area, Context, Id, Order, Rect, Ui, Vec2, vec2};
use history::History;
use situation::{Picture, Situation};
use wish::Wish;

/// Below this size a picture gets few panels, points.
const ROOMY: Vec2 = vec2(900.0, 560.0);
/// Below this size it gets the strip at the top only, points.
const TIGHT: Vec2 = vec2(600.0, 400.0);
/// Height of the strip at the top with its distance.
const TOP: f32 = 44.0;

/// Which panels are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Panels {
    /// Every one that fits.
    #[default]
    All,
    /// Strip, force, gap.
    Few,
    /// None but alarms and answers.
    None,
}

impl Panels {
    /// The next choice.
    #[must_use]
    pub fn next(self) -> Self {
        match self {
            Self::All => Self::Few,
            Self::Few => Self::None,
            Self::None => Self::All,
        }
    }
}

/// Whether the list of keys is open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Help {
    /// No.
    #[default]
    Closed,
    /// Yes.
    Open,
}

/// Curves, and which panels are shown.
pub struct Overlay {
    history: History,
    /// Which panels are shown.
    pub panels: Panels,
    /// Whether the list of keys is open.
    pub help: Help,
}

impl Overlay {
    /// For this context, which gets its look.
    #[must_use]
    pub fn new(context: &Context) -> Self {
        style::apply(context);
        Self { history: History::default(), panels: Panels::All, help: Help::Closed }
    }

    /// Takes a view into the curves; call it for every new view, drawn or not.
    pub fn take(&mut self, view: &View) {
        self.history.take(view);
    }

    /// Lays the panels out; says what was asked for.
    pub fn show(&mut self, ui: &mut Ui, view: &View, situation: &Situation<'_>) -> Vec<Wish> {
        let mut wishes = Vec::new();
        let context = ui.ctx().clone();
        let picture = context.viewport_rect();
        marks::paint(ui.painter(), picture, view, situation);
        let fits = |least: Vec2| picture.width() >= least.x && picture.height() >= least.y;
        let panels = match self.panels {
            // Two pictures for two eyes have no common place for a panel.
            _ if situation.projection.is_none() => Panels::None,
            Panels::All if !fits(ROOMY) => Panels::Few,
            chosen => chosen,
        };
        if panels != Panels::None {
            at(&context, "top", Align2::LEFT_TOP, vec2(style::GAP, style::GAP), |ui| {
                style::panel().show(ui, |ui| {
                    ui.set_width(picture.width() - 2.0 * style::GAP - 18.0);
                    top::show(ui, view, situation);
                });
            });
            if fits(TIGHT) {
                self.left_column(&context, view, situation, panels);
            }
        }
        if panels == Panels::All {
            right_column(&context, view, situation, &mut wishes);
        }
        self.fringe(&context, picture, view, situation, &mut wishes);
        wishes
    }

    fn left_column(&self, context: &Context, view: &View, situation: &Situation<'_>, panels: Panels) {
        at(context, "left", Align2::LEFT_TOP, vec2(style::GAP, TOP), |ui| {
            boxed(ui, |ui| force::show(ui, view, situation, &self.history));
            boxed(ui, |ui| gap::show(ui, view, &self.history));
            if panels == Panels::All {
                boxed(ui, |ui| health::show(ui, view, &self.history, situation.link));
            }
            if let Some(legend) = situation.legend {
                boxed(ui, |ui| legend::show(ui, legend));
            }
        });
    }

    /// What is not in a column: alarm, list of keys, answer, time line.
    fn fringe(&self, context: &Context, picture: Rect, view: &View, situation: &Situation<'_>, wishes: &mut Vec<Wish>) {
        if let Some(alarm) = banner::alarm(view, situation) {
            at(context, "banner", Align2::CENTER_TOP, vec2(0.0, TOP + 8.0), |ui| banner::show(ui, &alarm, wishes));
        }
        let mut bottom = style::GAP;
        if let Some(line) = &situation.time_line {
            at(context, "time-line", Align2::CENTER_BOTTOM, vec2(0.0, -bottom), |ui| {
                style::panel().show(ui, |ui| {
                    ui.set_width((0.55 * picture.width()).max(340.0).min(picture.width() - 40.0));
                    timeline::show(ui, line, wishes);
                });
            });
            bottom += 44.0;
        }
        if let Some(notice) = situation.notice {
            at(context, "answer", Align2::CENTER_BOTTOM, vec2(0.0, -bottom), |ui| answer::show(ui, notice));
        }
        if self.help == Help::Open {
            at(context, "help", Align2::CENTER_CENTER, Vec2::ZERO, help::show);
        }
    }
}

fn right_column(context: &Context, view: &View, situation: &Situation<'_>, wishes: &mut Vec<Wish>) {
    at(context, "right", Align2::RIGHT_TOP, vec2(-style::GAP, TOP), |ui| {
        boxed(ui, |ui| table::show(ui, view));
        if view.report.as_ref().is_some_and(|report| table::rows(report).next().is_some()) {
            boxed(ui, |ui| radar::show(ui, view));
        }
        if !situation.samples.all().is_empty() {
            boxed(ui, |ui| curves::show(ui, situation.samples, wishes));
        }
        if situation.picture == Picture::Running && situation.time_line.is_none() {
            boxed(ui, |ui| {
                ui.label(egui::RichText::new("H: list of keys").size(style::SMALL).color(style::WEAK));
            });
        }
    });
}

/// An area that stays where it is put.
fn at(context: &Context, name: &str, anchor: Align2, offset: Vec2, add: impl FnOnce(&mut Ui)) {
    let area = Area::new(Id::unique(name)).anchor(anchor, offset).order(Order::Middle).fade_in(false).movable(false);
    area.show(context, add);
}

/// A panel of a column.
fn boxed(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    style::panel().show(ui, |ui| {
        ui.set_width(style::COLUMN - 18.0);
        add(ui);
    });
    ui.add_space(style::GAP - 3.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::samples::Samples;
    use egui::{Pos2, RawInput, Shape};
    use situation::Link;

    /// All text that is painted for a picture of this size.
    fn text_of(size: Vec2, change: impl Fn(&mut Overlay, &mut View)) -> String {
        let context = Context::default();
        let mut overlay = Overlay::new(&context);
        let mut view = example::view();
        change(&mut overlay, &mut view);
        let (camera, samples) = (Camera::default(), Samples::default());
        let situation = Situation::seen_by(&camera, size.x / size.y, Link::Live(3_000_000), &samples);
        let mut text = String::new();
        for _ in 0..3 {
            overlay.take(&view);
            let input = RawInput { screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)), ..RawInput::default() };
            let output = context.run_ui(input, |ui| {
                overlay.show(ui, &view, &situation);
            });
            text.clear();
            for clipped in &output.shapes {
                collect(&clipped.shape, &mut text);
            }
            output.drop_without_applying_deltas();
        }
        text
    }

    fn collect(shape: &Shape, text: &mut String) {
        match shape {
            Shape::Text(part) => {
                text.push_str(part.galley.text());
                text.push('\n');
            }
            Shape::Vec(parts) => parts.iter().for_each(|part| collect(part, text)),
            _ => {}
        }
    }

    #[test]
    fn every_panel_of_a_roomy_picture_says_its_piece() {
        let text = text_of(vec2(1280.0, 720.0), |_, _| {});
        let expected = [
            "Skin",
            "scene 1 of 3",
            "pull the line",
            "live, 3 ms old",
            "0.50 N",
            "Gap of pair 4",
            "9.80 mm",
            "closed 1.30",
            "active",
        ];
        for piece in expected.into_iter().chain(["Table 1", "1.32", "6.0", "Fig. 8", "control on", "4.0 ms, affine"]) {
            assert!(text.contains(piece), "{piece:?} is missing in\n{text}");
        }
        assert!(!text.contains("Fault"));
    }

    #[test]
    fn a_small_picture_gets_few_panels_and_alarms_are_always_seen() {
        let fault = |overlay: &mut Overlay, view: &mut View| {
            overlay.panels = Panels::None;
            if let Some(servo) = &mut view.servo {
                (servo.mode, servo.fault) = (5, 1);
            }
        };
        let small = text_of(vec2(640.0, 400.0), |_, _| {});
        assert!(small.contains("Force at the hand") && !small.contains("Table 1"), "{small}");
        let tiny = text_of(vec2(480.0, 360.0), |_, _| {});
        assert!(tiny.contains("pull the line") && !tiny.contains("Force at the hand"), "{tiny}");
        let alarm = text_of(vec2(640.0, 400.0), fault);
        assert!(alarm.contains("the haptic device is gone") && !alarm.contains("Gap"), "{alarm}");
    }

    #[test]
    fn help_lists_every_key() {
        let text = text_of(vec2(1280.0, 900.0), |overlay, _| overlay.help = Help::Open);
        for (group, keys) in help::KEYS {
            assert!(text.contains(group));
            for (key, what) in keys {
                assert!(text.contains(key) && text.contains(what), "{key}: {what} is missing");
            }
        }
    }
}
