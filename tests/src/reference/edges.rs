//! Springs as a flat list of edges: forces and tangent for the references. Own code, three `f64` per node, no vector type.
//!
//! `F_a = Σ k (ℓ − L) n`, tangent `K = Σ k (g I + (1 − g) n nᵀ)` with `g = 1 − L/ℓ`, which is negative in compression.

use sim_core::tissue::network::SpringNetwork;

/// The springs of a network.
#[derive(Clone, Debug)]
pub(crate) struct EdgeList {
    edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    a: u32,
    b: u32,
    stiffness: f64,
    rest: f64,
}

impl Edge {
    /// From the first end to the second.
    fn apart(&self, x: &[[f64; 3]]) -> [f64; 3] {
        let (p, q) = (x[self.a as usize], x[self.b as usize]);
        [q[0] - p[0], q[1] - p[1], q[2] - p[2]]
    }

    /// L/ℓ; ends that coincide have no direction and no force.
    fn share(&self, length: f64) -> f64 {
        if length > 0.0 { self.rest / length } else { 1.0 }
    }

    /// Adds the force on both ends; `share` is L/ℓ.
    fn pull(&self, apart: [f64; 3], share: f64, out: &mut [[f64; 3]]) {
        let pull = self.stiffness * (1.0 - share);
        let a = &mut out[self.a as usize];
        for i in 0..3 {
            a[i] += pull * apart[i];
        }
        let b = &mut out[self.b as usize];
        for i in 0..3 {
            b[i] -= pull * apart[i];
        }
    }
}

fn length(d: [f64; 3]) -> f64 {
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// Tangent of every spring at one set of positions.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgeTangent {
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    a: u32,
    b: u32,
    across: f64,
    along: f64,
    n: [f64; 3],
}

impl EdgeList {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        let edge = |s: &sim_core::tissue::network::Spring| Edge {
            a: s.a,
            b: s.b,
            stiffness: s.stiffness_n_per_m,
            rest: s.rest_length_m,
        };
        Self { edges: network.springs.iter().map(edge).collect() }
    }

    pub(crate) fn stiffest_n_per_m(&self) -> f64 {
        self.edges.iter().map(|e| e.stiffness).fold(0.0, f64::max)
    }

    /// Writes the spring forces at positions `x` to `out`. Four springs at a time, so that roots and quotients of
    /// several are under way together.
    pub(crate) fn forces(&self, x: &[[f64; 3]], out: &mut [[f64; 3]]) {
        const TOGETHER: usize = 4;
        out.fill([0.0; 3]);
        let (fours, rest) = self.edges.as_chunks::<TOGETHER>();
        for edges in fours {
            let apart: [[f64; 3]; TOGETHER] = std::array::from_fn(|i| edges[i].apart(x));
            let length: [f64; TOGETHER] = std::array::from_fn(|i| length(apart[i]));
            let share: [f64; TOGETHER] = std::array::from_fn(|i| edges[i].share(length[i]));
            for i in 0..TOGETHER {
                edges[i].pull(apart[i], share[i], out);
            }
        }
        for e in rest {
            let apart = e.apart(x);
            e.pull(apart, e.share(length(apart)), out);
        }
    }

    /// Elastic energy, joules.
    pub(crate) fn energy_j(&self, x: &[[f64; 3]]) -> f64 {
        let stored = |e: &Edge| {
            let (p, q) = (x[e.a as usize], x[e.b as usize]);
            let length = (0..3).map(|i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt();
            0.5 * e.stiffness * (length - e.rest).powi(2)
        };
        self.edges.iter().map(stored).sum()
    }

    /// Tangent at `x`.
    pub(crate) fn tangent(&self, x: &[[f64; 3]], compression: Compression, out: &mut EdgeTangent) {
        out.entries.clear();
        out.entries.extend(self.edges.iter().map(|e| {
            let (p, q) = (x[e.a as usize], x[e.b as usize]);
            let d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(f64::MIN_POSITIVE);
            let g = match compression {
                Compression::Exact => 1.0 - e.rest / length,
                Compression::Clamped => (1.0 - e.rest / length).max(0.0),
            };
            let across = e.stiffness * g;
            Entry { a: e.a, b: e.b, across, along: e.stiffness - across, n: d.map(|c| c / length) }
        }));
    }
}

/// How a spring in compression enters the tangent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    /// As it is: the tangent may be indefinite.
    Exact,
    /// As if unstretched: the tangent is positive.
    Clamped,
}

