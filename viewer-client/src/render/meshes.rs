//! Rigid bodies made in code: ball, rod, cone, needle holder, needle. Ball, rod and cone are of size one; the tool is in
//! metres, its jaws at the origin, its handles along +z.

use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

/// Radius of the needle's arc, metres.
const ARC_M: f32 = 4.2e-3;
/// The needle's arc: from its swage, where the line is fixed, to its point.
const ARC_RAD: (f32, f32) = (1.0, 4.25);
/// Corners around a rod.
const ROUND: u32 = 12;

/// Triangles that turn to the left seen from outside.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    /// Positions and normals, each pair once.
    pub(super) vertices: Vec<[f32; 6]>,
    /// Three vertices a triangle.
    pub(super) indices: Vec<u32>,
    known: HashMap<[u32; 6], u32>,
}

/// A cross-section of a sweep: middle, half axes along two directions.
struct Section {
    middle: [f32; 3],
    u: [f32; 3],
    v: [f32; 3],
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    let size = a.iter().map(|c| c * c).sum::<f32>().sqrt().max(1.0e-20);
    a.map(|c| c / size)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(p, q)| p * q).sum()
}

impl Mesh {
    /// Two triangles, or one where two corners are the same.
    fn quad(&mut self, corners: [[f32; 3]; 4], normals: [[f32; 3]; 4]) {
        for [i, j, k] in [[0, 1, 2], [2, 1, 3]] {
            let [a, b, c] = [corners[i], corners[j], corners[k]];
            if a == b || b == c || c == a {
                continue;
            }
            let out = [i, j, k].map(|corner| normals[corner]);
            let turned = cross(minus(b, a), minus(c, a));
            let order = if out.iter().any(|n| dot(turned, *n) < 0.0) { [i, k, j] } else { [i, j, k] };
            let triangle = order.map(|corner| self.vertex(corners[corner], normals[corner]));
            self.indices.extend(triangle);
        }
    }

    fn vertex(&mut self, [x, y, z]: [f32; 3], [a, b, c]: [f32; 3]) -> u32 {
        let vertex = [x, y, z, a, b, c];
        let next = self.vertices.len() as u32;
        let index = *self.known.entry(vertex.map(f32::to_bits)).or_insert(next);
        if index == next {
            self.vertices.push(vertex);
        }
        index
    }

    /// A closed skin over cross-sections, with flat ends.
    fn sweep(&mut self, sections: &[Section]) {
        let at = |s: &Section, k: u32| -> [f32; 3] {
            let (sin, cos) = (TAU * k as f32 / ROUND as f32).sin_cos();
            std::array::from_fn(|i| s.middle[i] + cos * s.u[i] + sin * s.v[i])
        };
        for (low, high) in sections.iter().zip(&sections[1..]) {
            // Normal: along the ring's change × along the sweep, away from the middle.
            let normal = |s: &Section, k: u32| {
                let ring = minus(at(s, k + 1), at(s, k + ROUND - 1));
                let n = unit(cross(ring, minus(at(high, k), at(low, k))));
                if dot(n, minus(at(s, k), s.middle)) < 0.0 { n.map(|c| -c) } else { n }
            };
            for k in 0..ROUND {
                self.quad(
                    [at(low, k), at(low, k + 1), at(high, k), at(high, k + 1)],
                    [normal(low, k), normal(low, k + 1), normal(high, k), normal(high, k + 1)],
                );
            }
        }
        for (end, before) in [(0, 1), (sections.len() - 1, sections.len() - 2)] {
            let out = unit(minus(sections[end].middle, sections[before].middle));
            for k in 0..ROUND {
                let s = &sections[end];
                self.quad([s.middle, at(s, k), s.middle, at(s, k + 1)], [out; 4]);
            }
        }
    }
}

