//! The plain timer baseline: a thread that sleeps until the next millisecond and notes how late it woke.
//!
//! Absolute sleep on `CLOCK_MONOTONIC`, at `SCHED_FIFO` when the rights are there, as the servo does. Late periods are skipped
//! and counted, never caught up in a burst. Nanoseconds. Deliberately absent: any work in the tick.

use super::report::Percentiles;
use hdrhistogram::Histogram;
use rustix::thread::{ClockId, Timespec, clock_nanosleep_absolute};
use rustix::time::clock_gettime;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// Period, nanoseconds: the servo's.
const PERIOD_NS: u64 = 1_000_000;
/// `SCHED_FIFO` priority: the servo's.
const PRIORITY: u8 = 80;
/// Longest lateness that the histogram tells apart, nanoseconds: a minute.
const LONGEST_NS: u64 = 60_000_000_000;
/// Digits that the histogram keeps.
const DIGITS: u8 = 3;

/// A running baseline thread.
pub struct Baseline {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Measured>,
}

/// What the baseline saw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measured {
    /// Lateness of its wake-ups.
    pub wake_ns: Percentiles,
    /// Wake-ups.
    pub ticks: u64,
    /// Periods skipped.
    pub missed: u64,
    /// Whether it ran at `SCHED_FIFO`.
    pub real_time: bool,
}

impl Baseline {
    /// Starts the thread.
    ///
    /// # Errors
    /// The operating system gives no thread.
    pub fn start() -> std::io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let thread = std::thread::Builder::new().name("timer-baseline".into()).spawn(move || sleep_and_note(&seen))?;
        Ok(Self { stop, thread })
    }

    /// Stops it and tells what it saw.
    #[must_use]
    pub fn finish(self) -> Measured {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}

fn sleep_and_note(stop: &AtomicBool) -> Measured {
    let Ok(mut lateness) = Histogram::<u64>::new_with_bounds(1, LONGEST_NS, DIGITS) else {
        return Measured::default();
    };
    let real_time = ask_for_fifo();
    let (mut ticks, mut missed) = (0, 0);
    let mut next_ns = now_ns() + PERIOD_NS;
    while !stop.load(Ordering::Relaxed) {
        // An interrupted sleep shows as an early wake-up and sleeps again.
        let _interrupted = clock_nanosleep_absolute(ClockId::Monotonic, &timespec(next_ns));
        let now = now_ns();
        if now < next_ns {
            continue;
        }
        lateness.saturating_record(now - next_ns);
        ticks += 1;
        let skipped = (now - next_ns) / PERIOD_NS;
        missed += skipped;
        next_ns += (skipped + 1) * PERIOD_NS;
    }
    Measured { wake_ns: Percentiles::from(&lateness), ticks, missed, real_time }
}

fn ask_for_fifo() -> bool {
    let Ok(priority) = PRIORITY.try_into() else { return false };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy).is_ok()
}

fn now_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    // The monotonic clock counts up from 0 at boot.
    now.tv_sec.unsigned_abs() * 1_000_000_000 + now.tv_nsec.unsigned_abs()
}

fn timespec(ns: u64) -> Timespec {
    Timespec { tv_sec: (ns / 1_000_000_000) as i64, tv_nsec: (ns % 1_000_000_000) as i64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_period_is_a_wake_up_or_a_miss() {
        let begin = now_ns();
        let baseline = Baseline::start().expect("a thread");
        std::thread::sleep(std::time::Duration::from_millis(100));
        let measured = baseline.finish();
        let elapsed = (now_ns() - begin) / PERIOD_NS;
        assert!(measured.ticks >= 1 && measured.ticks + measured.missed <= elapsed, "{measured:?} in {elapsed} ms");
        assert!(measured.wake_ns.p50 <= measured.wake_ns.max);
    }
}
