//! The time line of a recording: play, pause, a picture back and on, speed, and a bar to drag.

use super::situation::TimeLine;
use super::style;
use super::wish::{PlayWish, Wish};
use egui::{RichText, Slider, SliderClamping, Ui};

pub(super) fn show(ui: &mut Ui, line: &TimeLine, wishes: &mut Vec<Wish>) {
    ui.horizontal(|ui| {
        let mut button = |text: &str, wish: PlayWish| {
            if ui.button(RichText::new(text)).clicked() {
                wishes.push(Wish::Play(wish));
            }
        };
        button("back", PlayWish::Back);
        button(if line.playing { "pause" } else { "play" }, PlayWish::Toggle);
        button("on", PlayWish::Forward);
        button("slower", PlayWish::Slower);
        button("faster", PlayWish::Faster);
        ui.label(RichText::new(format!("{} ×", speed(line.speed))).size(style::SMALL));
        ui.label(RichText::new(format!("{} / {}", clock(line.at_s), clock(line.duration_s))).size(style::SMALL));
        ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(60.0);
        let mut at_s = line.at_s;
        let bar = Slider::new(&mut at_s, 0.0..=line.duration_s.max(1e-3)).show_value(false);
        if ui.add(bar.clamping(SliderClamping::Always).trailing_fill(true)).changed() {
            wishes.push(Wish::Play(PlayWish::Seek(at_s)));
        }
    });
}

fn clock(seconds: f64) -> String {
    let hundredths = (100.0 * seconds.max(0.0)).round() as u64;
    format!("{}:{:02}.{:02}", hundredths / 6000, hundredths / 100 % 60, hundredths % 100)
}

fn speed(factor: f64) -> String {
    if factor >= 1.0 { format!("{factor:.0}") } else { format!("1/{:.0}", 1.0 / factor) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_speeds_read_well() {
        assert_eq!(clock(0.0), "0:00.00");
        assert_eq!(clock(75.239), "1:15.24");
        assert_eq!(clock(59.999), "1:00.00");
        assert_eq!((speed(2.0), speed(0.25)), ("2".to_owned(), "1/4".to_owned()));
    }
}
