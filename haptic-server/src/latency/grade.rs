//! A machine's grade in words: the worst wake-up decides, lost ticks can only make it worse.
//!
//! | worst wake-up | grade | | share of ticks kept | at best |
//! |---|---|---|---|---|
//! | < 20 µs | excellent | | ≥ 95 % | as it is |
//! | < 50 µs | good | | ≥ 90 % | fair |
//! | < 500 µs | fair | | < 90 % | unfit |
//! | else | unfit | | | |
//!
//! The first column are the limits that LinuxCNC gives for its latency test, the second those of libfranka's communication
//! test. Beside the grade stands whose it is: when the plain timer of the same run woke as late, the machine is the limit.

use crate::summary::Percentiles;
use std::fmt;

/// Fitness for a real device at 1 kHz.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// Not for a real device.
    Unfit,
    /// Usable; expect a felt roughness now and then.
    Fair,
    /// Usable.
    Good,
    /// Nothing to wish for.
    Excellent,
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unfit => "unfit",
            Self::Fair => "fair",
            Self::Good => "good",
            Self::Excellent => "excellent",
        })
    }
}

/// The baseline counts as late as the servo from this share of the servo's worst wake-up on.
const MACHINE_SHARE: f64 = 0.5;

/// Share of ticks that were not missed; 1 when there were none at all.
#[must_use]
pub fn success_rate(ticks: u64, missed: u64) -> f64 {
    if ticks + missed == 0 { 1.0 } else { ticks as f64 / (ticks + missed) as f64 }
}

/// Grade and its reason in one sentence.
#[must_use]
pub fn grade(wake: Option<&Percentiles>, baseline: Option<&Percentiles>, ticks: u64, missed: u64) -> (Grade, String) {
    let Some(wake) = wake else {
        return (Grade::Unfit, "no wake-up of the servo was measured; measure for longer".to_owned());
    };
    let by_wake = match wake.max {
        0..20_000 => Grade::Excellent,
        20_000..50_000 => Grade::Good,
        50_000..500_000 => Grade::Fair,
        _ => Grade::Unfit,
    };
    let success = success_rate(ticks, missed);
    let by_success = match success {
        s if s >= 0.95 => Grade::Excellent,
        s if s >= 0.90 => Grade::Fair,
        _ => Grade::Unfit,
    };
    let whose = match baseline {
        None => "no plain timer woke beside it, so whose it is remains open",
        Some(baseline) if baseline.max as f64 >= MACHINE_SHARE * wake.max as f64 => {
            "a plain timer beside it woke about as late, so the machine is the limit"
        }
        Some(_) => "a plain timer beside it did not, so look at the server's load and rights",
    };
    let reason = format!(
        "worst wake-up {:.1} µs late, {:.2} % of the ticks kept; {whose}",
        wake.max as f64 / 1e3,
        100.0 * success
    );
    (by_wake.min(by_success), reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(max: u64) -> Option<Percentiles> {
        Some(Percentiles { p50: 1, p99: 1, p999: 1, max })
    }

    #[test]
    fn limits_are_those_of_the_table() {
        for (max, expected) in [
            (19_999, Grade::Excellent),
            (20_000, Grade::Good),
            (49_999, Grade::Good),
            (50_000, Grade::Fair),
            (499_999, Grade::Fair),
            (500_000, Grade::Unfit),
        ] {
            assert_eq!(grade(worst(max).as_ref(), worst(0).as_ref(), 1000, 0).0, expected, "{max}");
        }
        for (missed, expected) in
            [(0, Grade::Excellent), (50, Grade::Excellent), (51, Grade::Fair), (101, Grade::Unfit)]
        {
            assert_eq!(grade(worst(1).as_ref(), worst(0).as_ref(), 1000 - missed, missed).0, expected, "{missed}");
        }
        assert_eq!(grade(worst(1).as_ref(), worst(0).as_ref(), 0, 0).0, Grade::Excellent);
    }

    #[test]
    fn the_baseline_tells_machine_from_server() {
        assert!(grade(worst(1000).as_ref(), worst(900).as_ref(), 1, 0).1.contains("the machine is the limit"));
        assert!(grade(worst(1000).as_ref(), worst(100).as_ref(), 1, 0).1.contains("load and rights"));
        assert!(grade(worst(1000).as_ref(), None, 1, 0).1.contains("remains open"));
    }

    #[test]
    fn what_was_not_measured_is_not_praised() {
        assert_eq!(grade(None, worst(1).as_ref(), 1000, 0).0, Grade::Unfit);
    }
}
