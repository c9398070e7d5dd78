//! The trace: a recording of one session as an MCAP file that Foxglove and the Python package
//! `mcap` read with no plugin (JSON messages, JSON schemas, lz4 chunks of at most 64 KiB).
//!
//! | topic | schema | content | rate |
//! |---|---|---|---|
//! | `/servo_state` | `suture.ServoState` | the servo after a tick | every tick |
//! | `/wound_report` | `suture.WoundReport` | Table 1, suture line, solver health | 30 Hz |
//! | `/tissue` | `foxglove.PointCloud` | nodes with their attachment force | 30 Hz |
//! | `/tissue_outline` | `suture.SceneOutline` | triangles, layers, suture pairs, wound edges | per scene |
//! | `/hand` | `foxglove.PoseInFrame` | stylus pose, with `buttons` added | 100 Hz |
//!
//! Scene, parameters, seeds, program and machine are metadata records in front. Log time is
//! `CLOCK_MONOTONIC` of the message's header (virtual time in lockstep). Numbers come back bit for
//! bit: JSON holds the shortest text that reads as the same `f64`, point clouds hold `f32`.
//! A file that was cut off or damaged reads up to the last whole chunk before that place, which
//! is named. Absent: seeking, attachments.

mod base64;
mod foxglove;
mod framing;
mod reader;
mod schema;
mod view;
mod writer;

pub use reader::{Channel, TraceEnd, TraceItem, TraceReader};
pub use view::HandPose;
pub use writer::TraceWriter;

use std::collections::BTreeMap;

/// Topic of the servo states.
pub const SERVO_STATE: &str = "/servo_state";
/// Topic of the wound reports.
pub const WOUND_REPORT: &str = "/wound_report";
/// Topic of the tissue's nodes.
pub const TISSUE: &str = "/tissue";
/// Topic of the tissue's topology.
pub const TISSUE_OUTLINE: &str = "/tissue_outline";
/// Topic of the stylus poses.
pub const HAND: &str = "/hand";

/// Named groups of named values: what a trace says about its origin.
pub type Metadata = BTreeMap<String, BTreeMap<String, String>>;

/// What can go wrong with a trace.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file is something else.
    #[error("byte 0: this is no MCAP file (it does not begin with the MCAP magic number); choose a recording")]
    NotMcap,
    /// The file could not be read.
    #[error("byte {byte}: the trace cannot be read: {source}; check the disk and try again")]
    Read {
        /// Where.
        byte: u64,
        /// Why.
        source: std::io::Error,
    },
    /// A message on one of our topics is not what the topic promises.
    #[error("byte {byte}: message {index} on {topic} cannot be used ({reason}); record it again or remove it")]
    Message {
        /// Where the record that holds it begins.
        byte: u64,
        /// Number of the message on its topic, from 1.
        index: u64,
        /// Topic.
        topic: String,
        /// What is wrong.
        reason: String,
    },
    /// The caller tried to record a message that no reader would accept.
    #[error("{topic}: field {field} is not finite or out of range and is not recorded; find out which stage made it")]
    Unusable {
        /// Topic.
        topic: &'static str,
        /// Field.
        field: &'static str,
    },
    /// The trace could not be written.
    #[error(
        "the trace cannot be written: {0}; free disk space or choose another file; what was written before is whole"
    )]
    Write(String),
}

/// Seconds and nanoseconds of a log time, as Foxglove's schemas have them.
fn split_time(time_ns: u64) -> (u64, u32) {
    const NS_PER_S: u64 = 1_000_000_000;
    (time_ns / NS_PER_S, (time_ns % NS_PER_S) as u32)
}

#[cfg(test)]
mod tests;
