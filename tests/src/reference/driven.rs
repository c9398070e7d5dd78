//! The common problem of both references: a network of which some nodes follow a given path, sampled at common times.
//!
//! Held nodes keep their offsets and move together by `path(t)`. What is compared: positions of all nodes, the springs'
//! force on the held nodes, and the energy, at every multiple of the sample time.

use super::edges::EdgeList;
use sim_core::tissue::network::SpringNetwork;
use sim_core::vector::Vec3;

/// A network with driven nodes.
pub struct Driven<'a> {
    /// The network.
    pub network: &'a SpringNetwork,
    /// Positions at the start, at rest, metres.
    pub start_m: &'a [Vec3],
    /// Driven nodes.
    pub held: &'a [u32],
    /// Their displacement at a time, metres; zero at time zero.
    pub path: &'a (dyn Fn(f64) -> [f64; 3] + Sync),
    /// Forces on nodes from outside, constant: node and newtons.
    pub loads: &'a [(u32, [f64; 3])],
    /// End, seconds: a multiple of the sample time.
    pub end_s: f64,
    /// Time between samples, seconds.
    pub sample_s: f64,
}

/// What a run leaves behind, at each multiple of the sample time from the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Positions of all nodes, metres.
    pub position_m: Vec<Vec<[f64; 3]>>,
    /// Force of the springs on the held nodes together, newtons.
    pub force_n: Vec<[f64; 3]>,
    /// Kinetic plus elastic energy, joules.
    pub energy_j: Vec<f64>,
}

/// Differences of two runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// RMS over nodes and samples, relative to the RMS of the motion.
    pub position: f64,
    /// RMS over samples, relative to the RMS of the force.
    pub force: f64,
    /// Largest, newtons.
    pub force_max_n: f64,
    /// Energy at the end, relative to the largest change of energy.
    pub energy: f64,
}

impl Driven<'_> {
    /// Number of samples.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        (self.end_s / self.sample_s).round() as usize
    }

    /// Which nodes move by their equation.
    pub(crate) fn moves(&self) -> Vec<bool> {
        let mut moves: Vec<bool> = self.network.fixed.iter().map(|f| *f == 0).collect();
        for &node in self.held {
            moves[node as usize] = false;
        }
        moves
    }

    pub(crate) fn start(&self) -> Vec<[f64; 3]> {
        self.start_m.iter().map(|x| [x.x, x.y, x.z]).collect()
    }

    /// Puts the held nodes where they are at `t`.
    pub(crate) fn place(&self, start: &[[f64; 3]], t: f64, x: &mut [[f64; 3]]) {
        let shift = (self.path)(t);
        for &node in self.held {
            let from = start[node as usize];
            x[node as usize] = std::array::from_fn(|i| from[i] + shift[i]);
        }
    }

    pub(crate) fn add_loads(&self, force: &mut [[f64; 3]]) {
        for (node, load) in self.loads {
            for (f, l) in force[*node as usize].iter_mut().zip(load) {
                *f += l;
            }
        }
    }

    /// Fewest steps per sample of at most `dt_s`.
    pub(crate) fn steps_per_sample(&self, dt_s: f64) -> usize {
        (self.sample_s / dt_s - 1e-9).ceil().max(1.0) as usize
    }

    /// The sum of the forces on the held nodes.
    pub(crate) fn held_force(&self, force: &[[f64; 3]]) -> [f64; 3] {
        self.held.iter().fold([0.0; 3], |sum, n| std::array::from_fn(|i| sum[i] + force[*n as usize][i]))
    }
}

