//! The servo process's part of the summary: its own measurements and the solver's last report.

use super::room::LoopEnd;
use crate::record::RecordOutcome;
use crate::summary::{Percentiles, RunSummary, integrator_name, servo_state_name};
use protocol::wound_report::WoundReport;

/// What the summary says of device and hand.
pub(super) struct Facts {
    /// Device that was driven.
    pub(super) device: String,
    /// Who moved it.
    pub(super) hand: String,
    /// How a recording was placed.
    pub(super) registration: String,
    /// What became of the recording.
    pub(super) recording: Option<RecordOutcome>,
}

/// The summary, but for what only the supervisor knows.
pub(super) fn summary(facts: Facts, end: &LoopEnd, wound: Option<&WoundReport>) -> RunSummary {
    let duration_s = end.duration.as_secs_f64();
    RunSummary {
        device: facts.device,
        hand: facts.hand,
        registration: facts.registration,
        duration_s,
        ticks: end.state.ticks,
        missed: end.state.missed,
        wake_ns: Percentiles::of(&end.stats.wake_ns),
        compute_ns: Percentiles::of(&end.stats.compute_ns),
        port_age_ns: Percentiles::of(&end.stats.port_age_ns),
        sample_to_force_ns: Percentiles::of(&end.stats.sample_to_force_ns),
        peak_force_n: end.stats.peak_force_n,
        net_energy_to_hand_j: end.state.energy_to_hand_j,
        stitches: wound.map_or(0, |w| w.row_count),
        points_taken: wound.map_or(0, |w| w.points_taken),
        grips: end.state.devices[0].press_count[0],
        grips_used: wound.map_or(0, |w| w.grips_used),
        er_max: wound.map_or(0.0, |w| w.er_max),
        solver_steps: wound.map_or(0, |w| w.solver_steps),
        integrator: wound.map_or("none", |w| integrator_name(w.integrator)).to_owned(),
        integrator_reason: wound.map_or_else(String::new, WoundReport::integrator_reason),
        stability_number: wound.map_or(0.0, |w| w.stability_number),
        state: servo_state_name(end.state.mode).to_owned(),
        degraded: end.rights.is_degraded(),
        degraded_reasons: end.rights.reasons(),
        realtime_factor: wound.filter(|_| duration_s > 0.0).map(|w| w.sim_time_s / duration_s),
        recording: facts.recording,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        ..RunSummary::default()
    }
}
