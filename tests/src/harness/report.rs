//! What one replayed trace showed, for a person and as JSON. The field names are keys that scripts rely on: add, don't
//! rename. Durations in nanoseconds; what was never measured is null.

use haptic_server::latency::Grade;
use haptic_server::summary::Percentiles;
use serde::Serialize;
use std::fmt;

/// Report of one trace.
#[derive(Clone, Debug, Serialize)]
pub struct TraceReport {
    /// The recording.
    pub trace: String,
    /// The scene.
    pub scene: String,
    /// Seconds of servo work.
    pub duration_s: f64,
    /// Ticks executed.
    pub ticks: u64,
    /// Ticks missed.
    pub missed: u64,
    /// Lateness of the servo's wake-ups.
    pub wake_ns: Option<Percentiles>,
    /// Time inside one tick.
    pub tick_ns: Option<Percentiles>,
    /// From the time stamp of the device sample until its force is handed over.
    pub sample_to_force_ns: Option<Percentiles>,
    /// Age of the tissue port when used.
    pub port_age_ns: Option<Percentiles>,
    /// Lateness of the plain timer in the same run.
    pub baseline_wake_ns: Option<Percentiles>,
    /// Wake-ups of the plain timer.
    pub baseline_ticks: u64,
    /// Periods that the plain timer missed.
    pub baseline_missed: u64,
    /// Share of ticks that were not missed.
    pub success_rate: f64,
    /// The machine in one word.
    pub grade: Grade,
    /// Why, in one sentence.
    pub grade_reason: String,
    /// Whether something that the figures depend on was missing.
    pub degraded: bool,
    /// What was missing, and how to get it.
    pub degraded_reasons: Vec<String>,
    /// Version of the server.
    pub version: String,
}

/// One object for one trace, a list for several.
pub(super) fn to_json(reports: &[TraceReport]) -> String {
    let json = match reports {
        [one] => serde_json::to_string_pretty(one),
        _ => serde_json::to_string_pretty(reports),
    };
    // Strings and numbers only: there is nothing that cannot be written.
    json.unwrap_or_default()
}

impl fmt::Display for TraceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} on {}, {:.1} s", self.trace, self.scene, self.duration_s)?;
        writeln!(
            f,
            "  ticks            {} done, {} missed ({:.3} % kept)",
            self.ticks,
            self.missed,
            100.0 * self.success_rate
        )?;
        writeln!(f, "  µs                    p50        p99      p99.9        max")?;
        for (name, p) in [
            ("wake-up", &self.wake_ns),
            ("plain timer", &self.baseline_wake_ns),
            ("tick", &self.tick_ns),
            ("sample to force", &self.sample_to_force_ns),
            ("port age", &self.port_age_ns),
        ] {
            let Some(p) = p else {
                writeln!(f, "  {name:<15} not measured")?;
                continue;
            };
            let us = [p.p50, p.p99, p.p999, p.max].map(|ns| ns as f64 / 1e3);
            writeln!(f, "  {name:<15} {:>9.1}  {:>9.1}  {:>9.1}  {:>9.1}", us[0], us[1], us[2], us[3])?;
        }
        write!(f, "  grade            {}: {}", self.grade, self.grade_reason)?;
        for reason in &self.degraded_reasons {
            write!(f, "\n  degraded         {reason}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) fn example() -> TraceReport {
    let some = Some(Percentiles { p50: 1_000, p99: 2_000, p999: 3_000, max: 4_500 });
    TraceReport {
        trace: "a.csv".into(),
        scene: "skin".into(),
        duration_s: 2.0,
        ticks: 2000,
        missed: 3,
        wake_ns: some,
        tick_ns: some,
        sample_to_force_ns: some,
        port_age_ns: some,
        baseline_wake_ns: some,
        baseline_ticks: 2001,
        baseline_missed: 2,
        success_rate: 0.9985,
        grade: Grade::Excellent,
        grade_reason: "all well".into(),
        degraded: true,
        degraded_reasons: vec!["no rights".into()],
        version: "1".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_has_the_keys_that_scripts_rely_on() {
        let json: serde_json::Value = serde_json::from_str(&to_json(&[example()])).expect("JSON");
        for key in ["trace", "ticks", "missed", "grade", "degraded"] {
            assert!(json.get(key).is_some(), "{key}");
        }
        for key in ["wake_ns", "tick_ns", "sample_to_force_ns", "port_age_ns", "baseline_wake_ns"] {
            for part in ["p50", "p99", "p999", "max"] {
                assert!(json[key][part].is_u64(), "{key}.{part}");
            }
        }
        assert_eq!(json["grade"], "excellent");
        let several: serde_json::Value = serde_json::from_str(&to_json(&[example(), example()])).expect("JSON");
        assert_eq!(several.as_array().map(Vec::len), Some(2));
    }

    #[test]
    fn the_text_shows_microseconds_and_the_grade() {
        let text = TraceReport { port_age_ns: None, ..example() }.to_string();
        assert!(text.contains("port age        not measured"), "{text}");
        assert!(text.contains("4.5") && text.contains("excellent: all well") && text.contains("no rights"), "{text}");
    }
}
