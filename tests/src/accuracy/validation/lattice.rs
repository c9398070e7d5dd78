//! Lattices of the product's spring builder without a wound: a tube of quads, a strip of triangles.

use sim_core::tissue::lattice::{LayeredSurface, springs};
use sim_core::tissue::model::TissueError;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::params::{DragReading, FamilyFactors, MaterialParams};
use sim_core::tissue::surface::Face;
use sim_core::units::{KilogramsPerCubicMetre, NewtonSecondsPerMetre, NewtonsPerMetre};
use sim_core::vector::Vec3;
use std::f64::consts::TAU;

/// Springs of `k` over a layered surface; nothing is fixed. Masses are of no account in statics.
fn network(faces: &[Face], layers: &[Vec<Vec3>], stiffness_n_per_m: f64) -> Result<SpringNetwork, TissueError> {
    let stack = LayeredSurface::stack(faces, None, layers)?;
    let material = MaterialParams {
        stiffness: NewtonsPerMetre::new(stiffness_n_per_m)?,
        factors: FamilyFactors::default(),
        drag: DragReading::PerNode(NewtonSecondsPerMetre::new(0.0)?),
        density: KilogramsPerCubicMetre::new(1000.0)?,
    };
    let built = springs(&stack, &material, 0.0)?;
    let nodes = stack.position_m.len();
    Ok(SpringNetwork::new(stack.position_m, vec![1e-5; nodes], vec![0.0; nodes], vec![0; nodes], built)?)
}

/// Tube along z with `around` nodes on each ring and `rings` rings `cell_m` apart; layers by radius, outside first.
pub(super) fn tube(
    radii_m: &[f64],
    around: u32,
    rings: u32,
    cell_m: f64,
    stiffness_n_per_m: f64,
) -> Result<SpringNetwork, TissueError> {
    let at = |i: u32, j: u32| j * around + i % around;
    let quad = |i, j| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let faces: Vec<Face> =
        (0..rings - 1).flat_map(|j| (0..around).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect();
    let layer = |radius: &f64| {
        let point = |n: u32| {
            let angle = TAU * f64::from(n % around) / f64::from(around);
            Vec3::new(radius * angle.cos(), radius * angle.sin(), cell_m * f64::from(n / around))
        };
        (0..around * rings).map(point).collect::<Vec<Vec3>>()
    };
    network(&faces, &radii_m.iter().map(layer).collect::<Vec<_>>(), stiffness_n_per_m)
}

/// Strip of equilateral triangles of side `cell_m` along x: `columns` nodes in each of `rows` rows, every other row
/// shifted by half a cell.
pub(super) fn triangle_strip(
    columns: u32,
    rows: u32,
    cell_m: f64,
    stiffness_n_per_m: f64,
) -> Result<SpringNetwork, TissueError> {
    let at = |i: u32, j: u32| j * columns + i;
    let pair = |i: u32, j: u32| {
        if j.is_multiple_of(2) {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
        } else {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        }
    };
    let cells = (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (i, j)));
    let faces: Vec<Face> = cells.flat_map(|(i, j)| pair(i, j)).map(Face::Triangle).collect();
    let point = |n: u32| {
        let (i, j) = (n % columns, n / columns);
        let x = f64::from(i) + 0.5 * f64::from(j % 2);
        Vec3::new(x * cell_m, f64::from(j) * cell_m * 0.75_f64.sqrt(), 0.0)
    };
    network(&faces, &[(0..columns * rows).map(point).collect()], stiffness_n_per_m)
}
