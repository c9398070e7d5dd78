//! A clamped sheet with an elliptical wound whose mesh follows the ellipse.
//!
//! A square lattice is slit over the length `2(A + B)` along y and the slit opened by Joukowski's map
//! `w = ζ − B/u`, `ζ = ½(A + B)(u + 1/u)`, which takes the slit to the ellipse of half axes A, B. The map is conformal:
//! cells stay square, and a square lattice of springs has the same membrane stiffness at every cell size. Towards the
//! rim the map fades to none. Springs are those of the product's builder. SI units; x across the wound, y along it.

use sim_core::tissue::cut::Cut;
use sim_core::tissue::lattice::{LayeredSurface, springs};
use sim_core::tissue::model::TissueError;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::params::{DragReading, FamilyFactors, MaterialParams};
use sim_core::tissue::surface::Face;
use sim_core::units::{KilogramsPerCubicMetre, NewtonSecondsPerMetre, NewtonsPerMetre};
use sim_core::vector::Vec3;

/// Half size of the sheet across and along the wound, metres: 120 × 160 mm.
pub(super) const HALF_SIZE_M: [f64; 2] = [0.06, 0.08];
/// Mass of a node, kilograms; statics do not depend on it.
const NODE_KG: f64 = 1e-5;

/// What to build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SheetSpec {
    /// Half axis along the wound as built, metres.
    pub half_length_m: f64,
    /// Half axis across it as built, metres, at least 0.
    pub half_width_m: f64,
    /// Side of a cell far from the wound, metres.
    pub spacing_m: f64,
    /// Stretch of the springs as built.
    pub pre_strain: f64,
    /// Structural stiffness k, newtons per metre.
    pub stiffness_n_per_m: f64,
}

/// A sheet with its wound.
#[derive(Clone, Debug)]
pub(super) struct WoundSheet {
    /// Nodes and springs, rim fixed.
    pub network: SpringNetwork,
    /// Wound edge without the tips, from −y to +y: left node, right node.
    pub edge: Vec<[u32; 2]>,
    /// The two tips.
    pub tips: [u32; 2],
    /// −1 left of the wound, +1 right of it, 0 at the tips.
    pub side: Vec<i8>,
}

/// `u` of `ζ = ½ c (u + 1/u)` outside the unit circle; on the slit the side decides. Returns real and imaginary part.
fn joukowski_u(along: f64, across: f64, half_slit: f64, side: i8) -> [f64; 2] {
    let (re, im) = (along / half_slit, across / half_slit);
    if across == 0.0 && re.abs() < 1.0 {
        return [re, f64::from(side) * (1.0 - re * re).sqrt()];
    }
    // √(z² − 1) on the branch of z, as √(z − 1)·√(z + 1) has it.
    let root = |re: f64, im: f64| {
        let r = re.hypot(im);
        let (a, b) = ((0.5 * (r + re)).max(0.0).sqrt(), (0.5 * (r - re)).max(0.0).sqrt());
        [a, if im < 0.0 { -b } else { b }]
    };
    let ([a, b], [c, d]) = (root(re - 1.0, im), root(re + 1.0, im));
    [re + a * c - b * d, im + a * d + b * c]
}

/// Displacement that opens the slit at a point of the lattice.
fn opening(x: f64, y: f64, spec: &SheetSpec, side: i8) -> Vec3 {
    let [re, im] = joukowski_u(y, x, spec.half_length_m + spec.half_width_m, side);
    let square = re * re + im * im;
    let fade = 1.0 - (x.abs() / HALF_SIZE_M[0]).max(y.abs() / HALF_SIZE_M[1]).powi(4);
    // −B/u with 1/u = ū/|u|².
    Vec3::new(im, -re, 0.0) * (spec.half_width_m * fade / square)
}

