//! A view as a running server gives it, for tests of the panels.

use crate::feed::View;
use protocol::scene_frame::FrameNode;
use protocol::servo_state::ServoState;
use protocol::wire::Field;
use protocol::wound_report::{LedgerRow, WoundReport};

/// Pairs of the scene.
const PAIRS: u32 = 4;
/// Stitches that are tied.
const TIED: usize = 3;

/// A skin scene of four pairs 10 mm apart, three of them tied at 1.2 mm and held at 1.32 mm by the control, a force of 0.5 N.
/// `ER = 0.12/max(1.2, 2) = 6 %`.
pub(crate) fn view() -> View {
    let mut view = View { frames: 1, outlines: 1, ..View::default() };
    let node = |x: f32, y: f32| FrameNode { position_m: [x, y, 0.0], spring_force_n: 0.3, ..FrameNode::EMPTY };
    view.frame.elements =
        (0..PAIRS).flat_map(|i| [node(-0.005, 0.01 * i as f32), node(0.005, 0.01 * i as f32)]).collect();
    view.frame.header.node_count = 2 * PAIRS;
    view.frame.header.sim_time_s = 12.5;
    view.outline.header.node_count = 2 * PAIRS;
    view.outline.header.pair_count = PAIRS;
    view.outline.header.triangle_count = 2;
    let words = [0, 1, 2, 1, 3, 2].into_iter().chain((0..2 * PAIRS).map(|_| 0)).chain(0..2 * PAIRS);
    view.outline.elements = words.collect();

    let mut servo =
        ServoState { mode: 4, ticks: 12_500, port_sequence: 900, port_age_ns: 4_000_000, ..ServoState::EMPTY };
    servo.period_ns = 1_000_000;
    servo.header.time_ns = 77_000_000_000;
    servo.devices[0].present = 1;
    servo.devices[0].force_n = [0.3, 0.0, 0.4];
    servo.devices[0].unclipped_force_n = [0.3, 0.0, 0.4];
    view.servo = Some(servo);

    let mut report = WoundReport { scene_count: 3, control: 1, stage: 3, row_count: TIED as u32, ..WoundReport::EMPTY };
    (report.pair, report.pair_count) = (TIED as u32, PAIRS);
    (report.gap_m, report.closed_gap_m) = (0.0098, 0.0013);
    (report.distance_floor_m, report.er_max) = (0.002, 0.06);
    report.set_integrator_reason("bdf2 x 1");
    for (pair, row) in report.rows.iter_mut().take(TIED).enumerate() {
        *row = LedgerRow {
            pair: pair as u32,
            open_distance_m: 0.010,
            original_distance_m: 0.0012,
            current_distance_m: 0.00132,
            relative_error: 0.06,
            flags: 3,
            holding_force_n: 0.4,
            stitch_tension_n: 0.25,
            ..LedgerRow::EMPTY
        };
    }
    view.report = Some(Box::new(report));
    view
}