impl Samples {
    /// `self` against a run that is taken as true; `start_m` are the positions at rest.
    #[must_use]
    pub fn against(&self, truth: &Self, start_m: &[Vec3]) -> Difference {
        let (mut off, mut way) = (0.0, 0.0);
        for (mine, true_m) in self.position_m.iter().zip(&truth.position_m) {
            for ((x, t), s) in mine.iter().zip(true_m).zip(start_m) {
                for i in 0..3 {
                    off += (x[i] - t[i]).powi(2);
                    way += (t[i] - s[i]).powi(2);
                }
            }
        }
        let squared = |f: &[f64; 3]| f.iter().map(|c| c * c).sum::<f64>();
        let apart = |f: &[f64; 3], t: &[f64; 3]| (0..3).map(|i| (f[i] - t[i]).powi(2)).sum::<f64>();
        let forces = || self.force_n.iter().zip(&truth.force_n);
        let (force_off, force) =
            (forces().map(|(f, t)| apart(f, t)).sum::<f64>(), truth.force_n.iter().map(squared).sum::<f64>());
        let ends = self.energy_j.last().zip(truth.energy_j.last());
        let (low, high) =
            truth.energy_j.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(*e), h.max(*e)));
        Difference {
            position: (off / way).sqrt(),
            force: (force_off / force).sqrt(),
            force_max_n: forces().map(|(f, t)| apart(f, t).sqrt()).fold(0.0, f64::max),
            energy: ends.map_or(f64::NAN, |(mine, true_j)| (mine - true_j) / (high - low)),
        }
    }

    /// Richardson's extrapolation of a run with half the step of `coarse`: `fine + (fine − coarse)/(2^order − 1)`.
    #[must_use]
    pub fn extrapolated(mut self, coarse: &Self, order: i32) -> Self {
        let weight = 1.0 / (2.0_f64.powi(order) - 1.0);
        let improve = |fine: &mut [f64; 3], coarse: &[f64; 3]| {
            for (f, c) in fine.iter_mut().zip(coarse) {
                *f += (*f - c) * weight;
            }
        };
        for (fine, coarse) in self.position_m.iter_mut().flatten().zip(coarse.position_m.iter().flatten()) {
            improve(fine, coarse);
        }
        for (fine, coarse) in self.force_n.iter_mut().zip(&coarse.force_n) {
            improve(fine, coarse);
        }
        for (fine, coarse) in self.energy_j.iter_mut().zip(&coarse.energy_j) {
            *fine += (*fine - coarse) * weight;
        }
        self
    }
}

/// Measures another program's run of a driven network as the references measure their own.
#[derive(Clone, Debug)]
pub struct Probe {
    edges: EdgeList,
    held: Vec<u32>,
    mass_kg: Vec<f64>,
    fixed: Vec<bool>,
    force: Vec<[f64; 3]>,
}

impl Probe {
    /// For this network with these driven nodes.
    #[must_use]
    pub fn new(network: &SpringNetwork, held: &[u32]) -> Self {
        let mut fixed: Vec<bool> = network.fixed.iter().map(|f| *f != 0).collect();
        held.iter().for_each(|n| fixed[*n as usize] = true);
        Self {
            edges: EdgeList::new(network),
            held: held.to_vec(),
            mass_kg: network.mass_kg.clone(),
            force: vec![[0.0; 3]; fixed.len()],
            fixed,
        }
    }

    /// Adds a sample.
    pub fn record(&mut self, position_m: &[Vec3], velocity_m_per_s: &[Vec3], samples: &mut Samples) {
        let x: Vec<[f64; 3]> = position_m.iter().map(|x| [x.x, x.y, x.z]).collect();
        self.edges.forces(&x, &mut self.force);
        let held = self.held.iter().fold([0.0; 3], |sum, n| {
            let f = self.force[*n as usize];
            std::array::from_fn(|i| sum[i] + f[i])
        });
        let nodes = velocity_m_per_s.iter().zip(&self.mass_kg).zip(&self.fixed);
        let kinetic = nodes.filter(|(_, fixed)| !**fixed).map(|((v, m), _)| 0.5 * m * v.norm_squared()).sum::<f64>();
        samples.force_n.push(held);
        samples.energy_j.push(kinetic + self.edges.energy_j(&x));
        samples.position_m.push(x);
    }
}
