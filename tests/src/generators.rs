//! Small networks for tests, all of them valid. SI units; equal arguments give equal networks.

use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};
use sim_core::vector::Vec3;

/// Straight chain of `links` equal springs along x; both ends fixed.
#[must_use]
pub fn chain(links: usize, spacing_m: f64, stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> SpringNetwork {
    let nodes = links + 1;
    let rest = (0..nodes).map(|i| Vec3::new(i as f64 * spacing_m, 0.0, 0.0)).collect();
    let fixed = (0..nodes).map(|i| u8::from(i == 0 || i == links)).collect();
    let springs =
        (0..links).map(|i| spring(i, i + 1, stiffness_n_per_m, spacing_m, SpringFamily::Structural)).collect();
    build(rest, mass_kg, drag_n_s_per_m, fixed, springs)
}

/// Sheet of `columns` × `rows` nodes in the xy plane, springs `k` along the sides (halved on the rim) and `k/2` along
/// both diagonals: the isotropic lattice with `E t = 4k/3`. Nothing is fixed.
#[must_use]
pub fn sheet(
    columns: usize,
    rows: usize,
    spacing_m: f64,
    stiffness_n_per_m: f64,
    mass_kg: f64,
    drag_n_s_per_m: f64,
) -> SpringNetwork {
    let at = |c: usize, r: usize| r * columns + c;
    let rest = (0..columns * rows)
        .map(|i| Vec3::new((i % columns) as f64 * spacing_m, (i / columns) as f64 * spacing_m, 0.0))
        .collect();
    let half_if = |rim: bool| if rim { 0.5 * stiffness_n_per_m } else { stiffness_n_per_m };
    let mut springs = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            if c + 1 < columns {
                let k = half_if(r == 0 || r + 1 == rows);
                springs.push(spring(at(c, r), at(c + 1, r), k, spacing_m, SpringFamily::Structural));
            }
            if r + 1 < rows {
                let k = half_if(c == 0 || c + 1 == columns);
                springs.push(spring(at(c, r), at(c, r + 1), k, spacing_m, SpringFamily::Structural));
            }
            if c + 1 < columns && r + 1 < rows {
                let (k, length) = (0.5 * stiffness_n_per_m, spacing_m * 2.0_f64.sqrt());
                springs.push(spring(at(c, r), at(c + 1, r + 1), k, length, SpringFamily::Shear));
                springs.push(spring(at(c + 1, r), at(c, r + 1), k, length, SpringFamily::Shear));
            }
        }
    }
    build(rest, mass_kg, drag_n_s_per_m, vec![0; columns * rows], springs)
}

/// Closed ring of `links` nodes of `radius_m` in the xy plane. Nothing is fixed.
#[must_use]
pub fn ring(links: usize, radius_m: f64, stiffness_n_per_m: f64, mass_kg: f64, drag_n_s_per_m: f64) -> SpringNetwork {
    let angle = |i: usize| 2.0 * std::f64::consts::PI * i as f64 / links as f64;
    let rest = (0..links).map(|i| Vec3::new(radius_m * angle(i).cos(), radius_m * angle(i).sin(), 0.0)).collect();
    let length = 2.0 * radius_m * (std::f64::consts::PI / links as f64).sin();
    let springs =
        (0..links).map(|i| spring(i, (i + 1) % links, stiffness_n_per_m, length, SpringFamily::Structural)).collect();
    build(rest, mass_kg, drag_n_s_per_m, vec![0; links], springs)
}

/// Connected cloud of `nodes` (at least 2) in a cube of 0.1 m with uneven springs and masses, from a seed.
#[must_use]
pub fn cloud(seed: u64, nodes: usize) -> SpringNetwork {
    let mut chance = SplitMix(seed);
    let rest: Vec<Vec3> = (0..nodes).map(|_| Vec3::from_fn(|_, _| 0.1 * chance.unit())).collect();
    let mass = (0..nodes).map(|_| 1e-4 + 1e-3 * chance.unit()).collect();
    let mut springs = Vec::new();
    for b in 1..nodes {
        for a in 0..b {
            // A tree keeps it connected; every third further pair adds loops.
            if a + 1 == b || chance.unit() < 0.33 {
                let length = (rest[b] - rest[a]).norm() * (0.9 + 0.2 * chance.unit());
                springs.push(spring(a, b, 20.0 + 200.0 * chance.unit(), length, SpringFamily::Structural));
            }
        }
    }
    SpringNetwork::new(rest, mass, vec![0.0; nodes], vec![0; nodes], springs).expect("a cloud is a valid network")
}

/// The same network with exactly the nodes fixed that `held` names.
#[must_use]
pub fn with_fixed(network: SpringNetwork, held: impl Fn(usize) -> bool) -> SpringNetwork {
    let fixed = (0..network.node_count()).map(|i| u8::from(held(i))).collect();
    SpringNetwork::new(network.rest_m, network.mass_kg, network.drag_n_s_per_m, fixed, network.springs)
        .expect("fixing nodes keeps a network valid")
}

/// The same network in the same shape with every spring stretched by `strain`.
#[must_use]
pub fn pre_strained(mut network: SpringNetwork, strain: f64) -> SpringNetwork {
    for spring in &mut network.springs {
        spring.rest_length_m /= 1.0 + strain;
    }
    SpringNetwork::new(network.rest_m, network.mass_kg, network.drag_n_s_per_m, network.fixed, network.springs)
        .expect("shorter springs keep a network valid")
}

/// Whether node `i` lies on the rim of a sheet of `columns` × `rows` nodes.
#[must_use]
pub fn on_rim(i: usize, columns: usize, rows: usize) -> bool {
    let (c, r) = (i % columns, i / columns);
    c == 0 || r == 0 || c + 1 == columns || r + 1 == rows
}

fn spring(a: usize, b: usize, stiffness_n_per_m: f64, rest_length_m: f64, family: SpringFamily) -> Spring {
    Spring { a: a as u32, b: b as u32, stiffness_n_per_m, rest_length_m, family }
}

fn build(rest: Vec<Vec3>, mass_kg: f64, drag_n_s_per_m: f64, fixed: Vec<u8>, springs: Vec<Spring>) -> SpringNetwork {
    let nodes = rest.len();
    SpringNetwork::new(rest, vec![mass_kg; nodes], vec![drag_n_s_per_m; nodes], fixed, springs)
        .expect("the generators build valid networks")
}

/// `SplitMix64`: a seed gives the same numbers everywhere.
#[derive(Clone, Copy, Debug)]
pub struct SplitMix(pub u64);

impl SplitMix {
    /// Next number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_shapes() {
        assert_eq!(chain(5, 0.1, 1.0, 1.0, 0.0).springs.len(), 5);
        // 4 × 3 nodes: 3·3 + 4·2 sides and 2·3·2 diagonals.
        assert_eq!(sheet(4, 3, 0.1, 1.0, 1.0, 0.0).springs.len(), 29);
        assert_eq!(ring(7, 0.1, 1.0, 1.0, 0.0).springs.len(), 7);
    }

    #[test]
    fn a_seed_gives_one_cloud() {
        assert_eq!(cloud(3, 12), cloud(3, 12));
        assert_ne!(cloud(3, 12).rest_m, cloud(4, 12).rest_m);
    }
}
