//! A scene that moves: tissue, hand, force and line go to and fro, and every picture of a round is like that of the next round.

use std::f32::consts::TAU;
use viewer_client::feed::View;
use viewer_tests::scene::{Kind, view};

/// Pictures of a round.
pub(crate) const ROUND: u32 = 50;
/// From picture to picture, nanoseconds.
const STEP_NS: u64 = 33_000_000;
/// How far things move, metres.
const SWAY_M: f32 = 0.0015;

/// A moving scene.
pub(crate) struct Film {
    first: View,
    now: View,
    number: u32,
}

impl Film {
    /// The tissue, and so many copies of it beside each other less one.
    pub(crate) fn of(kind: Kind, copies: u32) -> Self {
        let first = beside_each_other(view(kind), copies);
        Self { now: first.clone(), first, number: 0 }
    }

    /// The next picture's view; takes no memory.
    pub(crate) fn next(&mut self) -> &View {
        self.number += 1;
        let Self { first, now, number } = self;
        let sway = (TAU * (*number % ROUND) as f32 / ROUND as f32).sin();
        for (node, at_rest) in now.frame.elements.iter_mut().zip(&first.frame.elements) {
            let [x, y, z] = at_rest.position_m;
            node.position_m = [x, y, z + SWAY_M * sway * (60.0 * x).cos()];
            node.strain = at_rest.strain * (1.0 + 0.2 * sway);
        }
        now.frames += 1;
        if let (Some(servo), Some(at_rest)) = (&mut now.servo, &first.servo) {
            servo.header.time_ns += STEP_NS;
            servo.ticks += STEP_NS / 1_000_000;
            servo.devices[0].position_m[2] = at_rest.devices[0].position_m[2] + f64::from(SWAY_M * sway);
            servo.devices[0].force_n[2] = at_rest.devices[0].force_n[2] * (1.0 + 0.3 * f64::from(sway));
        }
        if let (Some(report), Some(at_rest)) = (&mut now.report, &first.report) {
            report.sim_time_s += STEP_NS as f64 * 1e-9;
            report.gap_m = at_rest.gap_m * (1.0 + 0.2 * f64::from(sway));
            report.line_m[4][0] = at_rest.line_m[4][0] + f64::from(SWAY_M * sway);
        }
        now
    }
}

/// Copies of the tissue in a row, as one tissue.
fn beside_each_other(mut view: View, copies: u32) -> View {
    let (nodes, header) = (view.frame.elements.clone(), view.outline.header);
    let count = header.node_count;
    let triangles = 3 * header.triangle_count as usize;
    let words = std::mem::take(&mut view.outline.elements);
    let (faces, rest) = words.split_at(triangles);
    let (layers, marks) = rest.split_at(count as usize);
    let all = &mut view.outline.elements;
    (0..copies).for_each(|copy| all.extend(faces.iter().map(|node| node + copy * count)));
    (0..copies).for_each(|_| all.extend(layers));
    all.extend(marks);
    for copy in 1..copies {
        let aside_m = 0.05 * copy as f32;
        view.frame.elements.extend(nodes.iter().map(|node| {
            let [x, y, z] = node.position_m;
            protocol::scene_frame::FrameNode { position_m: [x + aside_m, y, z], ..*node }
        }));
    }
    view.frame.header.node_count *= copies;
    view.outline.header.node_count *= copies;
    view.outline.header.triangle_count *= copies;
    assert!(view.outline_of_frame().is_some(), "the copies are a scene");
    view
}
