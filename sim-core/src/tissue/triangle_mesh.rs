//! Closed triangle meshes: what an organ's surface must be, and a parametric one.
//!
//! Accepted: finite vertices, faces with area, every edge in exactly two faces that run it in
//! opposite directions, one fan of faces round every vertex, one component, volume above 0 (normals
//! outward). The parametric organ is an icosphere scaled to an ellipsoid whose height tapers along
//! y, like the lobe of a liver. Metres. Deliberately absent: file formats (the host reads them).

use super::model::{TissueError, check_count};
use super::params::in_range;
use super::surface::{Face, by_edge, check_surface, edge_uses};
use crate::vector::Vec3;

/// A triangle mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Vertices, metres.
    pub vertices_m: Vec<Vec3>,
    /// Corners of each face, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

/// A face whose height is below this share of its longest edge has no usable normal.
const NEEDLE: f64 = 1.0e-6;
/// Finest parametric organ: 40 962 vertices.
const MAX_SUBDIVISION: u32 = 6;
/// Strongest taper: at 1 the lobe would end in an edge.
const MAX_TAPER: f64 = 0.8;

impl TriangleMesh {
    /// Faces as polygons.
    #[must_use]
    pub fn polygons(&self) -> Vec<Face> {
        self.faces.iter().map(|f| Face::Triangle(*f)).collect()
    }

    /// Checks everything that a volumetric organ asks of its surface.
    ///
    /// # Errors
    /// [`TissueError::Mesh`] naming the first face, edge or vertex at fault; too many nodes.
    pub fn check_closed(&self) -> Result<(), TissueError> {
        let mesh = |what: String| Err(TissueError::Mesh { what });
        check_count(2.0 * self.vertices_m.len() as f64)?;
        check_count(self.faces.len() as f64 / 2.0)?;
        let fine = |x: &Vec3| x.iter().all(|v| v.is_finite() && v.abs() <= crate::units::Metres::HIGH);
        if let Some(v) = self.vertices_m.iter().position(|x| !fine(x)) {
            return mesh(format!("vertex {v} is not a finite point within 100 m"));
        }
        if self.faces.is_empty() {
            return mesh("it has no faces".to_owned());
        }
        let polygons = self.polygons();
        check_surface(&polygons, self.vertices_m.len())?;
        let uses = edge_uses(&polygons);
        if let Some(open) = by_edge(&uses).find(|g| g.len() != 2) {
            return mesh(format!(
                "edge {}–{} belongs to one face only: the surface is open",
                open[0].low, open[0].high
            ));
        }
        if let Some(face) = self.faces.iter().position(|f| self.is_needle(f)) {
            return mesh(format!("face {face} has no area"));
        }
        self.check_fans()?;
        self.check_component()?;
        if self.volume() <= 0.0 {
            return mesh("its faces look inward (the volume is negative): turn all of them over".to_owned());
        }
        Ok(())
    }

    fn is_needle(&self, face: &[u32; 3]) -> bool {
        let [a, b, c] = face.map(|v| self.vertices_m[v as usize]);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        (b - a).cross(&(c - a)).norm() <= NEEDLE * longest || longest <= 0.0
    }

    /// Every vertex must have one fan: going round it from face to face meets all of its faces.
    fn check_fans(&self) -> Result<(), TissueError> {
        // Faces by (vertex, next corner): going round v, the face after (v, a, b) is the one at (v, b).
        let mut spokes: Vec<(u32, u32, u32)> =
            self.faces.iter().flat_map(|f| [(f[0], f[1], f[2]), (f[1], f[2], f[0]), (f[2], f[0], f[1])]).collect();
        spokes.sort_unstable();
        for fan in spokes.chunk_by(|a, b| a.0 == b.0) {
            let mut at = 0;
            for turned in 1..=fan.len() {
                at = fan.partition_point(|s| s.1 < fan[at].2);
                if at == 0 && turned < fan.len() {
                    let what = format!("vertex {} joins two sheets that touch only there", fan[0].0);
                    return Err(TissueError::Mesh { what });
                }
            }
        }
        Ok(())
    }

