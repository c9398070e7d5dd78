//! Absolute-time schedule of the servo thread.
//!
//! next += period; when that moment has passed, next += ⌈late / period⌉ · period: whole periods are skipped and counted,
//! never caught up in a burst (the rule of ros2_control). Arithmetic only: who sleeps and who reads the clock is
//! `thread.rs`. Also here: how many ticks a tick has missed, and whether the machine was suspended meanwhile
//! (`CLOCK_MONOTONIC` stands still in suspend, `CLOCK_BOOTTIME` does not). Nanoseconds.

/// A growth of `CLOCK_BOOTTIME − CLOCK_MONOTONIC` beyond this means that the machine slept, nanoseconds.
const SUSPEND_GAP_NS: u64 = 100_000_000;

/// When the next tick is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schedule {
    period_ns: u64,
    next_ns: u64,
}

impl Schedule {
    /// The first tick is due one period from now.
    #[must_use]
    pub fn starting(now_ns: u64, period_ns: u64) -> Self {
        let period_ns = period_ns.max(1);
        Self { period_ns, next_ns: now_ns.saturating_add(period_ns) }
    }

    /// Deadline of the coming tick.
    #[must_use]
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// After a tick: moves the deadline past `now_ns`; gives the periods that were skipped.
    pub fn advance(&mut self, now_ns: u64) -> u64 {
        self.next_ns = self.next_ns.saturating_add(self.period_ns);
        let late = now_ns.saturating_sub(self.next_ns);
        let skipped = late.div_ceil(self.period_ns);
        self.next_ns = self.next_ns.saturating_add(skipped.saturating_mul(self.period_ns));
        skipped
    }
}

/// Counts missed ticks from the scheduled times of the executed ones, whoever keeps the schedule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissCounter {
    last_scheduled_ns: Option<u64>,
    /// Since start.
    pub total: u64,
    /// Without an on-time tick in between.
    pub in_a_row: u64,
}

impl MissCounter {
    /// Takes the scheduled time of the tick that runs now; gives how many were missed just before it.
    pub fn measure(&mut self, scheduled_ns: u64, period_ns: u64) -> u64 {
        let last = self.last_scheduled_ns.replace(scheduled_ns);
        let gap = last.map_or(period_ns, |last| scheduled_ns.saturating_sub(last));
        let missed = (gap.saturating_add(period_ns / 2) / period_ns.max(1)).saturating_sub(1);
        self.total = self.total.saturating_add(missed);
        self.in_a_row = if missed == 0 { 0 } else { self.in_a_row.saturating_add(missed) };
        missed
    }
}

/// Notices a suspend of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SuspendWatch {
    offset_ns: Option<u64>,
}

/// What the suspend watch saw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wakefulness {
    /// The machine was awake since the last look.
    Awake,
    /// The machine was suspended since the last look.
    Suspended,
}

impl SuspendWatch {
    /// Compares the two clocks.
    pub fn measure(&mut self, boottime_ns: u64, monotonic_ns: u64) -> Wakefulness {
        let offset = boottime_ns.saturating_sub(monotonic_ns);
        match self.offset_ns.replace(offset) {
            Some(last) if offset > last.saturating_add(SUSPEND_GAP_NS) => Wakefulness::Suspended,
            _ => Wakefulness::Awake,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const P: u64 = 1_000_000;

    #[test]
    fn on_time_ticks_keep_the_grid_however_they_jitter() {
        let mut schedule = Schedule::starting(0, P);
        for k in 1..100 {
            assert_eq!(schedule.next_ns(), k * P);
            assert_eq!(schedule.advance(k * P + (k * 37_777) % (P - 1)), 0);
        }
    }

    #[test]
    fn late_ticks_are_skipped_and_counted_never_caught_up() {
        for missed in [1, 5, 19, 20, 100] {
            let mut schedule = Schedule::starting(0, P);
            // The tick due at 1 ms ends 0.3 ms after the deadline of the last one that was missed.
            assert_eq!(schedule.advance(P + missed * P + 300_000), missed);
            assert_eq!(schedule.next_ns(), (missed + 2) * P);
            assert_eq!(schedule.advance((missed + 2) * P + 1_000), 0);
        }
    }

    #[test]
    fn misses_are_seen_from_the_scheduled_times() {
        let mut misses = MissCounter::default();
        assert_eq!(misses.measure(5 * P, P), 0);
        assert_eq!(misses.measure(6 * P, P), 0);
        assert_eq!(misses.measure(12 * P, P), 5);
        assert_eq!(misses.measure(14 * P, P), 1);
        assert_eq!((misses.total, misses.in_a_row), (6, 6));
        assert_eq!(misses.measure(15 * P + 200_000, P), 0);
        assert_eq!((misses.total, misses.in_a_row), (6, 0));
        assert_eq!(misses.measure(3 * P, P), 0);
        // A clock that jumps to its end: a large count, no overflow.
        assert!(misses.measure(u64::MAX, P) > 1 << 40 && misses.measure(0, P) == 0);
        assert!(misses.measure(u64::MAX, 1) > 1 << 63 && misses.measure(0, 1) == 0 && misses.measure(u64::MAX, 1) > 0);
        assert_eq!((misses.total, misses.in_a_row), (u64::MAX, u64::MAX - 1));
    }

    #[test]
    fn a_suspend_is_noticed_once() {
        let mut watch = SuspendWatch::default();
        assert_eq!(watch.measure(500 * P, 100 * P), Wakefulness::Awake);
        assert_eq!(watch.measure(501 * P, 101 * P), Wakefulness::Awake);
        assert_eq!(watch.measure(802 * P, 102 * P), Wakefulness::Suspended);
        assert_eq!(watch.measure(803 * P, 103 * P), Wakefulness::Awake);
    }
}
