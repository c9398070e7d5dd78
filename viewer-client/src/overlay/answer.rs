//! The last sentence: what became of a command, where a file went.

use super::style;
use crate::notice::{Notice, Tone};
use egui::{RichText, Ui};

pub(super) fn show(ui: &mut Ui, notice: &Notice) {
    let colour = match notice.tone {
        Tone::Note => style::TEXT,
        Tone::Good => style::GOOD,
        Tone::Bad => style::BAD,
    };
    style::panel().show(ui, |ui| {
        ui.set_max_width(520.0);
        ui.label(RichText::new(&notice.text).color(colour));
    });
}
