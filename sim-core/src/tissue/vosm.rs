//! Volumetric organ suture model (Zhang et al., §2.1.1, Fig. 1b, Fig. 2b): the liver as a triangular
//! shell and an inner shell, joined by radial springs and both families of diagonals.
//!
//! Radial springs alone let the inner shell spin freely (9 zero modes instead of 6). The wound cuts
//! the inner shell when it is at least as deep as the shells' distance. The gap is opened over
//! three gaps to either side. The organ is turned into the wound frame. SI units.

use super::cut::{Cut, Opening};
use super::inner_shell::{inner_shell, prism_soundness, smooth_folds};
use super::lattice::LayeredSurface;
use super::model::{Blueprint, ShellReport, Tissue, TissueError, TissueKind};
use super::params::{MaterialParams, WoundParams, at_least_minimum, in_range};
use super::slit_path::{across_surface, facing, find_path, nearest_on, straighten};
use super::triangle_mesh::TriangleMesh;
pub use super::wound_frame::WoundSite;
use super::wound_frame::{centre, to_wound_frame};
use crate::units::Metres;
use crate::vector::Vec3;

/// The surface of an organ.
#[derive(Clone, Debug, PartialEq)]
pub enum OrganSurface {
    /// A parametric body: [`TriangleMesh::lobe`].
    Lobe {
        /// Half axes across, along and out of the wound, metres.
        half_axes_m: Vec3,
        /// Loss of height towards +y, 0 for an ellipsoid.
        taper: f64,
        /// How often each face of an icosahedron is split in four.
        subdivision: u32,
    },
    /// Any closed mesh.
    Mesh(TriangleMesh),
}

/// What is held, so that the organ does not drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeldRegion {
    /// Nothing.
    Nothing,
    /// All nodes farther from the middle of the wound than this.
    Beyond(Metres),
    /// The lowest part of the organ, as a share of its height below the wound.
    Bottom(f64),
}

/// A volumetric organ.
#[derive(Clone, Debug, PartialEq)]
pub struct VosmParams {
    /// Surface, outward faces.
    pub surface: OrganSurface,
    /// Distance of the inner shell.
    pub shell_distance: Metres,
    /// Thickness of the tissue that one shell stands for.
    pub layer_thickness: Metres,
    /// What is held.
    pub held: HeldRegion,
    /// Where the wound lies.
    pub site: WoundSite,
    /// Material.
    pub material: MaterialParams,
    /// Wound.
    pub wound: WoundParams,
}

/// Opening reaches this many gaps to either side: the tissue beside it is pressed by a sixth.
const REACH_PER_GAP: f64 = 3.0;

/// Builds the organ.
///
/// # Errors
/// [`TissueError`]: a parameter out of range, a surface that is not closed or too large, a wound or
/// suture points that do not fit.
pub fn build(params: &VosmParams) -> Result<Tissue, TissueError> {
    params.material.check()?;
    params.wound.check()?;
    let distance = at_least_minimum("distance of the inner shell", params.shell_distance)?;
    let thickness = at_least_minimum("layer thickness", params.layer_thickness)?;
    if let HeldRegion::Bottom(share) = params.held {
        in_range("held share of the organ's height", share, 0.0, 1.0)?;
    }
    let mut mesh = match &params.surface {
        OrganSurface::Lobe { half_axes_m, taper, subdivision } => {
            TriangleMesh::lobe(*half_axes_m, *taper, *subdivision)?
        }
        OrganSurface::Mesh(mesh) => mesh.clone(),
    };
    mesh.check_closed()?;
    let smoothed_vertices = smooth_folds(&mut mesh);
    to_wound_frame(&mut mesh, &params.site, params.wound.length.get())?;
    let path = find_path(&mesh, params.wound.length.get())?;
    straighten(&mut mesh, &path)?;
    centre(&mut mesh, &path);
    let (mut inner, report) = inner_shell(&mesh, distance)?;
    // Smoothed normals lean to either side along the wound: its walls are made to stand upright.
    path.iter().for_each(|v| inner[*v as usize].x = 0.0);
    let faces = mesh.polygons();
    let cut = Cut::along(&faces, mesh.vertices_m.len(), path)?;
    let shift = opening(&mesh, &cut, params.wound.gap.get())?;
    let outer: Vec<Vec3> = (0..).zip(&shift).map(|(v, s)| mesh.vertices_m[cut.original(v) as usize] + s).collect();
    let inner: Vec<Vec3> = if params.wound.depth >= params.shell_distance {
        (0..).zip(&shift).map(|(v, s)| inner[cut.original(v) as usize] + s).collect()
    } else {
        inner
    };
    let layers = LayeredSurface::stack(&faces, Some(&cut), &[outer, inner])?;
    check_prisms(&layers)?;
    Blueprint {
        kind: TissueKind::Vosm,
        fixed: held(&layers, params.held),
        layers,
        cut,
        layer_thickness_m: thickness,
        pre_strain: 0.0,
        material: &params.material,
        wound: &params.wound,
        shell: Some(ShellReport { smoothed_vertices, ..report }),
    }
    .build()
}

