//! An elliptical wound of a stated size after relaxation, and the middle stitch that closes it.
//!
//! The sheet is built pre-stretched, so a built hole opens; the built half axes are corrected until the relaxed ones
//! are as stated. Where tension alone opens the wound wider than stated, the built wound is a slit and the width is
//! what it comes to. The stitch: two rigid patches at the skin preset's bite, brought together until the edges meet.

use super::sheet::{SheetSpec, WoundSheet, build};
use crate::accuracy::statics::Statics;
use sim_core::vector::Vec3;

/// Distance of a suture point from the wound edge: the skin preset's, metres.
pub(super) const BITE_M: f64 = 0.002;
/// Nodes this near to a suture point move with it: the skin preset's, metres.
const PATCH_RADIUS_M: f64 = 0.0021;
/// Force that may be left on a node: a thousandth of the smallest closing force on a thousand nodes.
const TOLERANCE_N: f64 = 1e-6;
/// Corrections of the built axes: each leaves about a tenth of the miss.
const CORRECTIONS: usize = 4;

/// A wound at rest in its sheet.
#[derive(Clone, Debug)]
pub(super) struct OpenWound {
    pub(super) sheet: WoundSheet,
    pub(super) statics: Statics,
    /// Length and width after relaxation, metres.
    pub(super) size_m: [f64; 2],
}

/// A suture point on each side.
#[derive(Clone, Debug)]
pub(super) struct StitchPatches {
    pub(super) left: Vec<u32>,
    pub(super) right: Vec<u32>,
    /// Wound edge at the stitch: left node, right node.
    pub(super) edge: [u32; 2],
}

fn measured_size(sheet: &WoundSheet, x: &[Vec3]) -> [f64; 2] {
    let [first, last] = sheet.tips.map(|t| x[t as usize].y);
    let width = |[l, r]: &[u32; 2]| x[*r as usize].x - x[*l as usize].x;
    [last - first, sheet.edge.iter().map(width).fold(0.0, f64::max)]
}

/// Builds a wound that has `size_m` (length, width) after relaxation; `None` when the sheet cannot be built or finds no rest.
pub(super) fn open_wound(
    size_m: [f64; 2],
    spacing_m: f64,
    pre_strain: f64,
    stiffness_n_per_m: f64,
) -> Option<OpenWound> {
    let mut spec = SheetSpec {
        half_length_m: 0.5 * size_m[0],
        half_width_m: 0.5 * size_m[1],
        spacing_m,
        pre_strain,
        stiffness_n_per_m,
    };
    let mut found = None;
    for _ in 0..CORRECTIONS {
        let sheet = build(&spec).ok()?;
        let mut statics = Statics::new(sheet.network.clone(), TOLERANCE_N);
        if !statics.rest() {
            return None;
        }
        let size = measured_size(&sheet, &statics.position_m);
        spec.half_length_m += 0.5 * (size_m[0] - size[0]);
        spec.half_width_m = (spec.half_width_m + 0.5 * (size_m[1] - size[1])).max(0.0);
        found = Some(OpenWound { sheet, statics, size_m: size });
        if pre_strain == 0.0 {
            break;
        }
    }
    found
}

impl OpenWound {
    /// Suture points at the edge nodes nearest to `along_m` from the middle.
    pub(super) fn stitch_at(&self, along_m: f64) -> StitchPatches {
        let x = &self.statics.position_m;
        let off = |e: &[u32; 2]| (x[e[0] as usize].y - along_m).abs();
        let nearest = self.sheet.edge.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let edge = *nearest.unwrap_or(&self.sheet.tips);
        let near = |node: u32, side: i8| {
            let point = x[node as usize] + Vec3::x() * (BITE_M * f64::from(side));
            let within = |i: usize| self.sheet.side[i] == side && (x[i] - point).norm() <= PATCH_RADIUS_M;
            (0..x.len()).filter(|i| within(*i)).map(|i| i as u32).collect::<Vec<u32>>()
        };
        StitchPatches { left: near(edge[0], -1), right: near(edge[1], 1), edge }
    }

    /// Gap between the edges at a stitch, metres.
    pub(super) fn gap_m(&self, stitch: &StitchPatches) -> f64 {
        let [l, r] = stitch.edge.map(|n| self.statics.position_m[n as usize]);
        r.x - l.x
    }

    /// Brings the two suture points together until the edges meet, in `steps` steps. Gap and force at each step, the open
    /// wound first.
    pub(super) fn close(&mut self, stitch: &StitchPatches, steps: u32) -> Vec<(f64, f64)> {
        let half = 0.5 * self.gap_m(stitch);
        self.statics.hold(&stitch.left);
        self.statics.hold(&stitch.right);
        let mut path = vec![(self.gap_m(stitch), 0.0)];
        for _ in 0..steps {
            let by = Vec3::x() * (half / f64::from(steps));
            self.statics.shift(&stitch.left, by);
            self.statics.shift(&stitch.right, -by);
            if !self.statics.rest() {
                break;
            }
            let [left, right] = [&stitch.left, &stitch.right].map(|p| self.statics.force_on(|n| p.contains(&n)).x);
            path.push((self.gap_m(stitch), 0.5 * (right - left)));
        }
        path
    }
}
