//! What a run reports at its end, for a person and as one JSON document.
//!
//! The keys of the JSON are a contract with other people's scripts (add, don't rename); the struct's field
//! names are those keys. Nanosecond percentiles come from fixed-size histograms; what was never measured is null, not
//! zero. Deliberately absent: how the
//! numbers were measured (see `servo::stats` and the solver's report).

use crate::record::RecordOutcome;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Percentiles of one duration, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: u64,
    /// 99 %.
    pub p99: u64,
    /// 99.9 %.
    pub p999: u64,
    /// Largest.
    pub max: u64,
}

impl Percentiles {
    /// Percentiles of what was counted; an empty histogram has none.
    #[must_use]
    pub fn of(h: &hdrhistogram::Histogram<u64>) -> Option<Self> {
        (!h.is_empty()).then(|| Self {
            p50: h.value_at_quantile(0.5),
            p99: h.value_at_quantile(0.99),
            p999: h.value_at_quantile(0.999),
            max: h.max(),
        })
    }
}

/// The summary of `run` and `lockstep`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunSummary {
    /// Scene or procedure.
    pub scene: String,
    /// Device that was driven.
    pub device: String,
    /// Who moved the stylus.
    pub hand: String,
    /// How a recorded hand was placed onto the wound, in words; empty for others.
    pub registration: String,
    /// Seconds of servo work (simulated seconds in lockstep).
    pub duration_s: f64,
    /// Ticks executed.
    pub ticks: u64,
    /// Ticks missed.
    pub missed: u64,
    /// Wake-up lateness; null on a virtual clock.
    pub wake_ns: Option<Percentiles>,
    /// Time inside one tick; null on a virtual clock.
    pub compute_ns: Option<Percentiles>,
    /// Age of the tissue port when used; null when none ever arrived.
    pub port_age_ns: Option<Percentiles>,
    /// From the device's sample to the force for it; null on a virtual clock.
    pub sample_to_force_ns: Option<Percentiles>,
    /// Largest force sent to the hand, newtons.
    pub peak_force_n: f64,
    /// Energy given to the hand, joules; negative when the hand gave it.
    pub net_energy_to_hand_j: f64,
    /// Stitches tied.
    pub stitches: u32,
    /// Suture points that the hand took.
    pub points_taken: u32,
    /// How often the hand gripped.
    pub grips: u32,
    /// Grips that took a suture point or the line.
    pub grips_used: u32,
    /// Largest ER of the ledger.
    pub er_max: f64,
    /// Solver steps done.
    pub solver_steps: u64,
    /// Times the solver was started again after it died.
    pub solver_restarts: u32,
    /// Integrator.
    pub integrator: String,
    /// Why this integrator with these sub-steps.
    pub integrator_reason: String,
    /// `S = λ dt² / (4m + 2c dt)`.
    pub stability_number: f64,
    /// Servo state at the end.
    pub state: String,
    /// Faults of the run, oldest first.
    pub faults: Vec<String>,
    /// Whether something that the figures depend on was missing.
    pub degraded: bool,
    /// What was missing, and how to get it.
    pub degraded_reasons: Vec<String>,
    /// Simulated seconds per second of wall time; not in files that must come out equal on repetition.
    pub realtime_factor: Option<f64>,
    /// What became of the recording, if one was asked for.
    pub recording: Option<RecordOutcome>,
    /// Version of the binary.
    pub version: String,
}

/// What a summary after a solver restart says of itself.
const SINCE_RESTART: &str = "steps, times and points of the tissue since the last solver restart";

/// Name of the integrator code of `wound_report`.
#[must_use]
pub fn integrator_name(code: u32) -> &'static str {
    match code {
        0 => "semi_implicit",
        1 => "paper_explicit",
        2 => "verlet",
        3 => "bdf2",
        4 => "xpbd",
        _ => "unknown",
    }
}

/// Name of the servo mode code of `servo_state`.
#[must_use]
pub fn servo_state_name(code: u32) -> &'static str {
    match code {
        0 => "init",
        1 => "monitor",
        2 => "armed",
        3 => "ramp",
        4 => "active",
        5 => "fault",
        _ => "unknown",
    }
}

impl RunSummary {
    /// One JSON document in one line.
    ///
    /// # Errors
    /// None in practice: the struct has string keys and finite numbers only.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// With the number of solver restarts. Stitches outlive a solver; steps and tissue time are counted from its
    /// start, points are those of the stitches and what was taken since, and no real-time factor follows from them.
    #[must_use]
    pub fn after_solver_restarts(mut self, restarts: u32) -> Self {
        self.solver_restarts = restarts;
        if restarts > 0 {
            self.realtime_factor = None;
            self.degraded = true;
            self.degraded_reasons.push(SINCE_RESTART.to_owned());
        }
        self
    }
}

/// Nanoseconds in a unit that a person reads.
struct Ns(u64);

