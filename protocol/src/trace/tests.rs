//! What is written comes back bit for bit; what was cut or spoilt ends cleanly where it must.

mod sample;

use super::*;
use crate::servo_state::ServoState;
use crate::wire::Field;
use crate::wound_report::{LedgerRow, MAX_LEDGER_ROWS, MAX_LINE_POINTS};
use proptest::prelude::*;
use sample::{POSE, frame, metadata, outline, read, report, servo, small_trace};
use std::io;

/// Upper bound on a chunk's records: the promise of the module head.
const CHUNK_LIMIT: u64 = 64 * 1024;

#[test]
fn everything_comes_back_bit_for_bit() {
    let read = read(&small_trace()).unwrap();
    assert_eq!(read.end, TraceEnd::Complete);
    assert_eq!(read.metadata, metadata());
    let (frame_header, nodes) = frame(5);
    let (outline_header, words) = outline();
    let mut expected = vec![(77, TraceItem::Outline(outline_header, words))];
    for tick in 1..=3 {
        expected.push((tick * 1_000_000, TraceItem::ServoState(Box::new(servo(tick)))));
        expected.push((tick, TraceItem::Hand(POSE)));
    }
    expected.push((10_000_000, TraceItem::WoundReport(Box::new(report(1)))));
    expected.push((5_000_000, TraceItem::Tissue(frame_header, nodes)));
    assert_eq!(read.items, expected);
    // Equality takes −0.0 for 0.0; the printed form tells them apart.
    assert_eq!(format!("{:?}", read.items), format!("{expected:?}"));
}

#[test]
fn full_reports_come_back_whole() {
    let mut full = report(5);
    full.row_count = MAX_LEDGER_ROWS as u32;
    full.line_point_count = MAX_LINE_POINTS as u32;
    full.rows = [LedgerRow { pair: 9, ..LedgerRow::EMPTY }; MAX_LEDGER_ROWS];
    let mut writer = TraceWriter::create(Vec::new(), &Metadata::new()).unwrap();
    writer.wound_report(&full).unwrap();
    let read = read(&writer.finish().unwrap()).unwrap();
    assert_eq!(read.items[0].1, TraceItem::WoundReport(Box::new(full)));
}

#[test]
fn cut_at_every_byte_it_reads_up_to_the_cut_or_says_it_is_no_trace() {
    let whole = small_trace();
    let all = read(&whole).unwrap().items;
    let mut seen = 0;
    for length in 0..whole.len() {
        let cut = match read(&whole[..length]) {
            Ok(cut) => cut,
            Err(TraceError::NotMcap) if length < 8 => continue,
            Err(other) => panic!("{length}: {other}"),
        };
        let TraceEnd::Cut { byte } = cut.end else { panic!("{length}: {:?}", cut.end) };
        assert!(byte <= length as u64, "{length}: {byte}");
        assert_eq!(cut.rejected, 0, "{length}");
        assert!(all.starts_with(&cut.items), "{length}");
        assert!(cut.items.len() >= seen, "{length}: more bytes, fewer messages");
        seen = cut.items.len();
    }
    assert_eq!(seen, all.len(), "the index behind the messages is not needed to read them");
}

#[test]
fn a_flipped_bit_never_changes_a_message() {
    let whole = small_trace();
    let all = read(&whole).unwrap().items;
    for byte in 8..whole.len() {
        let mut spoilt = whole.clone();
        spoilt[byte] ^= 1 << (byte % 7);
        let spoilt = read(&spoilt).unwrap();
        // Chunks are guarded by their CRC; index and summary behind them are not used for messages. One bit makes a message's
        // record kind (5) out of an index's (7) or a channel's (4): what it holds is rejected and counted, never taken.
        let unchanged = all.starts_with(&spoilt.items);
        let other_as_message = whole[byte] ^ 1 << (byte % 7) == 5;
        assert!(
            unchanged && spoilt.rejected <= usize::from(other_as_message),
            "byte {byte} of {}: {:?}",
            whole.len(),
            spoilt.end
        );
    }
}

