//! Ports: the only way to send and to receive, one pair of types per role. QoS is decided here only.
//!
//! | role | message | transport |
//! |---|---|---|
//! | [`ServoStateWriter`] / [`ServoStateReader`] | `servo_state` | blackboard, one entry |
//! | [`TissuePortPublisher`] / [`TissuePortSubscriber`] | `tissue_port` | publish/subscribe, newest wins |
//! | [`WoundReportPublisher`] / [`WoundReportSubscriber`] | `wound_report` | publish/subscribe, newest wins |
//! | [`SceneFramePublisher`] / [`SceneFrameSubscriber`] | `scene_frame` + nodes | publish/subscribe, newest wins |
//! | [`SceneOutlinePublisher`] / [`SceneOutlineSubscriber`] | `scene_outline` + words | publish/subscribe, newest wins |
//! | [`PointerHandPublisher`] / [`PointerHandSubscriber`] | `pointer_hand` | publish/subscribe, newest of each sender |
//! | [`SessionCommandPublisher`] / [`SessionCommandSubscriber`] | `session_command` | publish/subscribe, queue of 16 per sender, in turn |
//!
//! A [`PortNode`] is the process's (thread's) membership in a run. Ports are not `Send`: open them
//! in the thread that uses them. Every receiver copies a message once and validates the copy.
//! A publisher that died is replaced by its successor without any action of the subscribers; a
//! sequence that goes backwards is normal then, so "newest" means the latest writer's time.

mod blackboard;
mod commands;
mod hands;
mod latest;
mod node;
mod slices;
mod turns;

pub use blackboard::{ServoStateReader, ServoStateWriter};
pub use commands::{SessionCommandPublisher, SessionCommandSubscriber};
pub use hands::{MAX_HAND_SENDERS, PointerHandPublisher, PointerHandSubscriber, WriterId};
pub use latest::{LatestPublisher, LatestSubscriber};
pub use node::PortNode;
pub use slices::{SceneFrame, SceneFramePublisher, SceneFrameSubscriber};
pub use slices::{SceneOutline, SceneOutlinePublisher, SceneOutlineSubscriber};
pub use slices::{SliceHeader, SliceMessage};
pub use turns::CommandFlood;

use crate::tissue_port::TissuePort;
use crate::wire::{WIRE_VERSION, WireError};
use crate::wound_report::WoundReport;

/// Sends the newest tissue port (solver).
pub type TissuePortPublisher = LatestPublisher<TissuePort>;
/// Receives the newest tissue port (bridge thread of the servo process).
pub type TissuePortSubscriber = LatestSubscriber<TissuePort>;
/// Sends the newest wound report (solver).
pub type WoundReportPublisher = LatestPublisher<WoundReport>;
/// Receives the newest wound report (viewers, recorder, harness).
pub type WoundReportSubscriber = LatestSubscriber<WoundReport>;

/// Receivers per topic: viewers, harness, recorder, people's own readers.
const MAX_RECEIVERS: usize = 32;
/// Threads that take part in one topic at the same time.
const MAX_NODES: usize = 64;

/// What can go wrong at a port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// Joining the run took too long: its management segment is damaged or held by somebody else.
    #[error(
        "joining the run took more than {seconds} s; its shared memory is damaged: stop the server and start it again"
    )]
    JoinTimeout {
        /// The limit.
        seconds: u64,
    },
    /// Joining the run failed.
    #[error("cannot join the run ({reason}); check free space in /dev/shm and the number of open files (ulimit -n)")]
    Join {
        /// iceoryx2's word for it.
        reason: String,
    },
    /// The path of the run directory cannot be used.
    #[error("the run directory {path} cannot be used ({reason}); set XDG_RUNTIME_DIR to a short, plain path")]
    Path {
        /// The path.
        path: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The peer was built from other sources.
    #[error(
        "{topic} is in use with another layout or type (we have layout {layout}, wire version {WIRE_VERSION}); \
         use binaries of one build"
    )]
    Incompatible {
        /// Message name.
        topic: &'static str,
        /// Our layout hash.
        layout: String,
    },
    /// A service or port could not be opened.
    #[error("cannot open {topic} ({reason}); if this persists, stop everything, then run `haptic-server clean`")]
    Open {
        /// Message name.
        topic: &'static str,
        /// iceoryx2's word for it.
        reason: String,
    },
    /// There is already a writer of this topic, or no room for another receiver.
    #[error("{topic} has no room for another {role}; close one of the other programs")]
    Full {
        /// Message name.
        topic: &'static str,
        /// Writer or receiver.
        role: &'static str,
    },
    /// Sending failed.
    #[error("cannot send {topic} ({reason}); check free space in /dev/shm")]
    Send {
        /// Message name.
        topic: &'static str,
        /// iceoryx2's word for it.
        reason: String,
    },
    /// Receiving failed.
    #[error("cannot receive {topic} ({reason}); if this persists, restart the server")]
    Receive {
        /// Message name.
        topic: &'static str,
        /// iceoryx2's word for it.
        reason: String,
    },
    /// The message was rejected; the last good one remains valid.
    #[error(transparent)]
    Rejected(#[from] WireError),
    /// Header and slice of a message do not fit together.
    #[error("message {topic} announces {announced} elements and carries {carried}")]
    Count {
        /// Message name.
        topic: &'static str,
        /// Number in the header.
        announced: u64,
        /// Length of the slice.
        carried: u64,
    },
}

/// `CLOCK_MONOTONIC` in nanoseconds: the clock of all headers, common to all processes.
#[must_use]
pub fn monotonic_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    u64::try_from(now.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(now.tv_nsec).unwrap_or(0)
}

#[cfg(test)]
mod sender_tests;
#[cfg(test)]
mod tests;
