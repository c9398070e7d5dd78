//! What lockstep keeps of every tick: a line in `ticks.csv`, four curves for `force.svg`, and the figures of the
//! summary. Port age and steps are of the virtual clock; nothing here reads a real one.

use super::room::TickWatch;
use crate::report::series::{Panel, series_svg};
use crate::report::tables::{write_tick, write_tick_header};
use crate::solver::session::SolverSession;
use hdrhistogram::Histogram;
use protocol::servo_state::ServoState;
use protocol::wound_report::WoundReport;
use std::io::{self, Write};

/// Longest port age the histogram tells apart, nanoseconds.
const LONGEST_AGE_NS: u64 = 10_000_000_000;

/// Figures and curves of a run.
pub(super) struct Trace<'a> {
    ticks_csv: Option<&'a mut dyn Write>,
    failed: Option<io::Error>,
    times_s: Vec<f64>,
    force_n: Vec<f64>,
    tension_n: Vec<f64>,
    gap_mm: Vec<f64>,
    closed_mm: Vec<f64>,
    pub(super) peak_force_n: f64,
    pub(super) port_age_ns: Histogram<u64>,
    pub(super) report: WoundReport,
    pub(super) faults: Vec<u32>,
}

impl<'a> Trace<'a> {
    /// Room for `ticks` ticks; `ticks_csv` gets one line per tick.
    pub(super) fn new(ticks: usize, ticks_csv: Option<&'a mut dyn Write>, report: WoundReport) -> io::Result<Self> {
        let mut trace = Self {
            ticks_csv,
            failed: None,
            times_s: Vec::with_capacity(ticks),
            force_n: Vec::with_capacity(ticks),
            tension_n: Vec::with_capacity(ticks),
            gap_mm: Vec::with_capacity(ticks),
            closed_mm: Vec::with_capacity(ticks),
            peak_force_n: 0.0,
            port_age_ns: Histogram::new_with_max(LONGEST_AGE_NS, 3).map_err(io::Error::other)?,
            report,
            faults: Vec::new(),
        };
        if let Some(out) = &mut trace.ticks_csv {
            write_tick_header(out)?;
        }
        Ok(trace)
    }

    /// The first error of writing, if there was one.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        match self.failed.take() {
            Some(error) => Err(error),
            None => self.ticks_csv.as_mut().map_or(Ok(()), |out| out.flush()),
        }
    }

    /// Force and gap over time.
    pub(super) fn force_svg(&self, title: &str) -> String {
        series_svg(
            title,
            &self.times_s,
            &[
                Panel {
                    label: "force (N)",
                    curves: vec![
                        ("on the hand", "#1f5fbf", &self.force_n),
                        ("line tension", "#c0392b", &self.tension_n),
                    ],
                    level: None,
                },
                Panel {
                    label: "distance of the pair at work (mm)",
                    curves: vec![("gap", "#2e7d32", &self.gap_mm), ("closed at", "#999999", &self.closed_mm)],
                    level: None,
                },
            ],
        )
    }
}

impl TickWatch for Trace<'_> {
    fn watch(&mut self, time_s: f64, state: &ServoState, session: &SolverSession) {
        let port = session.port();
        if let (Some(out), None) = (&mut self.ticks_csv, &self.failed) {
            self.failed = write_tick(out, time_s, state).err();
        }
        let force = state.devices[0].force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
        self.times_s.push(time_s);
        self.force_n.push(force);
        self.tension_n.push(state.handles.iter().map(|h| h.line_tension_n).fold(0.0, f64::max));
        self.gap_mm.push(port.gap_m * 1e3);
        self.closed_mm.push(port.closed_gap_m * 1e3);
        self.peak_force_n = self.peak_force_n.max(force);
        if state.port_sequence > 0 {
            self.port_age_ns.saturating_record(state.port_age_ns);
        }
        if state.fault != 0 && self.faults.last() != Some(&state.fault) {
            self.faults.push(state.fault);
        }
        self.report = *session.report();
    }
}
