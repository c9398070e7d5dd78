//! What the three tissue models have in common: material and wound, in SI units.
//!
//! k, c are Table 2 of Zhang et al.; the paper gives neither mesh size nor mass. Readings taken:
//! node mass m = ρ·t·A and node drag c·A/h² (A the node's share of its layer, h the spacing at
//! which Table 2's c holds), so that a finer mesh keeps its physics; c per node, as printed, is
//! the other [`DragReading`].

use super::model::TissueError;
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre};

/// How Table 2's c becomes the drag of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DragReading {
    /// Every node has this drag, as printed: total drag grows with the node count.
    PerNode(NewtonSecondsPerMetre),
    /// A node has this drag if its share of the surface is `spacing²`, else in proportion.
    PerArea {
        /// Drag of a node at the preset spacing.
        drag: NewtonSecondsPerMetre,
        /// The preset spacing.
        spacing: Metres,
    },
}

/// Stiffness of each spring family as a multiple of k (structural springs have 1); 0 leaves the
/// family out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FamilyFactors {
    /// Quad diagonals; ½ makes a square lattice isotropic with E·t = 4/3·k, ν = 1/3.
    pub shear: f64,
    /// Second neighbours over a shared edge.
    pub bend: f64,
    /// Node to its image on the next layer.
    pub radial: f64,
    /// Node to its neighbours' images on the next layer.
    pub diagonal: f64,
}

impl Default for FamilyFactors {
    fn default() -> Self {
        Self { shear: 0.5, bend: 0.0, radial: 1.0, diagonal: 0.5 }
    }
}

/// Material of a tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialParams {
    /// Structural spring stiffness k.
    pub stiffness: NewtonsPerMetre,
    /// The other families, as multiples of k.
    pub factors: FamilyFactors,
    /// Drag to ground.
    pub drag: DragReading,
    /// Density.
    pub density: KilogramsPerCubicMetre,
}

/// Which nodes a suture point moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchDepth {
    /// Nodes of the surface layer only.
    Surface,
    /// These and their images on every layer that the wound cuts ("the surface and inner layer
    /// were simultaneously sutured").
    CutLayers,
}

/// A straight slit and the suture points along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoundParams {
    /// Length from tip to tip.
    pub length: Metres,
    /// Opening in the middle, as built; tapers to 0 at the tips as 1 − (2s/length)².
    pub gap: Metres,
    /// Depth: layers that lie no deeper are cut.
    pub depth: Metres,
    /// Number of suture point pairs.
    pub pairs: u32,
    /// Distance of the suture points from the wound edge.
    pub bite: Metres,
    /// Radius of the patch of a suture point, along the mesh.
    pub patch_radius: Metres,
    /// Layers of the patch.
    pub patch_depth: PatchDepth,
}

/// Most suture point pairs of a scene.
pub const MAX_PAIRS: u32 = 256;
/// Most layers of a tissue.
pub const MAX_LAYERS: u32 = 32;
/// Smallest node spacing and thickness, metres: below it areas and masses lose their digits.
pub const MIN_LENGTH_M: f64 = 1.0e-6;

/// Refuses a length below [`MIN_LENGTH_M`].
pub(super) fn at_least_minimum(name: &'static str, value: Metres) -> Result<f64, TissueError> {
    in_range(name, value.get(), MIN_LENGTH_M, Metres::HIGH)
}

/// Refuses a number outside a closed range.
pub(super) fn in_range(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, TissueError> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(TissueError::Parameter { name, found: value, low, high })
}

impl MaterialParams {
    /// Checks what the unit types cannot.
    pub(super) fn check(&self) -> Result<(), TissueError> {
        let f = self.factors;
        for (name, factor) in [
            ("shear stiffness factor", f.shear),
            ("bend stiffness factor", f.bend),
            ("radial stiffness factor", f.radial),
            ("diagonal stiffness factor", f.diagonal),
        ] {
            in_range(name, factor, 0.0, 1.0e6)?;
        }
        if let DragReading::PerArea { spacing, .. } = self.drag {
            at_least_minimum("spacing of the drag preset", spacing)?;
        }
        Ok(())
    }
}

impl WoundParams {
    /// Checks what does not depend on the mesh.
    pub(super) fn check(&self) -> Result<(), TissueError> {
        at_least_minimum("wound length", self.length)?;
        at_least_minimum("wound depth", self.depth)?;
        in_range("number of suture point pairs", f64::from(self.pairs), 1.0, f64::from(MAX_PAIRS))?;
        Ok(())
    }
}
