//! The outer frame of an MCAP file: magic, then records of opcode, length and body
//! (<https://mcap.dev/spec>), read from a stream with the place of each.
//!
//! A body is read in pieces, so that memory grows with what the file holds and not with what a
//! length field claims. Chunks are taken apart by the `mcap` crate after their boundaries and
//! sizes have been checked here; it also checks their CRC before anything inside is used.

use super::TraceError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::io::Read;

const MAGIC: &[u8] = mcap::MAGIC;
/// Opcode and length.
const PREFIX_BYTES: usize = 9;
/// A record or the content of a chunk beyond this size is taken for damage.
const MAX_RECORD_BYTES: usize = 256 << 20;
const UNCOMPRESSED: &[u8] = b"";

/// Where and why reading had to stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// After the closing magic number.
    Complete,
    /// The stream ended too early.
    Cut,
    /// The bytes make no sense.
    Damaged(String),
}

/// One outer record.
pub(super) struct OuterRecord {
    pub(super) opcode: u8,
    pub(super) body: Vec<u8>,
}

/// Reads outer records.
pub(super) struct Framing<R> {
    source: R,
    /// End of the last whole record.
    pub(super) byte: u64,
}

/// A record, or the end.
pub(super) type Step<T> = Result<Result<T, Stop>, TraceError>;

impl<R: Read> Framing<R> {
    /// Checks the opening magic number.
    pub(super) fn open(source: R) -> Result<Self, TraceError> {
        let mut framing = Self { source, byte: 0 };
        let mut magic = Vec::new();
        framing.fill(&mut magic, MAGIC.len())?;
        if magic != MAGIC {
            return Err(TraceError::NotMcap);
        }
        framing.byte = MAGIC.len() as u64;
        Ok(framing)
    }

    /// The next outer record. After the footer the closing magic number is checked.
    pub(super) fn next(&mut self) -> Step<OuterRecord> {
        let mut prefix = Vec::new();
        self.fill(&mut prefix, PREFIX_BYTES)?;
        let Some((&opcode, length)) = prefix.split_first() else { return Ok(Err(Stop::Cut)) };
        let Ok(length) = <[u8; 8]>::try_from(length) else { return Ok(Err(Stop::Cut)) };
        let length = match usize::try_from(u64::from_le_bytes(length)) {
            Ok(length) if length <= MAX_RECORD_BYTES => length,
            _ => return Ok(Err(Stop::Damaged(format!("a record of kind {opcode} claims an impossible length")))),
        };
        let mut body = Vec::new();
        self.fill(&mut body, length)?;
        if body.len() < length {
            return Ok(Err(Stop::Cut));
        }
        if opcode == op::FOOTER {
            let mut magic = Vec::new();
            self.fill(&mut magic, MAGIC.len())?;
            return Ok(Err(match magic.as_slice() {
                m if m == MAGIC => Stop::Complete,
                m if MAGIC.starts_with(m) => Stop::Cut,
                _ => Stop::Damaged("the closing magic number is wrong".to_owned()),
            }));
        }
        self.byte += (PREFIX_BYTES + length) as u64;
        Ok(Ok(OuterRecord { opcode, body }))
    }

    fn fill(&mut self, buffer: &mut Vec<u8>, length: usize) -> Result<(), TraceError> {
        let limited = &mut (&mut self.source).take(length as u64);
        limited.read_to_end(buffer).map(drop).map_err(|source| TraceError::Read { byte: self.byte, source })
    }
}

/// The records inside a chunk whose CRC is right.
pub(super) struct ChunkRecords {
    reader: LinearReader,
    /// Bytes of uncompressed records that have not been handed out.
    remaining: u64,
}

impl ChunkRecords {
    /// Checks a chunk's boundaries.
    pub(super) fn open(body: &[u8]) -> Result<Self, String> {
        let chunk = ChunkLayout::parse(body).ok_or("a chunk has no proper header")?;
        if chunk.uncompressed_size > MAX_RECORD_BYTES as u64 {
            return Err("a chunk claims an impossible size".to_owned());
        }
        if chunk.compression == UNCOMPRESSED
            && (chunk.uncompressed_size != chunk.records.len() as u64 || !is_tiled(chunk.records))
        {
            return Err("the records of a chunk do not fill it".to_owned());
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        let mut reader = LinearReader::new_with_options(options);
        let record = reader.insert(PREFIX_BYTES + body.len());
        record[0] = op::CHUNK;
        record[1..PREFIX_BYTES].copy_from_slice(&(body.len() as u64).to_le_bytes());
        record[PREFIX_BYTES..].copy_from_slice(body);
        reader.notify_read(PREFIX_BYTES + body.len());
        Ok(Self { reader, remaining: chunk.uncompressed_size })
    }

    /// The next record: opcode and body; `None` at the end of the chunk.
    pub(super) fn next(&mut self) -> Result<Option<(u8, &[u8])>, String> {
        match self.reader.next_event() {
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                self.remaining = self.remaining.saturating_sub((PREFIX_BYTES + data.len()) as u64);
                Ok(Some((opcode, data)))
            }
            // The reader asks for what follows the chunk.
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None if self.remaining == 0 => Ok(None),
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None => Err("a chunk ends too early".to_owned()),
            Some(Err(error)) => Err(error.to_string()),
        }
    }
}

/// Fixed parts of a chunk record.
struct ChunkLayout<'b> {
    uncompressed_size: u64,
    compression: &'b [u8],
    records: &'b [u8],
}

impl<'b> ChunkLayout<'b> {
    fn parse(body: &'b [u8]) -> Option<Self> {
        let (_times, rest) = body.split_at_checked(16)?;
        let (uncompressed_size, rest) = rest.split_first_chunk::<8>()?;
        let (_crc, rest) = rest.split_at_checked(4)?;
        let (length, rest) = rest.split_first_chunk::<4>()?;
        let (compression, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        let (length, records) = rest.split_first_chunk::<8>()?;
        let whole = u64::from_le_bytes(*length) == records.len() as u64;
        let uncompressed_size = u64::from_le_bytes(*uncompressed_size);
        whole.then_some(Self { uncompressed_size, compression, records })
    }
}

/// Whether records follow each other without gap up to the end.
fn is_tiled(mut bytes: &[u8]) -> bool {
    while !bytes.is_empty() {
        let Some((prefix, rest)) = bytes.split_first_chunk::<PREFIX_BYTES>() else { return false };
        let [_, length @ ..] = *prefix;
        let Ok(length) = usize::try_from(u64::from_le_bytes(length)) else { return false };
        let Some((_, rest)) = rest.split_at_checked(length) else { return false };
        bytes = rest;
    }
    true
}
