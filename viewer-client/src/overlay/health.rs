//! How servo and solver do: state, missed ticks, spread of wake-ups, age of the tissue port and the rung it leads to, energy,
//! step time, integrator.

use super::history::History;
use super::situation::Link;
use super::style;
use crate::feed::View;
use egui::{Color32, Ui};
use protocol::servo_state::ServoState;
use protocol::words;
use protocol::wound_report::WoundReport;

/// `ServoState::flags`: no real-time rights.
const DEGRADED: u32 = 1;
/// Servo state machine: active.
const ACTIVE: u32 = 4;
/// Servo state machine: fault.
const FAULT: u32 = 5;
/// Wake-ups that spread over more than this are worth a look, microseconds.
const WATCH_US: f64 = 200.0;

pub(super) fn show(ui: &mut Ui, view: &View, history: &History, link: Link) {
    match &view.servo {
        Some(servo) => {
            match link {
                Link::Gone => style::title(ui, "Servo", "silent", style::BAD),
                _ => style::title(ui, "Servo", words::mode(servo.mode), mode_colour(servo.mode)),
            }
            for (name, value, colour) in servo_rows(servo, history) {
                style::row(ui, name, &value, colour);
            }
        }
        None => style::title(ui, "Servo", "not seen yet", style::WEAK),
    }
    if let Some(report) = &view.report {
        ui.add_space(3.0);
        style::title(ui, "Solver", &format!("{:.2} ms a step", report.step_time_ns as f64 * 1e-6), style::TEXT);
        let scheme = format!("{} × {}", words::integrator(report.integrator), report.substeps);
        style::row(ui, "integrator", &scheme, style::TEXT);
        style::row(ui, "longest step", &longest(report), style::TEXT);
    }
}

fn servo_rows(servo: &ServoState, history: &History) -> Vec<(&'static str, String, Color32)> {
    let missed_now = history.missed_since(servo.missed);
    let missed = if missed_now == servo.missed {
        servo.missed.to_string()
    } else {
        format!("{}, {missed_now} while watched", servo.missed)
    };
    let fine = |ok: bool| if ok { style::TEXT } else { style::WATCH };
    let spread = history.wake_spread_us();
    let mut rows = vec![
        ("ticks", servo.ticks.to_string(), style::TEXT),
        ("missed", missed, fine(missed_now == 0)),
        (
            "jitter of ticks seen",
            spread.map_or_else(|| "–".to_owned(), |us| format!("{us:.0} µs")),
            fine(spread.is_none_or(|us| us <= WATCH_US)),
        ),
        ("tissue port", port(servo), fine(servo.port_rung == 0)),
        ("energy to the hand", format!("{:+.2} mJ", 1e3 * servo.energy_to_hand_j), style::TEXT),
    ];
    if servo.flags & DEGRADED != 0 {
        rows.push(("real time", "degraded: no rights".to_owned(), style::WATCH));
    }
    rows
}

fn port(servo: &ServoState) -> String {
    if servo.port_sequence == 0 {
        return words::rung(4).to_owned();
    }
    format!("{:.1} ms, {}", servo.port_age_ns as f64 * 1e-6, words::rung(servo.port_rung))
}

fn longest(report: &WoundReport) -> String {
    format!("{:.2} ms", report.step_time_max_ns as f64 * 1e-6)
}

fn mode_colour(mode: u32) -> Color32 {
    match mode {
        ACTIVE => style::GOOD,
        FAULT => style::BAD,
        _ => style::WATCH,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::wire::Field;

    #[test]
    fn what_is_not_as_it_should_be_stands_out() {
        let mut servo = ServoState { flags: DEGRADED, port_rung: 2, port_sequence: 3, ..ServoState::EMPTY };
        let rows = servo_rows(&servo, &History::default());
        let colour = |name: &str| rows.iter().find(|r| r.0 == name).map(|r| r.2);
        assert_eq!(colour("real time"), Some(style::WATCH));
        assert_eq!(colour("tissue port"), Some(style::WATCH));
        assert_eq!(colour("missed"), Some(style::TEXT));
        servo.port_sequence = 0;
        assert_eq!(port(&servo), "no port");
    }
}