/// A ball of radius 1.
pub(super) fn ball() -> Mesh {
    const ROWS: u32 = 7;
    let at = |row: u32, k: u32| {
        let (sin, cos) = (PI * row as f32 / ROWS as f32).sin_cos();
        let turn = TAU * k as f32 / (2 * ROWS) as f32;
        [sin * turn.cos(), sin * turn.sin(), cos]
    };
    let mut mesh = Mesh::default();
    for (row, k) in (0..ROWS).flat_map(|row| (0..2 * ROWS).map(move |k| (row, k))) {
        let corners = [at(row, k), at(row + 1, k), at(row, k + 1), at(row + 1, k + 1)];
        mesh.quad(corners, corners);
    }
    mesh
}

fn level(z: f32, radius: f32) -> Section {
    Section { middle: [0.0, 0.0, z], u: [radius, 0.0, 0.0], v: [0.0, radius, 0.0] }
}

/// A rod of radius 1 from z = 0 to 1.
pub(super) fn rod() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.sweep(&[level(0.0, 1.0), level(1.0, 1.0)]);
    mesh
}

/// A cone of radius 1 at z = 0 with its tip at z = 1.
pub(super) fn cone() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.sweep(&[level(0.0, 1.0), level(1.0, 0.01)]);
    mesh
}

/// A needle holder: two jaws, a joint, two shanks, two rings.
pub(super) fn holder() -> Mesh {
    const MM: f32 = 1.0e-3;
    let section = |x: f32, y: f32, z: f32, half_x: f32, half_y: f32| Section {
        middle: [x * MM, y * MM, z * MM],
        u: [half_x * MM, 0.0, 0.0],
        v: [0.0, half_y * MM, 0.0],
    };
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        mesh.sweep(&[
            section(0.0, side * 0.45, -1.2, 0.55, 0.28),
            section(0.0, side * 0.50, -0.6, 0.85, 0.40),
            section(0.0, side * 0.75, 5.0, 1.20, 0.68),
            section(0.0, side * 0.95, 12.0, 1.60, 0.95),
        ]);
        mesh.sweep(&[
            section(side * 0.9, side * 0.4, 17.0, 1.3, 1.2),
            section(side * 1.7, side * 0.3, 30.0, 1.25, 1.1),
            section(side * 4.2, 0.0, 75.0, 1.3, 1.1),
            section(side * 6.5, 0.0, 112.0, 1.5, 1.2),
        ]);
        ring(&mut mesh, [side * 13.0 * MM, 0.0, 121.0 * MM], 9.0 * MM, 1.7 * MM);
    }
    mesh.sweep(&[
        section(0.0, 0.0, 11.0, 1.6, 1.7),
        section(0.0, 0.0, 13.5, 2.7, 2.1),
        section(0.0, 0.0, 17.5, 2.8, 2.1),
        section(0.0, 0.0, 20.5, 1.9, 1.5),
    ]);
    mesh
}

/// A ring in the plane y = 0.
fn ring(mesh: &mut Mesh, [x, y, z]: [f32; 3], radius: f32, thickness: f32) {
    let sections: Vec<Section> = (0..=28)
        .map(|k| {
            let (sin, cos) = (TAU * k as f32 / 28.0).sin_cos();
            Section {
                middle: [x + radius * cos, y, z + 1.2 * radius * sin],
                u: [thickness * cos, 0.0, thickness * sin],
                v: [0.0, thickness, 0.0],
            }
        })
        .collect();
    mesh.sweep(&sections);
}

/// Place of the needle's arc in the jaws: half a circle about (0, −R, 0).
fn arc(turn_rad: f32, radius_m: f32) -> [f32; 3] {
    [radius_m * turn_rad.cos(), radius_m * turn_rad.sin() - ARC_M, 0.0]
}

/// Where the line is fixed to the needle, metres in the tool's axes.
pub(super) fn swage_m() -> [f32; 3] {
    arc(ARC_RAD.0, ARC_M)
}