#[test]
fn chunks_stay_within_the_limit_and_a_second() {
    let mut writer = TraceWriter::create(Vec::new(), &Metadata::new()).unwrap();
    for tick in 1..=2000 {
        writer.servo_state(&servo(tick)).unwrap();
    }
    writer.servo_state(&servo(10_000)).unwrap();
    let bytes = writer.finish().unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.chunk_indexes.len() > 10);
    for chunk in &summary.chunk_indexes {
        assert!(chunk.uncompressed_size <= CHUNK_LIMIT, "{}", chunk.uncompressed_size);
        assert!(chunk.message_end_time - chunk.message_start_time <= 1_000_000_000);
        assert_eq!(chunk.compression, "lz4");
    }
    // The mcap crate's own reader agrees on the number of messages.
    assert_eq!(mcap::MessageStream::new(&bytes).unwrap().filter(Result::is_ok).count(), 2001);
}

#[test]
fn a_reader_gives_each_topic_its_count_and_span() {
    let bytes = small_trace();
    let mut reader = TraceReader::open(&bytes[..]).unwrap();
    while reader.next_item().unwrap().is_some() {}
    let servo = reader.channels().find(|c| c.topic == SERVO_STATE).unwrap();
    assert_eq!((servo.messages, servo.first_ns, servo.last_ns), (3, 1_000_000, 3_000_000));
    assert_eq!(reader.channels().map(|c| c.messages).sum::<u64>(), 9);
}

#[test]
fn unusable_messages_are_not_recorded() {
    let mut writer = TraceWriter::create(Vec::new(), &Metadata::new()).unwrap();
    let bad = ServoState { energy_to_hand_j: f64::NAN, ..servo(1) };
    assert!(matches!(writer.servo_state(&bad), Err(TraceError::Unusable { field: "energy_to_hand_j", .. })));
    let (header, nodes) = frame(3);
    assert!(matches!(writer.tissue(&header, &nodes[..2]), Err(TraceError::Unusable { field: "node_count", .. })));
    let pose = HandPose { position_m: [f64::INFINITY; 3], ..POSE };
    assert!(matches!(writer.hand(1, &pose), Err(TraceError::Unusable { .. })));
    assert_eq!(read(&writer.finish().unwrap()).unwrap().items, []);
}

#[test]
fn hostile_messages_on_our_topics_are_rejected_and_the_rest_is_read() {
    let mut sink = mcap::Writer::new(io::Cursor::new(Vec::new())).unwrap();
    let schema = sink.add_schema("suture.ServoState", "jsonschema", b"{}").unwrap();
    let channel =
        |sink: &mut mcap::Writer<_>, topic| sink.add_channel(schema, topic, "json", &BTreeMap::new()).unwrap();
    let (servo_id, outline_id) = (channel(&mut sink, SERVO_STATE), channel(&mut sink, TISSUE_OUTLINE));
    let cloud_id = channel(&mut sink, TISSUE);
    let good = serde_json::to_string(&view::ServoView::of(&servo(1))).unwrap();
    let huge = good.replace("\"handle_count\":2", "\"handle_count\":4000000000");
    let many = good.replace("\"handles\":[", &format!("\"handles\":[{}", "null,".repeat(9)));
    let stamp = r#""timestamp":{"sec":0,"nsec":0},"sequence":1,"scene_generation":0"#;
    let outline =
        format!(r#"{{{stamp},"scene_kind":0,"node_count":1,"triangles":[0,0,1],"layers":[0],"pairs":[],"edges":[]}}"#);
    let cloud =
        format!(r#"{{{stamp},"frame_id":"scene","pose":null,"point_stride":16,"fields":[],"data":"","sim_time_s":0}}"#);
    let messages = [
        (servo_id, "null".to_owned()),
        (servo_id, "[".repeat(10_000)),
        (servo_id, huge),
        (servo_id, many),
        (outline_id, outline),
        (cloud_id, cloud),
        (servo_id, good),
    ];
    for (sequence, (channel_id, text)) in messages.iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: *channel_id,
            sequence: sequence as u32,
            log_time: 1_000_000,
            publish_time: 0,
        };
        sink.write_to_known_channel(&header, text.as_bytes()).unwrap();
    }
    sink.finish().unwrap();
    let read = read(sink.into_inner().get_ref()).unwrap();
    assert_eq!(read.rejected, messages.len() - 1);
    assert_eq!(read.items, [(1_000_000, TraceItem::ServoState(Box::new(servo(1))))]);
}

