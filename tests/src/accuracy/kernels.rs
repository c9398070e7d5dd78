//! The force sweeps beside plain C kernels of the same work, in one process (`crate::kernels`).
//!
//! Absent: times of whole steps (`work_precision`), errors of the paths (`network_file`).

use super::section::{Effort, Progress, Row, Section};
use crate::kernels::{KernelTime, QUICK_SPRINGS, measure as time_all, meshes};
use serde_json::json;

/// A full report sweeps so many times the springs of a quick one.
const FULL_FACTOR: usize = 8;

/// Times every path, precision and instruction set on three meshes.
pub(super) fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let springs = match effort {
        Effort::Quick => QUICK_SPRINGS,
        Effort::Full => FULL_FACTOR * QUICK_SPRINGS,
    };
    let mut rows = Vec::new();
    for (mesh, network) in meshes::all() {
        if progress.stopped() {
            break;
        }
        (progress.say)(&format!("kernels on the {mesh}"));
        let count = network.springs.len();
        rows.extend(time_all(&network, springs).iter().map(|time| row(&mesh, count, time)));
    }
    Section {
        key: "kernels",
        title: "Force sweeps beside plain C".to_owned(),
        words: vec![
            "Nanoseconds per spring and step of one force sweep, one core, the least of interleaved repeats. The C kernels are \
             compiled for this very processor (-O3 -march=native -fno-math-errno) and run in the same process; a ratio means \
             something, a nanosecond on a shared machine little. Rows and gather are compared with the C gather of the \
             same precision, stencils with the C stencil."
                .to_owned(),
        ],
        figures: Vec::new(),
        rows,
    }
}

fn row(mesh: &str, springs: usize, time: &KernelTime) -> Row {
    vec![
        ("mesh", json!(mesh)),
        ("springs", json!(springs)),
        ("family", json!(time.family)),
        ("kernel", json!(time.name)),
        ("ns_per_spring_step", json!(time.ns_per_spring)),
        ("of_c", json!(time.of_c)),
    ]
}
