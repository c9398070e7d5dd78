//! Tubiform tissue suture model (Zhang et al., §2.1.1, Fig. 1c, Fig. 2c): a vessel as a tube of quads
//! in several layers, axis along y, the slit along the axis on top (+z), both end rings held.
//!
//! Layer l of n has radius R − l·w/(n − 1) and stands for w/n of the wall w; neighbours in depth are
//! joined by radial and diagonal springs, without which layers spin freely. The gap is opened by
//! pressing the rest of the circumference together evenly, by equal angles on every cut layer.

use super::cut::{Cut, Opening};
use super::lattice::LayeredSurface;
use super::model::{Blueprint, Tissue, TissueError, TissueKind, check_count};
use super::params::{MAX_LAYERS, MaterialParams, WoundParams, at_least_minimum, in_range};
use super::surface::Face;
use crate::units::Metres;
use crate::vector::Vec3;
use std::f64::consts::{PI, TAU};

/// A vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TtsmParams {
    /// Outer radius.
    pub radius: Metres,
    /// Length of the tube.
    pub length: Metres,
    /// Wall thickness.
    pub wall: Metres,
    /// Layers of the wall, at least 2.
    pub layers: u32,
    /// Cells around the tube, at least 6.
    pub cells_around: u32,
    /// Cells along the tube, at least 4.
    pub cells_along: u32,
    /// Material.
    pub material: MaterialParams,
    /// Wound.
    pub wound: WoundParams,
}

/// Fewest and most cells around or along.
const CELLS: (f64, f64) = (4.0, 100_000.0);
/// Thickest wall, as a share of the radius: the innermost ring must keep a lumen.
const THICKEST_WALL: f64 = 0.9;
/// A layer counts as reached by the depth of the wound within this share.
const DEPTH_TOLERANCE: f64 = 1.0e-9;

