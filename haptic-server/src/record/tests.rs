//! A recording holds every tick that fits on the disk, and never more trouble than a flag.

use super::*;
use protocol::ports::{SceneFramePublisher, SceneOutlinePublisher, WoundReportPublisher};
use protocol::run::{Environment, RunRoot};
use protocol::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use protocol::trace::{TraceEnd, TraceItem, TraceReader};
use protocol::wire::{Field, Message};
use std::io;

const PERIOD_NS: u64 = 1_000_000;
/// Generous: the machine may be loaded. A failure is a failure, not a slow machine.
const PATIENCE: Duration = Duration::from_secs(20);

fn state(tick: u64) -> ServoState {
    let mut state = ServoState { ticks: tick, ..ServoState::EMPTY };
    state.devices[0].present = 1;
    state.devices[0].orientation = [0.0, 0.0, 0.0, 1.0];
    state.devices[0].position_m = [tick as f64 * 1e-4, 0.0, 0.0];
    state.devices[0].buttons = u32::from((25..45).contains(&tick));
    state.stamp(tick, tick * PERIOD_NS);
    state
}

fn items(bytes: &[u8]) -> (Vec<(u64, TraceItem)>, TraceEnd) {
    let mut reader = TraceReader::open(bytes).unwrap();
    let mut items = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        items.push(item);
    }
    (items, reader.end().clone())
}

/// Takes some bytes, then the disk is full.
#[derive(Default)]
struct Disk {
    bytes: Vec<u8>,
    room: usize,
}

impl Write for &mut Disk {
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
fn every_tick_is_recorded_and_the_stylus_at_100_hz_and_at_button_changes() {
    let mut disk = Disk { room: usize::MAX, ..Disk::default() };
    let mut recording = Recording::create(&mut disk, &Metadata::new()).unwrap();
    (1..=100).for_each(|tick| recording.tick(&state(tick)));
    let outcome = recording.finish();
    assert_eq!(outcome, RecordOutcome { ticks: 100, ..RecordOutcome::default() });
    let (items, end) = items(&disk.bytes);
    assert_eq!(end, TraceEnd::Complete);
    let ticks: Vec<u64> = items
        .iter()
        .filter_map(|(_, item)| if let TraceItem::ServoState(s) = item { Some(s.ticks) } else { None })
        .collect();
    assert!(ticks.iter().copied().eq(1..=100));
    let poses: Vec<(u64, u32)> = items
        .iter()
        .filter_map(|(t, item)| if let TraceItem::Hand(h) = item { Some((t / PERIOD_NS, h.buttons)) } else { None })
        .collect();
    let expected =
        [(10, 0), (20, 0), (25, 1), (30, 1), (40, 1), (45, 0), (50, 0), (60, 0), (70, 0), (80, 0), (90, 0), (100, 0)];
    assert_eq!(poses, expected);
}

#[test]
fn a_full_disk_stops_the_recording_and_nothing_else() {
    let mut disk = Disk { room: 40_000, ..Disk::default() };
    let mut recording = Recording::create(&mut disk, &Metadata::new()).unwrap();
    (1..=20_000).for_each(|tick| recording.tick(&state(tick)));
    assert!(!recording.is_open());
    let outcome = recording.finish();
    assert_eq!(outcome.ticks + outcome.lost_ticks, 20_000, "every tick is accounted for");
    assert!(outcome.ticks > 0 && outcome.lost_ticks > 0);
    assert!(outcome.stopped.unwrap().contains("cannot be written"));
    let (items, end) = items(&disk.bytes);
    assert!(matches!(end, TraceEnd::Cut { .. }));
    assert!(!items.is_empty(), "what was written before reads");
}

#[test]
fn a_tick_that_no_reader_would_accept_is_left_out() {
    let mut disk = Disk { room: usize::MAX, ..Disk::default() };
    let mut recording = Recording::create(&mut disk, &Metadata::new()).unwrap();
    recording.tick(&ServoState { energy_to_hand_j: f64::NAN, ..state(1) });
    recording.tick(&state(2));
    assert_eq!(recording.finish(), RecordOutcome { ticks: 1, refused: 1, ..RecordOutcome::default() });
    assert_eq!(items(&disk.bytes).0.len(), 1);
}

#[test]
fn the_recorder_brings_ring_and_topics_into_one_file() {
    let place = tempfile::tempdir().unwrap();
    let environment = Environment { xdg_runtime_dir: Some(place.path().to_owned()), ..Environment::of_process() };
    let root = RunRoot::open(&environment).unwrap();
    let active = root.start().unwrap();
    let node = PortNode::join(active.run(), "solver").unwrap();
    let mut outlines = SceneOutlinePublisher::open(&node, 8).unwrap();
    let mut frames = SceneFramePublisher::open(&node, 8).unwrap();
    let mut reports = WoundReportPublisher::open(&node).unwrap();
    let mut header = OutlineHeader { node_count: 2, ..OutlineHeader::EMPTY };
    outlines.send(&mut header, 2, |_| 0).unwrap();

    let (mut servo, ring) = rtrb::RingBuffer::new(1_000);
    let file = place.path().join("session.mcap");
    let recorder = Recorder::start(&file, &origin::origin(), active.run().clone(), ring, Arc::default()).unwrap();
    // Wall clock: patience with the recorder thread; nothing is measured.
    let start = Instant::now();
    let mut tick = 0;
    let has_scene = |bytes: &[u8]| {
        let (items, _) = items(bytes);
        items.iter().any(|(_, i)| matches!(i, TraceItem::Tissue(..)))
            && items.iter().any(|(_, i)| matches!(i, TraceItem::Outline(..)))
            && items.iter().any(|(_, i)| matches!(i, TraceItem::WoundReport(_)))
    };
    while !has_scene(&std::fs::read(&file).unwrap()) {
        assert!(start.elapsed() < PATIENCE, "the topics do not reach the file");
        for _ in 0..50 {
            tick += 1;
            let record =
                TickRecord { state: state(tick), scheduled_ns: 0, now_ns: 0, dt_s: 1e-3, compute_ns: 0, clips: 0 };
            servo.push(record).unwrap();
        }
        outlines.serve_late_joiners().unwrap();
        let mut header = FrameHeader { node_count: 2, ..FrameHeader::EMPTY };
        frames.send(&mut header, 2, |_| FrameNode::EMPTY).unwrap();
        reports.send(&mut WoundReport::EMPTY.clone()).unwrap();
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(!recorder.has_failed());
    let outcome = recorder.finish().unwrap();
    assert_eq!(outcome, RecordOutcome { ticks: tick, ..RecordOutcome::default() });
    assert_eq!(items(&std::fs::read(&file).unwrap()).1, TraceEnd::Complete);
    drop((outlines, frames, reports, node));
    active.finish(&root).unwrap();
}

#[test]
fn a_file_that_cannot_be_made_is_refused_before_anything_starts() {
    let place = tempfile::tempdir().unwrap();
    let error = File::create(place.path().join("absent/x.mcap")).unwrap_err();
    assert_eq!(writing(Path::new("x.mcap"), &error).exit_code(), crate::exit::UNAVAILABLE);
}
