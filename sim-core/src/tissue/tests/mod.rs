//! Checks of the tissue dynamics against closed forms and other methods, and their fixtures.
//!
//! Fixtures: a square sheet in the plane z = 0 with structural and shear springs of the same
//! stiffness (the skin net of Zhang et al., Table 2), and single nodes held by springs.
//! Deliberately absent: the scenes; these nets are as small as the claim allows.

mod choice;
mod handle;
mod implicit;
mod order;
mod pair;
mod port;
mod precision;
mod regulation;
mod sleep;
mod stability;
mod wave;

use crate::tissue::network::{Spring, SpringFamily, SpringNetwork};
use crate::tissue::patch_set::PatchSet;
use crate::vector::Vec3;

/// Which nodes of a fixture stay.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rim {
    Fixed,
    Free,
}

/// A net with the same mass, drag and stiffness everywhere.
#[derive(Clone, Copy)]
pub(super) struct Net {
    pub(super) side: usize,
    pub(super) spacing_m: f64,
    pub(super) stiffness_n_per_m: f64,
    pub(super) mass_kg: f64,
    pub(super) drag_n_s_per_m: f64,
    /// Rest length over built length.
    pub(super) rest_ratio: f64,
    pub(super) rim: Rim,
}

/// Skin of Table 2 on an 11 × 11 net of 5 mm, 5 % pre-stretched.
pub(super) const SKIN: Net = Net {
    side: 11,
    spacing_m: 5e-3,
    stiffness_n_per_m: 160.0,
    mass_kg: 4.8e-5,
    drag_n_s_per_m: 3.0,
    rest_ratio: 1.0 / 1.05,
    rim: Rim::Fixed,
};

impl Net {
    pub(super) fn node(&self, i: usize, j: usize) -> u32 {
        (i + self.side * j) as u32
    }

    pub(super) fn build(&self) -> SpringNetwork {
        let n = self.side;
        let place = |at: usize| Vec3::new((at % n) as f64, (at / n) as f64, 0.0) * self.spacing_m;
        let rest: Vec<Vec3> = (0..n * n).map(place).collect();
        let mut springs = Vec::new();
        for j in 0..n {
            for i in 0..n {
                for (di, dj, family) in [
                    (1, 0, SpringFamily::Structural),
                    (0, 1, SpringFamily::Structural),
                    (1, 1, SpringFamily::Shear),
                    (-1, 1, SpringFamily::Shear),
                ] {
                    let (p, q) = (i as i64 + di, j as i64 + dj);
                    if (0..n as i64).contains(&p) && (0..n as i64).contains(&q) {
                        let (a, b) = (self.node(i, j), self.node(p as usize, q as usize));
                        let length = (rest[b as usize] - rest[a as usize]).norm();
                        springs.push(Spring {
                            a,
                            b,
                            stiffness_n_per_m: self.stiffness_n_per_m,
                            rest_length_m: length * self.rest_ratio,
                            family,
                        });
                    }
                }
            }
        }
        let on_rim = |at: usize| [at % n, at / n].iter().any(|c| *c == 0 || *c == n - 1);
        let fixed = (0..n * n).map(|at| u8::from(self.rim == Rim::Fixed && on_rim(at))).collect();
        SpringNetwork::new(rest, vec![self.mass_kg; n * n], vec![self.drag_n_s_per_m; n * n], fixed, springs)
            .expect("the fixture is a valid network")
    }

    /// A plus-shaped patch of five nodes of equal weight around a node.
    fn plus(&self, i: usize, j: usize) -> Vec<u32> {
        [(i, j), (i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)].iter().map(|&(i, j)| self.node(i, j)).collect()
    }

    /// Followers around a node within `radius_m` and their built distances, the node itself left out.
    fn followers(&self, i: usize, j: usize, radius_m: f64) -> Vec<(u32, f64)> {
        let network = self.build();
        let center = network.rest_m[self.node(i, j) as usize];
        let distances = network.rest_m.iter().enumerate().map(|(n, x)| (n as u32, (x - center).norm()));
        distances.filter(|(_, d)| *d > 0.0 && *d <= radius_m).collect()
    }
}

/// Patches of equal weights.
fn even_patches(node_count: usize, patches: &[Vec<u32>]) -> PatchSet {
    let weights: Vec<Vec<f64>> = patches.iter().map(|p| vec![1.0 / p.len() as f64; p.len()]).collect();
    PatchSet::new(node_count, patches.iter().map(Vec::as_slice).zip(weights.iter().map(Vec::as_slice)))
        .expect("the fixture's patches are valid")
}

/// Free nodes at the given places, without springs.
pub(super) fn dust(places: &[Vec3], mass_kg: f64, drag_n_s_per_m: f64) -> SpringNetwork {
    let n = places.len();
    SpringNetwork::new(places.to_vec(), vec![mass_kg; n], vec![drag_n_s_per_m; n], vec![0; n], Vec::new())
        .expect("the fixture is a valid network")
}
