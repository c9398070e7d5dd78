//! Mechanics of the built lattices against closed forms: in-plane constants of the sheet, zero modes
//! of tube and shell. The stiffness matrix at rest is Σ k·n·nᵀ over the springs, dense.

use super::cut::Cut;
use super::inner_shell::inner_shell;
use super::lattice::{LayeredSurface, springs};
use super::network::Spring;
use super::params::{FamilyFactors, MaterialParams};
use super::surface::Face;
use super::test_support::{liver, material, mm};
use super::triangle_mesh::TriangleMesh;
use super::vosm::OrganSurface;
use crate::vector::{Mat3, Vec3};
use nalgebra::{DMatrix, SymmetricEigen};

/// Eigenvalues below this share of the largest are zero: rounding leaves 1e-15, the softest true
/// mode of these small meshes lies above 1e-5.
const ZERO_SHARE: f64 = 1.0e-10;
/// Shift of the pivot count as a share of the largest diagonal entry: between the rounding of the
/// pivots of zero modes and the softest true mode.
const PIVOT_SHIFT: f64 = 1.0e-6;

fn with(shear: f64, bend: f64, radial: f64, diagonal: f64) -> MaterialParams {
    MaterialParams { factors: FamilyFactors { shear, bend, radial, diagonal }, ..material(0.16, 3.0, 1.0) }
}

fn stiffness_matrix(position_m: &[Vec3], springs: &[Spring]) -> DMatrix<f64> {
    let n = 3 * position_m.len();
    let mut k = DMatrix::<f64>::zeros(n, n);
    for s in springs {
        let [a, b] = [s.a as usize, s.b as usize];
        let d = (position_m[b] - position_m[a]).normalize();
        let block: Mat3 = s.stiffness_n_per_m * d * d.transpose();
        for (i, j, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            let mut view = k.fixed_view_mut::<3, 3>(3 * i, 3 * j);
            view += sign * block;
        }
    }
    k
}

fn modes_of(position_m: &[Vec3], springs: &[Spring]) -> usize {
    let values = SymmetricEigen::new(stiffness_matrix(position_m, springs)).eigenvalues;
    values.iter().filter(|v| **v < ZERO_SHARE * values.max()).count()
}

fn modes(layers: &LayeredSurface, material: &MaterialParams) -> usize {
    modes_of(&layers.position_m, &springs(layers, material, 0.0).unwrap())
}

/// The same count without eigenvalues, for meshes too large for them: the number of negative pivots
/// of K − s·I is the number of eigenvalues below s (Sylvester). Wants node numbers that keep
/// neighbours near: work grows with the square of the band.
fn modes_by_pivots(layers: &LayeredSurface, material: &MaterialParams) -> usize {
    let mut k = stiffness_matrix(&layers.position_m, &springs(layers, material, 0.0).unwrap());
    let n = k.nrows();
    let shift = PIVOT_SHIFT * k.diagonal().max();
    (0..n).for_each(|i| k[(i, i)] -= shift);
    for j in 0..n {
        let pivot = k[(j, j)];
        let below: Vec<usize> = (j + 1..n).filter(|i| k[(*i, j)] != 0.0).collect();
        for &c in &below {
            let factor = k[(c, j)] / pivot;
            below.iter().filter(|r| **r >= c).for_each(|&r| k[(r, c)] -= factor * k[(r, j)]);
        }
    }
    k.diagonal().iter().filter(|d| **d < 0.0).count()
}

fn free_tube(around: u32, along: u32, layers: u32) -> LayeredSurface {
    let ring = |l: u32| {
        let r = 8.0 - f64::from(l);
        (0..around * (along + 1))
            .map(|v| {
                let phi = std::f64::consts::TAU * f64::from(v % around) / f64::from(around);
                Vec3::new(r * phi.sin(), 3.0 * f64::from(v / around), r * phi.cos())
            })
            .collect()
    };
    let positions: Vec<Vec<Vec3>> = (0..layers).map(ring).collect();
    LayeredSurface::stack(&super::ttsm::tube(around, along), None, &positions).unwrap()
}

