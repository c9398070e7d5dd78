//! Which integrator moves the nodes, and the one loop that moves them.
//!
//! An explicit velocity update is `v⁺ = keep · v + gain · F`, `x⁺ = x + h v⁺`, with two factors per
//! node; each integrator of that shape is one file that gives the factors. Nodes that may not move
//! have both factors 0, so the loop has no branch for them.
//! Other shapes (Verlet's start and its output, BDF2, XPBD) have their own files; for them the two factors say how a
//! node answers forces that act at the end of the step.

use crate::finite::is_finite;
use crate::tissue::network::TissueState;
use crate::tissue::{bdf2, paper_explicit, semi_implicit, verlet};
use crate::vector::Vec3;

/// Integrators to choose from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Semi-implicit Euler with implicit drag.
    #[default]
    SemiImplicit,
    /// The paper's explicit form, as printed.
    PaperExplicit,
    /// Staggered Verlet with Crank–Nicolson drag.
    Verlet,
    /// Second-order backward differences, solved by Newton and conjugate gradients.
    Bdf2,
    /// Extended position-based dynamics, for comparison.
    Xpbd,
}

/// Velocity update of one node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeFactors {
    /// Share of the old velocity that stays.
    pub keep: f64,
    /// Velocity gained per newton, metres per second.
    pub gain_s_per_kg: f64,
}

/// What an advance had to hold back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdvanceCounts {
    /// Nodes whose step was cut to the displacement limit.
    pub saturated: u32,
    /// Nodes put back to their last good position.
    pub contained: u32,
}

impl Integrator {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::SemiImplicit, Self::PaperExplicit, Self::Verlet, Self::Bdf2, Self::Xpbd];

    /// Name as printed in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::SemiImplicit => "semi_implicit",
            Self::PaperExplicit => "paper_explicit",
            Self::Verlet => "verlet",
            Self::Bdf2 => "bdf2",
            Self::Xpbd => "xpbd",
        }
    }

    /// Whether it is bounded at any step; the others have a stability number below 1 or blow up.
    #[must_use]
    pub const fn is_stable_at_any_step(self) -> bool {
        matches!(self, Self::Bdf2 | Self::Xpbd)
    }

    /// Whether nodes at rest may be left out of its steps: the two that are meant for use and solve nothing globally.
    #[must_use]
    pub const fn lets_nodes_sleep(self) -> bool {
        matches!(self, Self::SemiImplicit | Self::Verlet)
    }

    /// Length of the implicit Euler step that resists as a step of `h` seconds does: `h/a₀`, `a₀` the leading
    /// coefficient of the difference quotient.
    #[must_use]
    pub fn resisting_step_s(self, h: f64) -> f64 {
        if self == Self::Bdf2 { h / bdf2::LEADING } else { h }
    }

    /// Factors of one node for a step of `h` seconds.
    #[must_use]
    pub fn factors(self, mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
        match self {
            Self::SemiImplicit | Self::Bdf2 | Self::Xpbd => semi_implicit::factors(mass_kg, drag_n_s_per_m, h),
            Self::Verlet => verlet::factors(mass_kg, drag_n_s_per_m, h),
            Self::PaperExplicit => paper_explicit::factors(mass_kg, drag_n_s_per_m, h),
        }
    }
}

/// Moves all nodes by one step of `h` seconds under `force_n`. No node moves farther than `limit_m`.
pub fn advance(
    factors: &[NodeFactors],
    force_n: &[Vec3],
    state: &mut TissueState,
    h: f64,
    limit_m: f64,
) -> AdvanceCounts {
    let mut counts = AdvanceCounts::default();
    let nodes = state.position_m.iter_mut().zip(&mut state.velocity_m_per_s).zip(factors).zip(force_n);
    for (((x, v), f), force) in nodes {
        advance_node((x, v), f, force, h, limit_m, &mut counts);
    }
    counts
}

/// The same for one node.
#[inline(always)]
pub(crate) fn advance_node(
    (x, v): (&mut Vec3, &mut Vec3),
    factors: &NodeFactors,
    force_n: &Vec3,
    h: f64,
    limit_m: f64,
    counts: &mut AdvanceCounts,
) {
    let mut velocity = *v * factors.keep + force_n * factors.gain_s_per_kg;
    let mut shift = velocity * h;
    let squared = shift.norm_squared();
    if squared > limit_m * limit_m {
        let scale = limit_m / squared.sqrt();
        shift *= scale;
        velocity *= scale;
        counts.saturated += 1;
    }
    let moved = *x + shift;
    if is_finite(&moved) && is_finite(&velocity) {
        *x = moved;
        *v = velocity;
    } else {
        *v = Vec3::zeros();
        counts.contained += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(x: Vec3, v: Vec3) -> TissueState {
        TissueState { position_m: vec![x], velocity_m_per_s: vec![v] }
    }

    #[test]
    fn a_node_without_gain_stays_where_it_is() {
        let mut state = one(Vec3::new(1.0, 2.0, 3.0), Vec3::new(9.0, 9.0, 9.0));
        let counts = advance(&[NodeFactors::default()], &[Vec3::repeat(1e6)], &mut state, 1e-3, 1.0);
        assert_eq!(state, one(Vec3::new(1.0, 2.0, 3.0), Vec3::zeros()));
        assert_eq!(counts, AdvanceCounts::default());
    }

    #[test]
    fn a_huge_force_moves_a_node_by_the_limit_only() {
        let factors = [Integrator::SemiImplicit.factors(1e-3, 0.0, 1e-3)];
        let mut state = one(Vec3::zeros(), Vec3::zeros());
        let counts = advance(&factors, &[Vec3::new(0.0, 1e6, 0.0)], &mut state, 1e-3, 1e-3);
        assert_eq!(counts, AdvanceCounts { saturated: 1, contained: 0 });
        // One rounding of a product.
        assert!((state.position_m[0].y - 1e-3).abs() < 1e-18 && (state.velocity_m_per_s[0].y - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_force_that_is_not_a_number_leaves_the_last_good_position() {
        let factors = [Integrator::SemiImplicit.factors(1e-3, 1.0, 1e-3)];
        for bad in [f64::NAN, f64::INFINITY] {
            let mut state = one(Vec3::new(1e-3, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
            let counts = advance(&factors, &[Vec3::new(0.0, bad, 0.0)], &mut state, 1e-3, 1e-3);
            assert_eq!(counts.contained, 1, "{bad}");
            assert_eq!(state, one(Vec3::new(1e-3, 0.0, 0.0), Vec3::zeros()));
        }
    }
}
