//! [`TraceReader`]: reads a trace from any stream, whole, cut off or damaged.
//!
//! Nothing in the file is trusted: sizes are checked before memory is taken, chunks by their CRC
//! before use, messages by the same rules as those from shared memory. Reading ends at the first
//! damage; [`TraceReader::end`] then says where. Topics of other programs are counted and passed over.

use super::foxglove::{PointCloud, PoseInFrame};
use super::framing::{ChunkRecords, Framing, Stop};
use super::view::{HandPose, OutlineView, ReportView, ServoView};
use super::{HAND, Metadata, SERVO_STATE, TISSUE, TISSUE_OUTLINE, TraceError, WOUND_REPORT};
use crate::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use crate::servo_state::ServoState;
use crate::wound_report::WoundReport;
use mcap::records::{Record, op};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::Read;

/// Channels that a file may declare; more is taken for damage.
const MAX_CHANNELS: usize = 1024;
/// Message header: channel, sequence, log time, publish time.
const MESSAGE_HEADER_BYTES: usize = 22;

/// How reading ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TraceEnd {
    /// Not yet.
    Reading,
    /// The file is whole.
    Complete,
    /// The file was cut off; everything before this byte was read.
    Cut {
        /// End of the last whole record.
        byte: u64,
    },
    /// The file is damaged; everything before this byte was read.
    Damaged {
        /// End of the last sound record.
        byte: u64,
        /// What is wrong behind it.
        reason: String,
    },
}

/// One topic of the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Channel {
    /// Topic name.
    pub topic: String,
    /// Message encoding, `json` for ours.
    pub encoding: String,
    /// Messages read so far.
    pub messages: u64,
    /// Log time of the first message.
    pub first_ns: u64,
    /// Log time of the last message.
    pub last_ns: u64,
}

/// A message of the trace.
#[derive(Clone, Debug, PartialEq)]
pub enum TraceItem {
    /// `/servo_state`.
    ServoState(Box<ServoState>),
    /// `/wound_report`.
    WoundReport(Box<WoundReport>),
    /// `/tissue`.
    Tissue(FrameHeader, Vec<FrameNode>),
    /// `/tissue_outline`.
    Outline(OutlineHeader, Vec<u32>),
    /// `/hand`.
    Hand(HandPose),
}

/// Reads a trace from its beginning.
pub struct TraceReader<R> {
    framing: Framing<R>,
    chunk: Option<ChunkRecords>,
    /// Where the record at work begins.
    at: u64,
    channels: BTreeMap<u16, Channel>,
    metadata: Metadata,
    section: Section,
    end: TraceEnd,
}

impl<R: Read> TraceReader<R> {
    /// Checks that this is an MCAP file.
    ///
    /// # Errors
    /// [`TraceError::NotMcap`], [`TraceError::Read`].
    pub fn open(source: R) -> Result<Self, TraceError> {
        let framing = Framing::open(source)?;
        let at = framing.byte;
        Ok(Self {
            framing,
            chunk: None,
            at,
            channels: BTreeMap::new(),
            metadata: Metadata::new(),
            section: Section::Data,
            end: TraceEnd::Reading,
        })
    }

    /// The next message of our topics with its log time in nanoseconds; `None` at the end.
    ///
    /// # Errors
    /// [`TraceError::Message`] for a message that must not be used (reading may go on),
    /// [`TraceError::Read`].
    pub fn next_item(&mut self) -> Result<Option<(u64, TraceItem)>, TraceError> {
        while self.end == TraceEnd::Reading {
            match self.step()? {
                Found::Nothing => {}
                Found::Item(time_ns, item) => return Ok(Some((time_ns, item))),
                Found::Stop(stop) => self.stop(stop),
            }
        }
        Ok(None)
    }

    /// Topics declared so far, with the number of their messages.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.channels.values()
    }

    /// Metadata read so far.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// How reading ended.
    #[must_use]
    pub fn end(&self) -> &TraceEnd {
        &self.end
    }

    fn stop(&mut self, stop: Stop) {
        let byte = self.at;
        self.chunk = None;
        self.end = match stop {
            Stop::Complete => TraceEnd::Complete,
            Stop::Cut => TraceEnd::Cut { byte },
            Stop::Damaged(reason) => TraceEnd::Damaged { byte, reason },
        };
    }

    fn step(&mut self) -> Result<Found, TraceError> {
        if let Some(chunk) = &mut self.chunk {
            return match chunk.next() {
                Ok(Some((opcode, body))) => take_record(&mut self.channels, self.at, opcode, body),
                Ok(None) => {
                    self.chunk = None;
                    Ok(Found::Nothing)
                }
                Err(reason) => Ok(Found::Stop(Stop::Damaged(reason))),
            };
        }
        self.at = self.framing.byte;
        let record = match self.framing.next()? {
            Ok(record) => record,
            Err(stop) => return Ok(Found::Stop(stop)),
        };
        match record.opcode {
            op::CHUNK => match ChunkRecords::open(&record.body) {
                Ok(chunk) => self.chunk = Some(chunk),
                Err(reason) => return Ok(Found::Stop(Stop::Damaged(reason))),
            },
            op::METADATA => match mcap::parse_record(op::METADATA, &record.body) {
                Ok(Record::Metadata(m)) => drop(self.metadata.insert(m.name, m.metadata)),
                _ => return Ok(Found::Stop(Stop::Damaged("a metadata record cannot be read".to_owned()))),
            },
            op::DATA_END => self.section = Section::Summary,
            opcode if self.section == Section::Data && !belongs_to_data(opcode, &record.body) => {
                return Ok(Found::Stop(Stop::Damaged(format!("a record of kind {opcode} does not belong there"))));
            }
            opcode => return take_record(&mut self.channels, self.at, opcode, &record.body),
        }
        Ok(Found::Nothing)
    }
}

