//! Parameters that the tests of the tissue models share: Table 2 of Zhang et al. on a wound of a
//! given size.

use super::model::{Tissue, TissueError};
use super::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre};

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
