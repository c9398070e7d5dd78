//! When the next solver step is due, and how long steps take.
//!
//! next += period; when that is past already, whole periods are skipped: the grid stays, nothing is made up.
//! The step time is reported as the mean over the last second and the longest since start. Nanoseconds of the
//! monotonic clock.

use std::time::Duration;

/// The mean step time is taken over this long.
const MEAN_WINDOW_NS: u64 = 1_000_000_000;

/// Grid of the solver steps.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    period_ns: u64,
    next_ns: u64,
    window_start_ns: u64,
    window_sum_ns: u64,
    window_steps: u64,
    mean_ns: u64,
    longest_ns: u64,
}

impl Pace {
    /// Steps every `period_s`, stretched by `slow_down`, from now on.
    pub(super) fn new(period_s: f64, slow_down: f64, now_ns: u64) -> Self {
        let period_ns = Duration::from_secs_f64(period_s * slow_down).as_nanos();
        Self {
            period_ns: u64::try_from(period_ns).unwrap_or(u64::MAX).max(1),
            next_ns: now_ns,
            window_start_ns: now_ns,
            window_sum_ns: 0,
            window_steps: 0,
            mean_ns: 0,
            longest_ns: 0,
        }
    }

    /// Notes how long a step took.
    pub(super) fn note_step(&mut self, began_ns: u64, ended_ns: u64) {
        let took = ended_ns.saturating_sub(began_ns);
        self.longest_ns = self.longest_ns.max(took);
        self.window_sum_ns += took;
        self.window_steps += 1;
        if ended_ns.saturating_sub(self.window_start_ns) >= MEAN_WINDOW_NS || self.mean_ns == 0 {
            self.mean_ns = self.window_sum_ns / self.window_steps;
        }
        if ended_ns.saturating_sub(self.window_start_ns) >= MEAN_WINDOW_NS {
            (self.window_start_ns, self.window_sum_ns, self.window_steps) = (ended_ns, 0, 0);
        }
    }

    /// Mean step time of the last full second.
    pub(super) fn mean_ns(&self) -> u64 {
        self.mean_ns
    }

    /// Longest step.
    pub(super) fn longest_ns(&self) -> u64 {
        self.longest_ns
    }

    /// Moves the grid past `now_ns` and gives the time until the next step is due.
    pub(super) fn until_next(&mut self, now_ns: u64) -> Duration {
        self.next_ns += self.period_ns;
        if self.next_ns < now_ns {
            let skipped = (now_ns - self.next_ns).div_ceil(self.period_ns);
            self.next_ns += skipped * self.period_ns;
        }
        Duration::from_nanos(self.next_ns - now_ns)
    }

    /// Sleeps until the next step is due.
    pub(super) fn wait(&mut self, now_ns: u64) {
        std::thread::sleep(self.until_next(now_ns));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_steps_skip_whole_periods_and_keep_the_grid() {
        let mut pace = Pace::new(0.005, 1.0, 0);
        assert_eq!(pace.until_next(1_000_000), Duration::from_millis(4));
        assert_eq!(pace.until_next(10_000_000), Duration::ZERO);
        assert_eq!(pace.until_next(31_000_000), Duration::from_millis(4));
    }

    #[test]
    fn slow_down_stretches_the_period() {
        assert_eq!(Pace::new(0.005, 10.0, 0).until_next(0), Duration::from_millis(50));
    }

    #[test]
    fn the_mean_is_of_the_last_full_second_and_the_longest_is_kept() {
        let mut pace = Pace::new(0.1, 1.0, 0);
        for step in 0..10_u64 {
            let began = step * 100_000_000;
            pace.note_step(began, began + if step == 3 { 9_000_000 } else { 1_000_000 });
        }
        pace.note_step(1_000_000_000, 1_003_000_000);
        assert_eq!(pace.mean_ns(), (9 * 1_000_000 + 9_000_000 + 3_000_000) / 11);
        pace.note_step(1_100_000_000, 1_101_000_000);
        assert_eq!(pace.mean_ns(), 21_000_000 / 11);
        assert_eq!(pace.longest_ns(), 9_000_000);
    }
}
