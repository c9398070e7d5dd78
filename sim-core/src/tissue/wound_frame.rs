//! From a mesh's own frame to the wound frame: x across the wound, y along it, z out of the tissue,
//! origin in its middle.
//!
//! x' = R·(x − x_site) with rows of R: along × n, along, n; n the mean surface normal within half a
//! wound's length of the site. After the path is straight its middle becomes the origin. Metres.

use super::model::TissueError;
use super::slit_path::nearest;
use super::triangle_mesh::TriangleMesh;
use crate::vector::{Mat3, Vec3};

/// Where the wound lies on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoundSite {
    /// The middle is the vertex nearest to this point; a far point picks the vertex farthest out in
    /// its direction.
    pub near_m: Vec3,
    /// Direction of the wound; its part along the surface counts.
    pub along: Vec3,
}

/// Turns and moves the mesh: site to the origin, surface normal (mean over the wound's length) to
/// z, wound to y.
pub(super) fn to_wound_frame(mesh: &mut TriangleMesh, site: &WoundSite, length_m: f64) -> Result<(), TissueError> {
    let lost = |what: &str| TissueError::Wound {
        what: what.to_owned(),
        remedy: "give a finite site and a direction that runs along the surface there",
    };
    if !site.near_m.iter().chain(site.along.iter()).all(|v| v.is_finite()) {
        return Err(lost("its site or direction is not a finite vector"));
    }
    let origin = mesh.vertices_m[nearest(mesh, site.near_m) as usize];
    let normals = mesh.vertex_normals();
    let own = normals[nearest(mesh, origin) as usize];
    let around = |(x, n): &(&Vec3, &Vec3)| (*x - origin).norm() <= 0.5 * length_m && n.dot(&own) > 0.0;
    let mean: Vec3 = mesh.vertices_m.iter().zip(&normals).filter(around).map(|(_, n)| *n).sum();
    let outward = mean.try_normalize(0.0).ok_or_else(|| lost("the surface has no direction at its site"))?;
    let direction = site.along.try_normalize(f64::MIN_POSITIVE).ok_or_else(|| lost("its direction is zero"))?;
    let along = (direction - outward * outward.dot(&direction))
        .try_normalize(1.0e-3)
        .ok_or_else(|| lost("its direction points out of the surface"))?;
    let rotation = Mat3::from_rows(&[along.cross(&outward).transpose(), along.transpose(), outward.transpose()]);
    mesh.vertices_m.iter_mut().for_each(|x| *x = rotation * (*x - origin));
    Ok(())
}

/// Moves the middle of the straightened path to the origin.
pub(super) fn centre(mesh: &mut TriangleMesh, path: &[u32]) {
    let line: Vec<Vec3> = path.iter().map(|v| mesh.vertices_m[*v as usize]).collect();
    let y = f64::midpoint(line[0].y, line[line.len() - 1].y);
    let z = line
        .windows(2)
        .find(|w| w[1].y >= y)
        .map_or(0.0, |w| w[0].z + (w[1].z - w[0].z) * (y - w[0].y) / (w[1].y - w[0].y));
    mesh.vertices_m.iter_mut().for_each(|x| *x -= Vec3::new(0.0, y, z));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_mesh_comes_back_to_the_same_frame() {
        let straight = TriangleMesh::lobe(Vec3::new(0.05, 0.07, 0.03), 0.2, 3).unwrap();
        let turn = *nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0).matrix();
        let move_by = Vec3::new(1.0, -2.0, 0.5);
        let mut turned = straight.clone();
        turned.vertices_m.iter_mut().for_each(|x| *x = turn * *x + move_by);
        let near = Vec3::new(0.001, 0.002, 0.05);
        let build = |mesh: &TriangleMesh, near_m: Vec3, along: Vec3| {
            let mut mesh = mesh.clone();
            to_wound_frame(&mut mesh, &WoundSite { near_m, along }, 0.03).unwrap();
            mesh
        };
        let one = build(&straight, near, Vec3::y());
        let other = build(&turned, turn * near + move_by, turn * Vec3::y());
        for (a, b) in one.vertices_m.iter().zip(&other.vertices_m) {
            assert!((a - b).norm() < 1.0e-14);
        }
        // The site is the origin, the surface there looks up, the body lies below and keeps its volume.
        let site = nearest(&one, Vec3::zeros()) as usize;
        assert!(one.vertices_m[site].norm() < 1.0e-15 && one.vertex_normals()[site].z > 0.95);
        assert!(one.vertices_m.iter().map(|x| x.z).sum::<f64>() < 0.0);
        assert!((one.volume() / straight.volume() - 1.0).abs() < 1.0e-12);
    }

    #[test]
    fn a_direction_out_of_the_surface_is_refused() {
        let mut sphere = TriangleMesh::icosphere(2).unwrap();
        let pole = sphere.vertices_m[0];
        let site = WoundSite { near_m: pole, along: pole };
        let text = to_wound_frame(&mut sphere, &site, 0.1).unwrap_err().to_string();
        assert!(text.contains("points out of the surface"), "{text}");
    }
}
