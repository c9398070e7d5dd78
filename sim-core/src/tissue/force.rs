//! Spring forces, gathered per node.
//!
//! `F_i = Σ_j k_ij (|x_j − x_i| − L_ij) (x_j − x_i)/|x_j − x_i|` in newtons (Zhang et al., Eq. (3),
//! second line, in the plain bilateral reading). Each node reads its own compressed row and writes
//! its own force, so rows may run in any order or side by side; the inner loop has no branch.
//! Springs whose ends coincide have no direction: they give no force and are counted. A spring that pulls only
//! gives nothing while it is shorter than at rest.
//! Deliberately absent: drag (the integrators treat it), attachments and stitches (constraints).

use crate::tissue::network::{HalfEdges, SpringNetwork};
use crate::vector::{Mat3, Vec3};

/// Ends closer than this count as coincident, metres: far below any mesh, far above underflow of the square.
pub const COINCIDENT_M: f64 = 1e-12;

/// Springs of a row that are worked on side by side.
const LANES: usize = 4;

/// Writes the spring force on every node. Returns the number of half-springs whose ends coincide.
pub fn gather(network: &SpringNetwork, position_m: &[Vec3], force_n: &mut [Vec3]) -> u32 {
    let edges = &network.half_edges;
    let mut coincident = 0;
    for (node, force) in force_n.iter_mut().enumerate() {
        let (f, c) = row_force(edges, node, position_m);
        *force = f;
        coincident += c;
    }
    coincident
}

/// Spring force on one node and the number of its springs whose ends coincide.
#[inline]
pub(crate) fn row_force(edges: &HalfEdges, node: usize, position_m: &[Vec3]) -> (Vec3, u32) {
    let row = edges.row(node);
    let x = position_m[node];
    let (neighbours, stiffness, rest) =
        (&edges.neighbour[row.clone()], &edges.stiffness_n_per_m[row.clone()], &edges.rest_length_m[row]);
    let mut sum = Vec3::zeros();
    let mut coincident = 0;
    let (wide_j, tail_j) = neighbours.as_chunks::<LANES>();
    let (wide_k, tail_k) = stiffness.as_chunks::<LANES>();
    let (wide_rest, tail_rest) = rest.as_chunks::<LANES>();
    for ((j, k), rest) in wide_j.iter().zip(wide_k).zip(wide_rest) {
        let d = j.map(|j| position_m[j as usize] - x);
        let squared = d.map(|d| d.norm_squared());
        let length = squared.map(f64::sqrt);
        coincident += length.iter().filter(|l| **l < COINCIDENT_M).count() as u32;
        let floored = length.map(|l| l.max(COINCIDENT_M));
        let scale: [f64; LANES] = std::array::from_fn(|lane| k[lane] - k[lane] * rest[lane] / floored[lane]);
        for (d, scale) in d.iter().zip(scale) {
            sum += d * scale;
        }
    }
    for ((&j, &k), &rest) in tail_j.iter().zip(tail_k).zip(tail_rest) {
        let d = position_m[j as usize] - x;
        let length = d.norm();
        coincident += u32::from(length < COINCIDENT_M);
        sum += d * (k - k * rest / length.max(COINCIDENT_M));
    }
    for e in edges.row(node).filter(|&e| edges.pulls_only[e]) {
        let other = &position_m[edges.neighbour[e] as usize];
        sum -= push(&x, other, edges.stiffness_n_per_m[e], edges.rest_length_m[e]);
    }
    (sum, coincident)
}

/// What a bilateral spring pushes its end at `from` with: zero at rest length and beyond.
#[must_use]
#[inline]
pub(crate) fn push(from: &Vec3, to: &Vec3, stiffness_n_per_m: f64, rest_length_m: f64) -> Vec3 {
    if (to - from).norm() < rest_length_m {
        eq3_spring_force(from, to, stiffness_n_per_m, rest_length_m)
    } else {
        Vec3::zeros()
    }
}

/// Whether a half-spring acts between these places: one that pulls only does not while it is shorter than at rest.
#[must_use]
#[inline]
pub(crate) fn acts(edges: &HalfEdges, half_spring: usize, from: &Vec3, to: &Vec3) -> bool {
    !edges.pulls_only[half_spring] || (to - from).norm() >= edges.rest_length_m[half_spring]
}

/// Force of one spring on its end at `from`, towards (or away from) `to`, newtons.
#[must_use]
#[inline]
pub fn eq3_spring_force(from: &Vec3, to: &Vec3, stiffness_n_per_m: f64, rest_length_m: f64) -> Vec3 {
    let d = to - from;
    d * (stiffness_n_per_m - stiffness_n_per_m * rest_length_m / d.norm().max(COINCIDENT_M))
}