#[test]
fn a_tube_needs_shear_and_diagonals() {
    // 8 around × 4 rings × 3 layers = 288 degrees of freedom.
    let tube = free_tube(8, 3, 3);
    let families = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5)].map(|(shear, diagonal)| with(shear, 0.0, 1.0, diagonal));
    assert_eq!(families.map(|f| modes(&tube, &f)), [64, 20, 6]);
    assert_eq!(families.map(|f| modes_by_pivots(&tube, &f)), [64, 20, 6]);
    // 16 around × 8 rings × 3 layers = 1152 degrees of freedom.
    assert_eq!(families.map(|f| modes_by_pivots(&free_tube(16, 7, 3), &f)), [192, 36, 6]);
}

#[test]
fn a_cut_tube_has_only_rigid_modes() {
    let faces = super::ttsm::tube(8, 6);
    let cut = Cut::along(&faces, 56, vec![8, 16, 24, 32, 40]).unwrap();
    let whole = free_tube(8, 6, 2);
    let layers: Vec<Vec<Vec3>> = (0..2)
        .map(|l| {
            let first = l * 56;
            let at = |v: u32| whole.position_m[first + cut.original(v) as usize];
            (0..cut.split_count() as u32).map(at).collect()
        })
        .collect();
    let stack = LayeredSurface::stack(&faces, Some(&cut), &layers).unwrap();
    assert_eq!(modes(&stack, &with(0.5, 0.0, 1.0, 0.5)), 6);
}

#[test]
fn a_shell_needs_diagonals_to_hold_its_inner_shell() {
    let mesh = TriangleMesh::lobe(Vec3::new(1.0, 0.8, 0.7), 0.3, 1).unwrap();
    let (inner, _) = inner_shell(&mesh, 0.2).unwrap();
    let stack = LayeredSurface::stack(&mesh.polygons(), None, &[mesh.vertices_m.clone(), inner]).unwrap();
    // A triangulated convex shell is rigid by itself: 6 + 6, less what 42 radial springs hold. On a
    // sphere they hold the shift of the shells against each other but not their twist.
    let sphere = TriangleMesh::icosphere(1).unwrap();
    let small = sphere.vertices_m.iter().map(|x| x * 0.7).collect();
    let round = LayeredSurface::stack(&sphere.polygons(), None, &[sphere.vertices_m.clone(), small]).unwrap();
    assert_eq!(modes(&round, &with(0.5, 0.0, 0.0, 0.0)), 12);
    assert_eq!(modes(&round, &with(0.5, 0.0, 1.0, 0.0)), 9);
    assert_eq!(modes(&round, &with(0.5, 0.0, 1.0, 0.5)), 6);
    assert_eq!(modes(&stack, &with(0.5, 0.0, 1.0, 0.5)), 6);
}

#[test]
fn a_cut_organ_has_only_rigid_modes() {
    let mut params = liver();
    params.surface = OrganSurface::Lobe { half_axes_m: Vec3::new(0.06, 0.08, 0.04), taper: 0.2, subdivision: 2 };
    params.wound.pairs = 1;
    params.wound.patch_radius = mm(1.0);
    let tissue = super::vosm::build(&params).unwrap();
    assert_eq!(modes_of(&tissue.network.rest_m, &tissue.network.springs), 6);
}

/// Membrane stiffness from the spring energy of a uniform strain: every lattice node moves with the
/// strain, so A·C_ij = Σ k·L²·n_i²·n_j² and E·t, ν follow from C_11 and C_12 (plane stress).
fn sheet_constants(springs: &[Spring], positions: &[Vec3], area: f64) -> (f64, f64) {
    let (mut c11, mut c12) = (0.0, 0.0);
    for s in springs {
        let d = positions[s.b as usize] - positions[s.a as usize];
        let n = d.normalize();
        let kl2 = s.stiffness_n_per_m * d.norm_squared() / area;
        c11 += kl2 * n.x.powi(4);
        c12 += kl2 * n.x.powi(2) * n.y.powi(2);
    }
    let poisson = c12 / c11;
    (c11 * (1.0 - poisson * poisson), poisson)
}

