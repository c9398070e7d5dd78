//! Uniform tissue suture model (Zhang et al., §2.1.1, Fig. 1a, Fig. 2a): skin as one sheet of
//! square quads in the xy plane, z outward, the wound along y in the middle.
//!
//! Structural k and shear k/2 give E·t = 4/3·k, ν = 1/3. A flat sheet at rest resists nothing out of
//! its plane, so the springs are built shorter by 1/(1 + pre-strain), as skin is stretched in life.
//! The gap is opened by pressing the tissue beside it together evenly out to the rim.

use super::cut::{Cut, Opening};
use super::lattice::LayeredSurface;
use super::model::{Blueprint, Tissue, TissueError, TissueKind, check_count};
use super::params::{MaterialParams, WoundParams, at_least_minimum, in_range};
use super::surface::Face;
use crate::units::Metres;
use crate::vector::Vec3;

/// Which sides of the sheet are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldRim {
    /// All four.
    All,
    /// The two that run along the wound.
    BesideWound,
    /// The two beyond the tips.
    BeyondTips,
}

/// A sheet of skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtsmParams {
    /// Size across the wound; rounded to an even number of cells.
    pub width: Metres,
    /// Size along the wound; rounded to whole cells.
    pub length: Metres,
    /// Side of a cell.
    pub spacing: Metres,
    /// Thickness of the tissue.
    pub thickness: Metres,
    /// What is held.
    pub held: HeldRim,
    /// Stretch of the springs as built, 0.05 by default in scenes.
    pub pre_strain: f64,
    /// Material.
    pub material: MaterialParams,
    /// Wound; always through the sheet.
    pub wound: WoundParams,
}

/// Largest pre-strain.
const MAX_PRE_STRAIN: f64 = 1.0;

/// Cells across, along, and along the wound.
struct Cells {
    across: u32,
    along: u32,
    wound: u32,
}

fn cells(params: &UtsmParams) -> Result<Cells, TissueError> {
    let h = at_least_minimum("spacing", params.spacing)?;
    let half_across = (at_least_minimum("sheet width", params.width)? / (2.0 * h)).round().max(1.0);
    let wound = (params.wound.length.get() / h).round();
    let beyond = ((at_least_minimum("sheet length", params.length)? / h - wound) / 2.0).round();
    if beyond < 1.0 {
        return Err(TissueError::Wound {
            what: format!(
                "a wound of {} m reaches the rim of a sheet of {} m",
                params.wound.length.get(),
                params.length.get()
            ),
            remedy: "make the wound shorter or the sheet longer",
        });
    }
    check_count((2.0 * half_across + 1.0) * (wound + 2.0 * beyond + 1.0) + wound)?;
    Ok(Cells { across: 2 * half_across as u32, along: (wound + 2.0 * beyond) as u32, wound: wound as u32 })
}