/// Tangent stiffness of one spring, `k (n nᵀ + g (I − n nᵀ))`, with `g = max(1 − L/l, 0)` so that a
/// compressed spring never counts as negative; zero for coincident ends, newtons per metre.
#[must_use]
#[inline]
pub fn spring_stiffness(from: &Vec3, to: &Vec3, stiffness_n_per_m: f64, rest_length_m: f64) -> Mat3 {
    let d = to - from;
    let length = d.norm();
    if length < COINCIDENT_M {
        return Mat3::zeros();
    }
    let n = d / length;
    let g = (1.0 - rest_length_m / length).max(0.0);
    (n * n.transpose() * (1.0 - g) + Mat3::identity() * g) * stiffness_n_per_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::network::{Spring, SpringFamily};

    fn spring(a: u32, b: u32, k: f64, rest: f64) -> Spring {
        Spring { a, b, stiffness_n_per_m: k, rest_length_m: rest, family: SpringFamily::Structural }
    }

    fn network(x: &[Vec3], springs: Vec<Spring>) -> SpringNetwork {
        let n = x.len();
        SpringNetwork::new(x.to_vec(), vec![1.0; n], vec![0.0; n], vec![0; n], springs).unwrap()
    }

    #[test]
    fn eq3_two_nodes_by_hand() {
        // 3-4-5 triangle: length 5 mm, rest 4 mm, k 160 N/m: 0.16 N along (0.6, 0.8, 0).
        let x = [Vec3::zeros(), Vec3::new(3e-3, 4e-3, 0.0)];
        let net = network(&x, vec![spring(0, 1, 160.0, 4e-3)]);
        let mut f = vec![Vec3::zeros(); 2];
        assert_eq!(gather(&net, &x, &mut f), 0);
        let expected = Vec3::new(0.096, 0.128, 0.0);
        // Rounding of one square root and one division.
        assert!((f[0] - expected).norm() < 1e-15 && (f[1] + expected).norm() < 1e-15, "{f:?}");
        assert_eq!(eq3_spring_force(&x[0], &x[1], 160.0, 4e-3), f[0]);
    }

    #[test]
    fn coincident_ends_give_no_force_and_are_counted() {
        let x = [Vec3::new(0.1, 0.2, 0.3); 2];
        let net = network(&x, vec![spring(0, 1, 160.0, 4e-3)]);
        let mut f = vec![Vec3::repeat(7.0); 2];
        assert_eq!(gather(&net, &x, &mut f), 2);
        assert_eq!(f, vec![Vec3::zeros(); 2]);
    }

    #[test]
    fn eq3_a_spring_that_pulls_only_is_silent_below_its_rest_length() {
        let x = [Vec3::zeros(), Vec3::new(3e-3, 0.0, 0.0), Vec3::new(0.0, 5e-3, 0.0)];
        let mut net = network(&x, vec![spring(0, 1, 160.0, 4e-3), spring(0, 2, 160.0, 4e-3)]);
        net.read_as_relaxed(0.8, |_| true);
        let mut f = vec![Vec3::zeros(); 3];
        gather(&net, &x, &mut f);
        // Only the longer one acts, with 0.8 · 160 N/m over 1 mm.
        assert!((f[0] - Vec3::new(0.0, 0.128, 0.0)).norm() < 1e-15, "{}", f[0]);
        assert_eq!(f[1], Vec3::zeros());
    }

    #[test]
    fn zero_rest_length_is_a_plain_linear_spring() {
        let x = [Vec3::zeros(), Vec3::new(0.0, 0.0, 2e-3)];
        let net = network(&x, vec![spring(0, 1, 100.0, 0.0)]);
        let mut f = vec![Vec3::zeros(); 2];
        gather(&net, &x, &mut f);
        assert_eq!(f[0], Vec3::new(0.0, 0.0, 0.2));
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_force() {
        let (a, b) = (Vec3::new(1e-3, -2e-3, 0.5e-3), Vec3::new(4e-3, 1e-3, 2e-3));
        let (k, rest) = (180.0, 3e-3);
        let tangent = spring_stiffness(&a, &b, k, rest);
        let step = 1e-8;
        for axis in 0..3 {
            let mut shift = Vec3::zeros();
            shift[axis] = step;
            let difference = eq3_spring_force(&(a - shift), &b, k, rest) - eq3_spring_force(&(a + shift), &b, k, rest);
            // Central differences at 1e-8 m of forces known to about 1e-16 N: relative 1e-6 is safe.
            assert!((difference / (2.0 * step) - tangent.column(axis)).norm() < 1e-6 * k);
        }
    }
}