/// Takes some bytes, then the disk is full.
struct FullDisk {
    bytes: Vec<u8>,
    room: usize,
}

impl io::Write for FullDisk {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        if self.bytes.len() + data.len() > self.room {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.bytes.extend_from_slice(data);
        Ok(data.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error_at_any_moment_and_what_was_written_reads() {
    let whole = small_trace().len();
    for room in (0..whole).step_by(7) {
        let mut disk = FullDisk { bytes: Vec::new(), room };
        let outcome = (|| {
            let mut writer = TraceWriter::create(&mut disk, &metadata())?;
            for tick in 1..=100 {
                writer.servo_state(&servo(tick))?;
                writer.flush()?;
            }
            writer.finish().map(drop)
        })();
        assert!(matches!(outcome, Err(TraceError::Write(_))), "{room}: {outcome:?}");
        match read(&disk.bytes) {
            Ok(read) => assert_eq!(read.rejected, 0),
            Err(error) => assert!(matches!(error, TraceError::NotMcap), "{room}: {error}"),
        }
    }
}

proptest! {
    #[test]
    fn random_damage_never_panics(
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = small_trace();
        for (place, value) in &edits {
            let place = place.index(bytes.len());
            bytes[place] = *value;
        }
        bytes.truncate(cut.index(bytes.len()) + 1);
        if let Ok(read) = read(&bytes) {
            prop_assert!(read.end != TraceEnd::Reading);
        }
    }

    #[test]
    fn random_records_behind_the_magic_never_panic(
        records in proptest::collection::vec((0_u8..17, proptest::collection::vec(any::<u8>(), 0..80), any::<bool>()), 0..8),
    ) {
        let mut bytes = mcap::MAGIC.to_vec();
        for (opcode, body, honest) in &records {
            bytes.push(*opcode);
            let claimed = if *honest { body.len() as u64 } else { u64::from(body.first().copied().unwrap_or(9)) << 50 };
            bytes.extend_from_slice(&claimed.to_le_bytes());
            bytes.extend_from_slice(body);
        }
        if let Ok(read) = read(&bytes) {
            prop_assert!(read.end != TraceEnd::Reading);
        }
    }

    #[test]
    fn random_uncompressed_chunks_never_panic(
        inside in proptest::collection::vec((3_u8..7, 0_u64..40, proptest::collection::vec(any::<u8>(), 0..40)), 0..6),
        size_error in prop_oneof![3 => Just(0_i64), 1 => -20_i64..20],
    ) {
        let mut records = Vec::new();
        for (opcode, claimed, body) in &inside {
            records.push(*opcode);
            records.extend_from_slice(&claimed.to_le_bytes());
            records.extend_from_slice(body);
        }
        let mut chunk = vec![0_u8; 16];
        chunk.extend_from_slice(&(records.len() as u64).saturating_add_signed(size_error).to_le_bytes());
        chunk.extend_from_slice(&[0; 8]);
        chunk.extend_from_slice(&(records.len() as u64).to_le_bytes());
        chunk.extend_from_slice(&records);
        let mut bytes = mcap::MAGIC.to_vec();
        bytes.push(6);
        bytes.extend_from_slice(&(chunk.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&chunk);
        prop_assert!(read(&bytes).unwrap().end != TraceEnd::Reading);
    }
}
