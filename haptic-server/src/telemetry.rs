//! What the servo says, said aloud: events become `tracing` lines.
//!
//! Runs on any thread but the servo's. [`tell`] empties the event ring; missed ticks are summed up to one line per call, so
//! a caller that comes every 200 ms writes at most five such lines a second. Deliberately absent: where lines go
//! (`logging.rs`), the ticks before a fault (`flight_record.rs`), and the recording of a whole run.

use crate::device::notice::{DeviceNotice, NoticeRing, Weight};
use crate::servo::events::{EventKind, ServoEvent};
use crate::servo::state_machine::ServoFault;
use crate::servo_setup::ServoLinks;
use rtrb::Consumer;
use std::sync::atomic::Ordering;

/// What a caller has to act upon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Told {
    /// The newest fault among the events.
    pub fault: Option<ServoFault>,
    /// Whether the servo was re-armed after it.
    pub is_rearmed: bool,
    /// Ticks missed.
    pub missed: u64,
}

/// Empties the event ring into `tracing`.
pub fn tell(events: &mut Consumer<ServoEvent>, links: &ServoLinks) -> Told {
    let mut told = Told::default();
    // At most one ring's worth: a servo that keeps talking must not keep us here.
    for _ in 0..events.slots() {
        let Ok(event) = events.pop() else { break };
        match event.kind {
            EventKind::TicksMissed(missed) => told.missed += missed,
            EventKind::Faulted(fault) => told = Told { fault: Some(fault), is_rearmed: false, ..told },
            EventKind::Rearmed => told.is_rearmed = true,
            _ => {}
        }
        tell_one(&event);
    }
    if told.missed > 0 {
        tracing::warn!(missed = told.missed, "servo ticks were missed");
    }
    let lost = links.lost_events.swap(0, Ordering::Relaxed);
    if lost > 0 {
        tracing::warn!(lost, "servo events were lost because their ring was full");
    }
    told
}

/// Empties a device's notices into `tracing`; gives those that switched the force off, for the operator.
pub fn tell_notices(ring: &NoticeRing) -> Vec<String> {
    let mut faults = Vec::new();
    for _ in 0..ring.capacity() {
        let Some(DeviceNotice { device, weight, what }) = ring.pop() else { break };
        match weight {
            Weight::Note => tracing::info!(device, "haptic device: {what}"),
            Weight::Warning => tracing::warn!(device, "haptic device: {what}"),
            Weight::Fault => {
                tracing::error!(device, "haptic device: {what}");
                faults.push(what.to_string());
            }
        }
    }
    faults
}

fn tell_one(event: &ServoEvent) {
    let tick = event.tick;
    match event.kind {
        EventKind::ModeChanged { from, to } => {
            tracing::info!(tick, from = from.name(), to = to.name(), "servo mode");
        }
        EventKind::Faulted(fault) => tracing::error!(
            tick,
            code = fault.code(),
            "{fault} (`haptic-server session rearm`, or the back button of the device)"
        ),
        EventKind::Rearmed => tracing::info!(tick, "servo re-armed"),
        EventKind::RungChanged { from, to, age_ns } => {
            tracing::info!(tick, ?from, ?to, age_ns, "tissue port ladder");
        }
        EventKind::PortRefused(why) => tracing::warn!(tick, ?why, "tissue port refused"),
        EventKind::SampleRefused(why) => tracing::warn!(tick, ?why, "device sample refused"),
        EventKind::HandleChanged { handle, mode, pair } => {
            tracing::info!(tick, handle, mode, pair, "handle changed");
        }
        EventKind::OutsideTrust { handle } => {
            tracing::debug!(tick, handle, "handle beyond the trust radius of its port");
        }
        EventKind::HandleReset { handle } => {
            tracing::warn!(tick, handle, "handle was not finite and was put back to its port");
        }
        EventKind::TicksMissed(missed) => tracing::debug!(tick, missed, "ticks missed"),
        EventKind::Stopping => tracing::info!(tick, "servo stops"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::events::EventBatch;
    use crate::servo::flight_recorder::TickRecord;
    use crate::servo_setup::{EVENT_RING, Recording, TICK_RING, open};
    use protocol::servo_state::ServoState;
    use protocol::wire::Field;

    fn record(tick: u64) -> TickRecord {
        let state = ServoState { ticks: tick, ..ServoState::EMPTY };
        TickRecord { state, scheduled_ns: 1_000, now_ns: 1_500, dt_s: 0.001, compute_ns: 9, clips: 2 }
    }

    #[test]
    fn events_are_told_once_and_summed_up() {
        let (links, mut room, mut outer) = open(Recording::EveryTick);
        let mut batch = EventBatch::new();
        for kind in [EventKind::TicksMissed(3), EventKind::Faulted(ServoFault::DeviceLost), EventKind::TicksMissed(2)] {
            batch.push(ServoEvent { tick: 1, time_ns: 0, kind });
        }
        room.hand_out(&record(1), &batch);
        let told = tell(&mut outer.events, &links);
        assert_eq!(told, Told { fault: Some(ServoFault::DeviceLost), is_rearmed: false, missed: 5 });
        assert_eq!(tell(&mut outer.events, &links), Told::default());
        assert_eq!(outer.record.as_ref().map(Consumer::slots), Some(1));
        assert_eq!(links.ticks.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn full_rings_lose_and_count_but_nobody_waits() {
        const TICKS: usize = 5_000;
        let (links, mut room, outer) = open(Recording::EveryTick);
        let mut batch = EventBatch::new();
        batch.push(ServoEvent { tick: 1, time_ns: 0, kind: EventKind::Rearmed });
        for tick in 0..TICKS {
            room.hand_out(&record(tick as u64), &batch);
        }
        assert_eq!(links.lost_events.load(Ordering::Relaxed), (TICKS - EVENT_RING) as u64);
        assert_eq!(links.lost_records.load(Ordering::Relaxed), (TICKS - TICK_RING) as u64);
        assert_eq!(outer.flight.slots(), TICK_RING);
    }
}