impl fmt::Display for Ns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Reading precision only: three digits are enough.
        let ns = self.0 as f64;
        match self.0 {
            0..10_000 => write!(f, "{ns} ns"),
            10_000..10_000_000 => write!(f, "{:.1} µs", ns / 1e3),
            _ => write!(f, "{:.1} ms", ns / 1e6),
        }
    }
}

impl fmt::Display for Percentiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "p50 {} · p99 {} · p99.9 {} · max {}", Ns(self.p50), Ns(self.p99), Ns(self.p999), Ns(self.max))
    }
}

impl fmt::Display for RunSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene            {} on {}, hand {}", self.scene, self.device, self.hand)?;
        if !self.registration.is_empty() {
            writeln!(f, "registration     {}", self.registration)?;
        }
        write!(f, "duration         {:.3} s", self.duration_s)?;
        match self.realtime_factor {
            Some(factor) => writeln!(f, ", {factor:.1} × real time")?,
            None => writeln!(f)?,
        }
        writeln!(f, "servo            {} ticks, {} missed, state {}", self.ticks, self.missed, self.state)?;
        let durations = [
            ("wake-up", &self.wake_ns),
            ("tick", &self.compute_ns),
            ("tissue port age", &self.port_age_ns),
            ("sample to force", &self.sample_to_force_ns),
        ];
        for (name, percentiles) in durations {
            if let Some(percentiles) = percentiles {
                writeln!(f, "{name:<17}{percentiles}")?;
            }
        }
        writeln!(
            f,
            "force            peak {:.3} N, net energy to the hand {:+.3e} J",
            self.peak_force_n, self.net_energy_to_hand_j
        )?;
        writeln!(
            f,
            "suturing         {} stitches, {} of {} grips took a point, {} points taken, largest ER {:.2} %",
            self.stitches,
            self.grips_used,
            self.grips,
            self.points_taken,
            100.0 * self.er_max
        )?;
        writeln!(
            f,
            "solver           {} steps, {} restarts, {}, S = {:.4}",
            self.solver_steps, self.solver_restarts, self.integrator, self.stability_number
        )?;
        if !self.integrator_reason.is_empty() {
            writeln!(f, "integrator       {}", self.integrator_reason)?;
        }
        if let Some(recording) = &self.recording {
            write!(f, "recording        {} ticks, {} lost", recording.ticks, recording.lost_ticks)?;
            match &recording.stopped {
                Some(reason) => writeln!(f, "; stopped: {reason}")?,
                None => writeln!(f)?,
            }
        }
        for fault in &self.faults {
            writeln!(f, "fault            {fault}")?;
        }
        for reason in &self.degraded_reasons {
            writeln!(f, "degraded         {reason}")?;
        }
        write!(f, "version          {}", self.version)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The keys that scripts rely on.
    const KEYS: [&str; 19] = [
        "scene",
        "device",
        "duration_s",
        "ticks",
        "missed",
        "wake_ns",
        "compute_ns",
        "port_age_ns",
        "peak_force_n",
        "net_energy_to_hand_j",
        "stitches",
        "er_max",
        "solver_steps",
        "integrator",
        "stability_number",
        "state",
        "faults",
        "degraded",
        "realtime_factor",
    ];

    #[test]
    fn the_json_has_the_promised_keys() {
        let measured = RunSummary { wake_ns: Some(Percentiles::default()), version: "1".into(), ..Default::default() };
        let text = measured.to_json().expect("representable");
        let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        for key in KEYS.iter().chain(&[
            "version",
            "sample_to_force_ns",
            "points_taken",
            "grips",
            "grips_used",
            "solver_restarts",
            "integrator_reason",
            "hand",
            "registration",
        ]) {
            assert!(json.get(key).is_some(), "{key}");
        }
        for key in ["p50", "p99", "p999", "max"] {
            assert!(json["wake_ns"].get(key).is_some(), "{key}");
        }
        assert!(json["port_age_ns"].is_null(), "what was not measured is null");
        assert!(!text.contains('\n'));
    }

    #[test]
    fn a_restarted_solver_takes_the_real_time_factor_away() {
        let summary = RunSummary { realtime_factor: Some(1.0), ..Default::default() };
        assert_eq!(summary.clone().after_solver_restarts(0), summary);
        let restarted = summary.after_solver_restarts(2);
        assert_eq!((restarted.solver_restarts, restarted.realtime_factor, restarted.degraded), (2, None, true));
        assert_eq!(restarted.degraded_reasons, [SINCE_RESTART]);
    }

    #[test]
    fn percentiles_of_a_known_histogram() {
        let mut h = hdrhistogram::Histogram::<u64>::new_with_bounds(1, 1_000_000_000, 3).expect("bounds");
        assert_eq!(Percentiles::of(&h), None);
        for v in 1..=1000 {
            h.record(v).expect("in range");
        }
        let p = Percentiles::of(&h).expect("counted");
        assert_eq!((p.p50, p.p99, p.p999, p.max), (500, 990, 999, 1000));
    }
}
