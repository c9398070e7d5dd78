//! Extended position-based dynamics (Macklin, Müller, Chentanez 2016): springs as compliant constraints, for comparison.
//!
//! Predicted `x* = x + h (m v + h f)/(m + c h)` (drag implicit, loads only); then each spring in fixed order, `C = |x_b −
//! x_a| − L`, node mobility `μ = h²/(m + c h)`: `Δλ = −(C + λ/k)/(1/k + μ_a + μ_b)`, `x_a −= μ_a Δλ n`, `x_b += μ_b Δλ n`;
//! velocities from the positions, `v = (x⁺ − x)/h`. One sweep per sub-step and small sub-steps (Macklin et al. 2019).
//! Bounded at any step, and not accurate: the sweep does not converge, and force errors of 20 to 80 % are usual at the
//! cost of an explicit step. It is here because other systems use it; the automatic choice never takes it.

use crate::finite::is_finite;
use crate::tissue::force::COINCIDENT_M;
use crate::tissue::integrator::AdvanceCounts;
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::vector::Vec3;

/// Multipliers of the springs and positions at the start of the sub-step.
#[derive(Clone, Debug)]
pub(crate) struct SpringProjection {
    before_m: Vec<Vec3>,
    multiplier_n: Vec<f64>,
}

impl SpringProjection {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        Self { before_m: network.rest_m.clone(), multiplier_n: vec![0.0; network.springs.len()] }
    }

    /// Keeps the positions that velocities will be taken from.
    pub(crate) fn remember(&mut self, position_m: &[Vec3]) {
        self.before_m.copy_from_slice(position_m);
    }

    /// `iterations` Gauss–Seidel sweeps over all springs. Springs whose ends coincide have no direction and wait.
    pub(crate) fn project(
        &mut self,
        network: &SpringNetwork,
        mobility_m_per_n: &[f64],
        position_m: &mut [Vec3],
        iterations: u32,
    ) {
        self.multiplier_n.fill(0.0);
        for _ in 0..iterations {
            let mut pulls_only = network.pulls_only.iter().peekable();
            for (index, (spring, multiplier)) in network.springs.iter().zip(&mut self.multiplier_n).enumerate() {
                let (a, b) = (spring.a as usize, spring.b as usize);
                let (of_a, of_b) = (mobility_m_per_n[a], mobility_m_per_n[b]);
                let d = position_m[b] - position_m[a];
                let length = d.norm();
                // k (C + λ/k) and k (1/k + μ): a spring of stiffness 0 needs no infinite compliance.
                let k = spring.stiffness_n_per_m;
                let one_sided = pulls_only.next_if(|&&pulling| pulling as usize == index).is_some();
                if length < COINCIDENT_M || (one_sided && length < spring.rest_length_m) {
                    continue;
                }
                let change = -(k * (length - spring.rest_length_m) + *multiplier) / (1.0 + k * (of_a + of_b));
                *multiplier += change;
                let push = d * (change / length);
                position_m[a] -= push * of_a;
                position_m[b] += push * of_b;
            }
        }
    }

    /// Velocities from positions. No free node moves farther than `limit_m`, none ends where it is not finite.
    pub(crate) fn close(
        &self,
        mobility_m_per_n: &[f64],
        state: &mut TissueState,
        h: f64,
        limit_m: f64,
    ) -> AdvanceCounts {
        let mut counts = AdvanceCounts::default();
        let nodes = state.position_m.iter_mut().zip(&mut state.velocity_m_per_s).zip(&self.before_m);
        for (((x, v), before), &mobility) in nodes.zip(mobility_m_per_n) {
            if mobility == 0.0 {
                continue;
            }
            let mut shift = *x - before;
            if !is_finite(&shift) {
                (*x, *v) = (*before, Vec3::zeros());
                counts.contained += 1;
                continue;
            }
            let length = shift.norm();
            if length > limit_m {
                // Divided first: a far position may overflow in a product.
                shift = (shift / length) * limit_m;
                *x = before + shift;
                counts.saturated += 1;
            }
            *v = shift / h;
        }
        counts
    }
}
