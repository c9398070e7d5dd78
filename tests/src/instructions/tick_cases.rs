//! Ticks of the servo's room: with a recording, without one, and with the recording left out at compile time.
//!
//! The room is the live one, with the clock, the triple buffer and the rings of the 1 kHz thread; only the device is a
//! sample that stands still. Every fifth tick finds a new port, as at 200 Hz. Rings are emptied outside of nothing: like
//! a reader that keeps up, the case empties them within the tick, which costs all three the same but for the recording's.

use super::Step;
use haptic_server::device::{DeviceLimits, DeviceSample, SampleQuality, ServoRoom, TickTime};
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::thread::LiveRoom;
use haptic_server::servo::tick::{Rights, Servo};
use haptic_server::servo_setup::{OuterEnds, Recording, RoomEnds, TickRing, new_stats, open};
use protocol::servo_state::ServoState;
use protocol::tissue_port::TissuePort;
use protocol::wire::{Field, Message};
use sim_core::vector::Vec3;
use std::hint::black_box;

/// Ticks of one counted step: one period of a 200 Hz solver.
pub(super) const TICKS: u64 = 5;
const TICK_NS: u64 = 1_000_000;

/// The case of a kind.
pub(super) fn prepare(kind: &str) -> Result<Step, String> {
    match kind {
        "recording" => {
            let (_, ends, outer) = open(Recording::EveryTick);
            stepping(ends, outer)
        }
        "silent" => {
            let (_, ends, outer) = open(Recording::None);
            stepping(ends, outer)
        }
        "without" => {
            let (_, ends, outer) = open(Recording::None);
            stepping(ends.without_recording(), outer)
        }
        _ => Err(format!("there is no servo {kind}; take recording, silent or without")),
    }
}

fn stepping<R: TickRing + 'static>(ends: RoomEnds<R>, mut outer: OuterEnds) -> Result<Step, String> {
    let params = ServoParams::new(&ServoConfig::default(), &DeviceLimits::OMNI).map_err(|e| e.to_string())?;
    let servo = Servo::new(&params, Rights::Full);
    let sink = |state: &mut ServoState| {
        black_box(state);
    };
    let stats = new_stats().map_err(|e| e.to_string())?;
    let mut room = LiveRoom::new(servo, &params, ends, sink, stats);
    let (mut now_ns, mut sequence) = (1_000 * TICK_NS, 0);
    Ok(Box::new(move || {
        sequence += 1;
        let mut port = TissuePort { publish_ns: now_ns, valid_ns: now_ns, ..TissuePort::EMPTY };
        port.stamp(sequence, now_ns);
        outer.ports.write(port);
        for _ in 0..TICKS {
            now_ns += TICK_NS;
            let time = TickTime { scheduled_ns: now_ns, now_ns, dt_s: 1e-3 };
            black_box(room.tick(time, &still(now_ns)));
        }
        while outer.flight.pop().is_ok() {}
        while outer.events.pop().is_ok() {}
        while outer.record.as_mut().is_some_and(|ring| ring.pop().is_ok()) {}
    }))
}

fn still(time_ns: u64) -> DeviceSample {
    DeviceSample {
        time_ns,
        position_m: Vec3::new(0.004, 0.0, 0.02),
        velocity_m_per_s: Vec3::zeros(),
        orientation: [0.0, 0.0, 0.0, 1.0],
        buttons: 0,
        quality: SampleQuality::Fresh,
    }
}