    fn check_component(&self) -> Result<(), TissueError> {
        let mut root: Vec<u32> = (0..self.vertices_m.len() as u32).collect();
        fn find(root: &mut [u32], mut v: u32) -> u32 {
            while root[v as usize] != v {
                root[v as usize] = root[root[v as usize] as usize];
                v = root[v as usize];
            }
            v
        }
        let mut parts = root.len();
        for (a, b) in self.faces.iter().flat_map(|f| [(f[0], f[1]), (f[1], f[2])]) {
            let (a, b) = (find(&mut root, a), find(&mut root, b));
            if a != b {
                root[a.max(b) as usize] = a.min(b);
                parts -= 1;
            }
        }
        if parts == 1 {
            return Ok(());
        }
        Err(TissueError::Mesh { what: format!("it falls into {parts} separate parts, an organ has one") })
    }

    /// Enclosed volume, m³; positive when the faces look outward.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let origin = self.vertices_m.first().copied().unwrap_or_default();
        let six = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| self.vertices_m[v as usize] - origin);
            a.dot(&b.cross(&c))
        };
        self.faces.iter().map(six).sum::<f64>() / 6.0
    }

    /// Area-weighted vertex normals, unit.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::zeros(); self.vertices_m.len()];
        for f in &self.faces {
            let [a, b, c] = f.map(|v| self.vertices_m[v as usize]);
            let doubled = (b - a).cross(&(c - a));
            f.iter().for_each(|v| normals[*v as usize] += doubled);
        }
        normals.into_iter().map(|n| n.try_normalize(0.0).unwrap_or(Vec3::z())).collect()
    }

    /// Undirected edges, each once, by vertex pair.
    pub(super) fn edges(&self) -> Vec<(u32, u32)> {
        let uses = edge_uses(&self.polygons());
        by_edge(&uses).map(|g| (g[0].low, g[0].high)).collect()
    }

    /// A sphere of radius 1 from an icosahedron, each face split in four `subdivision` times.
    ///
    /// # Errors
    /// [`TissueError::Parameter`] above 6 subdivisions.
    pub fn icosphere(subdivision: u32) -> Result<Self, TissueError> {
        in_range("subdivision", f64::from(subdivision), 0.0, f64::from(MAX_SUBDIVISION))?;
        let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
        let ring = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)];
        let mut vertices: Vec<Vec3> = ring.iter().map(|&(a, b)| Vec3::new(a, b, 0.0).normalize()).collect();
        vertices.extend(ring.iter().map(|&(a, b)| Vec3::new(0.0, a, b).normalize()));
        vertices.extend(ring.iter().map(|&(a, b)| Vec3::new(b, 0.0, a).normalize()));
        let mut mesh = Self { vertices_m: vertices, faces: ICOSAHEDRON.to_vec() };
        (0..subdivision).for_each(|_| mesh.split_faces());
        Ok(mesh)
    }

    fn split_faces(&mut self) {
        let uses = edge_uses(&self.polygons());
        let mut middle = vec![[0_u32; 3]; self.faces.len()];
        for edge in by_edge(&uses) {
            let sum = self.vertices_m[edge[0].low as usize] + self.vertices_m[edge[0].high as usize];
            edge.iter().for_each(|u| middle[u.face as usize][u.slot as usize] = self.vertices_m.len() as u32);
            self.vertices_m.push(sum.normalize());
        }
        let split =
            |([a, b, c], [d, e, f]): (&[u32; 3], &[u32; 3])| [[*a, *d, *f], [*d, *b, *e], [*f, *e, *c], [*d, *e, *f]];
        self.faces = self.faces.iter().zip(&middle).flat_map(split).collect();
    }

    /// An organ-like body: an ellipsoid with these half axes whose height (z) is multiplied by
    /// 1 − taper·y/b.
    ///
    /// # Errors
    /// [`TissueError::Parameter`]: a half axis outside 1 mm to 10 m, a taper outside 0 to 0.8, more
    /// than 6 subdivisions.
    pub fn lobe(half_axes_m: Vec3, taper: f64, subdivision: u32) -> Result<Self, TissueError> {
        for axis in half_axes_m.iter() {
            in_range("half axis of the organ", *axis, 1.0e-3, 10.0)?;
        }
        in_range("taper of the organ", taper, 0.0, MAX_TAPER)?;
        let mut mesh = Self::icosphere(subdivision)?;
        for v in &mut mesh.vertices_m {
            *v = v.component_mul(&half_axes_m).component_mul(&Vec3::new(1.0, 1.0, 1.0 - taper * v.y));
        }
        Ok(mesh)
    }
}

