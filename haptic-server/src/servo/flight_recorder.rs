//! The last two seconds of ticks, kept so that a fault can be understood.
//!
//! A ring that was made outside the room holds whole tick records; the newest replaces the oldest. The servo only pushes.
//! On a fault another thread empties the ring (`telemetry.rs`) while the servo goes on pushing: the fault is at most some
//! milliseconds before the end of the record. The same record goes to the recording, when there is one.
//! Deliberately absent: files and formats.

use crossbeam::queue::ArrayQueue;
use protocol::servo_state::ServoState;

/// How far back the ring reaches, seconds.
pub const FLIGHT_S: f64 = 2.0;

/// One tick, whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickRecord {
    /// The servo after the tick, as published.
    pub state: ServoState,
    /// When the tick was due, monotonic nanoseconds.
    pub scheduled_ns: u64,
    /// When it ran, monotonic nanoseconds.
    pub now_ns: u64,
    /// Time since the tick before, seconds.
    pub dt_s: f64,
    /// Time inside the tick, nanoseconds.
    pub compute_ns: u64,
    /// `CLIP_…` bits of the safety stage.
    pub clips: u32,
}

/// The servo's end of the ring.
#[derive(Clone, Copy, Debug)]
pub struct FlightRecorder<'a> {
    ring: &'a ArrayQueue<TickRecord>,
}

impl<'a> FlightRecorder<'a> {
    /// Records into `ring`.
    #[must_use]
    pub fn new(ring: &'a ArrayQueue<TickRecord>) -> Self {
        Self { ring }
    }

    /// Adds a tick; a full ring loses its oldest one.
    pub fn record(&self, tick: &TickRecord) {
        self.ring.force_push(*tick);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo_setup::{Recording, ServoLinks};
    use protocol::wire::Field;

    #[test]
    fn the_ring_keeps_the_newest_two_seconds() {
        let links = ServoLinks::new(1_000_000, Recording::None);
        let recorder = FlightRecorder::new(&links.flight);
        let mut tick =
            TickRecord { state: ServoState::EMPTY, scheduled_ns: 0, now_ns: 0, dt_s: 0.001, compute_ns: 0, clips: 0 };
        for k in 0..5_000 {
            tick.now_ns = k;
            recorder.record(&tick);
        }
        assert_eq!(links.flight.len(), 2_000);
        assert_eq!(links.flight.pop().map(|t| t.now_ns), Some(3_000));
    }
}
