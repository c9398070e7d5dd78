//! What the 1 kHz room needs but must not make itself: cell, rings, flags, histograms.
//!
//! Everything that crosses the room's border is wait-free on the servo's side, whatever the other thread is doing when it
//! loses its processor: the newest port comes in through a triple buffer, events and ticks leave through rings with one
//! writer and one reader each, orders are atomic counters, so that none is lost or taken twice. [`open`] makes both ends;
//! each thread is given its own. Deliberately absent: the threads on the other ends.

use crate::servo::events::{EventBatch, ServoEvent};
use crate::servo::flight_recorder::TickRecord;
use crate::servo::stats::ServoStats;
use hdrhistogram::{CreationError, Histogram};
use protocol::tissue_port::TissuePort;
use protocol::wire::Field;
use rtrb::{Consumer, Producer, RingBuffer};
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use triple_buffer::{Input, Output, triple_buffer};

/// Events that wait for their reader at most.
pub const EVENT_RING: usize = 1_024;
/// Ticks that wait for a reader at most: four seconds of a disk that does not answer.
pub const TICK_RING: usize = 4_096;
/// Longest duration that the histograms tell apart, nanoseconds.
const LONGEST_NS: u64 = 10_000_000_000;
/// Significant digits of the histograms.
const DIGITS: u8 = 3;

/// Whether ticks are handed to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recording {
    /// Nobody records: no ring.
    None,
    /// Every tick goes into [`OuterEnds::record`].
    EveryTick,
}

/// Flags and counters that the servo thread shares with other threads.
#[derive(Debug, Default)]
pub struct ServoLinks {
    /// Set once: fade to zero force and end the loop.
    pub stop: AtomicBool,
    /// Deaths of the solver that the supervisor has reported.
    pub solver_deaths: AtomicU32,
    /// Re-arm commands.
    pub rearms: AtomicU32,
    /// Who is the hand of a pointer device: process id, and number of the turn above it.
    pub hand: AtomicU64,
    /// Ticks done: the heartbeat of a loop that really turns.
    pub ticks: AtomicU64,
    /// Events that found their ring full.
    pub lost_events: AtomicU64,
    /// Ticks that found the recording's ring full.
    pub lost_records: AtomicU64,
}

/// A ring had no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingFull;

/// Where ticks go that a recording shall have.
pub trait TickRing {
    /// Takes a tick.
    ///
    /// # Errors
    /// There is no room; the tick is lost.
    fn put(&mut self, tick: TickRecord) -> Result<(), RingFull>;
}

impl TickRing for Producer<TickRecord> {
    fn put(&mut self, tick: TickRecord) -> Result<(), RingFull> {
        self.push(tick).map_err(|_| RingFull)
    }
}

/// No recording by type: what is compiled for it has no branch for one.
impl TickRing for Infallible {
    fn put(&mut self, _: TickRecord) -> Result<(), RingFull> {
        match *self {}
    }
}

/// The servo thread's ends; `R` takes ticks for a recording, if there is one.
#[derive(Debug)]
pub struct RoomEnds<R = Producer<TickRecord>> {
    /// Newest tissue port.
    pub(crate) ports: Output<TissuePort>,
    events: Producer<ServoEvent>,
    flight: Producer<TickRecord>,
    record: Option<R>,
    links: Arc<ServoLinks>,
}

/// The ends of the other threads.
#[derive(Debug)]
pub struct OuterEnds {
    /// Where the bridge puts a new tissue port.
    pub ports: Input<TissuePort>,
    /// Events for telemetry.
    pub events: Consumer<ServoEvent>,
    /// Every tick, for the flight record.
    pub flight: Consumer<TickRecord>,
    /// Every tick, for the recording if there is one.
    pub record: Option<Consumer<TickRecord>>,
}

/// Empty cell and rings.
#[must_use]
pub fn open(recording: Recording) -> (Arc<ServoLinks>, RoomEnds, OuterEnds) {
    let links = Arc::new(ServoLinks::default());
    let (to_room, ports) = triple_buffer(&TissuePort::EMPTY);
    let (events, told) = RingBuffer::new(EVENT_RING);
    let (flight, flown) = RingBuffer::new(TICK_RING);
    let (record, recorded) = match recording {
        Recording::None => (None, None),
        Recording::EveryTick => {
            let (writer, reader) = RingBuffer::new(TICK_RING);
            (Some(writer), Some(reader))
        }
    };
    let room = RoomEnds { ports, events, flight, record, links: links.clone() };
    (links, room, OuterEnds { ports: to_room, events: told, flight: flown, record: recorded })
}

impl ServoLinks {
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

    /// Says who is the hand of a pointer device, 0 nobody, and in which turn.
    pub fn tell_hand(&self, sender: u32, turn: u32) {
        self.hand.store(u64::from(turn) << 32 | u64::from(sender), Ordering::Relaxed);
    }

    /// Who is the hand of a pointer device, and in which turn.
    #[must_use]
    pub fn hand(&self) -> (u32, u32) {
        let both = self.hand.load(Ordering::Relaxed);
        (both as u32, (both >> 32) as u32)
    }
}

impl RoomEnds {
    /// The same ends in a form that cannot record: the measure of what a recording that is absent costs.
    #[must_use]
    pub fn without_recording(self) -> RoomEnds<Infallible> {
        let Self { ports, events, flight, links, .. } = self;
        RoomEnds { ports, events, flight, record: None, links }
    }
}

impl<R: TickRing> RoomEnds<R> {
    /// Flags and counters.
    pub(crate) fn links(&self) -> &ServoLinks {
        &self.links
    }

    /// Hands a tick and its events out; what finds no room is counted (a tick that the flight record misses shows there as
    /// a gap), nothing waits.
    pub fn hand_out(&mut self, tick: &TickRecord, events: &EventBatch) {
        tell(&mut self.events, &mut self.flight, &self.links, tick, events);
        if let Some(ring) = &mut self.record {
            record(ring, &self.links, tick);
        }
        self.links.ticks.store(tick.state.ticks, Ordering::Relaxed);
    }
}

/// What a run that records hands out besides; apart, so that a tick that does not record pays for one branch.
#[inline(never)]
fn record<R: TickRing>(ring: &mut R, links: &ServoLinks, tick: &TickRecord) {
    if ring.put(*tick).is_err() {
        links.lost_records.fetch_add(1, Ordering::Relaxed);
    }
}

/// What every run hands out: events, and the tick for the flight record.
fn tell(
    told: &mut Producer<ServoEvent>,
    flight: &mut Producer<TickRecord>,
    links: &ServoLinks,
    tick: &TickRecord,
    events: &EventBatch,
) {
    let mut lost = u64::from(events.dropped());
    for event in events.as_slice() {
        lost += u64::from(told.push(*event).is_err());
    }
    if lost > 0 {
        links.lost_events.fetch_add(lost, Ordering::Relaxed);
    }
    let _gap = flight.push(*tick);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_is_still_being_written_is_not_seen_and_the_newest_whole_one_is() {
        let (_, mut room, mut outer) = open(Recording::None);
        assert!(!room.ports.update(), "nothing was delivered");
        for epoch in 1..=3 {
            outer.ports.write(TissuePort { epoch, ..TissuePort::EMPTY });
        }
        // A writer that lost its processor in the middle of the next one.
        outer.ports.input_buffer_mut().epoch = 4;
        assert!(room.ports.update());
        assert_eq!(room.ports.output_buffer().epoch, 3);
        assert!(!room.ports.update());
        outer.ports.publish();
        assert!(room.ports.update());
        assert_eq!(room.ports.output_buffer().epoch, 4);
    }
}
