//! The inner shell of a volumetric organ: the surface moved inward along smoothed normals ("shrinks
//! the surface volume to construct a new mesh model inside the surface", Zhang et al., §2.1.1).
//!
//! x' = x − d·n. d is the asked distance, cut down to 0.4 of the local thickness (so that shells of
//! opposite walls never meet), evened out so that it changes by at most half an edge per edge. Where the
//! prism between a face and its image would be inverted, d shrinks and the normals draw together. Metres.

use super::model::{ShellReport, TissueError};
use super::ray::FaceGrid;
use super::triangle_mesh::TriangleMesh;
use crate::vector::Vec3;

/// Largest offset as a share of the local thickness.
const THICKNESS_SHARE: f64 = 0.4;
/// Smoothing passes over the normals.
const NORMAL_PASSES: usize = 8;
/// Steepest change of the offset along an edge.
const OFFSET_SLOPE: f64 = 0.5;
/// Passes that even out the offset.
const SLOPE_PASSES: usize = 32;
/// Factor on the offsets round an inverted prism, and how often it is tried.
const SHRINK: f64 = 0.8;
const SHRINK_PASSES: usize = 40;
/// A prism corner counts as sound above this share of face area × offset.
const SOUND_SHARE: f64 = 0.01;
/// A face is folded back when the cosine between it and a corner's normal is below this.
const FOLDED: f64 = 0.1;
/// How often folds are smoothed.
const FOLD_PASSES: usize = 50;

/// Smallest corner volume of the prism between a face and its image, relative to twice the face's
/// area times its mean offset; at most 0 when the prism is inverted.
pub(super) fn prism_soundness(outer: [Vec3; 3], inner: [Vec3; 3]) -> f64 {
    let top = (outer[1] - outer[0]).cross(&(outer[2] - outer[0]));
    let bottom = (inner[1] - inner[0]).cross(&(inner[2] - inner[0]));
    let link = |i: usize| outer[i] - inner[i];
    let scale = top.norm() * (0..3).map(|i| link(i).norm()).sum::<f64>() / 3.0;
    let smallest = (0..3).map(|i| top.dot(&link(i)).min(bottom.dot(&link(i)))).fold(f64::INFINITY, f64::min);
    if scale > 0.0 { smallest / scale } else { 0.0 }
}

/// Positions of the inner shell.
///
/// # Errors
/// [`TissueError::Mesh`] where no positive offset gives a sound prism.
pub fn inner_shell(mesh: &TriangleMesh, distance_m: f64) -> Result<(Vec<Vec3>, ShellReport), TissueError> {
    let edges = mesh.edges();
    let mut normals = smoothed_normals(mesh, &edges);
    let grid = FaceGrid::new(mesh);
    let reach = distance_m / THICKNESS_SHARE;
    let mut offset: Vec<f64> = (0..)
        .zip(mesh.vertices_m.iter().zip(&normals))
        .map(|(v, (x, n))| grid.first_hit(mesh, v, *x, -n * reach).map_or(distance_m, |t| t * distance_m))
        .collect();
    for pass in 0.. {
        even_out(mesh, &edges, &mut offset);
        let image = |v: u32| mesh.vertices_m[v as usize] - normals[v as usize] * offset[v as usize];
        let inverted =
            |f: &&[u32; 3]| prism_soundness(f.map(|v| mesh.vertices_m[v as usize]), f.map(image)) < SOUND_SHARE;
        let bad: Vec<[u32; 3]> = mesh.faces.iter().filter(inverted).copied().collect();
        let Some(first) = bad.first() else { break };
        if pass == SHRINK_PASSES {
            let what = format!(
                "no inner shell fits {distance_m} m below the face of vertices {first:?} (the surface is too sharp there)"
            );
            return Err(TissueError::Mesh { what });
        }
        mend(&bad, &mut normals, &mut offset);
    }
    let report = ShellReport {
        smoothed_vertices: 0,
        shrunk_vertices: offset.iter().filter(|d| **d < distance_m).count() as u32,
        smallest_offset_m: offset.iter().copied().fold(f64::INFINITY, f64::min),
    };
    let inner = mesh.vertices_m.iter().zip(normals.iter().zip(&offset)).map(|(x, (n, d))| x - n * *d).collect();
    Ok((inner, report))
}

/// Smooths places where a face is folded back over its neighbours (imported meshes have them): no
/// inward direction serves such a face. Each pass moves the corners half way to the mean of their
/// neighbours. Returns how many vertices were moved.
pub(super) fn smooth_folds(mesh: &mut TriangleMesh) -> u32 {
    let edges = mesh.edges();
    let mut moved = vec![false; mesh.vertices_m.len()];
    for _ in 0..FOLD_PASSES {
        let normals = mesh.vertex_normals();
        let folded = |f: &&[u32; 3]| {
            let [a, b, c] = f.map(|v| mesh.vertices_m[v as usize]);
            let face = (b - a).cross(&(c - a));
            f.iter().any(|v| face.dot(&normals[*v as usize]) < FOLDED * face.norm())
        };
        let mut now = vec![false; moved.len()];
        mesh.faces.iter().filter(folded).flatten().for_each(|v| now[*v as usize] = true);
        if !now.contains(&true) {
            break;
        }
        let mut sum = vec![(Vec3::zeros(), 0.0); moved.len()];
        for &(a, b) in &edges {
            for (i, j) in [(a as usize, b as usize), (b as usize, a as usize)] {
                sum[i].0 += mesh.vertices_m[j];
                sum[i].1 += 1.0;
            }
        }
        for (v, (total, count)) in sum.into_iter().enumerate().filter(|(v, _)| now[*v]) {
            mesh.vertices_m[v] = (mesh.vertices_m[v] + total / count) * 0.5;
            moved[v] = true;
        }
    }
    moved.iter().filter(|m| **m).count() as u32
}

