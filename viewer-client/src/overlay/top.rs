//! The strip at the top: which scene of the procedure, how many stitches, what to do next, and how the connection is.

use super::situation::{FrameTime, HandMode, Link, Picture, Situation};
use super::style;
use super::table;
use crate::feed::View;
use egui::{Align, Color32, Layout, RichText, Sense, Ui, vec2};
use protocol::words;

/// Height of a dot of progress.
const DOT: f32 = 9.0;
/// Pairs that are drawn as dots; more are a number.
const DOTS: u32 = 16;

pub(super) fn show(ui: &mut Ui, view: &View, situation: &Situation<'_>) {
    ui.horizontal(|ui| {
        progress(ui, view);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let (text, colour) = connection(situation.link);
            ui.label(RichText::new(text).color(colour).size(style::SMALL));
            if let Some(times) = situation.frame_time {
                ui.label(RichText::new(pace(&times)).color(style::WEAK).size(style::SMALL));
            }
            if situation.picture == Picture::Paused {
                ui.label(RichText::new("picture held (Space)").color(style::WATCH));
            }
            if let Some(text) = mouse(situation.hand) {
                ui.label(RichText::new(text).color(style::WATCH));
            }
        });
    });
}

/// How often, and for how long the processor works for a picture: what a graphics card then does is not in it.
fn pace(times: &FrameTime) -> String {
    format!("{:.0} pictures/s, CPU {:.1} ms (1 in 100: {:.1})", times.per_second, times.work_p50_ms, times.work_p99_ms)
}

/// What the mouse is, where the server would take it for the hand.
fn mouse(hand: HandMode) -> Option<&'static str> {
    match hand {
        HandMode::NoPointer => None,
        HandMode::Idle => Some("press M to be the hand"),
        HandMode::Hand => Some("mouse is the hand (M)"),
    }
}

fn progress(ui: &mut Ui, view: &View) {
    let Some(report) = &view.report else {
        ui.label(RichText::new("waiting for the solver").color(style::WEAK));
        return;
    };
    let scene = words::scene(report.scene_kind);
    ui.label(RichText::new(capital(scene)).strong());
    if report.scene_count > 1 {
        let place = format!("scene {} of {}", report.scene_index + 1, report.scene_count);
        ui.label(RichText::new(place).color(style::WEAK).size(style::SMALL));
    }
    let pairs = view.outline_of_frame().map_or(0, |parts| (parts.pairs.len() / 2) as u32);
    if (1..=DOTS).contains(&pairs) {
        let tied = |pair| table::rows(report).any(|row| row.pair == pair);
        dots(ui, pairs, tied);
    } else {
        let count = format!("{} of {pairs} stitches", table::rows(report).count());
        ui.label(RichText::new(count).size(style::SMALL));
    }
    let done = report.stage == 5;
    ui.label(RichText::new(words::stage(report.stage)).color(if done { style::GOOD } else { style::TEXT }));
}

/// One dot per pair, full when it is tied.
fn dots(ui: &mut Ui, pairs: u32, tied: impl Fn(u32) -> bool) {
    let (response, painter) = ui.allocate_painter(vec2(pairs as f32 * (DOT + 2.0), DOT), Sense::hover());
    for pair in 0..pairs {
        let centre = response.rect.left_center() + vec2((pair as f32 + 0.5) * (DOT + 2.0), 0.0);
        if tied(pair) {
            painter.circle_filled(centre, DOT / 2.0 - 0.5, style::GOOD);
        } else {
            painter.circle_stroke(centre, DOT / 2.0 - 1.0, (1.2, style::WEAK));
        }
    }
}

fn connection(link: Link) -> (String, Color32) {
    match link {
        Link::Waiting => ("waiting for the server".to_owned(), style::WATCH),
        Link::Live(age_ns) => (format!("live, {:.0} ms old", age_ns as f64 * 1e-6), style::GOOD),
        Link::Gone => ("server gone".to_owned(), style::BAD),
        Link::Recorded => ("recording".to_owned(), style::TEXT),
    }
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_connection_is_told_in_words() {
        assert_eq!(connection(Link::Live(4_600_000)).0, "live, 5 ms old");
        assert_eq!(connection(Link::Gone).1, style::BAD);
        let times = FrameTime { work_p50_ms: 1.25, work_p99_ms: 4.0, per_second: 60.0 };
        assert_eq!(pace(&times), "60 pictures/s, CPU 1.2 ms (1 in 100: 4.0)");
        assert_eq!(capital("vessel"), "Vessel");
        assert!(mouse(HandMode::NoPointer).is_none() && mouse(HandMode::Idle).is_some_and(|text| text.contains('M')));
    }
}
