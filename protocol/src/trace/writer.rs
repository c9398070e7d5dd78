//! [`TraceWriter`]: writes a trace to anything that takes bytes.
//!
//! Messages gather in a chunk of at most 64 KiB (a larger message gets one of its own); a chunk is
//! closed when the next message would not fit, and after a second of log time, so that a killed
//! program loses little. The writer never seeks. After an error the file ends with the last chunk
//! that was written whole.

use super::foxglove::{PointCloud, PoseInFrame};
use super::schema::topics;
use super::view::{HandPose, OutlineView, ReportView, ServoView};
use super::{HAND, Metadata, SERVO_STATE, TISSUE, TISSUE_OUTLINE, TraceError, WOUND_REPORT};
use crate::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use crate::servo_state::ServoState;
use crate::wire::{Field, Message};
use crate::wound_report::WoundReport;
use mcap::records::{MessageHeader, Metadata as MetadataRecord};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions, Writer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;

/// Bytes of uncompressed records in a chunk.
const CHUNK_BYTES: u64 = 64 * 1024;
/// Opcode, length and header of a message record.
const RECORD_OVERHEAD: u64 = 9 + 22;
/// Log time after which an open chunk is closed.
const FLUSH_NS: u64 = 1_000_000_000;

/// Writes a trace. Call [`TraceWriter::finish`] at the end; a trace without its end still reads.
pub struct TraceWriter<W: Write> {
    writer: Writer<NoSeek<W>>,
    channels: BTreeMap<&'static str, (u16, u32)>,
    text: Vec<u8>,
    chunk_bytes: u64,
    chunk_start_ns: u64,
}