/// Builds the sheet.
///
/// # Errors
/// [`TissueError`] where the wound does not fit.
pub(super) fn build(spec: &SheetSpec) -> Result<WoundSheet, TissueError> {
    let half_slit = spec.half_length_m + spec.half_width_m;
    let cells = |length: f64| (length / spec.spacing_m).round().max(1.0) as u32;
    let (half_across, half_wound, beyond) =
        (cells(HALF_SIZE_M[0]), cells(half_slit), cells(HALF_SIZE_M[1] - half_slit));
    let (columns, half_along) = (2 * half_across + 1, half_wound + beyond);
    let rows = 2 * half_along + 1;
    let at = |i: u32, j: u32| j * columns + i;
    let quad = |i, j| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let faces: Vec<Face> =
        (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect();
    let path: Vec<u32> = (beyond..=beyond + 2 * half_wound).map(|j| at(half_across, j)).collect();
    let cut = Cut::along(&faces, (columns * rows) as usize, path)?;

    let lattice = |v: u32| {
        let (i, j) = (cut.original(v) % columns, cut.original(v) / columns);
        let (row, wound) = (f64::from(j) - f64::from(half_along), f64::from(half_wound));
        let inside = row.abs() <= wound;
        let outer = half_slit + (row.abs() - wound) * (HALF_SIZE_M[1] - half_slit) / f64::from(beyond);
        let y = if inside { half_slit * row / wound } else { outer.copysign(row) };
        let x = HALF_SIZE_M[0] * (f64::from(i) - f64::from(half_across)) / f64::from(half_across);
        let rim = i == 0 || i + 1 == columns || j == 0 || j + 1 == rows;
        (x, y, rim)
    };
    let split: Vec<(f64, f64, bool)> = (0..cut.split_count() as u32).map(lattice).collect();
    let side = cut.sides(&split.iter().map(|p| p.0).collect::<Vec<_>>());
    let moved = |(p, side): (&(f64, f64, bool), &i8)| Vec3::new(p.0, p.1, 0.0) + opening(p.0, p.1, spec, *side);
    let positions: Vec<Vec3> = split.iter().zip(&side).map(moved).collect();

    let layers = LayeredSurface::stack(&faces, Some(&cut), std::slice::from_ref(&positions))?;
    let material = MaterialParams {
        stiffness: NewtonsPerMetre::new(spec.stiffness_n_per_m)?,
        factors: FamilyFactors::default(),
        drag: DragReading::PerNode(NewtonSecondsPerMetre::new(0.0)?),
        density: KilogramsPerCubicMetre::new(1100.0)?,
    };
    let nodes = positions.len();
    let network = SpringNetwork::new(
        positions,
        vec![NODE_KG; nodes],
        vec![0.0; nodes],
        split.iter().map(|p| u8::from(p.2)).collect(),
        springs(&layers, &material, spec.pre_strain)?,
    )?;
    let edge = cut.left().iter().zip(cut.right()).map(|(l, r)| [*l, r]).collect();
    let tips = [cut.path[0], cut.path[cut.path.len() - 1]];
    Ok(WoundSheet { network, edge, tips, side })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edge_nodes_lie_on_the_ellipse() {
        let (a, b) = (0.015, 0.0075);
        let spec = SheetSpec {
            half_length_m: a,
            half_width_m: b,
            spacing_m: 0.0025,
            pre_strain: 0.0,
            stiffness_n_per_m: 160.0,
        };
        let sheet = build(&spec).expect("it fits");
        let x = &sheet.network.rest_m;
        for node in sheet.edge.iter().flatten().chain(&sheet.tips) {
            let p = x[*node as usize];
            let fade = 1.0 - ((p.y / 0.08).abs().max(p.x.abs() / 0.06)).powi(4);
            let on = (p.x / b).powi(2) + (p.y / a).powi(2);
            // The fade towards the rim leaves the ellipse by (22 mm / 80 mm)⁴ of its half width at most.
            assert!((on - 1.0).abs() < 0.02, "{p}: {on} (fade {fade})");
        }
        assert!(sheet.edge.iter().all(|[l, r]| (x[*l as usize] + x[*r as usize]).x.abs() < 1e-15));
        let smallest = sheet.network.springs.iter().map(|s| s.rest_length_m).fold(f64::MAX, f64::min);
        assert!(smallest > 0.2 * spec.spacing_m, "a cell has collapsed: {smallest}");
    }
}
