//! What the 1 kHz room needs but must not make itself: rings, flags, histograms.
//!
//! [`ServoLinks`] is everything that other threads share with the servo thread: each ring has one fixed size, each flag is
//! an atomic, so that nobody can make the servo wait. Orders are counters, so that none is lost or taken twice.
//! Deliberately absent: the threads on the other ends.

use crate::servo::events::{EventBatch, ServoEvent};
use crate::servo::flight_recorder::{FLIGHT_S, TickRecord};
use crate::servo::stats::ServoStats;
use crate::servo::thread::PORT_CELL;
use crossbeam::queue::ArrayQueue;
use hdrhistogram::{CreationError, Histogram};
use protocol::tissue_port::TissuePort;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Events that wait for their reader at most.
const EVENT_RING: usize = 1_024;
/// Tick records that wait for the recording at most: four seconds of a disk that does not answer.
const RECORD_RING: usize = 4_096;
/// Longest duration that the histograms tell apart, nanoseconds.
const LONGEST_NS: u64 = 10_000_000_000;
/// Significant digits of the histograms.
const DIGITS: u8 = 3;

/// Whether ticks are handed to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recording {
    /// Nobody records: no ring.
    None,
    /// Every tick goes into [`ServoLinks::record`].
    EveryTick,
}

/// What the servo thread shares with other threads.
#[derive(Debug)]
pub struct ServoLinks {
    /// Newest tissue port; the bridge thread uses `force_push`.
    pub ports: ArrayQueue<TissuePort>,
    /// Events for telemetry.
    pub events: ArrayQueue<ServoEvent>,
    /// Last two seconds of ticks.
    pub flight: ArrayQueue<TickRecord>,
    /// Ticks for the recording.
    pub record: Option<ArrayQueue<TickRecord>>,
    /// Set once: fade to zero force and end the loop.
    pub stop: AtomicBool,
    /// Deaths of the solver that the supervisor has reported.
    pub solver_deaths: AtomicU32,
    /// Re-arm commands.
    pub rearms: AtomicU32,
    /// Ticks done: the heartbeat of a loop that really turns.
    pub ticks: AtomicU64,
    /// Events that found their ring full.
    pub lost_events: AtomicU64,
    /// Ticks that found the recording's ring full.
    pub lost_records: AtomicU64,
}

impl ServoLinks {
    /// Empty rings for a servo of this period.
    #[must_use]
    pub fn new(period_ns: u64, recording: Recording) -> Self {
        let flight_ticks = (FLIGHT_S * 1e9 / period_ns.max(1) as f64).clamp(1.0, 100_000.0) as usize;
        Self {
            ports: ArrayQueue::new(PORT_CELL),
            events: ArrayQueue::new(EVENT_RING),
            flight: ArrayQueue::new(flight_ticks),
            record: match recording {
                Recording::None => None,
                Recording::EveryTick => Some(ArrayQueue::new(RECORD_RING)),
            },
            stop: AtomicBool::new(false),
            solver_deaths: AtomicU32::new(0),
            rearms: AtomicU32::new(0),
            ticks: AtomicU64::new(0),
            lost_events: AtomicU64::new(0),
            lost_records: AtomicU64::new(0),
        }
    }

    /// Fade to zero force and end the loop.
    pub fn order_stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// The solver is known to be dead.
    pub fn report_solver_death(&self) {
        self.solver_deaths.fetch_add(1, Ordering::Relaxed);
    }

    /// Leave a latched fault.
    pub fn order_rearm(&self) {
        self.rearms.fetch_add(1, Ordering::Relaxed);
    }

    /// The servo's side: hands a tick and its events out; what finds no room is counted, nothing waits.
    pub(crate) fn hand_out(&self, tick: &TickRecord, events: &EventBatch) {
        let mut lost = u64::from(events.dropped());
        for event in events.as_slice() {
            lost += u64::from(self.events.push(*event).is_err());
        }
        if lost > 0 {
            self.lost_events.fetch_add(lost, Ordering::Relaxed);
        }
        if self.record.as_ref().is_some_and(|ring| ring.push(*tick).is_err()) {
            self.lost_records.fetch_add(1, Ordering::Relaxed);
        }
        self.ticks.store(tick.state.ticks, Ordering::Relaxed);
    }
}

/// Empty histograms of fixed size, their pages touched.
///
/// # Errors
/// None in practice: the bounds are constants that the histogram accepts.
pub fn new_stats() -> Result<ServoStats, CreationError> {
    let histogram = || {
        let mut histogram = Histogram::<u64>::new_with_bounds(1, LONGEST_NS, DIGITS)?;
        histogram.reset();
        Ok(histogram)
    };
    Ok(ServoStats {
        wake_ns: histogram()?,
        compute_ns: histogram()?,
        port_age_ns: histogram()?,
        sample_to_force_ns: histogram()?,
        peak_force_n: 0.0,
    })
}
