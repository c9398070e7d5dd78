//! Table 1 live: one row per stitch of the scene, with the distances, the relative error and what holds it.
//!
//! Zhang et al., Table 1 lists positions and distances, original and current; positions are told when the pointer rests on a
//! row. `ER = |D_c − D_o| / max(D_o, D_floor)` comes from the solver; a stitch that has opened by more
//! than 10 % is red: control acts on it, when it is on. One that has tightened is not marked, however far.

use super::style;
use crate::feed::View;
use egui::{Color32, Grid, RichText, Ui};
use protocol::words;
use protocol::wound_report::{LedgerRow, WoundReport};

/// Millimetres in a metre.
const MM: f64 = 1e3;
/// Rows that are shown; the newest ones win.
const SHOWN: usize = 8;
/// Algorithm 2 acts above this part of `max(D_o, D_floor)`.
pub(super) const BAND: f64 = 0.10;

/// Rows of the scene at work.
pub(super) fn rows(report: &WoundReport) -> impl Iterator<Item = &LedgerRow> {
    let used = report.rows.get(..report.row_count as usize).unwrap_or(&[]);
    used.iter().filter(|row| row.scene_index == report.scene_index)
}

pub(super) fn show(ui: &mut Ui, view: &View) {
    let Some(report) = &view.report else {
        style::title(ui, "Stitches (Table 1)", "no solver yet", style::WEAK);
        return;
    };
    let count = rows(report).count();
    let worst = rows(report).map(|row| row.relative_error).fold(0.0, f64::max);
    let control = format!("control {}", words::control(report.control));
    style::title(ui, "Stitches (Table 1)", &control, if report.control == 0 { style::WATCH } else { style::TEXT });
    if count == 0 {
        ui.label(RichText::new("none tied yet").size(style::SMALL).color(style::WEAK));
        return;
    }
    Grid::new("table-1").num_columns(6).spacing([8.0, 1.0]).min_col_width(10.0).show(ui, |ui| {
        for name in ["", "D_o", "D_c mm", "ER %", "hold", "line N"] {
            ui.label(RichText::new(name).size(style::SMALL).color(style::WEAK));
        }
        ui.end_row();
        for row in rows(report).skip(count.saturating_sub(SHOWN)) {
            let number = ui.label(RichText::new((row.pair + 1).to_string()).size(style::SMALL).color(style::WEAK));
            number.on_hover_text(positions(row));
            for (value, colour) in cells(row) {
                ui.label(RichText::new(value).size(style::SMALL).color(colour));
            }
            ui.end_row();
        }
    });
    style::row(ui, "largest ER", &format!("{:.1} %{}", 100.0 * worst, remarks(report)), worst_colour(report));
}

fn cells(row: &LedgerRow) -> [(String, Color32); 5] {
    let acts = row.flags & 1 != 0;
    [
        (format!("{:.2}", row.original_distance_m * MM), style::RED),
        (format!("{:.2}", row.current_distance_m * MM), style::BLUE),
        (format!("{:.1}", 100.0 * row.relative_error), error_colour(row)),
        (format!("{:.2}", row.holding_force_n), if acts { style::WATCH } else { style::WEAK }),
        (format!("{:.2}", row.stitch_tension_n), style::TEXT),
    ]
}

fn error_colour(row: &LedgerRow) -> Color32 {
    let relative = row.relative_error;
    if row.current_distance_m <= row.original_distance_m {
        style::TEXT
    } else if relative <= BAND / 2.0 {
        style::GOOD
    } else if relative <= BAND {
        style::WATCH
    } else {
        style::BAD
    }
}

/// Colour of the stitch that has opened most.
fn worst_colour(report: &WoundReport) -> Color32 {
    let opened = rows(report).filter(|row| row.current_distance_m > row.original_distance_m);
    let worst = opened.max_by(|a, b| a.relative_error.total_cmp(&b.relative_error));
    worst.map_or(style::TEXT, error_colour)
}

/// What happened to stitches, in as few words as fit.
fn remarks(report: &WoundReport) -> String {
    let with = |bit: u32| rows(report).filter(|row| row.flags & bit != 0).count();
    let (slipped, torn) = (with(4), with(8));
    match (slipped, torn) {
        (0, 0) => String::new(),
        (_, 0) => format!(", {slipped} slipped"),
        _ => format!(", {torn} pulled through"),
    }
}

fn positions(row: &LedgerRow) -> String {
    let place = |p: &[f64; 3]| format!("{:.2}, {:.2}, {:.2}", p[0] * MM, p[1] * MM, p[2] * MM);
    format!(
        "left original  {}\nleft current  {}\nright original  {}\nright current  {}\nmillimetres",
        place(&row.left_original_m),
        place(&row.left_current_m),
        place(&row.right_original_m),
        place(&row.right_current_m)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::example;

    #[test]
    fn table1_shows_the_stitches_of_the_scene_at_work() {
        let mut report = example::view().report.expect("a report");
        assert_eq!(rows(&report).count(), 3);
        let cells = cells(rows(&report).nth(1).expect("a row"));
        assert_eq!(cells.clone().map(|c| c.0), ["1.20", "1.32", "6.0", "0.40", "0.25"]);
        assert_eq!(cells[2].1, style::WATCH);
        report.rows[0].scene_index = 7;
        report.rows[1].flags |= 8;
        assert_eq!(rows(&report).count(), 2);
        assert_eq!(remarks(&report), ", 1 pulled through");
    }

    #[test]
    fn only_a_stitch_that_has_opened_is_red() {
        let mut report = example::view().report.expect("a report");
        (report.rows[0].current_distance_m, report.rows[0].relative_error) = (0.0009, 0.15);
        assert_eq!(error_colour(&report.rows[0]), style::TEXT);
        assert_eq!(worst_colour(&report), style::WATCH);
        (report.rows[0].current_distance_m, report.rows[0].relative_error) = (0.0015, 0.15);
        assert_eq!(error_colour(&report.rows[0]), style::BAD);
        assert_eq!(worst_colour(&report), style::BAD);
    }
}