/// Displacement of every vertex of the split surface when the wound is opened.
fn opening(mesh: &TriangleMesh, cut: &Cut, gap_m: f64) -> Result<Vec<Vec3>, TissueError> {
    let line: Vec<Vec3> = cut.path.iter().map(|v| mesh.vertices_m[*v as usize]).collect();
    let lateral: Vec<f64> = mesh.vertices_m.iter().map(|x| x.x).collect();
    let sides = cut.sides(&lateral);
    check_sides(cut, &sides)?;
    let normals = mesh.vertex_normals();
    let opening = Opening {
        half_gap_m: 0.5 * gap_m,
        half_length_m: line[line.len() - 1].y,
        reach_m: (REACH_PER_GAP * gap_m).max(f64::MIN_POSITIVE),
    };
    opening.check()?;
    let shift = |v: u32| {
        let (x, n) = (mesh.vertices_m[cut.original(v) as usize], normals[cut.original(v) as usize]);
        let distance = if cut.path.contains(&cut.original(v)) { 0.0 } else { nearest_on(&line, x).1 };
        across_surface(n, opening.shift(sides[v as usize], x.y, distance) * facing(n))
    };
    Ok((0..cut.split_count() as u32).map(shift).collect())
}

/// Faces at the wound must lie on the side to which the cut gave them.
fn check_sides(cut: &Cut, sides: &[i8]) -> Result<(), TissueError> {
    for (index, face) in cut.faces.iter().enumerate() {
        let right = face.corners().iter().any(|c| *c >= cut.vertex_count);
        let left = face.corners().iter().any(|c| cut.left().contains(c));
        let stray = |c: &u32| (right && sides[*c as usize] < 0) || (left && sides[*c as usize] > 0);
        if face.corners().iter().any(stray) {
            return Err(TissueError::Wound {
                what: format!("face {index} beside it reaches across its line"),
                remedy: "refine the mesh or move the site of the wound",
            });
        }
    }
    Ok(())
}

/// Opening must not invert the body between the shells.
fn check_prisms(layers: &LayeredSurface) -> Result<(), TissueError> {
    let corners = |layer: usize, face: usize| {
        let c = layers.faces[layer][face].corners();
        [c[0], c[1], c[2]].map(|n| layers.position_m[n as usize])
    };
    match (0..layers.faces[0].len()).find(|f| prism_soundness(corners(0, *f), corners(1, *f)) <= 0.0) {
        Some(face) => Err(TissueError::Wound {
            what: format!("opening it turns the body below face {face} inside out"),
            remedy: "make the gap smaller, the wound longer or the inner shell nearer",
        }),
        None => Ok(()),
    }
}

