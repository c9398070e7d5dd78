//! Where a straight slit runs on a triangle mesh: an edge path near the wanted line, moved onto it.
//!
//! Path: Dijkstra with cost |e|·(1 + w·x²/h²), x the distance from the line's plane and h the mean
//! edge. Straightening: every vertex moves along the surface by −x_path·(1 − d/reach), d its distance
//! from the path, so that the path comes to x = 0 and no neighbour is overtaken (slope ≤ 1/4).
//! Works in the wound frame: x across, y along, z outward, the site at the origin. Metres.

use super::geodesic::WalkGraph;
use super::model::TissueError;
use super::triangle_mesh::TriangleMesh;
use crate::vector::Vec3;

/// Weight w of the distance from the line in the path's cost.
const LINE_WEIGHT: f64 = 8.0;
/// Edges must gain at least this share of their length along the line.
const LEAST_PROGRESS: f64 = 0.25;
/// Faces whose normal has a z below this look too far away from the wound's middle to be cut.
const FACING: f64 = 0.25;
/// The straightening reaches this many times farther than it moves.
const REACH_PER_MOVE: f64 = 4.0;
/// A tip may miss its place by this many mean edges.
const TIP_MISS: f64 = 1.0;
/// Flattest tangent along which a vertex is still moved across.
const FLATTEST: f64 = 0.3;

fn refuse(what: String) -> TissueError {
    TissueError::Wound { what, remedy: "make the wound shorter, move its site to a flatter place or refine the mesh" }
}

/// Mean edge length, metres.
pub(super) fn mean_edge(mesh: &TriangleMesh, edges: &[(u32, u32)]) -> f64 {
    edges.iter().map(|e| edge_vector(mesh, *e).norm()).sum::<f64>() / edges.len() as f64
}

fn edge_vector(mesh: &TriangleMesh, (a, b): (u32, u32)) -> Vec3 {
    mesh.vertices_m[b as usize] - mesh.vertices_m[a as usize]
}

/// The edge path of a slit of the given length through the origin along y, by rising y.
pub(super) fn find_path(mesh: &TriangleMesh, length_m: f64) -> Result<Vec<u32>, TissueError> {
    let edges = mesh.edges();
    let h = mean_edge(mesh, &edges);
    let normals = mesh.vertex_normals();
    let position = |v: u32| mesh.vertices_m[v as usize];
    let usable = |v: u32| normals[v as usize].z >= FACING;
    let middle = nearest(mesh, Vec3::zeros());
    let lengths: Vec<(u32, u32, f64)> = edges.iter().map(|e| (e.0, e.1, edge_vector(mesh, *e).norm())).collect();
    let near = WalkGraph::from_edges(mesh.vertices_m.len(), &lengths).within(middle, length_m);
    let mut ends = [0_u32; 2];
    for (end, y) in ends.iter_mut().zip([-0.5 * length_m, 0.5 * length_m]) {
        let miss = |v: u32| (position(v).x).hypot(position(v).y - y);
        let best = near.iter().map(|n| n.0).filter(|v| usable(*v)).min_by(|a, b| miss(*a).total_cmp(&miss(*b)));
        *end = best.filter(|v| miss(*v) <= TIP_MISS * h).ok_or_else(|| {
            refuse(format!("the surface bends away before the tip at {y} m from the middle of the wound"))
        })?;
    }
    let cost = |&(a, b): &(u32, u32)| {
        let (along, length) = (edge_vector(mesh, (a, b)).y.abs(), edge_vector(mesh, (a, b)).norm());
        let off = 0.5 * (position(a).x.powi(2) + position(b).x.powi(2)) / (h * h);
        let open = usable(a) && usable(b) && along >= LEAST_PROGRESS * length;
        open.then_some((a, b, length * (1.0 + LINE_WEIGHT * off)))
    };
    let weighted: Vec<(u32, u32, f64)> = edges.iter().filter_map(cost).collect();
    let path = WalkGraph::from_edges(mesh.vertices_m.len(), &weighted).path(ends[0], ends[1]);
    let path = without_chords(&path, &edges);
    if path.len() < 3 || path.windows(2).any(|w| position(w[1]).y <= position(w[0]).y) {
        return Err(refuse(format!("no path of edges runs along it (mean edge {h} m, wound {length_m} m)")));
    }
    Ok(path)
}

/// The vertex nearest to a point.
pub(super) fn nearest(mesh: &TriangleMesh, point: Vec3) -> u32 {
    let square = |v: &u32| (mesh.vertices_m[*v as usize] - point).norm_squared();
    (0..mesh.vertices_m.len() as u32).min_by(|a, b| square(a).total_cmp(&square(b))).unwrap_or(0)
}

