//! The plain timer baseline: a thread that sleeps until the next millisecond and notes how late it woke.
//!
//! Absolute sleep on `CLOCK_MONOTONIC` by the servo's own schedule and with the rights that the servo asks for: late periods
//! are skipped and counted, never caught up in a burst. Nanoseconds. Deliberately absent: any work in the tick.

use crate::realtime::{RealtimeConfig, acquire};
use crate::servo::clock::Schedule;
use crate::summary::Percentiles;
use hdrhistogram::Histogram;
use rustix::thread::{ClockId, Timespec, clock_nanosleep_absolute};
use rustix::time::clock_gettime;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Period, nanoseconds: the servo's.
const PERIOD_NS: u64 = 1_000_000;
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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Measured {
    /// Lateness of its wake-ups, if there was one.
    pub wake_ns: Option<Percentiles>,
    /// Wake-ups.
    pub ticks: u64,
    /// Periods skipped.
    pub missed: u64,
    /// What it asked for and did not get, in words.
    pub missing_rights: Vec<String>,
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
    let rights = acquire(&RealtimeConfig::default());
    let missing_rights = if rights.is_degraded() { rights.reasons() } else { Vec::new() };
    let (mut ticks, mut missed) = (0, 0);
    let mut schedule = Schedule::starting(now_ns(), PERIOD_NS);
    // However short the run, one wake-up is measured.
    while ticks == 0 || !stop.load(Ordering::Relaxed) {
        let due_ns = schedule.next_ns();
        // An interrupted sleep shows as an early wake-up and sleeps again.
        let _interrupted = clock_nanosleep_absolute(ClockId::Monotonic, &timespec(due_ns));
        let now = now_ns();
        if now < due_ns {
            continue;
        }
        lateness.saturating_record(now - due_ns);
        ticks += 1;
        missed += schedule.advance(now);
    }
    Measured { wake_ns: Percentiles::of(&lateness), ticks, missed, missing_rights }
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
        assert!(measured.wake_ns.is_some_and(|p| p.p50 <= p.max), "{measured:?}");
    }
}
