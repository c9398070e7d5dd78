//! The list of keys; the same list is in the viewer's page of the documentation.

use super::style;
use egui::{Grid, RichText, Ui};

/// What the mouse and the keys do, in groups.
pub const KEYS: [(&str, &[(&str, &str)]); 5] = [
    (
        "Look",
        &[
            ("left drag", "orbit"),
            ("middle drag, Shift + left drag", "pan"),
            ("wheel", "zoom"),
            ("F", "all tissue in the picture"),
            ("1  3  7  0", "front, side, top, surgeon's view"),
            ("Space", "hold the picture, or let it go on"),
            ("V", "next colouring of the tissue"),
            ("S", "stereo, side by side"),
            ("G", "background: room or print"),
            ("O", "panels: all, few, none"),
            ("P, F12", "screenshot as PNG"),
        ],
    ),
    (
        "Measure",
        &[
            ("Ctrl + click", "pick a sample point"),
            ("K", "save the sample curves as CSV"),
            ("J", "clear the sample points"),
        ],
    ),
    (
        "Session",
        &[
            ("R", "restore the scene"),
            ("Shift + R", "start the procedure anew"),
            ("N  B", "next, previous scene"),
            ("T", "tie the stitch at work"),
            ("C", "control off, on, paper"),
            ("A", "re-arm after a fault"),
        ],
    ),
    (
        "Mouse as the hand",
        &[
            ("M", "be the hand, or not (haptic-server run --device pointer)"),
            ("move", "stylus in the plane of the picture"),
            ("wheel", "stylus along the view; over a suture point it goes there by itself"),
            ("left button, X", "front button of the stylus"),
            ("Z", "back button of the stylus"),
            ("right drag", "orbit meanwhile"),
        ],
    ),
    (
        "Recording",
        &[
            ("Space", "play or pause"),
            (",  .  or arrow keys", "one picture back, on"),
            ("–  +", "half, twice as fast"),
            ("Home", "to the start"),
            ("H, Esc, Q", "this list; close it; quit"),
        ],
    ),
];

pub(super) fn show(ui: &mut Ui) {
    style::panel().show(ui, |ui| {
        Grid::new("keys").num_columns(2).spacing([18.0, 2.0]).show(ui, |ui| {
            for (group, keys) in KEYS {
                ui.label(RichText::new(group).strong());
                ui.end_row();
                for (key, what) in keys {
                    ui.label(RichText::new(*key).color(style::BLUE).size(style::SMALL));
                    ui.label(RichText::new(*what).size(style::SMALL));
                    ui.end_row();
                }
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_of_the_viewer_lists_the_same_keys() {
        let page = include_str!("../../../docs/viewer.md");
        for (group, keys) in KEYS {
            assert!(page.contains(&format!("| **{group}** | |")), "{group}");
            for (key, what) in keys {
                assert!(page.contains(&format!("| {key} | {what} |")), "{key}: {what}");
            }
        }
    }
}