/// Takes every short cut that one edge offers: a face with two edges on the path would collapse.
fn without_chords(path: &[u32], edges: &[(u32, u32)]) -> Vec<u32> {
    let joined = |a: u32, b: u32| edges.binary_search(&(a.min(b), a.max(b))).is_ok();
    let mut short = Vec::new();
    let mut at = 0;
    while let Some(&here) = path.get(at) {
        short.push(here);
        at = (at + 1..path.len()).rev().find(|next| joined(here, path[*next])).unwrap_or(path.len());
    }
    short
}

/// Nearest point of a polyline and the distance to it.
pub(super) fn nearest_on(line: &[Vec3], point: Vec3) -> (Vec3, f64) {
    let on = |w: &[Vec3]| {
        let d = w[1] - w[0];
        let t = ((point - w[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        w[0] + d * t
    };
    let closest = line.windows(2).map(on).min_by(|a, b| (a - point).norm().total_cmp(&(b - point).norm()));
    closest.map_or((point, f64::INFINITY), |q| (q, (q - point).norm()))
}

/// Displacement along a surface with normal `n` that gains `across` in x.
pub(super) fn across_surface(normal: Vec3, across: f64) -> Vec3 {
    let tangent = Vec3::x() - normal * normal.x;
    tangent * (across / tangent.x.max(FLATTEST))
}

/// How far a vertex takes part in what happens at the wound: 1 where it faces outward, 0 behind.
pub(super) fn facing(normal: Vec3) -> f64 {
    (2.0 * normal.z).clamp(0.0, 1.0)
}

/// Moves a path to x = 0 together with its surroundings.
pub(super) fn straighten(mesh: &mut TriangleMesh, path: &[u32]) -> Result<(), TissueError> {
    let normals = mesh.vertex_normals();
    let before = mesh.clone();
    let line: Vec<Vec3> = path.iter().map(|v| mesh.vertices_m[*v as usize]).collect();
    let reach = REACH_PER_MOVE * line.iter().map(|p| p.x.abs()).fold(0.0, f64::max);
    if reach > 0.0 {
        for (x, n) in mesh.vertices_m.iter_mut().zip(&normals) {
            let (on_path, distance) = nearest_on(&line, *x);
            let share = (1.0 - distance / reach).max(0.0) * facing(*n);
            *x += across_surface(*n, -on_path.x * share);
        }
        path.iter().for_each(|v| mesh.vertices_m[*v as usize].x = 0.0);
    }
    let normal = |m: &TriangleMesh, f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| m.vertices_m[v as usize]);
        (b - a).cross(&(c - a))
    };
    let turned = |f: &&[u32; 3]| {
        let (old, new) = (normal(&before, f), normal(mesh, f));
        old.dot(&new) < KEPT_AREA * old.norm_squared()
    };
    match mesh.faces.iter().position(|f| turned(&f)) {
        Some(face) => Err(refuse(format!("face {face} would be turned over when the wound's edge is made straight"))),
        None => Ok(()),
    }
}

/// A face must keep this share of its area when the path is made straight.
const KEPT_AREA: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_runs_along_the_line_and_ends_up_on_it() {
        let mut mesh = TriangleMesh::lobe(Vec3::new(0.08, 0.1, 0.04), 0.3, 4).unwrap();
        let (sin, cos) = 0.3_f64.sin_cos();
        // Turned about z, so that the mesh's own lines are oblique to the wound; top moved to z = 0.
        for v in &mut mesh.vertices_m {
            *v = Vec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z - 0.04);
        }
        let volume = mesh.volume();
        let path = find_path(&mesh, 0.06).unwrap();
        let h = mean_edge(&mesh, &mesh.edges());
        assert!(path.iter().all(|v| mesh.vertices_m[*v as usize].x.abs() < h));
        straighten(&mut mesh, &path).unwrap();
        assert!(path.iter().all(|v| mesh.vertices_m[*v as usize].x == 0.0));
        assert!(mesh.check_closed().is_ok());
        // Vertices slide along the surface: the body keeps its volume.
        assert!((mesh.volume() / volume - 1.0).abs() < 1.0e-3);
        let length = mesh.vertices_m[path[path.len() - 1] as usize].y - mesh.vertices_m[path[0] as usize].y;
        assert!((length - 0.06).abs() < 2.0 * h);
    }

    #[test]
    fn a_wound_longer_than_the_organ_is_refused() {
        let mut mesh = TriangleMesh::icosphere(3).unwrap();
        mesh.vertices_m.iter_mut().for_each(|v| v.z -= 1.0);
        let text = find_path(&mesh, 2.5).unwrap_err().to_string();
        assert!(text.contains("bends away") && text.contains("shorter"), "{text}");
    }

    #[test]
    fn chords_are_taken() {
        let edges = [(0, 1), (0, 2), (1, 2), (2, 3)];
        assert_eq!(without_chords(&[0, 1, 2, 3], &edges), vec![0, 2, 3]);
    }
}
