//! A spring-box model after Choi, Chan and Pang (2012): tissue as one layer of cubes joined at their corners.
//!
//! Their abstract says "spring-connected boxes"; sizes, stiffnesses and law are not public. Assumed here: cubes of the
//! tissue's own spacing, springs along every edge and both diagonals of every face, all of the tissue's k but for shared edges
//! and faces as the product's builder shares them; no pre-strain, no attachments; a slit opened to the gap of the tissue it
//! stands beside; rim of both layers held; drag and mass per node as on the tissue. SI units.

use super::rig::Specimen;
use sim_core::tissue::cut::{Cut, Opening};
use sim_core::tissue::lattice::{LayeredSurface, springs};
use sim_core::tissue::model::TissueError;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::params::{DragReading, FamilyFactors, MaterialParams};
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::surface::Face;
use sim_core::units::{KilogramsPerCubicMetre, NewtonSecondsPerMetre, NewtonsPerMetre};
use sim_core::vector::Vec3;

/// Cells of tissue on each side of the wound and beyond each tip.
const MARGIN_CELLS: u32 = 10;
/// Density of a box, kilograms per cubic metre.
const DENSITY: f64 = 1060.0;

/// What the boxes stand beside.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxSpec {
    pub(super) spacing_m: f64,
    pub(super) wound_length_m: f64,
    pub(super) gap_m: f64,
    pub(super) bite_m: f64,
    pub(super) patch_radius_m: f64,
    pub(super) stiffness_n_per_m: f64,
    pub(super) drag_n_s_per_m: f64,
}

/// Builds the boxes with one pair of suture points in the middle of the wound; `None` where the wound is too short.
pub(super) fn build(spec: &BoxSpec) -> Option<Specimen> {
    let h = spec.spacing_m;
    let wound = 2 * (0.5 * spec.wound_length_m / h).round().max(2.0) as u32;
    let (columns, rows) = (2 * MARGIN_CELLS + 1, wound + 2 * MARGIN_CELLS + 1);
    let at = |i: u32, j: u32| j * columns + i;
    let quad = |i, j| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let faces: Vec<Face> =
        (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect();
    let path = (MARGIN_CELLS..=MARGIN_CELLS + wound).map(|j| at(MARGIN_CELLS, j)).collect();
    let cut = Cut::along(&faces, (columns * rows) as usize, path).ok()?;
    let flat = |v: u32| {
        let (i, j) = (cut.original(v) % columns, cut.original(v) / columns);
        Vec3::new(f64::from(i) - f64::from(MARGIN_CELLS), f64::from(j) - 0.5 * f64::from(rows - 1), 0.0) * h
    };
    let mut top: Vec<Vec3> = (0..cut.split_count() as u32).map(flat).collect();
    let side = cut.sides(&top.iter().map(|p| p.x).collect::<Vec<_>>());
    let opening = Opening {
        half_gap_m: 0.5 * spec.gap_m,
        half_length_m: 0.5 * f64::from(wound) * h,
        reach_m: f64::from(MARGIN_CELLS) * h,
    };
    for (p, side) in top.iter_mut().zip(&side) {
        p.x += opening.shift(*side, p.y, p.x.abs());
    }
    let bottom = top.iter().map(|p| p - Vec3::z() * h).collect();
    let network = network(spec, &faces, &cut, &[top.clone(), bottom]).ok()?;
    let rim = |v: u32| {
        let (i, j) = (cut.original(v) % columns, cut.original(v) / columns);
        i == 0 || j == 0 || i + 1 == columns || j + 1 == rows
    };
    let mut network = network;
    let count = top.len();
    (0..network.fixed.len()).for_each(|n| network.fixed[n] = u8::from(rim((n % count) as u32)));
    let point = |s: i8| {
        let center = Vec3::x() * (f64::from(s) * (0.5 * spec.gap_m + spec.bite_m));
        let near = |n: &usize| side[*n] == s && (top[*n] - center).norm() <= spec.patch_radius_m.max(0.8 * h);
        (0..count).filter(near).map(|n| n as u32).collect::<Vec<u32>>()
    };
    let points = [point(-1), point(1)];
    let weights = points.clone().map(|p| vec![1.0 / p.len() as f64; p.len()]);
    let patches =
        PatchSet::new(network.node_count(), points.iter().zip(&weights).map(|(p, w)| (p.as_slice(), w.as_slice())))
            .ok()?;
    let state = network.rest_state();
    let [left, right] = [0, 1].map(|p| patches.mean(sim_core::tissue::patch_set::PatchId(p), &state.position_m));
    let contact_m = ((right - left).norm() - spec.gap_m).max(0.0);
    Some(Specimen { network, patches, state, attachments: None, pair: 0, contact_m })
}

fn network(spec: &BoxSpec, faces: &[Face], cut: &Cut, layers: &[Vec<Vec3>]) -> Result<SpringNetwork, TissueError> {
    let stack = LayeredSurface::stack(faces, Some(cut), layers)?;
    let material = MaterialParams {
        stiffness: NewtonsPerMetre::new(spec.stiffness_n_per_m)?,
        factors: FamilyFactors { shear: 1.0, bend: 0.0, radial: 1.0, diagonal: 1.0 },
        drag: DragReading::PerNode(NewtonSecondsPerMetre::new(spec.drag_n_s_per_m)?),
        density: KilogramsPerCubicMetre::new(DENSITY)?,
    };
    let built = springs(&stack, &material, 0.0)?;
    let nodes = stack.position_m.len();
    let mass_kg = 0.5 * DENSITY * spec.spacing_m.powi(3);
    Ok(SpringNetwork::new(
        stack.position_m,
        vec![mass_kg; nodes],
        vec![0.5 * spec.drag_n_s_per_m; nodes],
        vec![0; nodes],
        built,
    )?)
}
