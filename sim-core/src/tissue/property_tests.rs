//! Any parameters end in a tissue that keeps its promises or in a sentence: property tests of all
//! three models. Most values are usual, a few are odd, so that both outcomes occur.

use super::model::{Tissue, TissueError};
use super::model_tests::{check, vessel};
use super::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use super::test_support::liver;
use super::ttsm::TtsmParams;
use super::utsm::{HeldRim, UtsmParams};
use super::vosm::{HeldRegion, OrganSurface, VosmParams};
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre};
use crate::vector::Vec3;
use proptest::prelude::*;
use proptest::strategy::ValueTree;

/// A length near a usual one in millimetres, now and then an odd one.
fn near(usual_mm: f64) -> impl Strategy<Value = Metres> {
    let scaled = (0.7..1.4_f64).prop_map(move |v| v * usual_mm / 1000.0);
    prop_oneof![40 => scaled, 1 => Just(0.0), 1 => Just(1.0e-6), 1 => 0.0..100.0_f64]
        .prop_map(|v| Metres::new(v).unwrap())
}

fn factor(usual: f64) -> impl Strategy<Value = f64> {
    prop_oneof![30 => Just(usual), 8 => Just(0.0), 1 => Just(-1.0), 1 => Just(f64::NAN), 1 => 0.0..1.0e7_f64]
}

fn any_material() -> impl Strategy<Value = MaterialParams> {
    let factors = (factor(0.5), factor(0.3), factor(1.0), factor(0.5));
    (0.0..1.0e9_f64, factors, 0.0..1.0e6_f64, near(2.0), any::<bool>(), 1.0e-3..1.0e5_f64).prop_map(
        |(k, (shear, bend, radial, diagonal), c, spacing, per_node, density)| {
            let drag = NewtonSecondsPerMetre::new(c).unwrap();
            MaterialParams {
                stiffness: NewtonsPerMetre::new(k).unwrap(),
                factors: FamilyFactors { shear, bend, radial, diagonal },
                drag: if per_node { DragReading::PerNode(drag) } else { DragReading::PerArea { drag, spacing } },
                density: KilogramsPerCubicMetre::new(density).unwrap(),
            }
        },
    )
}

/// A wound near a usual one: length, gap, depth, bite and patch radius in millimetres.
fn wound_near(usual_mm: [f64; 5]) -> impl Strategy<Value = WoundParams> {
    let depth = prop_oneof![Just(PatchDepth::Surface), Just(PatchDepth::CutLayers)];
    let pairs = prop_oneof![20 => 1..6_u32, 1 => Just(0), 1 => any::<u32>()];
    (usual_mm.map(near), pairs, depth).prop_map(|([length, gap, depth, bite, patch_radius], pairs, patch_depth)| {
        WoundParams { length, gap, depth, pairs, bite, patch_radius, patch_depth }
    })
}

fn judge(built: Result<Tissue, TissueError>, wound: &WoundParams) {
    match built {
        Ok(tissue) => check(&tissue, wound),
        Err(error) => assert!(error.to_string().len() > 20),
    }
}

proptest! {
    #[test]
    fn any_sheet_is_built_or_refused(
        [width, length, thickness, spacing] in [60.0, 80.0, 2.0, 2.5].map(near),
        held in prop_oneof![Just(HeldRim::All), Just(HeldRim::BesideWound), Just(HeldRim::BeyondTips)],
        pre_strain in -0.02..1.02_f64,
        material in any_material(),
        wound in wound_near([40.0, 4.0, 2.0, 3.0, 2.5]),
    ) {
        let params = UtsmParams { width, length, spacing, thickness, held, pre_strain, material, wound };
        judge(super::utsm::build(&params), &wound);
    }

    #[test]
    fn any_tube_is_built_or_refused(
        [radius, length, wall] in [8.0, 60.0, 1.5].map(near),
        [layers, cells_around, cells_along] in [1..5_u32, 3..40_u32, 20..60_u32],
        huge in prop_oneof![20 => Just(1_u32), 1 => any::<u32>()],
        material in any_material(),
        wound in wound_near([30.0, 2.0, 1.5, 2.0, 1.5]),
    ) {
        let (cells_around, cells_along) = (cells_around.saturating_mul(huge), cells_along.saturating_mul(huge));
        let params = TtsmParams { radius, length, wall, layers, cells_around, cells_along, material, wound };
        judge(super::ttsm::build(&params), &wound);
    }

    #[test]
    fn any_organ_is_built_or_refused(
        axes in [0.04..0.1_f64, 0.04..0.1_f64, 0.01..0.06_f64],
        taper in -0.02..0.82_f64,
        subdivision in prop_oneof![20 => 1..5_u32, 1 => any::<u32>()],
        [shell_distance, layer_thickness, radius] in [6.0, 3.0, 60.0].map(near),
        share in -0.02..1.02_f64,
        region in 0..3_u8,
        site in [-1.0..1.0_f64, -1.0..1.0_f64, 0.0..1.0_f64],
        along in prop_oneof![20 => [-1.0..1.0_f64, -1.0..1.0_f64, -0.1..0.1_f64], 1 => Just([0.0, 0.0, 1.0e-300])],
        material in any_material(),
        wound in wound_near([50.0, 4.0, 6.0, 5.0, 4.0]),
    ) {
        let mut params = VosmParams { shell_distance, layer_thickness, material, wound, ..liver() };
        params.surface = OrganSurface::Lobe { half_axes_m: Vec3::from(axes), taper, subdivision };
        params.held = match region {
            0 => HeldRegion::Nothing,
            1 => HeldRegion::Beyond(radius),
            _ => HeldRegion::Bottom(share),
        };
        params.site.near_m = Vec3::from(site);
        params.site.along = Vec3::from(along);
        judge(super::vosm::build(&params), &wound);
    }

    #[test]
    fn a_dented_organ_is_built_or_refused(
        dents in proptest::collection::vec((0..642_usize, [-0.02..0.02_f64, -0.02..0.02_f64, -0.02..0.02_f64]), 0..12),
    ) {
        let mut mesh = super::triangle_mesh::TriangleMesh::lobe(Vec3::new(0.07, 0.09, 0.04), 0.2, 3).unwrap();
        for (vertex, by) in dents {
            mesh.vertices_m[vertex] += Vec3::from(by);
        }
        let mut params = liver();
        params.surface = OrganSurface::Mesh(mesh);
        params.wound.pairs = 2;
        judge(super::vosm::build(&params), &params.wound);
    }

    #[test]
    fn a_damaged_mesh_is_refused_or_unchanged(face in 0..320_usize, corner in 0..3_usize, vertex in 0..200_u32) {
        let whole = super::triangle_mesh::TriangleMesh::icosphere(2).unwrap();
        let mut mesh = whole.clone();
        mesh.faces[face][corner] = vertex;
        prop_assert_eq!(mesh.check_closed().is_ok(), mesh == whole);
    }
}

/// The usual parameters of the strategies are built, so that the property tests are not idle.
#[test]
fn usual_parameters_are_built() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut built = 0;
    for _ in 0..40 {
        let wound = wound_near([30.0, 2.0, 1.5, 2.0, 1.5]).new_tree(&mut runner).unwrap().current();
        built += u32::from(super::ttsm::build(&TtsmParams { wound, ..vessel() }).is_ok());
    }
    assert!((10..40).contains(&built), "{built} of 40");
}
