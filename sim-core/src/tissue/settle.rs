//! Static equilibrium at load: where the pre-strained, cut tissue comes to rest.
//!
//! Relaxation with fictitious masses and a fading drag (Nesterov's accelerated descent):
//! `y = x + (x − x_last) r/(r + 3)`, `x_next = y + F(y)/(2 Σ_j k_ij)`, which is stable because `λ ≤ 2 Σ k`;
//! `r` counts from 0 again whenever the force points back against the motion. Ends when no free node
//! feels more than the tolerance. Deterministic, with no clock. Deliberately absent: attachments,
//! stitches and handles; kinetic damping, which left 3 µN on a hanging chain of 12 links after 20 000 steps.

use crate::finite::is_finite;
use crate::tissue::load::Loads;
use crate::tissue::network::SpringNetwork;
use crate::tissue::patch_set::PatchSet;
use crate::tissue::sweep::SpringSweep;
use crate::vector::Vec3;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleParams {
    /// Largest force left on a free node, newtons.
    pub tolerance_n: f64,
    /// Most iterations.
    pub max_iterations: u32,
}

impl Default for SettleParams {
    /// 10 nN per node: across a pre-strained sheet, some newtons per metre soft, that is a few nanometres.
    fn default() -> Self {
        Self { tolerance_n: 1e-8, max_iterations: 20_000 }
    }
}

/// How a settling ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettleEnd {
    /// In equilibrium within the tolerance.
    Converged,
    /// The iterations ran out.
    IterationsSpent,
    /// A force was not finite; the positions are those at the start.
    Diverged,
}

/// Outcome of a settling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Largest force left on a free node, newtons.
    pub residual_n: f64,
    /// Iterations used.
    pub iterations: u32,
    /// How it ended.
    pub end: SettleEnd,
}

/// Moves `position_m` to the equilibrium of the springs, and the loads if there are any.
pub fn settle(
    network: &SpringNetwork,
    loads: Option<(&Loads, &PatchSet)>,
    position_m: &mut [Vec3],
    params: &SettleParams,
) -> Settled {
    let start = position_m.to_vec();
    let step = steps_m_per_n(network);
    let mut springs = SpringSweep::new(network);
    let mut force = vec![Vec3::zeros(); position_m.len()];
    let mut velocity = vec![Vec3::zeros(); position_m.len()];
    let mut run = 0.0;
    let mut outcome = Settled { residual_n: f64::INFINITY, iterations: 0, end: SettleEnd::IterationsSpent };
    for iteration in 0..=params.max_iterations {
        springs.sweep(position_m, &mut force);
        if let Some((loads, patches)) = loads {
            loads.add(patches, &mut force);
        }
        let free = force.iter().zip(&step).filter(|(_, w)| **w > 0.0);
        let residual_n = free.map(|(f, _)| f.norm_squared()).fold(0.0, f64::max).sqrt();
        if !force.iter().all(is_finite) {
            position_m.copy_from_slice(&start);
            return Settled { end: SettleEnd::Diverged, ..outcome };
        }
        outcome = Settled { residual_n, iterations: iteration, ..outcome };
        if residual_n <= params.tolerance_n {
            return Settled { end: SettleEnd::Converged, ..outcome };
        }
        if iteration == params.max_iterations {
            break;
        }
        // The way from the last x to the next: what the extrapolation added, and the descent from there.
        let mut along = 0.0;
        for ((v, f), &w) in velocity.iter_mut().zip(&force).zip(&step) {
            let way = *v + f * w;
            along += f.dot(&way) * f64::from(w > 0.0);
            *v = way;
        }
        run = if along < 0.0 { 0.0 } else { run + 1.0 };
        let carry = run / (run + 3.0);
        for (((x, v), f), &w) in position_m.iter_mut().zip(&mut velocity).zip(&force).zip(&step) {
            *v *= carry;
            *x += f * w + *v;
        }
    }
    outcome
}

