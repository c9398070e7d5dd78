//! Ticks of the servo's room: with a recording, without one, and with the recording left out at compile time.
//!
//! A step is five ticks, one period of a 200 Hz solver, the first of which finds a new port: the tick itself, and its hand-out
//! to the rings of the other threads. Their ends are emptied after the fifth, as readers that keep up would.
//! Deliberately absent: the clock of the live room (valgrind cannot start its vDSO) and the device, which stands still.

use super::Step;
use haptic_server::device::{DeviceLimits, DeviceSample, SampleQuality, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::events::EventBatch;
use haptic_server::servo::flight_recorder::TickRecord;
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::tick::{Orders, Rights, Servo, TickInput};
use haptic_server::servo_setup::{OuterEnds, Recording, RoomEnds, TickRing, open};
use protocol::tissue_port::TissuePort;
use protocol::wire::{Field, Message};
use sim_core::vector::Vec3;

/// Ticks of one counted step.
pub(super) const TICKS: u64 = 5;
const TICK_NS: u64 = 1_000_000;
const TICK_S: f64 = 1e-3;

/// What is copied stands at the same place in a cache line in every case: copies take more instructions where it does not.
#[repr(align(64))]
struct Aligned<T>(T);

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

fn stepping<R: TickRing + 'static>(mut ends: RoomEnds<R>, mut outer: OuterEnds) -> Result<Step, String> {
    let params = ServoParams::new(&ServoConfig::default(), &DeviceLimits::OMNI).map_err(|e| e.to_string())?;
    let mut servo = Box::new(Aligned(Servo::new(&params, Rights::Full)));
    let (mut now_ns, mut sequence) = (1_000 * TICK_NS, 0);
    Ok(Box::new(move || {
        sequence += 1;
        let mut port = Aligned(TissuePort { publish_ns: now_ns, valid_ns: now_ns, ..TissuePort::EMPTY });
        port.0.stamp(sequence, now_ns);
        let mut is_new = true;
        for _ in 0..TICKS {
            now_ns += TICK_NS;
            let (record, events) = tick(&mut servo.0, now_ns, std::mem::take(&mut is_new).then_some(&port.0));
            ends.hand_out(&record, &events);
        }
        drain(&mut outer);
    }))
}

/// One tick, the same code in every case.
#[inline(never)]
fn tick(servo: &mut Servo, now_ns: u64, new_port: Option<&TissuePort>) -> (TickRecord, EventBatch) {
    let time = TickTime { scheduled_ns: now_ns, now_ns, dt_s: TICK_S };
    let (orders, wakefulness) = (Orders::default(), Wakefulness::Awake);
    let input = TickInput { time, sample: &still(now_ns), new_port, orders, wakefulness };
    let output = servo.tick(&input);
    let record = TickRecord {
        state: *servo.state(),
        scheduled_ns: now_ns,
        now_ns,
        dt_s: TICK_S,
        compute_ns: 0,
        clips: output.clips,
    };
    (record, output.events)
}

/// Empties the other ends.
#[inline(never)]
fn drain(outer: &mut OuterEnds) {
    while outer.flight.pop().is_ok() {}
    while outer.events.pop().is_ok() {}
    while outer.record.as_mut().is_some_and(|ring| ring.pop().is_ok()) {}
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