/// Quads of a grid of `across` × `along` cells, row by row, seen from +z.
pub(super) fn grid(across: u32, along: u32) -> Vec<Face> {
    let at = |i: u32, j: u32| j * (across + 1) + i;
    let quad = |i, j| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    (0..along).flat_map(|j| (0..across).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect()
}

/// Builds the sheet.
///
/// # Errors
/// [`TissueError`]: a parameter out of range, too many nodes, a wound or suture points that do not fit.
pub fn build(params: &UtsmParams) -> Result<Tissue, TissueError> {
    params.material.check()?;
    params.wound.check()?;
    let thickness = at_least_minimum("thickness", params.thickness)?;
    in_range("pre-strain", params.pre_strain, 0.0, MAX_PRE_STRAIN)?;
    let Cells { across, along, wound } = cells(params)?;
    let h = params.spacing.get();
    let faces = grid(across, along);
    let columns = across + 1;
    let vertex_count = (columns * (along + 1)) as usize;
    let first_row = (along - wound) / 2;
    let path = (first_row..=first_row + wound).map(|j| j * columns + across / 2).collect();
    let cut = Cut::along(&faces, vertex_count, path)?;

    let flat = |v: u32| {
        let (i, j) = (v % columns, v / columns);
        let x = (f64::from(i) - 0.5 * f64::from(across)) * h;
        Vec3::new(x, (f64::from(j) - 0.5 * f64::from(along)) * h, 0.0)
    };
    let mut positions: Vec<Vec3> = (0..cut.split_count() as u32).map(|v| flat(cut.original(v))).collect();
    let opening = Opening {
        half_gap_m: 0.5 * params.wound.gap.get(),
        half_length_m: 0.5 * f64::from(wound) * h,
        reach_m: 0.5 * f64::from(across) * h,
    };
    opening.check()?;
    let lateral: Vec<f64> = positions.iter().map(|p| p.x).collect();
    for (p, side) in positions.iter_mut().zip(cut.sides(&lateral)) {
        p.x += opening.shift(side, p.y, p.x.abs());
    }
    let held = |v: u32| {
        let (i, j) = (v % columns, v / columns);
        let beside = i == 0 || i == across;
        let beyond = j == 0 || j == along;
        match params.held {
            HeldRim::All => beside || beyond,
            HeldRim::BesideWound => beside,
            HeldRim::BeyondTips => beyond,
        }
    };
    let fixed = (0..cut.split_count() as u32).map(|v| u8::from(held(cut.original(v)))).collect();
    Blueprint {
        kind: TissueKind::Utsm,
        layers: LayeredSurface::stack(&faces, Some(&cut), &[positions])?,
        cut,
        fixed,
        layer_thickness_m: thickness,
        pre_strain: params.pre_strain,
        material: &params.material,
        wound: &params.wound,
        shell: None,
    }
    .build()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::network::SpringFamily;
    use crate::tissue::test_support::{material, mm, refusal, wound};

    fn skin() -> UtsmParams {
        UtsmParams {
            width: mm(100.0),
            length: mm(100.0),
            spacing: mm(2.5),
            thickness: mm(1.75),
            held: HeldRim::All,
            pre_strain: 0.05,
            material: material(0.16, 3.0, 2.5),
            wound: wound(40.0, 4.0, 1.75),
        }
    }

    #[test]
    fn no_spring_crosses_the_open_slit() {
        let mut params = skin();
        params.material.factors.bend = 0.3;
        let tissue = build(&params).unwrap();
        let half = 0.5 * tissue.wound_length_m;
        for s in &tissue.network.springs {
            let [p, q] = [s.a, s.b].map(|n| tissue.network.rest_m[n as usize]);
            if p.x * q.x < 0.0 {
                let y = p.y + (q.y - p.y) * p.x / (p.x - q.x);
                assert!(y.abs() >= half, "a {:?} spring crosses the wound at y = {y}", s.family);
            }
        }
        assert!(tissue.network.springs.iter().any(|s| s.family == SpringFamily::Bend));
    }

    #[test]
    fn mass_is_density_times_thickness_times_area() {
        let tissue = build(&skin()).unwrap();
        // The lens 1 − (s/a)² of gap g and length 2a, as the polygon through the lattice rows.
        let (rows, h, gap) = (16, 0.0025, 0.004);
        let width = |i: i32| gap * (1.0 - (f64::from(i) / 8.0 - 1.0).powi(2));
        let lens: f64 = (0..rows).map(|i| 0.5 * h * (width(i) + width(i + 1))).sum();
        let expected = 1100.0 * 0.00175 * (0.1 * 0.1 - lens);
        let total: f64 = tissue.network.mass_kg.iter().sum();
        assert!((total / expected - 1.0).abs() < 1.0e-12, "{total} against {expected}");
    }

    #[test]
    fn springs_are_pre_stretched() {
        let tissue = build(&skin()).unwrap();
        for s in &tissue.network.springs {
            let length = (tissue.network.rest_m[s.a as usize] - tissue.network.rest_m[s.b as usize]).norm();
            assert!((length / s.rest_length_m - 1.05).abs() < 1.0e-12);
        }
    }

    #[test]
    fn sides_and_edge_agree_with_the_built_shape() {
        let tissue = build(&skin()).unwrap();
        assert!((tissue.wound_length_m - 0.04).abs() < 1.0e-12);
        assert_eq!(tissue.wound_edge.len(), 2 + 2 * 15);
        for (node, side) in tissue.side.iter().enumerate() {
            let x = tissue.network.rest_m[node].x;
            assert!(f64::from(*side) * x >= 0.0 && (*side != 0 || x == 0.0));
        }
        let widest = tissue.wound_edge.iter().map(|n| tissue.network.rest_m[*n as usize].x).fold(0.0, f64::max);
        assert!((widest - 0.002).abs() < 1.0e-12);
    }

    #[test]
    fn a_finer_sheet_keeps_total_mass_and_drag() {
        let coarse = build(&skin()).unwrap();
        let fine = build(&UtsmParams { spacing: mm(1.25), ..skin() }).unwrap();
        let sum = |v: &[f64]| v.iter().sum::<f64>();
        // The lens is a polygon of fewer sides on the coarse lattice: 0.01 % of the sheet.
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1.0e-4;
        assert!(close(sum(&coarse.network.mass_kg), sum(&fine.network.mass_kg)));
        assert!(close(sum(&coarse.network.drag_n_s_per_m), sum(&fine.network.drag_n_s_per_m)));
    }

    #[test]
    fn refusals_say_what_and_how() {
        let cases = [
            (UtsmParams { spacing: mm(0.001), ..skin() }, "nodes (about"),
            (UtsmParams { length: mm(30.0), ..skin() }, "reaches the rim"),
            (UtsmParams { wound: wound(40.0, 60.0, 1.0), ..skin() }, "gap"),
            (UtsmParams { wound: wound(2.0, 0.5, 1.0), ..skin() }, "needs 2"),
            (UtsmParams { spacing: mm(10.0), ..skin() }, "pairs do not fit"),
            (UtsmParams { pre_strain: f64::NAN, ..skin() }, "pre-strain"),
        ];
        for (params, words) in cases {
            let text = refusal(build(&params));
            assert!(text.contains(words), "“{text}” lacks “{words}”");
        }
    }
}
