//! Scenes of a few hundred nodes: a grid with a slit in its middle, flat (skin), as a dome of two layers (liver) or as
//! a tube of three (vessel), with a tied stitch, a line in work, a tool and a force.

use protocol::scene_frame::{AWAKE, FrameNode};
use protocol::servo_state::ServoState;
use protocol::tissue_port::HANDLE_PULLED;
use protocol::wire::{Field, Message};
use protocol::wound_report::{LedgerRow, WoundReport};
use std::f32::consts::TAU;
use viewer_client::feed::View;

/// Cells across (even), along, and rows at each end without a slit.
const ACROSS: u32 = 16;
const ALONG: u32 = 14;
const UNCUT: u32 = 3;
/// Size of the flat sheet, metres.
const WIDTH_M: f32 = 0.040;
const LENGTH_M: f32 = 0.034;
/// Widest opening of the slit, metres.
const GAP_M: f32 = 0.004;

/// What the grid is bent into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A flat sheet.
    Skin,
    /// A dome of two layers.
    Liver,
    /// A tube of three layers.
    Vessel,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Skin, Self::Liver, Self::Vessel];

    fn layers(self) -> u32 {
        self as u32 + 1
    }

    fn bent(self, x: f32, y: f32, layer: u32) -> [f32; 3] {
        let depth = 0.0016 * layer as f32;
        match self {
            Self::Skin => [x, y, 0.0015 * (x * 120.0).sin() * (y * 90.0).cos()],
            Self::Liver => [x * (1.0 - 20.0 * depth), y * (1.0 - 20.0 * depth), -14.0 * (x * x + y * y) - depth],
            Self::Vessel => {
                let (sin, cos) = (TAU * x / (WIDTH_M + WIDTH_M / ACROSS as f32)).sin_cos();
                let radius = 0.0065 - depth / 2.0;
                [radius * sin, y, radius * cos - 0.0065]
            }
        }
    }
}

/// One corner of a layer's grid; right of the slit its twin.
fn corner(i: u32, j: u32, right_of_slit: bool) -> u32 {
    let in_slit = i == ACROSS / 2 && (UNCUT + 1..ALONG - UNCUT).contains(&j);
    if in_slit && right_of_slit { (ACROSS + 1) * (ALONG + 1) + j - UNCUT - 1 } else { j * (ACROSS + 1) + i }
}

const NODES_PER_LAYER: u32 = (ACROSS + 1) * (ALONG + 1) + ALONG - 2 * UNCUT - 1;

fn place(kind: Kind, node: u32, layer: u32) -> [f32; 3] {
    let grid = (ACROSS + 1) * (ALONG + 1);
    let (i, j, side) = match node.checked_sub(grid) {
        Some(twin) => (ACROSS / 2, twin + UNCUT + 1, 1.0),
        None => {
            let (i, j) = (node % (ACROSS + 1), node / (ACROSS + 1));
            (i, j, if i > ACROSS / 2 { 1.0 } else { -1.0 })
        }
    };
    let y = (j as f32 / ALONG as f32 - 0.5) * LENGTH_M;
    let x = (i as f32 / ACROSS as f32 - 0.5) * WIDTH_M;
    let half_slit = (0.5 - UNCUT as f32 / ALONG as f32) * LENGTH_M;
    let open = (1.0 - (y / half_slit).powi(2)).max(0.0);
    kind.bent(x + side * 0.5 * GAP_M * open * (1.0 - 2.0 * x.abs() / WIDTH_M), y, layer)
}

/// Four-cornered faces of a layer, as indices into it.
fn faces() -> Vec<[u32; 4]> {
    let quad = |i, j| {
        let right = i >= ACROSS / 2;
        [corner(i, j, right), corner(i + 1, j, right), corner(i + 1, j + 1, right), corner(i, j + 1, right)]
    };
    (0..ALONG).flat_map(|j| (0..ACROSS).map(move |i| quad(i, j))).collect()
}

/// Triangles of all layers with the walls between them.
fn triangles(kind: Kind) -> Vec<u32> {
    let faces = faces();
    let sides: Vec<(u32, u32)> = faces.iter().flat_map(|f| (0..4).map(|k| (f[k], f[(k + 1) % 4]))).collect();
    let mut triangles = Vec::new();
    for layer in 0..kind.layers() {
        let at = layer * NODES_PER_LAYER;
        for [a, b, c, d] in faces.iter().map(|f| f.map(|n| n + at)) {
            triangles.extend(if layer == 0 { [a, b, c, a, c, d] } else { [a, c, b, a, d, c] });
        }
        if layer + 1 < kind.layers() {
            for &(from, to) in sides.iter().filter(|(from, to)| !sides.contains(&(*to, *from))) {
                let [upper, lower] = [at, at + NODES_PER_LAYER];
                triangles.extend([from + upper, from + lower, to + upper, to + upper, from + lower, to + lower]);
            }
        }
    }
    triangles
}

