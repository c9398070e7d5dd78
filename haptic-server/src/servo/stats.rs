//! What the servo thread measures of itself.
//!
//! | histogram | from … to |
//! |---|---|
//! | `wake_ns` | scheduled time of the tick → thread runs |
//! | `compute_ns` | thread runs → force ready for the device |
//! | `port_age_ns` | publication of the port in use → its use (only with a port) |
//! | `sample_to_force_ns` | time stamp of the device sample → force ready for the device |
//!
//! A device that computes its pose stamps it with the scheduled time: there `sample_to_force_ns` is wake-up lateness plus
//! time in the tick. No duration includes the device's own output (bus, motors).
//!
//! HdrHistograms of fixed size, made outside the room; a value beyond their range counts as the largest one.
//! Nanoseconds, except for the peak force in newtons. Deliberately absent: percentiles (who reports them computes them).

use hdrhistogram::Histogram;
use sim_core::vector::Vec3;

/// Histograms of one run.
#[derive(Clone, Debug)]
pub struct ServoStats {
    /// Wake-up lateness.
    pub wake_ns: Histogram<u64>,
    /// Time inside the tick.
    pub compute_ns: Histogram<u64>,
    /// Age of the tissue port when used.
    pub port_age_ns: Histogram<u64>,
    /// From sample to force.
    pub sample_to_force_ns: Histogram<u64>,
    /// Largest force sent, newtons.
    pub peak_force_n: f64,
}

/// The durations of one tick, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickTimes {
    /// Wake-up lateness.
    pub wake_ns: u64,
    /// Time inside the tick.
    pub compute_ns: u64,
    /// Age of the port, if one was in use.
    pub port_age_ns: Option<u64>,
    /// From sample to force.
    pub sample_to_force_ns: u64,
}

impl ServoStats {
    /// Counts one tick.
    pub fn measure(&mut self, times: &TickTimes, force_n: Vec3) {
        self.wake_ns.saturating_record(times.wake_ns);
        self.compute_ns.saturating_record(times.compute_ns);
        if let Some(age) = times.port_age_ns {
            self.port_age_ns.saturating_record(age);
        }
        self.sample_to_force_ns.saturating_record(times.sample_to_force_ns);
        self.peak_force_n = self.peak_force_n.max(force_n.norm());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo_setup::new_stats;

    #[test]
    fn values_beyond_the_range_count_as_the_largest() {
        let mut stats = new_stats().expect("histograms");
        let times = TickTimes { wake_ns: u64::MAX, compute_ns: 900, port_age_ns: None, sample_to_force_ns: 1_000 };
        stats.measure(&times, Vec3::new(0.0, -3.0, 0.0));
        stats.measure(&TickTimes { wake_ns: 5, ..times }, Vec3::zeros());
        assert_eq!(stats.wake_ns.len(), 2);
        assert!(stats.wake_ns.max() >= 10_000_000_000);
        assert_eq!(stats.port_age_ns.len(), 0);
        assert_eq!(stats.compute_ns.value_at_quantile(0.5), 900);
        assert_eq!(stats.peak_force_n, 3.0);
    }
}
