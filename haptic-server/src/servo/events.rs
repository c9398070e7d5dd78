//! What the servo has to say: plain `Copy` events, collected per tick in a batch of fixed size.
//!
//! The servo thread never logs. `thread.rs` pushes each batch into a ring; `telemetry.rs` empties the ring on another
//! thread and turns the events into `tracing`. A full batch or ring drops events and counts them: the loop never waits.

use crate::servo::ladder::{PortRefusal, Rung};
use crate::servo::sample::SampleRefusal;
use crate::servo::state_machine::{Mode, ServoFault};

/// Events that one tick can tell; a tick has at most one of each kind, two of handle changes.
pub const MAX_EVENTS_PER_TICK: usize = 12;

/// One thing that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The state machine moved.
    ModeChanged {
        /// Before.
        from: Mode,
        /// Now.
        to: Mode,
    },
    /// A fault was found; the servo stays in Fault until re-armed.
    Faulted(ServoFault),
    /// The operator re-armed the servo.
    Rearmed,
    /// The late-solver ladder moved.
    RungChanged {
        /// Before.
        from: Rung,
        /// Now.
        to: Rung,
        /// Age of the port, nanoseconds.
        age_ns: u64,
    },
    /// A port was refused.
    PortRefused(PortRefusal),
    /// A sample was refused (told for the first in a row).
    SampleRefused(SampleRefusal),
    /// A handle changed its mode (`HANDLE_…` codes).
    HandleChanged {
        /// Handle.
        handle: u32,
        /// New mode.
        mode: u32,
        /// Suture pair.
        pair: u32,
    },
    /// A handle left the region where its port is trusted (told once per stay).
    OutsideTrust {
        /// Handle.
        handle: u32,
    },
    /// A handle's state was not finite and was put back to its port.
    HandleReset {
        /// Handle.
        handle: u32,
    },
    /// Ticks were skipped.
    TicksMissed(u64),
    /// A stop order arrived.
    Stopping,
}

/// An event with its place in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoEvent {
    /// Tick number, from 1.
    pub tick: u64,
    /// Monotonic nanoseconds of the tick.
    pub time_ns: u64,
    /// What happened.
    pub kind: EventKind,
}

/// The events of one tick; in whole cache lines, so that every copy costs the same.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct EventBatch {
    events: [ServoEvent; MAX_EVENTS_PER_TICK],
    count: usize,
    dropped: u32,
}

impl EventBatch {
    /// Empty.
    #[must_use]
    pub fn new() -> Self {
        let filler = ServoEvent { tick: 0, time_ns: 0, kind: EventKind::Stopping };
        Self { events: [filler; MAX_EVENTS_PER_TICK], count: 0, dropped: 0 }
    }

    /// Adds an event; a full batch counts it as dropped.
    pub fn push(&mut self, event: ServoEvent) {
        match self.events.get_mut(self.count) {
            Some(slot) => {
                *slot = event;
                self.count += 1;
            }
            None => self.dropped = self.dropped.saturating_add(1),
        }
    }

    /// Events that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// In order.
    #[must_use]
    pub fn as_slice(&self) -> &[ServoEvent] {
        &self.events[..self.count]
    }
}

impl Default for EventBatch {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_batch_keeps_the_first_events_and_counts_the_rest() {
        let mut batch = EventBatch::new();
        assert!(batch.as_slice().is_empty());
        for tick in 0..20 {
            batch.push(ServoEvent { tick, time_ns: 0, kind: EventKind::Rearmed });
        }
        assert_eq!(batch.as_slice().len(), MAX_EVENTS_PER_TICK);
        assert_eq!(batch.as_slice()[3].tick, 3);
        assert_eq!(batch.dropped(), 8);
    }
}