/// Descent step by node, `1/(2 Σ k)`; 0 where a node is fixed or has no spring.
fn steps_m_per_n(network: &SpringNetwork) -> Vec<f64> {
    let edges = &network.half_edges;
    let stiffness = |node: usize| edges.stiffness_n_per_m[edges.row(node)].iter().sum::<f64>();
    let steps = network.fixed.iter().enumerate().map(|(node, &fixed)| {
        let sum = stiffness(node);
        if fixed == 0 && sum > 0.0 { 0.5 / sum } else { 0.0 }
    });
    steps.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::load::NodeForce;
    use crate::tissue::network::{Spring, SpringFamily};

    /// A vertical chain of `links`, hung at node 0.
    fn chain(links: u32, stiffness_n_per_m: f64) -> SpringNetwork {
        let count = links as usize + 1;
        let x = (0..count).map(|i| Vec3::new(0.0, 0.0, -0.01 * i as f64)).collect();
        let link = |a| Spring { a, b: a + 1, stiffness_n_per_m, rest_length_m: 0.01, family: SpringFamily::Structural };
        let mut fixed = vec![0; count];
        fixed[0] = 1;
        let springs = (0..links).map(link).collect();
        SpringNetwork::new(x, vec![1e-3; count], vec![0.0; count], fixed, springs).unwrap()
    }

    #[test]
    fn hanging_chain_carries_the_weight_below_each_link() {
        let (links, k, weight) = (12_u32, 200.0, 0.01);
        let network = chain(links, k);
        let hung = |node| NodeForce { node, force_n: Vec3::new(0.0, 0.0, -weight) };
        let loads = Loads { nodes: (1..=links).map(hung).collect(), patches: Vec::new() };
        let mut x = network.rest_state().position_m;
        let params = SettleParams { tolerance_n: 1e-10, ..SettleParams::default() };
        let settled = settle(&network, Some((&loads, &PatchSet::default())), &mut x, &params);
        assert_eq!(settled.end, SettleEnd::Converged, "{settled:?}");
        for link in 0..links as usize {
            let tension = k * ((x[link + 1] - x[link]).norm() - 0.01);
            let expected = weight * (links as usize - link) as f64;
            // Each node's residual is at most 1e-10 N and they add up along the chain.
            assert!((tension - expected).abs() < 2e-9, "link {link}: {tension} N, expected {expected} N");
        }
    }

    #[test]
    fn a_pre_strained_strip_between_fixed_ends_finds_the_even_tension() {
        // Three links of 10 mm rest over 36 mm, with the inner nodes started off the line.
        let mut network = chain(3, 100.0);
        network.fixed[3] = 1;
        let mut x = network.rest_state().position_m;
        x[3].z = -0.036;
        x[1].x = 0.003;
        x[2].x = -0.002;
        let settled = settle(&network, None, &mut x, &SettleParams { tolerance_n: 1e-11, max_iterations: 20_000 });
        assert_eq!(settled.end, SettleEnd::Converged, "{settled:?}");
        for node in 1..3 {
            let expected = Vec3::new(0.0, 0.0, -0.012 * node as f64);
            assert!((x[node] - expected).norm() < 1e-11, "{x:?}");
        }
    }

    #[test]
    fn a_settling_that_diverges_leaves_the_positions_of_the_start() {
        let network = chain(2, 1e-6);
        // A force so large that the first move overflows.
        let load = NodeForce { node: 2, force_n: Vec3::new(0.0, 0.0, -1e305) };
        let loads = Loads { nodes: vec![load], patches: Vec::new() };
        let mut x = network.rest_state().position_m;
        let settled = settle(&network, Some((&loads, &PatchSet::default())), &mut x, &SettleParams::default());
        assert_eq!((settled.end, settled.iterations), (SettleEnd::Diverged, 0));
        assert_eq!(x, network.rest_state().position_m);
    }

    #[test]
    fn equal_inputs_give_equal_bits_and_a_body_at_rest_stays() {
        let network = chain(5, 80.0);
        let run = || {
            let mut x = network.rest_state().position_m;
            x[2].x += 1e-3;
            let settled = settle(&network, None, &mut x, &SettleParams::default());
            (settled, x)
        };
        assert_eq!(run(), run());
        let mut x = network.rest_state().position_m;
        let settled = settle(&network, None, &mut x, &SettleParams::default());
        assert_eq!((settled.iterations, x), (0, network.rest_state().position_m));
    }
}
