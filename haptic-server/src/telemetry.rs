//! What the servo says, said aloud: events become `tracing` lines, a fault becomes a flight record.
//!
//! Runs on any thread but the servo's. [`tell`] empties the event ring; missed ticks are summed up to one line per call, so
//! a caller that comes every 200 ms writes at most five such lines a second. [`write_flight_record`] empties the ring of the
//! last two seconds into a CSV: one row per tick, SI units in the column names.
//! Deliberately absent: where lines go (`logging.rs`), and the recording of a whole run.

use crate::servo::events::{EventKind, ServoEvent};
use crate::servo::flight_recorder::TickRecord;
use crate::servo::state_machine::ServoFault;
use crate::servo_setup::ServoLinks;
use crossbeam::queue::ArrayQueue;
use std::io::Write;
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
pub fn tell(links: &ServoLinks) -> Told {
    let mut told = Told::default();
    // At most one ring's worth: a servo that keeps talking must not keep us here.
    for _ in 0..links.events.capacity() {
        let Some(event) = links.events.pop() else { break };
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

fn tell_one(event: &ServoEvent) {
    let tick = event.tick;
    match event.kind {
        EventKind::ModeChanged { from, to } => {
            tracing::info!(tick, from = from.name(), to = to.name(), "servo mode");
        }
        EventKind::Faulted(fault) => tracing::error!(tick, code = fault.code(), "{fault}"),
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

/// Columns of a flight record.
const COLUMNS: [&str; 32] = [
    "tick",
    "now_ns",
    "late_ns",
    "dt_s",
    "compute_ns",
    "mode",
    "fault",
    "flags",
    "missed",
    "port_sequence",
    "port_age_ns",
    "port_rung",
    "buttons",
    "x_m",
    "y_m",
    "z_m",
    "vx_m_per_s",
    "vy_m_per_s",
    "vz_m_per_s",
    "fx_n",
    "fy_n",
    "fz_n",
    "wanted_x_n",
    "wanted_y_n",
    "wanted_z_n",
    "clips",
    "handle_0_mode",
    "handle_0_x_m",
    "handle_0_y_m",
    "handle_0_z_m",
    "line_tension_n",
    "energy_to_hand_j",
];

/// Empties the flight ring into a CSV; gives the number of ticks.
///
/// # Errors
/// What the writer says.
pub fn write_flight_record(ring: &ArrayQueue<TickRecord>, out: &mut dyn Write) -> std::io::Result<u64> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(COLUMNS)?;
    let mut ticks = 0;
    for _ in 0..ring.capacity() {
        let Some(tick) = ring.pop() else { break };
        write_tick(&mut csv, &tick)?;
        ticks += 1;
    }
    csv.flush()?;
    Ok(ticks)
}

fn write_tick<W: Write>(csv: &mut csv::Writer<W>, tick: &TickRecord) -> Result<(), csv::Error> {
    let state = &tick.state;
    let (device, handle) = (&state.devices[0], &state.handles[0]);
    let counts = [tick.compute_ns, u64::from(state.mode), u64::from(state.fault), u64::from(state.flags), state.missed];
    let port = [state.port_sequence, state.port_age_ns, u64::from(state.port_rung), u64::from(device.buttons)];
    let vectors = [device.position_m, device.velocity_m_per_s, device.force_n, device.unclipped_force_n];
    csv.write_field(state.ticks.to_string())?;
    csv.write_field(tick.now_ns.to_string())?;
    csv.write_field(tick.now_ns.saturating_sub(tick.scheduled_ns).to_string())?;
    csv.write_field(tick.dt_s.to_string())?;
    for number in counts.iter().chain(&port) {
        csv.write_field(number.to_string())?;
    }
    for number in vectors.as_flattened() {
        csv.write_field(number.to_string())?;
    }
    csv.write_field(tick.clips.to_string())?;
    csv.write_field(handle.mode.to_string())?;
    for number in handle.position_m.iter().chain([&handle.line_tension_n, &state.energy_to_hand_j]) {
        csv.write_field(number.to_string())?;
    }
    csv.write_record(None::<&[u8]>)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::events::EventBatch;
    use crate::servo_setup::Recording;
    use protocol::servo_state::ServoState;
    use protocol::wire::Field;

    fn record(tick: u64) -> TickRecord {
        let mut state = ServoState::EMPTY;
        state.ticks = tick;
        TickRecord { state, scheduled_ns: 1_000, now_ns: 1_500, dt_s: 0.001, compute_ns: 9, clips: 2 }
    }

    #[test]
    fn events_are_told_once_and_summed_up() {
        let links = ServoLinks::new(1_000_000, Recording::EveryTick);
        let mut batch = EventBatch::new();
        for kind in [EventKind::TicksMissed(3), EventKind::Faulted(ServoFault::DeviceLost), EventKind::TicksMissed(2)] {
            batch.push(ServoEvent { tick: 1, time_ns: 0, kind });
        }
        links.hand_out(&record(1), &batch);
        assert_eq!(tell(&links), Told { fault: Some(ServoFault::DeviceLost), is_rearmed: false, missed: 5 });
        assert_eq!(tell(&links), Told::default());
        assert_eq!(links.record.as_ref().map(ArrayQueue::len), Some(1));
        assert_eq!(links.ticks.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn a_full_event_ring_loses_and_counts_but_never_waits() {
        let links = ServoLinks::new(1_000_000, Recording::None);
        let mut batch = EventBatch::new();
        batch.push(ServoEvent { tick: 1, time_ns: 0, kind: EventKind::Rearmed });
        for tick in 0..2_000 {
            links.hand_out(&record(tick), &batch);
        }
        assert_eq!(links.lost_events.load(Ordering::Relaxed), 2_000 - links.events.capacity() as u64);
    }

    #[test]
    fn a_flight_record_has_a_row_per_tick_and_a_name_per_column() {
        let links = ServoLinks::new(1_000_000, Recording::None);
        for tick in 1..=3 {
            links.flight.force_push(record(tick));
        }
        let mut text = Vec::new();
        assert_eq!(write_flight_record(&links.flight, &mut text).expect("memory"), 3);
        let mut rows = csv::Reader::from_reader(text.as_slice());
        assert_eq!(rows.headers().expect("head").len(), COLUMNS.len());
        let rows: Result<Vec<_>, _> = rows.records().collect();
        let rows = rows.expect("as many fields as columns");
        assert_eq!((rows.len(), &rows[2][0], &rows[2][2]), (3, "3", "500"));
    }
}