/// The spec of the closed form E·t = 4/3·k, ν = 1/3.
const SHEET_TOLERANCE: f64 = 1.0e-4;

#[test]
fn sheet_has_the_closed_form_constants() {
    let faces = super::utsm::grid(6, 9);
    let position = |v: u32| Vec3::new(f64::from(v % 7), f64::from(v / 7), 0.0);
    let layer: Vec<Vec3> = (0..70).map(position).collect();
    let stack = LayeredSurface::stack(&faces, None, &[layer]).unwrap();
    let built = springs(&stack, &with(0.5, 0.0, 1.0, 0.5), 0.0).unwrap();
    let (et, poisson) = sheet_constants(&built, &stack.position_m, 54.0);
    assert!((et / 160.0 - 4.0 / 3.0).abs() < SHEET_TOLERANCE, "E·t = {et}");
    assert!((poisson - 1.0 / 3.0).abs() < SHEET_TOLERANCE, "ν = {poisson}");
    // With whole springs on the rim the sheet comes out too stiff: the halving is what is tested.
    let mut whole_rim = built.clone();
    whole_rim.iter_mut().filter(|s| s.stiffness_n_per_m < 100.0).for_each(|s| {
        let shear = s.family == super::network::SpringFamily::Shear;
        s.stiffness_n_per_m *= if shear { 1.0 } else { 2.0 };
    });
    assert!(sheet_constants(&whole_rim, &stack.position_m, 54.0).0 / 160.0 > 1.4);
}

#[test]
fn a_cut_shares_the_stiffness_of_its_edges() {
    let faces = super::utsm::grid(4, 4);
    let position = |v: u32| Vec3::new(f64::from(v % 5), f64::from(v / 5), 0.0);
    let cut = Cut::along(&faces, 25, vec![2, 7, 12, 17, 22]).err();
    assert!(cut.is_none(), "tips may lie on the rim: {cut:?}");
    let cut = Cut::along(&faces, 25, vec![2, 7, 12, 17, 22]).unwrap();
    let layer: Vec<Vec3> = (0..cut.split_count() as u32).map(|v| position(cut.original(v))).collect();
    let total = |cut: Option<&Cut>, layer: Vec<Vec3>| {
        let stack = LayeredSurface::stack(&faces, cut, &[layer]).unwrap();
        let all = springs(&stack, &with(0.5, 0.0, 0.0, 0.0), 0.0).unwrap();
        all.iter().map(|s| s.stiffness_n_per_m).sum::<f64>()
    };
    let whole = total(None, (0..25).map(position).collect());
    assert!((total(Some(&cut), layer) - whole).abs() < 1.0e-9 * whole);
}

#[test]
fn bend_springs_span_two_faces_and_double_nothing() {
    let faces = vec![Face::Triangle([0, 1, 2]), Face::Triangle([2, 1, 3])];
    let layer = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.0)];
    let stack = LayeredSurface::stack(&faces, None, &[layer]).unwrap();
    let built = springs(&stack, &with(0.5, 0.25, 0.0, 0.0), 0.05).unwrap();
    let bend: Vec<&Spring> = built.iter().filter(|s| s.family == super::network::SpringFamily::Bend).collect();
    assert_eq!((built.len(), bend.len(), bend[0].a, bend[0].b), (6, 1, 0, 3));
    assert_eq!(bend[0].stiffness_n_per_m, 40.0);
    assert!((bend[0].rest_length_m - 2.0_f64.sqrt() / 1.05).abs() < 1.0e-15);
}
