//! How far each spring is strained and what it carries, for eyes and reports; never part of a step.
//!
//! `ε = l/l₀ − 1` and `F = k (l − l₀)` in newtons, pulling above 0 (Zhang et al., Eq. (3), second line); a spring that pulls
//! only carries nothing while it is shorter than at rest. A rest length of zero has no strain: ε is 0 there.
//! Each spring is visited once, in the order of the network. Deliberately absent: memory for results; the caller keeps what it
//! wants of them.

use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;

/// One spring at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringLoad {
    /// Its two nodes.
    pub nodes: [u32; 2],
    /// Force along it, newtons; pulling above 0.
    pub force_n: f64,
    /// `l/l₀ − 1`.
    pub strain: f64,
}

/// Shows every spring to `each`.
pub fn measure(network: &SpringNetwork, position_m: &[Vec3], mut each: impl FnMut(SpringLoad)) {
    // Ascending, as the springs are.
    let mut pulls_only = network.pulls_only.iter().copied().peekable();
    for (index, s) in (0_u32..).zip(&network.springs) {
        let stretch_m = (position_m[s.b as usize] - position_m[s.a as usize]).norm() - s.rest_length_m;
        let is_silent = pulls_only.next_if_eq(&index).is_some() && stretch_m < 0.0;
        each(SpringLoad {
            nodes: [s.a, s.b],
            force_n: if is_silent { 0.0 } else { s.stiffness_n_per_m * stretch_m },
            strain: if s.rest_length_m > 0.0 { stretch_m / s.rest_length_m } else { 0.0 },
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::force::gather;
    use crate::tissue::network::{Spring, SpringFamily};

    fn network(x: &[Vec3], springs: Vec<Spring>) -> SpringNetwork {
        let n = x.len();
        SpringNetwork::new(x.to_vec(), vec![1.0; n], vec![0.0; n], vec![0; n], springs).unwrap()
    }

    fn spring(a: u32, b: u32, k: f64, rest: f64) -> Spring {
        Spring { a, b, stiffness_n_per_m: k, rest_length_m: rest, family: SpringFamily::Structural }
    }

    #[test]
    fn eq3_a_stretched_and_a_compressed_spring_by_hand() {
        let x = [Vec3::zeros(), Vec3::new(3e-3, 4e-3, 0.0), Vec3::new(0.0, 0.0, 1e-3)];
        let springs = vec![spring(0, 1, 160.0, 4e-3), spring(0, 2, 100.0, 2e-3), spring(1, 2, 50.0, 0.0)];
        let mut seen = Vec::new();
        measure(&network(&x, springs), &x, |load| seen.push(load));
        // 160 N/m over 1 mm of 4; 100 N/m over -1 mm of 2; a rest length of zero has a force and no strain.
        let expected = [([0, 1], 0.16, 0.25), ([0, 2], -0.1, -0.5), ([1, 2], 50.0 * 26.0_f64.sqrt() * 1e-3, 0.0)];
        for (load, (nodes, force_n, strain)) in seen.iter().zip(expected) {
            // Rounding of one square root.
            assert!(load.nodes == nodes && (load.force_n - force_n).abs() < 1e-15, "{load:?}");
            assert!((load.strain - strain).abs() < 1e-14, "{load:?}");
        }
        assert_eq!(seen.len(), 3);
    }

    #[test]
    fn eq3_the_loads_add_up_to_the_force_on_every_node() {
        // A tetrahedron with a spring that pulls only; positions without symmetry.
        let x: Vec<Vec3> = (0..4_u8)
            .map(f64::from)
            .map(|i| Vec3::new((1.7 * i).sin(), (2.3 * i).cos(), (0.9 * i * i).sin()) * 1e-2)
            .collect();
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        let springs = pairs.map(|(a, b)| spring(a, b, 100.0 + f64::from(a * 7 + b), 9e-3)).to_vec();
        let mut net = network(&x, springs);
        net.read_as_relaxed(0.8, |s| s.a == 0);
        let mut expected = vec![Vec3::zeros(); 4];
        gather(&net, &x, &mut expected);
        let mut sum = [Vec3::zeros(); 4];
        measure(&net, &x, |load| {
            let [a, b] = load.nodes.map(|n| n as usize);
            let pull = (x[b] - x[a]).normalize() * load.force_n;
            sum[a] += pull;
            sum[b] -= pull;
        });
        for (sum, expected) in sum.iter().zip(&expected) {
            assert!((sum - expected).norm() < 1e-14, "{sum} {expected}");
        }
    }
}