const ICOSAHEDRON: [[u32; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn icosphere_tends_to_the_sphere_at_second_order() {
        let error = |s: u32| {
            let mesh = TriangleMesh::icosphere(s).unwrap();
            assert!(mesh.check_closed().is_ok());
            assert_eq!(mesh.vertices_m.len(), 10 * 4_usize.pow(s) + 2);
            let face = |f: &[u32; 3]| {
                let [a, b, c] = f.map(|v| mesh.vertices_m[v as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            };
            let area: f64 = mesh.faces.iter().map(face).sum();
            [1.0 - mesh.volume() / (4.0 / 3.0 * PI), 1.0 - area / (4.0 * PI)]
        };
        let (coarse, fine) = (error(3), error(4));
        for (c, f) in coarse.iter().zip(fine) {
            assert!(f > 0.0 && f < 0.005, "an inscribed sphere is smaller: {f}");
            // Halved edges: a quarter of the error.
            assert!((c / f - 4.0).abs() < 0.1, "ratio {}", c / f);
        }
    }

    #[test]
    fn lobe_has_the_volume_of_the_ellipsoid() {
        // The taper is odd in y, so it cancels; subdivision 4 is 0.6 % short of the smooth body.
        let lobe = TriangleMesh::lobe(Vec3::new(0.1, 0.07, 0.03), 0.4, 4).unwrap();
        let smooth = 4.0 / 3.0 * PI * 0.1 * 0.07 * 0.03;
        assert!((lobe.volume() / smooth - 1.0).abs() < 0.007);
        assert!(lobe.check_closed().is_ok());
    }

    #[test]
    fn faults_are_named() {
        let sphere = TriangleMesh::icosphere(1).unwrap();
        let check = |change: &dyn Fn(&mut TriangleMesh), words: &str| {
            let mut mesh = sphere.clone();
            change(&mut mesh);
            let text = mesh.check_closed().unwrap_err().to_string();
            assert!(text.contains(words), "“{text}” lacks “{words}”");
        };
        check(&|m| m.faces.truncate(79), "open");
        check(&|m| m.faces.iter_mut().for_each(|f| f.swap(0, 1)), "inward");
        check(&|m| m.faces[3].swap(0, 1), "turned over");
        check(&|m| m.vertices_m[5].x = f64::NAN, "vertex 5");
        check(&|m| m.vertices_m[m.faces[0][0] as usize] = m.vertices_m[m.faces[0][1] as usize], "no area");
        check(&|m| m.faces.clear(), "no faces");
        check(
            &|m| {
                let count = m.vertices_m.len() as u32;
                let copy: Vec<[u32; 3]> = m.faces.iter().map(|f| f.map(|v| v + count)).collect();
                m.faces.extend(copy);
                m.vertices_m.extend_from_within(..);
            },
            "2 separate parts",
        );
        check(
            &|m| {
                // Two spheres that share vertex 0.
                let count = m.vertices_m.len() as u32;
                let shift = |v: u32| if v == 0 { 0 } else { v + count - 1 };
                let copy: Vec<[u32; 3]> = m.faces.iter().map(|f| f.map(shift)).collect();
                let around = 2.0 * m.vertices_m[0];
                let mirrored: Vec<Vec3> = m.vertices_m[1..].iter().map(|x| x + around).collect();
                m.faces.extend(copy);
                m.vertices_m.extend(mirrored);
            },
            "vertex 0 joins two sheets",
        );
    }
}
