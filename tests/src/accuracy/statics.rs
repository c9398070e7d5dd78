//! Static experiments on a spring network: hold nodes, move them, let the rest come to rest, read the force.
//!
//! Rest is found by `sim_core::tissue::settle`; forces are summed here from the edge list, so that the balance of
//! what is held against what the rim carries tests both. SI units. Absent: time, drag, attachments.

use sim_core::tissue::load::Loads;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::settle::{SettleEnd, SettleParams, settle};
use sim_core::vector::Vec3;

/// Most descent steps of one settling: a 160 × 120 mm sheet of 2 mm needs some hundreds.
const MAX_ITERATIONS: u32 = 40_000;

/// A network at rest, or on its way there.
#[derive(Clone, Debug)]
pub struct Statics {
    /// Nodes and springs; `fixed` says what is held.
    pub network: SpringNetwork,
    /// Positions, metres.
    pub position_m: Vec<Vec3>,
    /// Forces from outside.
    pub loads: Loads,
    /// Largest force that may be left on a free node, newtons.
    pub tolerance_n: f64,
}

impl Statics {
    /// The network in its built shape.
    #[must_use]
    pub fn new(network: SpringNetwork, tolerance_n: f64) -> Self {
        Self { position_m: network.rest_m.clone(), network, loads: Loads::default(), tolerance_n }
    }

    /// Holds nodes where they are.
    pub fn hold(&mut self, nodes: &[u32]) {
        nodes.iter().for_each(|n| self.network.fixed[*n as usize] = 1);
    }

    /// Moves nodes.
    pub fn shift(&mut self, nodes: &[u32], by_m: Vec3) {
        nodes.iter().for_each(|n| self.position_m[*n as usize] += by_m);
    }

    /// Lets the free nodes come to rest. Returns false when they did not.
    #[must_use]
    pub fn rest(&mut self) -> bool {
        let params = SettleParams { tolerance_n: self.tolerance_n, max_iterations: MAX_ITERATIONS };
        let loads = (!self.loads.nodes.is_empty()).then_some(&self.loads);
        let none = PatchSet::default();
        settle(&self.network, loads.map(|l| (l, &none)), &mut self.position_m, &params).end == SettleEnd::Converged
    }

    /// Spring force on a set of nodes from the nodes outside it, newtons.
    #[must_use]
    pub fn force_on(&self, inside: impl Fn(u32) -> bool) -> Vec3 {
        let x = &self.position_m;
        let crossing = self.network.springs.iter().filter(|s| inside(s.a) != inside(s.b));
        crossing.fold(Vec3::zeros(), |sum, s| {
            let along = x[s.b as usize] - x[s.a as usize];
            let length = along.norm();
            let tension_n = s.stiffness_n_per_m * (length - s.rest_length_m);
            let on_a = if length > 0.0 { along * (tension_n / length) } else { Vec3::zeros() };
            if inside(s.a) { sum + on_a } else { sum - on_a }
        })
    }
}
