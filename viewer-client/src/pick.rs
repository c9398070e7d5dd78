//! Which node a person points at: the nearest triangle that the ray meets, then the nearest of its corners.
//!
//! Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997: with e₁ = b − a, e₂ = c − a,
//! p = d × e₂, the determinant e₁·p, then the barycentric coordinates u, v and the distance t. Both sides count: a wound is looked
//! at from inside, too. Metres, scene frame. Deliberately absent: a search tree, since one click looks once.

use nalgebra::{Point3, Vector3};
use protocol::scene_frame::FrameNode;

/// A triangle whose plane is seen this much from the side is not met.
const PARALLEL: f32 = 1e-20;

/// What lies under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Nearest corner.
    pub node: u32,
    /// Where the ray meets the tissue, metres.
    pub at_m: Point3<f32>,
    /// Distance along the ray, in lengths of its direction.
    pub distance: f32,
}

/// The first triangle along the ray, `None` when it meets none.
#[must_use]
pub fn nearest(origin: &Point3<f32>, direction: &Vector3<f32>, nodes: &[FrameNode], triangles: &[u32]) -> Option<Hit> {
    let corner = |index: u32| nodes.get(index as usize).map(|n| Point3::from(n.position_m));
    let mut best: Option<(f32, &[u32])> = None;
    for triangle in triangles.chunks_exact(3) {
        let (Some(a), Some(b), Some(c)) = (corner(triangle[0]), corner(triangle[1]), corner(triangle[2])) else {
            continue;
        };
        if let Some(t) = meets(origin, direction, [a, b, c])
            && best.is_none_or(|(nearest, _)| t < nearest)
        {
            best = Some((t, triangle));
        }
    }
    let (distance, triangle) = best?;
    let at_m = origin + direction * distance;
    let squared = |index: u32| corner(index).map_or(f32::INFINITY, |p| (p - at_m).norm_squared());
    let node = triangle.iter().copied().min_by(|l, r| squared(*l).total_cmp(&squared(*r)))?;
    Some(Hit { node, at_m, distance })
}

/// Distance along the ray at which it meets the triangle, in front of the origin.
fn meets(origin: &Point3<f32>, direction: &Vector3<f32>, [a, b, c]: [Point3<f32>; 3]) -> Option<f32> {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(&e2);
    let determinant = e1.dot(&p);
    if determinant.abs() < PARALLEL {
        return None;
    }
    let s = (origin - a) / determinant;
    let u = s.dot(&p);
    let q = s.cross(&e1);
    let v = direction.dot(&q);
    let t = e2.dot(&q);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use protocol::wire::Field;

    fn nodes(positions: &[[f32; 3]]) -> Vec<FrameNode> {
        positions.iter().map(|p| FrameNode { position_m: *p, ..FrameNode::EMPTY }).collect()
    }

    /// Numbers in −1 … 1, the same ones every time.
    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 0x2545_F491_4F6C_DD1D_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    #[test]
    fn the_nearest_of_a_cloud_is_that_of_solving_every_triangle() {
        let mut next = numbers();
        let mut hits = 0;
        for _ in 0..200 {
            let cloud: Vec<[f32; 3]> = (0..60).map(|_| [next(), next(), next()]).collect();
            let triangles: Vec<u32> = (0..60).collect();
            let origin = Point3::new(3.0 * next(), 3.0 * next(), -3.0);
            let direction = Vector3::new(next(), next(), next()) - origin.coords;
            let found = nearest(&origin, &direction, &nodes(&cloud), &triangles);
            // o + t d = a + u e1 + v e2 as three equations, in double precision.
            let mut reference: Option<(f64, usize)> = None;
            for i in 0..20 {
                let [a, b, c] = [0, 1, 2].map(|k| Vector3::from(cloud[3 * i + k]).cast::<f64>());
                let (o, d) = (origin.coords.cast::<f64>(), direction.cast::<f64>());
                let Some(inverse) = Matrix3::from_columns(&[b - a, c - a, -d]).try_inverse() else { continue };
                let x = inverse * (o - a);
                if x.x >= 0.0 && x.y >= 0.0 && x.x + x.y <= 1.0 && x.z > 0.0 && reference.is_none_or(|(t, _)| x.z < t) {
                    reference = Some((x.z, i));
                }
            }
            assert_eq!(found.is_some(), reference.is_some());
            if let (Some(hit), Some((t, i))) = (found, reference) {
                hits += 1;
                // Single precision against double.
                assert!((f64::from(hit.distance) - t).abs() < 1e-4, "{} against {t}", hit.distance);
                assert!((3 * i..3 * i + 3).contains(&(hit.node as usize)));
            }
        }
        assert!(hits > 50, "only {hits} rays met anything");
    }

    #[test]
    fn the_nearer_sheet_wins_and_its_nearest_corner_is_named() {
        let far = [[0.0, 0.0, -2.0], [1.0, 0.0, -2.0], [0.0, 1.0, -2.0]];
        let near = [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0]];
        let nodes = nodes(&[far, near].concat());
        let ray = |x: f32, y: f32| {
            nearest(&Point3::new(x, y, 0.0), &-Vector3::z(), &nodes, &[0, 1, 2, 5, 4, 3]).map(|hit| hit.node)
        };
        assert_eq!(ray(0.8, 0.1), Some(4));
        assert_eq!(ray(0.1, 0.8), Some(5));
        assert_eq!(ray(0.9, 0.9), None);
        let behind = nearest(&Point3::origin(), &Vector3::z(), &nodes, &[0, 1, 2]);
        assert_eq!(behind, None);
    }

    #[test]
    fn an_index_without_a_node_is_passed_over() {
        assert_eq!(nearest(&Point3::origin(), &Vector3::z(), &[], &[0, 1, 2]), None);
    }
}
