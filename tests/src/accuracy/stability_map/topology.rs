//! The nets of the stability maps, each with the largest eigenvalue of its tangent stiffness.
//!
//! | net | springs |
//! |---|---|
//! | one node, valence 4 and 8 | k to held neighbours in the plane: K = 2k, 4k |
//! | quad net | 13 × 13, k along the sides, rim held |
//! | quad + shear | the same with k along the diagonals too: K → 8k |
//! | skin sheet | k, shear k/2, 5 % pre-strain: the model's own |
//! | two-shell liver | shells and radial springs; with both diagonals of k/2 |
//! | three-layer vessel | layers and radial springs; with shear k/2 and diagonals of k/2 |
//!
//! k and c are Table 2's. The first four are those of which limits have been published or are known in closed form.

use crate::generators::{on_rim, pre_strained, sheet, with_fixed};
use sim_core::tissue::model::{Tissue, TissueError};
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};
use sim_core::tissue::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use sim_core::tissue::stability::{Tangent, lambda_max};
use sim_core::tissue::sweep::SpringSweep;
use sim_core::tissue::ttsm::{self, TtsmParams};
use sim_core::tissue::vosm::{self, HeldRegion, OrganSurface, VosmParams, WoundSite};
use sim_core::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre, UnitError};
use sim_core::vector::Vec3;

/// One net.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Name in the rows.
    pub name: &'static str,
    /// Nodes and springs; masses and drag are those of the point of a map.
    pub network: SpringNetwork,
    /// The solver's own sweep over its springs.
    pub sweep: SpringSweep,
    /// k, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// c of Table 2, newton seconds per metre.
    pub drag_n_s_per_m: f64,
    /// K: largest eigenvalue of the tangent stiffness, newtons per metre.
    pub lambda_n_per_m: f64,
    /// Distance of neighbours, metres.
    pub spacing_m: f64,
    /// Axes along which it is disturbed, 1 or 0 each.
    pub disturbed_along: Vec3,
}

const SKIN_SHEET: &str = "skin sheet, pre-strained";
const WHOLE_LIVER: &str = "two-shell liver + diagonals";
const WHOLE_VESSEL: &str = "three-layer vessel, full";
/// k and c of skin, liver and vessel.
const SKIN: (f64, f64) = (160.0, 3.0);
const LIVER: (f64, f64) = (180.0, 3.0);
const VESSEL: (f64, f64) = (270.0, 2.0);
/// Spacing of the flat nets, metres.
const SPACING_M: f64 = 5e-3;
/// Nodes along a side of the flat nets.
const SIDE: usize = 13;
/// In the plane: a flat net without pre-strain resists nothing across it.
const PLANE: Vec3 = Vec3::new(1.0, 1.0, 0.0);
const SPACE: Vec3 = Vec3::new(1.0, 1.0, 1.0);

/// All nets, the cheap ones first.
///
/// # Panics
/// When a model refuses parameters that are fixed here.
#[must_use]
pub fn all() -> Vec<Topology> {
    let bare = FamilyFactors { shear: 0.0, bend: 0.0, radial: 1.0, diagonal: 0.0 };
    let organ = |factors| liver(factors).expect("the liver of the maps is valid").network;
    let tube = |factors| vessel(factors).expect("the vessel of the maps is valid").network;
    let mut nets = flat();
    nets.push(Topology::new("two-shell liver", organ(bare), LIVER, 25e-3, SPACE));
    nets.push(Topology::new(WHOLE_LIVER, organ(FamilyFactors::default()), LIVER, 25e-3, SPACE));
    nets.push(Topology::new("three-layer vessel", tube(bare), VESSEL, 3e-3, SPACE));
    nets.push(Topology::new(WHOLE_VESSEL, tube(FamilyFactors::default()), VESSEL, 3e-3, SPACE));
    nets
}

/// The flat nets.
#[must_use]
pub fn flat() -> Vec<Topology> {
    let held = |network| with_fixed(network, |i| on_rim(i, SIDE, SIDE));
    let skin = pre_strained(held(sheet(SIDE, SIDE, SPACING_M, SKIN.0, 1.0, 0.0)), 0.05);
    vec![
        Topology::new("one node, valence 4", star(4, SKIN.0), SKIN, SPACING_M, PLANE),
        Topology::new("one node, valence 8", star(8, SKIN.0), SKIN, SPACING_M, PLANE),
        Topology::new("quad net", held(quads(0.0)), SKIN, SPACING_M, PLANE),
        Topology::new("quad + shear", held(quads(1.0)), SKIN, SPACING_M, PLANE),
        Topology::new(SKIN_SHEET, skin, SKIN, SPACING_M, SPACE),
    ]
}

