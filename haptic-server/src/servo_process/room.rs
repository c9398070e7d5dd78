//! The servo thread: joins the run, asks for its rights, and lets the device run the loop.
//!
//! Order: shared memory first, then scheduling and locked memory, so that the loop maps nothing. The thread has
//! a small stack of its own, which is touched before the loop.

use crate::device::Device;
use crate::error::ServerError;
use crate::realtime::{REMEDY, RealtimeConfig, RealtimeRights, RightsPolicy, acquire, judge};
use crate::servo::params::ServoParams;
use crate::servo::stats::ServoStats;
use crate::servo::thread::LiveRoom;
use crate::servo::tick::{Rights, Servo};
use crate::servo_setup::{RoomEnds, ServoLinks, new_stats};
use protocol::ports::{PortNode, ServoStateWriter};
use protocol::run::RunDir;
use protocol::servo_state::ServoState;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Stack of the servo thread, bytes.
pub(super) const STACK: usize = 512 * 1024;

/// What the servo thread is started with.
pub(super) struct Task {
    /// Its constants.
    pub(super) params: ServoParams,
    /// What to do when rights are missing.
    pub(super) policy: RightsPolicy,
    /// Its processor, if it is bound to one.
    pub(super) processor: Option<usize>,
    /// Flags of `servo_state` beside those of the tick.
    pub(super) marks: u32,
    /// Knows who is the hand of a pointer device.
    pub(super) links: Arc<ServoLinks>,
}

/// What the servo thread leaves behind.
pub(super) struct LoopEnd {
    /// Its measurements.
    pub(super) stats: ServoStats,
    /// The servo after its last tick.
    pub(super) state: ServoState,
    /// With which rights it ran.
    pub(super) rights: RealtimeRights,
    /// How long it ran.
    pub(super) duration: Duration,
}

/// The whole life of the servo thread.
pub(super) fn run(run: &RunDir, device: &mut dyn Device, task: &Task, ends: RoomEnds) -> Result<LoopEnd, ServerError> {
    let node = PortNode::join(run, "servo")?;
    let mut writer = ServoStateWriter::create(&node)?;
    let stats = new_stats().map_err(|e| ServerError::Internal(format!("cannot make the histograms: {e}")))?;
    let rights = acquire(&RealtimeConfig { processor: task.processor, ..RealtimeConfig::default() });
    judge(&rights, task.policy).map_err(|e| ServerError::Permission(e.to_string()))?;
    if rights.is_degraded() {
        tracing::warn!("{rights}; this run is marked degraded. {REMEDY}");
    }
    let servo = Servo::new(&task.params, if rights.is_degraded() { Rights::Degraded } else { Rights::Full });
    let sink = |state: &mut ServoState| {
        state.flags |= task.marks;
        (state.hand_sender, state.hand_turn) = task.links.hand();
        writer.write(state);
    };
    let mut room = LiveRoom::new(servo, &task.params, ends, sink, stats);
    let began = Instant::now();
    device.run(&mut room);
    let duration = began.elapsed();
    let (servo, stats) = room.finish();
    Ok(LoopEnd { stats, state: *servo.state(), rights, duration })
}