/// What is looked at from nearby, because it is a few pixels from afar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The left end of the tied stitch, with its knot.
    Stitch,
    /// The jaws with the needle.
    Tool,
    /// The suture point in hand.
    Proxy,
}

/// Two corners of a box around it, for a camera.
#[must_use]
pub fn corners(detail: Detail, view: &View) -> [[f32; 3]; 2] {
    let (row, servo) = (view.report.as_ref().map(|r| r.rows[0]), view.servo.as_ref());
    let (middle, border_m) = match detail {
        Detail::Stitch => {
            // The knot sits three tenths of the way to the right point; the middle of point and knot is in the middle.
            let middle = row.map(|row| {
                let (left, right) = (row.left_current_m, row.right_current_m);
                std::array::from_fn::<f64, 3, _>(|c| left[c] + 0.15 * (right[c] - left[c]))
            });
            (middle, 0.0015)
        }
        Detail::Tool => (servo.map(|s| s.devices[0].position_m), 0.004),
        Detail::Proxy => (servo.map(|s| s.handles[0].position_m), 0.002),
    };
    [-border_m, border_m].map(|b| middle.unwrap_or_default().map(|c| (c + b) as f32))
}

/// The whole view: tissue, two pairs of suture points of which one is tied, line, tool, force.
#[must_use]
pub fn view(kind: Kind) -> View {
    let mut view = View::default();
    let count = kind.layers() * NODES_PER_LAYER;
    let node = |n: u32| {
        let position_m = place(kind, n % NODES_PER_LAYER, n / NODES_PER_LAYER);
        let strain = 0.3 * (0.5 + position_m[0] / WIDTH_M).clamp(0.0, 1.0);
        let flags = if position_m[1] > 0.0 { AWAKE } else { 0 };
        FrameNode { position_m, attachment_force_n: 2.0 * strain, spring_force_n: strain, strain, flags }
    };
    view.frame.elements = (0..count).map(node).collect();
    view.frame.header.node_count = count;
    view.frame.header.scene_generation = 1;
    view.frame.header.stamp(1, 1);

    let (rows, middle) = ([UNCUT + 2, ALONG - UNCUT - 2], ACROSS / 2);
    let pairs = rows.map(|j| [corner(middle - 2, j, false), corner(middle + 2, j, true)]);
    let edges = (UNCUT..=ALONG - UNCUT).flat_map(|j| [corner(middle, j, false), corner(middle, j, true)]);
    let triangles = triangles(kind);
    let edges: Vec<u32> = edges.collect();
    let header = &mut view.outline.header;
    header.scene_generation = 1;
    header.scene_kind = kind as u32;
    header.node_count = count;
    header.triangle_count = triangles.len() as u32 / 3;
    header.pair_count = pairs.len() as u32;
    header.edge_count = edges.len() as u32;
    header.stamp(1, 1);
    let layers = (0..count).map(|n| n / NODES_PER_LAYER);
    view.outline.elements =
        triangles.into_iter().chain(layers).chain(pairs.into_iter().flatten()).chain(edges).collect();
    (view.frames, view.outlines) = (1, 1);

    let of = |node: u32| place(kind, node, 0).map(f64::from);
    let [tied, at_work] = pairs.map(|pair| pair.map(of));
    let hand = [0.010, -0.004, 0.016];
    view.report = Some(Box::new(report(tied, at_work, hand)));
    view.servo = Some(servo(at_work[1], hand));
    view
}

fn report(tied: [[f64; 3]; 2], at_work: [[f64; 3]; 2], hand: [f64; 3]) -> WoundReport {
    let mut report = WoundReport { stage: 3, row_count: 1, scene_count: 1, ..WoundReport::EMPTY };
    report.rows[0] = LedgerRow { left_current_m: tied[0], right_current_m: tied[1], ..LedgerRow::EMPTY };
    let line = [tied[0], tied[1], at_work[0], at_work[1], hand];
    report.line_point_count = line.len() as u32;
    report.line_m[..line.len()].copy_from_slice(&line);
    report.stamp(1, 1);
    report
}

fn servo(point: [f64; 3], hand: [f64; 3]) -> ServoState {
    let mut servo = ServoState { mode: 4, handle_count: 1, ..ServoState::EMPTY };
    servo.devices[0].present = 1;
    servo.devices[0].position_m = hand;
    servo.devices[0].orientation = [0.0, 0.0, 0.0, 1.0];
    servo.devices[0].force_n = [-0.4, 0.0, -0.5];
    servo.handles[0].mode = HANDLE_PULLED;
    servo.handles[0].pair = 1;
    servo.handles[0].position_m = point;
    servo.stamp(1, 1);
    servo
}
