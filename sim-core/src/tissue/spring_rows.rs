//! The springs of a network laid out for the force sweep: each spring once, in the row of its lower node.
//!
//! `F_a += (k − k L / |x_b − x_a|) (x_b − x_a)`, `F_b −=` the same (Zhang et al., Eq. (3), second line), with `k L`
//! stored. One square root and one division per spring instead of two of each in a gather; the lower node's sum stays in
//! registers, four springs are worked on side by side. The order is fixed: equal inputs give equal bits.
//! Springs that pull only are few: their push is taken out again after the sweep.
//! Deliberately absent: drag (the integrators treat it), attachments and stitches (constraints).

use crate::tissue::force::{COINCIDENT_M, push};
use crate::tissue::network::{Spring, SpringNetwork};
use crate::vector::Vec3;

/// Springs worked on side by side.
const LANES: usize = 4;

/// All springs by their lower node.
#[derive(Clone, Debug)]
pub struct SpringRows {
    /// First spring of each node, one more entry than nodes.
    start: Vec<u32>,
    upper: Vec<u32>,
    stiffness_n_per_m: Vec<f64>,
    /// `k L`, newtons.
    preload_n: Vec<f64>,
    /// Springs that pull only.
    pulls_only: Vec<Spring>,
}

impl SpringRows {
    /// Lays out a network.
    #[must_use]
    pub fn new(network: &SpringNetwork) -> Self {
        let springs = &network.springs;
        let mut start = vec![0_u32; network.node_count() + 1];
        for s in springs {
            start[s.a as usize + 1] += 1;
        }
        for node in 0..network.node_count() {
            start[node + 1] += start[node];
        }
        // The network keeps its springs sorted by (a, b): they lie in row order already.
        Self {
            start,
            upper: springs.iter().map(|s| s.b).collect(),
            stiffness_n_per_m: springs.iter().map(|s| s.stiffness_n_per_m).collect(),
            preload_n: springs.iter().map(|s| s.stiffness_n_per_m * s.rest_length_m).collect(),
            pulls_only: network.pulls_only.iter().map(|&i| springs[i as usize]).collect(),
        }
    }

    /// Writes the spring force on every node. Returns the number of springs whose ends coincide; they give no force.
    pub fn sweep(&self, position_m: &[Vec3], force_n: &mut [Vec3]) -> u32 {
        force_n.fill(Vec3::zeros());
        let mut coincident = 0;
        for (a, ends) in self.start.windows(2).enumerate() {
            let row = ends[0] as usize..ends[1] as usize;
            let x = position_m[a];
            let mut own = Vec3::zeros();
            let (wide_b, tail_b) = self.upper[row.clone()].as_chunks::<LANES>();
            let (wide_k, tail_k) = self.stiffness_n_per_m[row.clone()].as_chunks::<LANES>();
            let (wide_preload, tail_preload) = self.preload_n[row].as_chunks::<LANES>();
            for ((b, k), preload) in wide_b.iter().zip(wide_k).zip(wide_preload) {
                let d = b.map(|b| position_m[b as usize] - x);
                let length = d.map(|d| d.norm_squared()).map(f64::sqrt);
                coincident += length.iter().filter(|l| **l < COINCIDENT_M).count() as u32;
                let floored = length.map(|l| l.max(COINCIDENT_M));
                let scale: [f64; LANES] = std::array::from_fn(|lane| k[lane] - preload[lane] / floored[lane]);
                for lane in 0..LANES {
                    let force = d[lane] * scale[lane];
                    own += force;
                    force_n[b[lane] as usize] -= force;
                }
            }
            for ((&b, &k), &preload) in tail_b.iter().zip(tail_k).zip(tail_preload) {
                let d = position_m[b as usize] - x;
                let length = d.norm();
                coincident += u32::from(length < COINCIDENT_M);
                let force = d * (k - preload / length.max(COINCIDENT_M));
                own += force;
                force_n[b as usize] -= force;
            }
            force_n[a] += own;
        }
        for s in &self.pulls_only {
            let (a, b) = (s.a as usize, s.b as usize);
            let pushed = push(&position_m[a], &position_m[b], s.stiffness_n_per_m, s.rest_length_m);
            force_n[a] -= pushed;
            force_n[b] += pushed;
        }
        coincident
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::force;
    use crate::tissue::network::SpringFamily;

    /// A ring of nodes, each joined to its next five: rows of five, a block and a remainder.
    fn ring(nodes: u32) -> SpringNetwork {
        let at = |i: u32| {
            let angle = f64::from(i) * 0.37;
            Vec3::new(angle.cos(), angle.sin(), 0.01 * f64::from(i))
        };
        let spring = |a: u32, step: u32| Spring {
            a,
            b: (a + step) % nodes,
            stiffness_n_per_m: 100.0 + f64::from(a),
            rest_length_m: 0.1 * f64::from(step),
            family: SpringFamily::Structural,
        };
        let springs = (0..nodes).flat_map(|a| (1..=5).map(move |step| spring(a, step))).collect();
        let n = nodes as usize;
        SpringNetwork::new((0..nodes).map(at).collect(), vec![1.0; n], vec![0.0; n], vec![0; n], springs).unwrap()
    }

    #[test]
    fn eq3_each_spring_once_gives_the_force_of_the_gather() {
        let mut network = ring(37);
        network.read_as_relaxed(0.7, |s| s.a % 5 == 0);
        let mut plain = vec![Vec3::zeros(); 37];
        let mut rows = plain.clone();
        force::gather(&network, &network.rest_m, &mut plain);
        assert_eq!(SpringRows::new(&network).sweep(&network.rest_m, &mut rows), 0);
        for (a, b) in plain.iter().zip(&rows) {
            // Ten terms of about 100 N summed in another order.
            assert!((a - b).norm() < 1e-12 * a.norm().max(100.0), "{a} {b}");
        }
    }

    #[test]
    fn coincident_ends_give_no_force_and_are_counted() {
        let x = vec![Vec3::new(0.1, 0.2, 0.3); 2];
        let spring =
            Spring { a: 0, b: 1, stiffness_n_per_m: 160.0, rest_length_m: 4e-3, family: SpringFamily::Structural };
        let network = SpringNetwork::new(x.clone(), vec![1.0; 2], vec![0.0; 2], vec![0; 2], vec![spring]).unwrap();
        let mut f = vec![Vec3::repeat(7.0); 2];
        assert!(SpringRows::new(&network).sweep(&x, &mut f) == 1);
        assert_eq!(f, vec![Vec3::zeros(); 2]);
    }
}
