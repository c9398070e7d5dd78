//! Messages that differ from each other in every field that a trace keeps, a small trace of them, and what was read of one.

use super::super::*;
use crate::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use crate::servo_state::{DeviceState, HandleState, ServoState};
use crate::session_command::CommandAnswer;
use crate::wire::{Field, Message};
use crate::wound_report::{LedgerRow, WoundReport};

pub(super) fn servo(tick: u64) -> ServoState {
    let t = tick as f64 / 1000.0;
    let device = DeviceState {
        position_m: [t.sin() / 3.0, 1e-300, -0.0],
        orientation: [0.0, 0.0, (t / 7.0).sin(), (t / 7.0).cos()],
        force_n: [0.1 + 0.2, f64::MIN_POSITIVE, 1e308],
        buttons: u32::from(tick.is_multiple_of(2)),
        present: 1,
        press_count: [tick as u32, 0],
        ..DeviceState::EMPTY
    };
    let handle = HandleState { position_m: [t, t / 3.0, -t], pair: 3, mode: 2, ..HandleState::EMPTY };
    let mut m = ServoState { ticks: tick, handle_count: 2, period_ns: 1_000_000, ..ServoState::EMPTY };
    (m.hand_sender, m.hand_turn) = (4711, 3);
    m.devices[0] = device;
    m.handles[1] = handle;
    m.stamp(tick, tick * 1_000_000);
    m
}

pub(super) fn report(steps: u64) -> WoundReport {
    let mut m = WoundReport {
        solver_steps: steps,
        row_count: 2,
        line_point_count: 3,
        scene_generation: 7,
        pair: 2,
        pair_count: 4,
        gap_m: 0.0021,
        closed_gap_m: 0.0013,
        distance_floor_m: 0.002,
        ..WoundReport::EMPTY
    };
    m.rows[1] = LedgerRow {
        original_distance_m: 0.001,
        relative_error: 1.0 / 3.0,
        slipped_m: 1e-4,
        scene_index: 2,
        ..LedgerRow::EMPTY
    };
    m.line_m[2] = [1.0, 2.0, 3.0];
    m.set_integrator_reason("semi_implicit x 3: S = 0.7");
    m.add_answer(CommandAnswer::new(1 << 40, 17, 4, "the gap is still open"));
    m.add_answer(CommandAnswer::new(2 << 40, 18, 1, ""));
    m.stamp(steps, steps * 10_000_000);
    m
}

pub(super) fn frame(count: u32) -> (FrameHeader, Vec<FrameNode>) {
    let nodes = (0..count)
        .map(|i| FrameNode {
            position_m: [i as f32 / 3.0, 0.1, -0.0],
            attachment_force_n: 1e-30,
            spring_force_n: 0.7,
            strain: 0.25,
            flags: i,
        })
        .collect();
    let mut header = FrameHeader { node_count: count, scene_generation: 4, sim_time_s: 0.1, ..FrameHeader::EMPTY };
    header.stamp(9, 5_000_000);
    (header, nodes)
}

pub(super) fn outline() -> (OutlineHeader, Vec<u32>) {
    let mut header = OutlineHeader {
        node_count: 3,
        triangle_count: 2,
        pair_count: 1,
        edge_count: 1,
        scene_kind: 2,
        ..OutlineHeader::EMPTY
    };
    header.stamp(1, 77);
    (header, vec![0, 1, 2, 2, 1, 0, 10, 11, 12, 0, 2, 1])
}

pub(super) fn metadata() -> Metadata {
    let group = |pairs: &[(&str, &str)]| pairs.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    [("scene".to_owned(), group(&[("kind", "skin"), ("β", "0.5")])), ("seeds".to_owned(), group(&[("hand", "7")]))]
        .into()
}

pub(super) const POSE: HandPose =
    HandPose { position_m: [0.1, 0.2, 0.3], orientation: [0.0, 0.0, 0.6, 0.8], buttons: 1 };

/// A small trace with every topic in several chunks.
pub(super) fn small_trace() -> Vec<u8> {
    let mut writer = TraceWriter::create(Vec::new(), &metadata()).unwrap();
    let (header, words) = outline();
    writer.outline(&header, &words).unwrap();
    for tick in 1..=3 {
        writer.servo_state(&servo(tick)).unwrap();
        writer.hand(tick, &POSE).unwrap();
        writer.flush().unwrap();
    }
    writer.wound_report(&report(1)).unwrap();
    let (header, nodes) = frame(5);
    writer.tissue(&header, &nodes).unwrap();
    writer.finish().unwrap()
}

pub(super) struct Read {
    pub(super) items: Vec<(u64, TraceItem)>,
    pub(super) rejected: usize,
    pub(super) metadata: Metadata,
    pub(super) end: TraceEnd,
}

pub(super) fn read(bytes: &[u8]) -> Result<Read, TraceError> {
    let mut reader = TraceReader::open(bytes)?;
    let (mut items, mut rejected) = (Vec::new(), 0);
    loop {
        match reader.next_item() {
            Ok(Some(item)) => items.push(item),
            Ok(None) => break,
            Err(TraceError::Message { .. }) => rejected += 1,
            Err(other) => return Err(other),
        }
    }
    Ok(Read { items, rejected, metadata: reader.metadata().clone(), end: reader.end().clone() })
}
