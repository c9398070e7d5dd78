//! What the servo leaves of every tick.
//!
//! The room hands each record to a ring and forgets it; the flight record (`flight_record.rs`) keeps the last two seconds of
//! them on another thread, and a recording, when there is one, all of them. Deliberately absent: files and formats.

use protocol::servo_state::ServoState;

/// One tick, whole; in whole cache lines, so that a copy costs the same in every slot of a ring.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
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