impl<W: Write> TraceWriter<W> {
    /// Begins a trace: metadata, schemas, topics.
    ///
    /// # Errors
    /// [`TraceError::Write`].
    pub fn create(sink: W, metadata: &Metadata) -> Result<Self, TraceError> {
        let writer = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            .disable_seeking(true)
            .profile("")
            .library(concat!("haptic-suture ", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(sink))
            .map_err(write_error)?;
        let mut trace = Self { writer, channels: BTreeMap::new(), text: Vec::new(), chunk_bytes: 0, chunk_start_ns: 0 };
        for (name, values) in metadata {
            trace.metadata(name, values)?;
        }
        for topic in topics() {
            let schema = topic.schema.to_string();
            let schema_id =
                trace.writer.add_schema(topic.schema_name, "jsonschema", schema.as_bytes()).map_err(write_error)?;
            let channel =
                trace.writer.add_channel(schema_id, topic.name, "json", &BTreeMap::new()).map_err(write_error)?;
            trace.channels.insert(topic.name, (channel, 0));
        }
        trace.flush()?;
        Ok(trace)
    }

    /// Adds a group of named values; possible at any time.
    ///
    /// # Errors
    /// [`TraceError::Write`].
    pub fn metadata(&mut self, name: &str, values: &BTreeMap<String, String>) -> Result<(), TraceError> {
        self.chunk_bytes = 0;
        let record = MetadataRecord { name: name.to_owned(), metadata: values.clone() };
        self.writer.write_metadata(&record).map_err(write_error)
    }

    /// Records the servo after a tick; log time is the header's.
    ///
    /// # Errors
    /// [`TraceError::Unusable`], [`TraceError::Write`].
    pub fn servo_state(&mut self, state: &ServoState) -> Result<(), TraceError> {
        usable(SERVO_STATE, state)?;
        self.message(SERVO_STATE, state.header.time_ns, &ServoView::of(state))
    }

    /// Records a wound report.
    ///
    /// # Errors
    /// [`TraceError::Unusable`], [`TraceError::Write`].
    pub fn wound_report(&mut self, report: &WoundReport) -> Result<(), TraceError> {
        usable(WOUND_REPORT, report)?;
        self.message(WOUND_REPORT, report.header.time_ns, &ReportView::of(report))
    }

    /// Records the tissue's nodes.
    ///
    /// # Errors
    /// [`TraceError::Unusable`], [`TraceError::Write`].
    pub fn tissue(&mut self, header: &FrameHeader, nodes: &[FrameNode]) -> Result<(), TraceError> {
        usable(TISSUE, header)?;
        if header.node_count as usize != nodes.len() {
            return Err(TraceError::Unusable { topic: TISSUE, field: "node_count" });
        }
        if !nodes.iter().all(Field::is_usable) {
            return Err(TraceError::Unusable { topic: TISSUE, field: "nodes" });
        }
        self.message(TISSUE, header.header.time_ns, &PointCloud::of(header, nodes))
    }

    /// Records the tissue's topology; once per scene.
    ///
    /// # Errors
    /// [`TraceError::Unusable`], [`TraceError::Write`].
    pub fn outline(&mut self, header: &OutlineHeader, words: &[u32]) -> Result<(), TraceError> {
        usable(TISSUE_OUTLINE, header)?;
        let view = OutlineView::of(header, words)
            .ok_or(TraceError::Unusable { topic: TISSUE_OUTLINE, field: "triangle_count" })?;
        self.message(TISSUE_OUTLINE, header.header.time_ns, &view)
    }

    /// Records a stylus pose.
    ///
    /// # Errors
    /// [`TraceError::Unusable`], [`TraceError::Write`].
    pub fn hand(&mut self, time_ns: u64, pose: &HandPose) -> Result<(), TraceError> {
        if !(pose.position_m.is_usable() && pose.orientation.is_usable()) {
            return Err(TraceError::Unusable { topic: HAND, field: "pose" });
        }
        self.message(HAND, time_ns, &PoseInFrame::of(time_ns, pose))
    }

    /// Closes the open chunk and flushes the sink.
    ///
    /// # Errors
    /// [`TraceError::Write`].
    pub fn flush(&mut self) -> Result<(), TraceError> {
        self.chunk_bytes = 0;
        self.writer.flush().map_err(write_error)
    }

    /// Writes index and footer and returns the sink.
    ///
    /// # Errors
    /// [`TraceError::Write`].
    pub fn finish(mut self) -> Result<W, TraceError> {
        self.writer.finish().map_err(write_error)?;
        Ok(self.writer.into_inner().into_inner())
    }

    fn message(&mut self, topic: &'static str, time_ns: u64, view: &impl Serialize) -> Result<(), TraceError> {
        self.text.clear();
        serde_json::to_writer(&mut self.text, view).map_err(|e| TraceError::Write(e.to_string()))?;
        let bytes = self.text.len() as u64 + RECORD_OVERHEAD;
        let full = self.chunk_bytes + bytes > CHUNK_BYTES;
        let old = time_ns.saturating_sub(self.chunk_start_ns) > FLUSH_NS;
        if self.chunk_bytes > 0 && (full || old) {
            self.flush()?;
        }
        if self.chunk_bytes == 0 {
            self.chunk_start_ns = time_ns;
        }
        self.chunk_bytes += bytes;
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else {
            return Err(TraceError::Write(format!("topic {topic} is not declared")));
        };
        *sequence = sequence.wrapping_add(1);
        let header =
            MessageHeader { channel_id: *channel_id, sequence: *sequence, log_time: time_ns, publish_time: time_ns };
        self.writer.write_to_known_channel(&header, &self.text).map_err(write_error)
    }
}

/// Refuses what a reader would refuse. The header need not be stamped: lockstep has its own time.
fn usable<M: Message>(topic: &'static str, message: &M) -> Result<(), TraceError> {
    message.first_bad_field().map_or(Ok(()), |field| Err(TraceError::Unusable { topic, field }))
}

fn write_error(error: McapError) -> TraceError {
    TraceError::Write(match error {
        McapError::Io(e) => e.to_string(),
        other => other.to_string(),
    })
}