fn held(layers: &LayeredSurface, region: HeldRegion) -> Vec<u8> {
    let lowest = layers.position_m.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    let is_held = |x: &Vec3| match region {
        HeldRegion::Nothing => false,
        HeldRegion::Beyond(radius) => x.norm() > radius.get(),
        HeldRegion::Bottom(share) => x.z <= lowest * (1.0 - share),
    };
    layers.position_m.iter().map(|x| u8::from(is_held(x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::network::SpringFamily;
    use crate::tissue::test_support::{liver, mm, refusal};

    #[test]
    fn no_spring_crosses_the_open_slit() {
        let mut params = liver();
        params.material.factors.bend = 0.3;
        let tissue = build(&params).unwrap();
        let (half, mut beyond) = (0.5 * tissue.wound_length_m, 0);
        for s in &tissue.network.springs {
            let [p, q] = [s.a, s.b].map(|n| tissue.network.rest_m[n as usize]);
            if p.x * q.x < 0.0 && p.z.min(q.z) > -0.03 {
                let y = p.y + (q.y - p.y) * p.x / (p.x - q.x);
                assert!(y.abs() >= half - 1.0e-9, "a {:?} spring crosses the wound at y = {y}", s.family);
                beyond += 1;
            }
        }
        assert!(beyond > 0, "beyond the tips springs do join the sides");
        assert!(tissue.network.springs.iter().any(|s| s.family == SpringFamily::Diagonal));
    }

    #[test]
    fn wound_stands_at_the_origin_and_is_as_wide_as_asked() {
        let tissue = build(&liver()).unwrap();
        let edge: Vec<Vec3> = tissue.wound_edge.iter().map(|n| tissue.network.rest_m[*n as usize]).collect();
        let widest = edge.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!((widest - 0.0025).abs() < 0.0005, "{widest}");
        assert!((tissue.wound_length_m - 0.06).abs() < 0.01, "{}", tissue.wound_length_m);
        let ends = [edge[0], edge[edge.len() / 2]];
        assert!((ends[0].y + ends[1].y).abs() < 1.0e-12 && ends.iter().all(|p| p.x == 0.0));
    }

    #[test]
    fn depth_and_patch_reach_the_inner_shell() {
        let mut params = liver();
        let nodes = |p: &VosmParams| build(p).unwrap().network.node_count();
        let deep = nodes(&params);
        let tissue = build(&params).unwrap();
        let layers: Vec<u8> = tissue.pairs[1].left.patch.nodes.iter().map(|n| tissue.layer[*n as usize]).collect();
        assert!(layers.contains(&0) && layers.contains(&1));
        params.wound.depth = mm(4.0);
        let twins = (tissue.wound_edge.len() - 2) / 2;
        assert_eq!(deep - nodes(&params), twins);
    }

    #[test]
    fn held_regions_hold_what_they_say() {
        let held = |region| {
            let tissue = build(&VosmParams { held: region, ..liver() }).unwrap();
            (0..tissue.network.node_count())
                .filter(|i| tissue.network.fixed[*i] == 1)
                .map(|i| tissue.network.rest_m[i])
                .collect::<Vec<_>>()
        };
        assert!(held(HeldRegion::Nothing).is_empty());
        let bottom = held(HeldRegion::Bottom(0.3));
        assert!(!bottom.is_empty() && bottom.iter().all(|x| x.z < -0.04));
        let far = held(HeldRegion::Beyond(mm(60.0)));
        assert!(!far.is_empty() && far.iter().all(|x| x.norm() > 0.06));
    }

    #[test]
    fn refusals_say_what_and_how() {
        let long = |p: &mut VosmParams| p.wound.length = mm(300.0);
        let aimless = |p: &mut VosmParams| p.site.along = Vec3::zeros();
        let nowhere = |p: &mut VosmParams| p.site.near_m.x = f64::NAN;
        let wide = |p: &mut VosmParams| p.wound.gap = mm(90.0);
        let coarse = |p: &mut VosmParams| {
            p.surface = OrganSurface::Lobe { half_axes_m: Vec3::repeat(0.05), taper: 0.0, subdivision: 0 };
        };
        let open = |p: &mut VosmParams| {
            let mut mesh = TriangleMesh::icosphere(1).unwrap();
            mesh.faces.truncate(70);
            p.surface = OrganSurface::Mesh(mesh);
        };
        let check = |change: &dyn Fn(&mut VosmParams), words: &str| {
            let mut params = liver();
            change(&mut params);
            let text = refusal(build(&params));
            assert!(text.contains(words), "“{text}” lacks “{words}”");
        };
        check(&long, "bends away");
        check(&aimless, "direction is zero");
        check(&nowhere, "not a finite vector");
        check(&wide, "make the gap smaller");
        check(&coarse, "refine the mesh");
        check(&open, "open");
    }
}