impl EdgeTangent {
    /// Adds `K v` to `out`.
    pub(crate) fn add_product(&self, v: &[[f64; 3]], out: &mut [[f64; 3]]) {
        for e in &self.entries {
            let (p, q) = (v[e.a as usize], v[e.b as usize]);
            let d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            let s = e.along * (e.n[0] * d[0] + e.n[1] * d[1] + e.n[2] * d[2]);
            let f: [f64; 3] = std::array::from_fn(|i| e.across * d[i] + s * e.n[i]);
            let a = &mut out[e.a as usize];
            for i in 0..3 {
                a[i] -= f[i];
            }
            let b = &mut out[e.b as usize];
            for i in 0..3 {
                b[i] += f[i];
            }
        }
    }

    /// Adds the 3 × 3 diagonal blocks of `K` to `out`.
    pub(crate) fn add_diagonal(&self, out: &mut [nalgebra::Matrix3<f64>]) {
        for e in &self.entries {
            let n = nalgebra::Vector3::from(e.n);
            let block = nalgebra::Matrix3::identity() * e.across + n * n.transpose() * e.along;
            out[e.a as usize] += block;
            out[e.b as usize] += block;
        }
    }
}

/// Largest angular frequency of the network without drag at `x`, by power iteration, radians per second. Comes out low
/// by some per cent where the stiffest modes lie close together.
pub(crate) fn largest_frequency(network: &SpringNetwork, moves: &[bool], x: &[[f64; 3]]) -> f64 {
    const ITERATIONS: usize = 80;
    let edges = EdgeList::new(network);
    let mut tangent = EdgeTangent::default();
    edges.tangent(x, Compression::Clamped, &mut tangent);
    let root: Vec<f64> = network.mass_kg.iter().zip(moves).map(|(m, moves)| f64::from(*moves) / m.sqrt()).collect();
    let mut chance = crate::generators::SplitMix(1);
    let mut v: Vec<[f64; 3]> = root.iter().map(|_| std::array::from_fn(|_| chance.unit() - 0.5)).collect();
    let (mut scaled, mut product) = (v.clone(), v.clone());
    let mut value = 0.0;
    for _ in 0..ITERATIONS {
        for (s, (v, r)) in scaled.iter_mut().zip(v.iter().zip(&root)) {
            *s = v.map(|c| c * r);
        }
        product.fill([0.0; 3]);
        tangent.add_product(&scaled, &mut product);
        for (p, r) in product.iter_mut().zip(&root) {
            *p = p.map(|c| c * r);
        }
        value = product.iter().flatten().map(|c| c * c).sum::<f64>().sqrt();
        if value == 0.0 {
            return 0.0;
        }
        for (v, p) in v.iter_mut().zip(&product) {
            *v = p.map(|c| c / value);
        }
    }
    value.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generators::{SplitMix, sheet};

    /// Central differences over 0.1 µm on springs of 2 mm: cut off at 1e-9 of a force, rounding of the energy below 1e-7.
    const DIFFERENCE_M: f64 = 1e-7;
    const TOLERANCE: f64 = 1e-6;

    #[test]
    fn forces_are_the_slope_of_the_energy() {
        let network = sheet(4, 3, 2e-3, 160.0, 5e-5, 3.0);
        let edges = EdgeList::new(&network);
        assert_ne!(edges.edges.len() % 4, 0, "both loops of the forces are taken");
        let mut chance = SplitMix(7);
        let mut x: Vec<[f64; 3]> =
            network.rest_m.iter().map(|p| std::array::from_fn(|i| p[i] + 1e-3 * (chance.unit() - 0.5))).collect();
        let mut forces = vec![[0.0; 3]; x.len()];
        edges.forces(&x, &mut forces);
        let largest = forces.iter().flatten().fold(0.0, |most: f64, f| most.max(f.abs()));
        for node in 0..x.len() {
            for i in 0..3 {
                let here = x[node][i];
                let [more, less] = [1.0, -1.0].map(|sign| {
                    x[node][i] = here + sign * DIFFERENCE_M;
                    edges.energy_j(&x)
                });
                x[node][i] = here;
                let slope = (more - less) / (2.0 * DIFFERENCE_M);
                assert!((forces[node][i] + slope).abs() < TOLERANCE * largest, "{node}: {} {slope}", forces[node][i]);
            }
        }
    }
}