/// A half-round needle in the jaws.
pub(super) fn needle() -> Mesh {
    const PIECES: u16 = 28;
    let sections: Vec<Section> = (0..=PIECES)
        .map(|k| {
            let share = f32::from(k) / f32::from(PIECES);
            let turn = ARC_RAD.0 + share * (ARC_RAD.1 - ARC_RAD.0);
            // Even up to the last quarter, then a point.
            let half = 2.6e-4 * (1.0 - ((share - 0.75) / 0.25).max(0.0)).max(0.03);
            let out = [turn.cos() * half, turn.sin() * half, 0.0];
            Section { middle: arc(turn, ARC_M), u: out, v: [0.0, 0.0, half] }
        })
        .collect();
    let mut mesh = Mesh::default();
    mesh.sweep(&sections);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_faces_the_way_its_corners_do_and_no_vertex_is_there_twice() {
        for mesh in [ball(), rod(), cone(), holder(), needle()] {
            for face in mesh.indices.as_chunks::<3>().0 {
                let corners = face.map(|i| mesh.vertices[i as usize]);
                let [a, b, c] = corners.map(|[x, y, z, ..]| [x, y, z]);
                let turned = cross(minus(b, a), minus(c, a));
                let out = corners.iter().map(|[_, _, _, x, y, z]| dot(turned, [*x, *y, *z])).sum::<f32>();
                assert!(out > 0.0, "{corners:?}");
            }
            let mut bits: Vec<_> = mesh.vertices.iter().map(|v| v.map(f32::to_bits)).collect();
            bits.sort_unstable();
            bits.dedup();
            assert_eq!(bits.len(), mesh.vertices.len());
            assert!(mesh.vertices.len() * 2 < mesh.indices.len());
        }
    }

    #[test]
    fn a_body_is_not_inside_out() {
        let mut hoop = Mesh::default();
        ring(&mut hoop, [0.0; 3], 9.0e-3, 1.7e-3);
        for (name, mesh) in [("needle", needle()), ("holder", holder()), ("ring", hoop), ("rod", rod())] {
            let corner = |i: u32| mesh.vertices[i as usize];
            let parts = mesh.indices.as_chunks::<3>().0.iter().map(|face| {
                let [a, b, c] = face.map(corner).map(|[x, y, z, ..]| [x, y, z]);
                dot(a, cross(b, c))
            });
            let (volume, largest) = parts.fold((0.0_f32, 0.0_f32), |(v, most), p| (v + p, most.max(p.abs())));
            assert!(volume > largest, "{name}: six times its volume is {volume}");
        }
    }

    #[test]
    fn normals_are_of_length_one_and_point_out_of_a_convex_body() {
        for (name, mesh, inside) in
            [("ball", ball(), [0.0; 3]), ("rod", rod(), [0.0, 0.0, 0.5]), ("cone", cone(), [0.0, 0.0, 0.2])]
        {
            for [x, y, z, a, b, c] in &mesh.vertices {
                let normal = [*a, *b, *c];
                assert!((dot(normal, normal) - 1.0).abs() < 1e-3, "{name} {normal:?}");
                let out = dot(normal, minus([*x, *y, *z], inside));
                assert!(out > -1e-3, "{name}: {out} at {x} {y} {z}");
            }
        }
    }

    #[test]
    fn the_needle_is_gripped_at_the_origin_and_ends_at_its_swage() {
        let near = |p: [f32; 3]| {
            let distance = |v: &[f32; 6]| minus([v[0], v[1], v[2]], p).iter().map(|c| c * c).sum::<f32>().sqrt();
            needle().vertices.iter().map(distance).fold(f32::INFINITY, f32::min)
        };
        assert!(near([0.0; 3]) < 6e-4 && near(swage_m()) < 6e-4 && near([0.0, 0.0, 5e-3]) > 4e-3);
        assert!([holder(), needle()].iter().all(|m| m.vertices.iter().flatten().all(|c| c.is_finite())));
    }
}