/// Quads of a tube, ring by ring, seen from outside.
pub(super) fn tube(around: u32, along: u32) -> Vec<Face> {
    let at = |i: u32, j: u32| j * around + i % around;
    let quad = |i, j| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    (0..along).flat_map(|j| (0..around).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect()
}

/// Angle of a column from the top, in −π..=π.
fn angle(column: u32, around: u32) -> f64 {
    let turn = f64::from(column) / f64::from(around);
    TAU * if turn > 0.5 { turn - 1.0 } else { turn }
}

/// Point of a tube whose top line is the y axis at depth 0.
fn point(radius: f64, outer: f64, angle: f64, y: f64) -> Vec3 {
    Vec3::new(radius * angle.sin(), y, radius * angle.cos() - outer)
}

fn check(params: &TtsmParams) -> Result<(), TissueError> {
    params.material.check()?;
    params.wound.check()?;
    let radius = at_least_minimum("tube radius", params.radius)?;
    at_least_minimum("tube length", params.length)?;
    at_least_minimum("wall thickness", params.wall)?;
    in_range("wall thickness as a share of the radius", params.wall.get() / radius, 0.0, THICKEST_WALL)?;
    in_range("number of layers", f64::from(params.layers), 2.0, f64::from(MAX_LAYERS))?;
    in_range("cells around the tube", f64::from(params.cells_around), CELLS.0 + 2.0, CELLS.1)?;
    in_range("cells along the tube", f64::from(params.cells_along), CELLS.0, CELLS.1)?;
    let rings = f64::from(params.cells_along) + 1.0;
    check_count((f64::from(params.cells_around) + 1.0) * rings * f64::from(params.layers))
}

/// The path of the wound along the top, in whole cells, centred.
fn top_path(params: &TtsmParams) -> Result<Vec<u32>, TissueError> {
    let along = f64::from(params.cells_along);
    let wanted = params.wound.length.get() / params.length.get() * along;
    let beyond = (0.5 * (along - wanted)).round();
    if beyond < 1.0 {
        return Err(TissueError::Wound {
            what: format!(
                "a wound of {} m reaches the held ends of a tube of {} m",
                params.wound.length.get(),
                params.length.get()
            ),
            remedy: "make the wound shorter or the tube longer",
        });
    }
    let first = beyond as u32;
    Ok((first..=params.cells_along - first).map(|j| j * params.cells_around).collect())
}

/// Builds the tube.
///
/// # Errors
/// [`TissueError`]: a parameter out of range, too many nodes, a wound or suture points that do not fit.
pub fn build(params: &TtsmParams) -> Result<Tissue, TissueError> {
    check(params)?;
    let (around, along) = (params.cells_around, params.cells_along);
    let faces = tube(around, along);
    let vertex_count = around * (along + 1);
    let path = top_path(params)?;
    let wound_cells = path.len() - 1;
    let cut = Cut::along(&faces, vertex_count as usize, path)?;
    let outer = params.radius.get();
    let cell = params.length.get() / f64::from(along);
    let opening = Opening {
        half_gap_m: 0.5 * params.wound.gap.get(),
        half_length_m: 0.5 * wound_cells as f64 * cell,
        reach_m: PI * outer,
    };
    opening.check()?;
    let angles: Vec<f64> = (0..cut.split_count() as u32).map(|v| angle(cut.original(v) % around, around)).collect();
    let sides = cut.sides(&angles);
    let y = |v: u32| (f64::from(cut.original(v) / around) - 0.5 * f64::from(along)) * cell;

    let deepest = f64::from(params.layers - 1);
    let mut layers = Vec::new();
    let mut fixed = Vec::new();
    for layer in 0..params.layers {
        let depth = params.wall.get() * f64::from(layer) / deepest;
        let is_cut = depth <= params.wound.depth.get() * (1.0 + DEPTH_TOLERANCE);
        let count = if is_cut { cut.split_count() as u32 } else { vertex_count };
        let opened = |v: u32| {
            let (phi, side) = (angles[v as usize], sides[v as usize]);
            let shift = if is_cut { opening.shift(side, y(v), phi.abs() * outer) } else { 0.0 };
            point(outer - depth, outer, phi + shift / outer, y(v))
        };
        layers.push((0..count).map(opened).collect());
        let ring = |v: u32| cut.original(v) / around;
        fixed.extend((0..count).map(|v| u8::from(ring(v) == 0 || ring(v) == along)));
    }
    Blueprint {
        kind: TissueKind::Ttsm,
        layers: LayeredSurface::stack(&faces, Some(&cut), &layers)?,
        cut,
        fixed,
        layer_thickness_m: params.wall.get() / f64::from(params.layers),
        pre_strain: 0.0,
        material: &params.material,
        wound: &params.wound,
        shell: None,
    }
    .build()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::test_support::{material, mm, refusal, wound};

    fn vessel() -> TtsmParams {
        let mut wound = wound(24.0, 2.0, 1.5);
        wound.bite = mm(2.0);
        wound.patch_radius = mm(2.0);
        TtsmParams {
            radius: mm(8.0),
            length: mm(60.0),
            wall: mm(1.5),
            layers: 3,
            cells_around: 32,
            cells_along: 40,
            material: material(0.27, 2.0, 1.5),
            wound,
        }
    }

    #[test]
    fn no_spring_crosses_the_open_slit() {
        let mut params = vessel();
        params.material.factors.bend = 0.3;
        let tissue = build(&params).unwrap();
        let half = 0.5 * tissue.wound_length_m;
        let mut crossings = 0;
        for s in &tissue.network.springs {
            let [p, q] = [s.a, s.b].map(|n| tissue.network.rest_m[n as usize]);
            let above_axis = p.z > -0.008 && q.z > -0.008;
            if p.x * q.x < 0.0 && above_axis {
                crossings += 1;
                let y = p.y + (q.y - p.y) * p.x / (p.x - q.x);
                assert!(y.abs() >= half, "a {:?} spring crosses the wound at y = {y}", s.family);
            }
        }
        assert!(crossings > 0, "beyond the tips springs do join the sides");
    }

    #[test]
    fn mass_is_that_of_the_layers() {
        let mut params = vessel();
        params.wound.gap = Metres::new(0.0).unwrap();
        let tissue = build(&params).unwrap();
        // A ring of n chords has the perimeter 2·n·r·sin(π/n).
        let perimeter = |r: f64| 2.0 * 32.0 * r * (PI / 32.0).sin();
        let area: f64 = [0.008, 0.00725, 0.0065].iter().map(|r| perimeter(*r) * 0.06).sum();
        let expected = 1100.0 * 0.0005 * area;
        let total: f64 = tissue.network.mass_kg.iter().sum();
        assert!((total / expected - 1.0).abs() < 1.0e-9, "{total} against {expected}");
    }

    #[test]
    fn depth_decides_which_layers_are_cut() {
        let counts = |depth: f64| {
            let mut params = vessel();
            params.wound.depth = mm(depth);
            let tissue = build(&params).unwrap();
            let inner = tissue.pairs[0].left.patch.nodes.iter().map(|n| tissue.layer[*n as usize]).max();
            (tissue.network.node_count() - 3 * 32 * 41, inner)
        };
        // 24 mm are 16 cells: 15 twins on each cut layer.
        assert_eq!(counts(0.5), (15, Some(0)));
        assert_eq!(counts(0.75), (30, Some(1)));
        assert_eq!(counts(1.5), (45, Some(2)));
    }

    #[test]
    fn refusals_say_what_and_how() {
        let thick = TtsmParams { wall: mm(7.9), ..vessel() };
        let single = TtsmParams { layers: 1, ..vessel() };
        let huge = TtsmParams { cells_around: 99_000, cells_along: 99_000, ..vessel() };
        let long = TtsmParams { length: mm(24.5), ..vessel() };
        let cases = [(thick, "share of the radius"), (single, "layers"), (huge, "nodes (about"), (long, "held ends")];
        for (params, words) in cases {
            let text = refusal(build(&params));
            assert!(text.contains(words), "“{text}” lacks “{words}”");
        }
    }
}
