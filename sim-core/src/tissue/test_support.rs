//! Parameters that the tests of the tissue models share: Table 2 of Zhang et al. on a wound of a
//! given size.

use super::model::{Tissue, TissueError};
use super::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use super::triangle_mesh::TriangleMesh;
use super::vosm::{HeldRegion, OrganSurface, VosmParams, WoundSite};
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre};
use crate::vector::Vec3;

/// Millimetres.
pub(super) fn mm(value: f64) -> Metres {
    Metres::from_mm(value).expect("tests use lengths in range")
}

/// A material of Table 2: k in N/mm, c in N·s/m at the given spacing in mm.
pub(super) fn material(k_n_per_mm: f64, c: f64, spacing_mm: f64) -> MaterialParams {
    MaterialParams {
        stiffness: NewtonsPerMetre::from_n_per_mm(k_n_per_mm).expect("Table 2 is in range"),
        factors: FamilyFactors::default(),
        drag: DragReading::PerArea {
            drag: NewtonSecondsPerMetre::new(c).expect("Table 2 is in range"),
            spacing: mm(spacing_mm),
        },
        density: KilogramsPerCubicMetre::new(1100.0).expect("a tissue density is in range"),
    }
}

/// A wound with four pairs, all in mm.
pub(super) fn wound(length_mm: f64, gap_mm: f64, depth_mm: f64) -> WoundParams {
    WoundParams {
        length: mm(length_mm),
        gap: mm(gap_mm),
        depth: mm(depth_mm),
        pairs: 4,
        bite: mm(3.0),
        patch_radius: mm(3.0),
        patch_depth: PatchDepth::CutLayers,
    }
}

/// The sentence of a refused build; empty where the build went through.
pub(super) fn refusal(built: Result<Tissue, TissueError>) -> String {
    built.err().map(|e| e.to_string()).unwrap_or_default()
}

/// Whether a closed mesh encloses a point: the solid angles of its faces sum to 4π, not 0.
pub(super) fn encloses(mesh: &TriangleMesh, point: Vec3) -> bool {
    let solid_angle = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices_m[v as usize] - point);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    mesh.faces.iter().map(solid_angle).sum::<f64>() > std::f64::consts::TAU
}

/// A liver-like organ with its wound on top, free.
pub(super) fn liver() -> VosmParams {
    let mut wound = wound(60.0, 5.0, 8.0);
    wound.bite = mm(7.0);
    wound.patch_radius = mm(6.0);
    VosmParams {
        surface: OrganSurface::Lobe { half_axes_m: Vec3::new(0.07, 0.09, 0.035), taper: 0.3, subdivision: 4 },
        shell_distance: mm(8.0),
        layer_thickness: mm(3.0),
        held: HeldRegion::Nothing,
        site: WoundSite { near_m: Vec3::new(0.0, 0.0, 10.0), along: Vec3::y() },
        material: material(0.18, 3.0, 5.0),
        wound,
    }
}