/// Brings the normals round inverted prisms together and their offsets down.
fn mend(bad: &[[u32; 3]], normals: &mut [Vec3], offset: &mut [f64]) {
    for f in bad {
        let mean: Vec3 = f.iter().map(|v| normals[*v as usize]).sum();
        for v in f.map(|v| v as usize) {
            normals[v] = (normals[v] + mean).try_normalize(0.0).unwrap_or(normals[v]);
        }
    }
    let mut corners: Vec<u32> = bad.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners.iter().for_each(|v| offset[*v as usize] *= SHRINK);
}

fn smoothed_normals(mesh: &TriangleMesh, edges: &[(u32, u32)]) -> Vec<Vec3> {
    let raw = mesh.vertex_normals();
    let mut normals = raw.clone();
    for _ in 0..NORMAL_PASSES {
        let mut sum = normals.clone();
        for &(a, b) in edges {
            sum[a as usize] += normals[b as usize];
            sum[b as usize] += normals[a as usize];
        }
        let unit = |(s, old): (Vec3, &Vec3)| s.try_normalize(0.0).unwrap_or(*old);
        normals = sum.into_iter().zip(&normals).map(unit).collect();
    }
    // At a sharp ridge the smoothed normal may look past a face: there the plain one is kept.
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| mesh.vertices_m[v as usize]);
        let face = (b - a).cross(&(c - a));
        for v in f.map(|v| v as usize) {
            if face.dot(&normals[v]) <= 0.0 {
                normals[v] = raw[v];
            }
        }
    }
    normals
}

fn even_out(mesh: &TriangleMesh, edges: &[(u32, u32)], offset: &mut [f64]) {
    for _ in 0..SLOPE_PASSES {
        let mut changed = false;
        for &(a, b) in edges {
            let (a, b) = (a as usize, b as usize);
            let step = OFFSET_SLOPE * (mesh.vertices_m[a] - mesh.vertices_m[b]).norm();
            for (i, j) in [(a, b), (b, a)] {
                if offset[i] > offset[j] + step {
                    offset[i] = offset[j] + step;
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::test_support::encloses;

    #[test]
    fn shell_of_a_sphere_is_a_smaller_sphere() {
        let sphere = TriangleMesh::icosphere(3).unwrap();
        let (inner, report) = inner_shell(&sphere, 0.2).unwrap();
        assert_eq!(report.shrunk_vertices, 0);
        // Normals of the polyhedron differ from radii by O(h²).
        assert!(inner.iter().all(|x| (x.norm() - 0.8).abs() < 1.0e-3));
    }

    #[test]
    fn shell_stays_inside_a_thin_and_bent_body() {
        // A plate whose half thickness is far below the offset asked for, bent like a liver's lobe.
        let mut plate = TriangleMesh::lobe(Vec3::new(0.1, 0.1, 0.01), 0.5, 4).unwrap();
        plate.vertices_m.iter_mut().for_each(|v| v.z -= 4.0 * v.x * v.x);
        let (inner, report) = inner_shell(&plate, 0.01).unwrap();
        assert!(report.shrunk_vertices > 100 && report.smallest_offset_m > 0.0);
        for (v, x) in inner.iter().enumerate() {
            assert!(encloses(&plate, *x), "inner vertex {v} is outside");
        }
        let shell = TriangleMesh { vertices_m: inner, faces: plate.faces.clone() };
        assert!(shell.check_closed().is_ok() && shell.volume() < plate.volume());
        let corners = |m: &TriangleMesh, f: usize| m.faces[f].map(|v| m.vertices_m[v as usize]);
        for f in 0..plate.faces.len() {
            assert!(prism_soundness(corners(&plate, f), corners(&shell, f)) > 0.0);
            let middle = corners(&shell, f).iter().sum::<Vec3>() / 3.0;
            assert!(encloses(&plate, middle), "inner face {f} is outside");
        }
    }

    #[test]
    fn inverted_prisms_are_seen() {
        let top = [Vec3::zeros(), Vec3::x(), Vec3::y()];
        let below = |z: f64| top.map(|p| p - Vec3::z() * z);
        assert!((prism_soundness(top, below(0.3)) - 1.0).abs() < 1.0e-12);
        assert!(prism_soundness(top, below(-0.3)) < 0.0);
        let mut turned = below(0.3);
        turned.swap(1, 2);
        assert!(prism_soundness(top, turned) < 0.0);
    }
}