/// Parts of an MCAP file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    /// Messages.
    Data,
    /// Repetitions and indices, not needed here.
    Summary,
}

/// Whether a record may stand among the messages. A chunk whose kind was spoilt must not be
/// passed over as something that is of no interest.
fn belongs_to_data(opcode: u8, body: &[u8]) -> bool {
    const FIRST_PRIVATE: u8 = 0x80;
    match opcode {
        op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | FIRST_PRIVATE.. => true,
        // Channel number, length of the list, list.
        op::MESSAGE_INDEX => matches!(body, [_, _, l0, l1, l2, l3, entries @ ..]
            if u32::from_le_bytes([*l0, *l1, *l2, *l3]) as usize == entries.len()),
        _ => false,
    }
}

enum Found {
    Nothing,
    Item(u64, TraceItem),
    Stop(Stop),
}

/// A record that may stand inside or outside of a chunk.
fn take_record(channels: &mut BTreeMap<u16, Channel>, byte: u64, opcode: u8, body: &[u8]) -> Result<Found, TraceError> {
    let damaged = |reason: &str| Ok(Found::Stop(Stop::Damaged(reason.to_owned())));
    match opcode {
        op::CHANNEL => {
            let Ok(Record::Channel(c)) = mcap::parse_record(op::CHANNEL, body) else {
                return damaged("a channel record cannot be read");
            };
            if channels.len() >= MAX_CHANNELS {
                return damaged("it declares too many channels");
            }
            channels.entry(c.id).or_insert_with(|| Channel {
                topic: c.topic,
                encoding: c.message_encoding,
                ..Channel::default()
            });
            Ok(Found::Nothing)
        }
        op::MESSAGE => {
            let Some((header, text)) = body.split_first_chunk::<MESSAGE_HEADER_BYTES>() else {
                return damaged("a message record is too short");
            };
            let [c0, c1, _, _, _, _, t0, t1, t2, t3, t4, t5, t6, t7, ..] = *header;
            let time_ns = u64::from_le_bytes([t0, t1, t2, t3, t4, t5, t6, t7]);
            let Some(channel) = channels.get_mut(&u16::from_le_bytes([c0, c1])) else {
                return damaged("a message belongs to no channel");
            };
            if channel.messages == 0 {
                channel.first_ns = time_ns;
            }
            channel.last_ns = time_ns;
            channel.messages += 1;
            match decode(channel, text) {
                Ok(None) => Ok(Found::Nothing),
                Ok(Some(item)) => Ok(Found::Item(time_ns, item)),
                Err(reason) => {
                    let (index, topic) = (channel.messages, channel.topic.clone());
                    Err(TraceError::Message { byte, index, topic, reason })
                }
            }
        }
        _ => Ok(Found::Nothing),
    }
}

/// The message of one of our topics; `None` for topics of others.
fn decode(channel: &Channel, text: &[u8]) -> Result<Option<TraceItem>, String> {
    if channel.encoding != "json" {
        return Ok(None);
    }
    Ok(Some(match channel.topic.as_str() {
        SERVO_STATE => TraceItem::ServoState(Box::new(json::<ServoView<'_>>(text)?.restore()?)),
        WOUND_REPORT => TraceItem::WoundReport(Box::new(json::<ReportView<'_>>(text)?.restore()?)),
        TISSUE => {
            let (header, nodes) = json::<PointCloud>(text)?.restore()?;
            TraceItem::Tissue(header, nodes)
        }
        TISSUE_OUTLINE => {
            let (header, words) = json::<OutlineView<'_>>(text)?.restore()?;
            TraceItem::Outline(header, words)
        }
        HAND => TraceItem::Hand(json::<PoseInFrame>(text)?.restore()?),
        _ => return Ok(None),
    }))
}

fn json<'t, T: Deserialize<'t>>(text: &'t [u8]) -> Result<T, String> {
    serde_json::from_slice(text).map_err(|e| e.to_string())
}
