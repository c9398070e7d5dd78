//! Lockstep: the same servo tick and solver step as live, in one process on a virtual clock.
//!
//! Equal inputs and binary give equal bytes in `ticks.csv`, `ledger.csv`, `radar.svg`, `force.svg` and
//! `summary.json`. The only figure that a clock on the wall enters is the real-time factor; it is printed, and is
//! `null` in the file.

mod film;
mod room;
mod trace;

use crate::device::{PulledDevice, run_pulled};
use crate::error::ServerError;
use crate::record::writing;
use crate::report::radar::{RadarAxis, radar_svg};
use crate::report::tables::{ledger_rows, scene_kind_name, write_ledger};
use crate::servo::params::ServoParams;
use crate::servo::state_machine::ServoFault;
use crate::solver::session::SolverSession;
use crate::summary::{Percentiles, RunSummary, integrator_name, servo_state_name};
use film::Film;
use protocol::servo_state::ServoState;
use protocol::trace::Metadata;
use protocol::wound_report::WoundReport;
use room::{End, LockstepRoom, TickWatch};
use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use trace::Trace;

/// What lockstep is asked to run.
pub struct LockstepJob<'a> {
    /// Label of the scene or procedure.
    pub scene: String,
    /// Label of the hand.
    pub hand: String,
    /// How a recorded hand was placed, in words.
    pub registration: String,
    /// The tissue side; after the run it stands as the run left it.
    pub session: &'a mut SolverSession,
    /// The device that is driven.
    pub device: &'a mut dyn PulledDevice,
    /// Its servo constants.
    pub params: ServoParams,
    /// Most simulated seconds.
    pub longest_s: f64,
    /// Whether a finished procedure ends the run.
    pub ends: RunEnd,
    /// Folder for the files.
    pub out: Option<PathBuf>,
    /// A recording, if one is wanted.
    pub kept: Option<Kept>,
}

/// A recording of a lockstep run.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The file.
    pub path: PathBuf,
    /// What it says about its origin.
    pub origin: Metadata,
    /// Time between two views of the tissue in it.
    pub view_period: Duration,
}

/// Who looks at the ticks of a run.
struct Watchers<'a, 'w> {
    trace: &'a mut Trace<'w>,
    film: Option<&'a mut Film>,
}

impl TickWatch for Watchers<'_, '_> {
    fn watch(&mut self, time_s: f64, state: &ServoState, session: &SolverSession) {
        self.trace.watch(time_s, state, session);
        if let Some(film) = &mut self.film {
            film.keep(state, session);
        }
    }
}

/// What ends a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// Only the time.
    AfterTime,
    /// Also the end of the procedure.
    WhenFinished,
}

/// Runs the job and writes its files.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn run(job: LockstepJob<'_>) -> Result<RunSummary, ServerError> {
    let LockstepJob { scene, hand, registration, session, device, params, longest_s, ends, out, kept } = job;
    if let Some(folder) = &out {
        fs::create_dir_all(folder).map_err(|e| writing(folder, &e))?;
    }
    let mut ticks_csv = match &out {
        Some(folder) => Some(create(&folder.join("ticks.csv"))?),
        None => None,
    };
    let period_s = params.period_ns() as f64 * 1e-9;
    let ticks = (longest_s / period_s).round() as u64;
    let start = Instant::now();
    let writer = ticks_csv.as_mut().map(|w| w as &mut dyn Write);
    let report = *session.report();
    // Room for the run, but not for one that will end early: ten minutes at most are taken ahead.
    let reserve = ticks.min(600_000) as usize;
    let shown = out.clone().unwrap_or_default();
    let mut trace = Trace::new(reserve, writer, report).map_err(|e| writing(&shown, &e))?;
    let mut film = kept.as_ref().map(Film::create).transpose()?;
    let end = End { ticks, when_finished: ends == RunEnd::WhenFinished };
    let mut watchers = Watchers { trace: &mut trace, film: film.as_mut() };
    let mut room = LockstepRoom::new(&params, session, &mut watchers, end);
    run_pulled(device, &mut room);
    let servo = room.into_servo();
    let recording = film.map(Film::finish);
    trace.finish().map_err(|e| writing(&shown, &e))?;
    let state = servo.state();
    let simulated_s = state.ticks as f64 * period_s;
    let summary = RunSummary {
        scene,
        device: "simulated".to_owned(),
        hand,
        registration,
        duration_s: simulated_s,
        ticks: state.ticks,
        missed: state.missed,
        port_age_ns: Percentiles::of(&trace.port_age_ns),
        peak_force_n: trace.peak_force_n,
        net_energy_to_hand_j: state.energy_to_hand_j,
        stitches: trace.report.row_count,
        points_taken: trace.report.points_taken,
        grips: state.devices[0].press_count[0],
        grips_used: trace.report.grips_used,
        er_max: trace.report.er_max,
        solver_steps: trace.report.solver_steps,
        integrator: integrator_name(trace.report.integrator).to_owned(),
        integrator_reason: trace.report.integrator_reason(),
        stability_number: trace.report.stability_number,
        state: servo_state_name(state.mode).to_owned(),
        faults: trace.faults.iter().map(|code| fault_name(*code)).collect(),
        recording,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        ..RunSummary::default()
    };
    if let Some(folder) = &out {
        let title = format!("{} — {} s", summary.scene, summary.duration_s);
        write(&folder.join("force.svg"), trace.force_svg(&title).as_bytes())?;
        write(&folder.join("radar.svg"), radar(&summary.scene, &trace.report).as_bytes())?;
        let mut ledger = Vec::new();
        write_ledger(&mut ledger, &trace.report).map_err(|e| writing(folder, &e))?;
        write(&folder.join("ledger.csv"), &ledger)?;
        let text = serde_json::to_string_pretty(&summary).map_err(|e| ServerError::Internal(e.to_string()))?;
        write(&folder.join("summary.json"), format!("{text}\n").as_bytes())?;
    }
    let factor = simulated_s / start.elapsed().as_secs_f64().max(1e-9);
    Ok(RunSummary { realtime_factor: Some(factor), ..summary })
}

fn fault_name(code: u32) -> String {
    ServoFault::from_code(code).map_or_else(|| format!("fault {code}"), |fault| fault.to_string())
}

/// Fig. 8: one axis per stitch, named by scene and number.
fn radar(title: &str, report: &WoundReport) -> String {
    let axes: Vec<RadarAxis> = ledger_rows(report)
        .iter()
        .map(|row| RadarAxis {
            label: format!("{} {}", scene_kind_name(row.scene_kind), row.pair + 1),
            original_mm: row.original_distance_m * 1e3,
            current_mm: row.current_distance_m * 1e3,
        })
        .collect();
    radar_svg(&format!("{title}: distance of the suture points"), &axes)
}

fn create(path: &Path) -> Result<BufWriter<fs::File>, ServerError> {
    fs::File::create(path).map(BufWriter::new).map_err(|e| writing(path, &e))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ServerError> {
    fs::write(path, bytes).map_err(|e| writing(path, &e))
}
