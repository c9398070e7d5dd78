//! `doctor --latency`: a plain timer at 1 kHz, alone or while every processor computes, graded as `latency-harness` grades.
//!
//! It measures the machine, not the server: the servo's own schedule and rights, and no work in the tick. With `--load` one thread of
//! ordinary priority per processor walks through memory meanwhile (LinuxCNC: abuse the computer while testing it). Seconds show the
//! order of magnitude, minutes the worst case. Deliberately absent: a limit below which the program is wrong.

use super::check::Check;
use crate::error::ServerError;
use crate::exit;
use crate::latency::{Baseline, Grade, grade, success_rate};
use crate::realtime::stay_awake;
use crate::summary::Percentiles;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Words that a load thread walks through: more than most second-level caches hold.
const WALK: usize = 1 << 20;

/// What else the machine does meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Load {
    /// What it does anyway.
    None,
    /// A busy thread on each processor.
    Cpu,
}

/// What was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Latency {
    /// Seconds measured.
    pub duration_s: f64,
    /// What else ran.
    pub load: Load,
    /// Wake-ups.
    pub ticks: u64,
    /// Periods skipped.
    pub missed: u64,
    /// Lateness of the wake-ups.
    pub wake_ns: Option<Percentiles>,
    /// Share of the ticks that were not missed.
    pub success_rate: f64,
    /// The machine in one word.
    pub grade: Grade,
    /// Why.
    pub grade_reason: String,
    /// Whether the timer ran without its rights.
    pub degraded: bool,
    /// What it asked for and did not get.
    pub degraded_reasons: Vec<String>,
}

/// Measures for this long.
///
/// # Errors
/// The operating system gives no thread.
pub fn measure(duration_s: f64, load: Load) -> Result<Latency, ServerError> {
    let no_thread = |e| ServerError::Unavailable(format!("cannot start a thread: {e}; raise the limit of processes"));
    let threads = match load {
        Load::None => 0,
        Load::Cpu => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let load_threads = (0..threads).map(|_| LoadThread::start()).collect::<Result<Vec<_>, _>>().map_err(no_thread)?;
    // As the servo process does.
    let _awake = stay_awake();
    let timer = Baseline::start().map_err(no_thread)?;
    std::thread::sleep(Duration::from_secs_f64(duration_s));
    let measured = timer.finish();
    drop(load_threads);
    // The timer is the measurement itself here, so it is its own baseline.
    let wake = measured.wake_ns.as_ref();
    let (grade, reason) = grade(wake, wake, measured.ticks, measured.missed);
    let grade_reason = reason.split("; ").next().unwrap_or_default().to_owned();
    Ok(Latency {
        duration_s,
        load,
        ticks: measured.ticks,
        missed: measured.missed,
        wake_ns: measured.wake_ns,
        success_rate: success_rate(measured.ticks, measured.missed),
        grade,
        grade_reason,
        degraded: !measured.missing_rights.is_empty(),
        degraded_reasons: measured.missing_rights,
    })
}

/// The row for it.
pub(super) fn check(latency: &Latency) -> Check {
    const NAME: &str = "latency";
    let under = match latency.load {
        Load::None => "",
        Load::Cpu => " with every processor busy",
    };
    let rights = if latency.degraded { ", without real-time rights" } else { "" };
    let p99 = latency.wake_ns.map_or_else(String::new, |w| format!(", p99 {:.1} µs", w.p99 as f64 / 1e3));
    let found = format!("{}: {}{p99}, {} s{under}{rights}", latency.grade, latency.grade_reason, latency.duration_s);
    let remedy = if latency.degraded {
        "give the rights first (see real_time_trial)"
    } else {
        "see kernel, hypervisor, governor and c_states above; measure for minutes, with --load"
    };
    match latency.grade {
        Grade::Excellent | Grade::Good => Check::ok(NAME, found),
        Grade::Fair => Check::warn(NAME, found, remedy),
        Grade::Unfit => Check::fail(NAME, found, remedy, exit::UNAVAILABLE),
    }
}

/// A thread that computes until it is dropped.
struct LoadThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LoadThread {
    fn start() -> std::io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let thread = std::thread::Builder::new().name("load".to_owned()).spawn(move || walk(&seen))?;
        Ok(Self { stop, thread: Some(thread) })
    }
}

impl Drop for LoadThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A load thread has nothing to tell.
            let _ended = thread.join();
        }
    }
}

fn walk(stop: &AtomicBool) {
    let mut memory = vec![1_u64; WALK];
    let mut at = 0_usize;
    while !stop.load(Ordering::Relaxed) {
        for _ in 0..4096 {
            // A linear congruential step: every word is visited, none is guessed by the cache.
            at = (at.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)) % WALK;
            memory[at] = memory[at].wrapping_mul(3).wrapping_add(at as u64);
        }
        std::hint::black_box(&mut memory);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;

    fn latency(grade: Grade, degraded: bool) -> Latency {
        Latency {
            duration_s: 2.0,
            load: Load::Cpu,
            ticks: 2000,
            missed: 0,
            wake_ns: Some(Percentiles { p50: 1_000, p99: 12_300, p999: 13_000, max: 14_000 }),
            success_rate: 1.0,
            grade,
            grade_reason: "worst wake-up 14.0 µs late".into(),
            degraded,
            degraded_reasons: Vec::new(),
        }
    }

    #[test]
    fn the_grade_decides_the_row() {
        for (grade, expected) in [
            (Grade::Excellent, Status::Ok),
            (Grade::Good, Status::Ok),
            (Grade::Fair, Status::Warn),
            (Grade::Unfit, Status::Fail),
        ] {
            assert_eq!(check(&latency(grade, false)).status, expected);
        }
        let row = check(&latency(Grade::Fair, true));
        assert!(row.found.contains("without real-time rights") && row.found.contains("p99 12.3 µs"), "{row:?}");
        assert!(row.remedy.is_some_and(|r| r.contains("real_time_trial")));
    }

    #[test]
    fn a_short_measurement_has_ticks_and_ends_its_load() {
        let measured = measure(0.05, Load::Cpu).expect("threads");
        assert!(measured.ticks >= 1 && measured.wake_ns.is_some(), "{measured:?}");
        assert!((0.0..=1.0).contains(&measured.success_rate));
    }
}