impl Topology {
    fn new(name: &'static str, network: SpringNetwork, (k, c): (f64, f64), spacing_m: f64, along: Vec3) -> Self {
        let lambda_n_per_m = lambda_max(&Tangent::at(&network, &network.rest_m));
        Self {
            name,
            sweep: SpringSweep::new(&network),
            network,
            stiffness_n_per_m: k,
            drag_n_s_per_m: c,
            lambda_n_per_m,
            spacing_m,
            disturbed_along: along,
        }
    }

    /// Whether it has all the springs that the scenes give their tissue.
    #[must_use]
    pub fn is_own(&self) -> bool {
        [SKIN_SHEET, WHOLE_LIVER, WHOLE_VESSEL].contains(&self.name)
    }

    /// Whether its runs are expensive.
    #[must_use]
    pub fn is_large(&self) -> bool {
        self.network.node_count() > 200
    }

    /// The same net with its springs scaled to another k.
    #[must_use]
    pub fn with_stiffness(&self, stiffness_n_per_m: f64) -> Self {
        let mut network = self.network.clone();
        let factor = stiffness_n_per_m / self.stiffness_n_per_m;
        for spring in &mut network.springs {
            spring.stiffness_n_per_m *= factor;
        }
        let c = self.drag_n_s_per_m;
        Self::new(self.name, network, (stiffness_n_per_m, c), self.spacing_m, self.disturbed_along)
    }
}

/// A node between held neighbours on a circle.
fn star(valence: u32, stiffness_n_per_m: f64) -> SpringNetwork {
    let arm = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(valence);
        Vec3::new(angle.cos(), angle.sin(), 0.0) * SPACING_M
    };
    let x: Vec<Vec3> = std::iter::once(Vec3::zeros()).chain((0..valence).map(arm)).collect();
    let n = x.len();
    let spring = |b| Spring { a: 0, b, stiffness_n_per_m, rest_length_m: SPACING_M, family: SpringFamily::Structural };
    let fixed = (0..n).map(|i| u8::from(i > 0)).collect();
    SpringNetwork::new(x, vec![1.0; n], vec![0.0; n], fixed, (1..=valence).map(spring).collect())
        .expect("a star is a valid network")
}

/// Square net with k along the sides and `shear`·k along the diagonals, nothing halved at the rim.
fn quads(shear: f64) -> SpringNetwork {
    let even = sheet(SIDE, SIDE, SPACING_M, SKIN.0, 1.0, 0.0);
    let mut springs = even.springs;
    for spring in &mut springs {
        spring.stiffness_n_per_m = if spring.family == SpringFamily::Shear { shear * SKIN.0 } else { SKIN.0 };
    }
    springs.retain(|s| s.stiffness_n_per_m > 0.0);
    SpringNetwork::new(even.rest_m, even.mass_kg, even.drag_n_s_per_m, even.fixed, springs).expect("a valid net")
}

fn material((k, c): (f64, f64), factors: FamilyFactors) -> Result<MaterialParams, UnitError> {
    Ok(MaterialParams {
        stiffness: NewtonsPerMetre::new(k)?,
        factors,
        drag: DragReading::PerNode(NewtonSecondsPerMetre::new(c)?),
        density: KilogramsPerCubicMetre::new(1060.0)?,
    })
}

/// A wound with one pair, all in millimetres.
fn wound(length: f64, gap: f64, depth: f64, bite: f64) -> Result<WoundParams, UnitError> {
    Ok(WoundParams {
        length: Metres::from_mm(length)?,
        gap: Metres::from_mm(gap)?,
        depth: Metres::from_mm(depth)?,
        pairs: 1,
        bite: Metres::from_mm(bite)?,
        patch_radius: Metres::from_mm(bite)?,
        patch_depth: PatchDepth::CutLayers,
    })
}

fn liver(factors: FamilyFactors) -> Result<Tissue, TissueError> {
    vosm::build(&VosmParams {
        surface: OrganSurface::Lobe { half_axes_m: Vec3::new(0.07, 0.09, 0.035), taper: 0.3, subdivision: 2 },
        shell_distance: Metres::from_mm(8.0)?,
        layer_thickness: Metres::from_mm(3.0)?,
        held: HeldRegion::Bottom(0.1),
        site: WoundSite { near_m: Vec3::new(0.0, 0.0, 10.0), along: Vec3::y() },
        material: material(LIVER, factors)?,
        wound: wound(90.0, 2.0, 9.0, 25.0)?,
    })
}

fn vessel(factors: FamilyFactors) -> Result<Tissue, TissueError> {
    ttsm::build(&TtsmParams {
        radius: Metres::from_mm(6.0)?,
        length: Metres::from_mm(28.0)?,
        wall: Metres::from_mm(1.5)?,
        layers: 3,
        cells_around: 10,
        cells_along: 10,
        material: material(VESSEL, factors)?,
        wound: wound(12.0, 0.5, 1.5, 3.5)?,
    })
}
