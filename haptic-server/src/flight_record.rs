//! The last two seconds of ticks, kept so that a fault can be understood.
//!
//! Lives on a thread that can wait: it takes the servo's ticks out of their ring a few times a second, keeps the newest, and
//! on a fault writes them as a CSV: one row per tick, SI units in the column names. A reader that stood still for longer than
//! the ring holds leaves a gap in the first column. Deliberately absent: when to write, and where to.

use crate::servo::flight_recorder::TickRecord;
use rtrb::Consumer;
use std::collections::VecDeque;
use std::io::Write;

/// How far back the record reaches, seconds.
pub const FLIGHT_S: f64 = 2.0;
/// Most ticks that are kept, whatever the servo's rate.
const MOST_TICKS: f64 = 100_000.0;

/// The newest ticks of one run.
#[derive(Debug)]
pub struct FlightRecord {
    ticks: VecDeque<TickRecord>,
    room: usize,
}

impl FlightRecord {
    /// Empty, for a servo of this period.
    #[must_use]
    pub fn new(period_ns: u64) -> Self {
        let room = (FLIGHT_S * 1e9 / period_ns.max(1) as f64).clamp(1.0, MOST_TICKS) as usize;
        Self { ticks: VecDeque::with_capacity(room), room }
    }

    /// Takes in what the servo has left; at most one ring's worth, so that a servo that goes on cannot keep us here.
    pub fn take(&mut self, ring: &mut Consumer<TickRecord>) {
        for _ in 0..ring.slots() {
            let Ok(tick) = ring.pop() else { break };
            if self.ticks.len() == self.room {
                self.ticks.pop_front();
            }
            self.ticks.push_back(tick);
        }
    }

    /// Writes the ticks as a CSV and forgets them; gives their number.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, out: &mut dyn Write) -> std::io::Result<u64> {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(COLUMNS)?;
        let mut ticks = 0;
        for tick in self.ticks.drain(..) {
            write_tick(&mut csv, &tick)?;
            ticks += 1;
        }
        csv.flush()?;
        Ok(ticks)
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
    use protocol::servo_state::ServoState;
    use protocol::wire::Field;

    fn tick(number: u64) -> TickRecord {
        let state = ServoState { ticks: number, ..ServoState::EMPTY };
        TickRecord { state, scheduled_ns: 1_000, now_ns: 1_500, dt_s: 0.001, compute_ns: 9, clips: 2 }
    }

    #[test]
    fn the_newest_two_seconds_are_kept_with_a_name_per_column_and_written_once() {
        let (mut servo, mut ring) = rtrb::RingBuffer::new(500);
        let mut record = FlightRecord::new(1_000_000);
        for number in 1..=2_100 {
            servo.push(tick(number)).expect("room");
            if number % 300 == 0 {
                record.take(&mut ring);
            }
        }
        let mut text = Vec::new();
        assert_eq!(record.write(&mut text).expect("memory"), 2_000);
        let mut rows = csv::Reader::from_reader(text.as_slice());
        assert_eq!(rows.headers().expect("head").len(), COLUMNS.len());
        let rows: Result<Vec<_>, _> = rows.records().collect();
        let rows = rows.expect("as many fields as columns");
        assert_eq!((rows.len(), &rows[0][0], &rows[1_999][0], &rows[0][2]), (2_000, "101", "2100", "500"));
        assert_eq!(record.write(&mut Vec::new()).expect("memory"), 0);
    }
}
