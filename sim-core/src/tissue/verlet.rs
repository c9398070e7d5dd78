//! Verlet with Crank–Nicolson drag, staggered: velocities live half a step before the positions.
//!
//! `v½⁺ = ((m − c h/2) v½⁻ + h F(x))/(m + c h/2)`, `x⁺ = x + h v½⁺`. Second order; without drag the energy swings but
//! does not drift. Stable for `λ h² < 4 m`: drag does not help. It starts, and starts again after an event, from the
//! velocity `v` of the full step by half a kick, `v½ = (m v + h F/2)/(m + c h/2)`; the drag of the half kick is
//! implicit, so that heavy drag cannot throw a node (an error of `h²`, once). Velocities of full steps are given out by
//! extrapolation, `v = (3 v½ − v½⁻)/2`: also of second order, and constraints are in it.
//! Deliberately absent: the loop over the nodes (`integrator::advance`).

use crate::tissue::integrator::{AdvanceCounts, NodeFactors, advance};
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::scheme::History;
use crate::tissue::sleep::Sleep;
use crate::vector::Vec3;

/// Factors of one node for a whole kick of `h` seconds.
#[must_use]
pub fn factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    let half_drag = 0.5 * drag_n_s_per_m * h;
    let heavy = mass_kg + half_drag;
    NodeFactors { keep: (mass_kg - half_drag) / heavy, gain_s_per_kg: h / heavy }
}

/// Factors of one node for the half kick that leads from a full step to the next half step.
#[must_use]
pub fn half_factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    let heavy = mass_kg + 0.5 * drag_n_s_per_m * h;
    NodeFactors { keep: mass_kg / heavy, gain_s_per_kg: 0.5 * h / heavy }
}

/// Velocities of half steps, kept between periods.
#[derive(Clone, Debug)]
pub(crate) struct Staggered {
    history: History,
    half: Vec<NodeFactors>,
    /// Of the last half step.
    velocity_m_per_s: Vec<Vec3>,
    /// Of the half step before it; of the full step half a step before it, after the first step.
    before_m_per_s: Vec<Vec3>,
    /// Weights of the two in the velocity of the full step.
    weights: (f64, f64),
}

impl Staggered {
    pub(crate) fn new(nodes: usize) -> Self {
        Self {
            history: History::Fresh,
            half: vec![NodeFactors::default(); nodes],
            velocity_m_per_s: vec![Vec3::zeros(); nodes],
            before_m_per_s: vec![Vec3::zeros(); nodes],
            weights: (1.0, 0.0),
        }
    }

    /// Starts again from the velocities of the state, with sub-steps of `h`.
    pub(crate) fn restart(&mut self, network: &SpringNetwork, mobility_m_per_n: &[f64], h: f64) {
        self.history = History::Fresh;
        let nodes = network.mass_kg.iter().zip(&network.drag_n_s_per_m).zip(mobility_m_per_n);
        for (half, ((&m, &c), &mobility)) in self.half.iter_mut().zip(nodes) {
            *half = if mobility > 0.0 { half_factors(m, c, h) } else { NodeFactors::default() };
        }
    }

    /// Puts the velocities of half steps into the state for the sub-steps of a period.
    pub(crate) fn open(&mut self, state: &mut TissueState) {
        if self.history == History::Running {
            std::mem::swap(&mut state.velocity_m_per_s, &mut self.velocity_m_per_s);
        }
    }

    /// Keeps the velocities before the last sub-step of a period; `resting` says which nodes are awake, `None` all.
    pub(crate) fn remember(&mut self, velocity_m_per_s: &[Vec3], resting: Option<&Sleep>) {
        match resting {
            None => self.before_m_per_s.copy_from_slice(velocity_m_per_s),
            Some(sleep) => sleep.awake().for_each(|node| self.before_m_per_s[node] = velocity_m_per_s[node]),
        }
    }

    /// One sub-step; the first one of a history is half a kick and a whole way.
    pub(crate) fn advance(
        &mut self,
        factors: &[NodeFactors],
        force_n: &[Vec3],
        state: &mut TissueState,
        (h, limit_m): (f64, f64),
        resting: Option<&Sleep>,
    ) -> AdvanceCounts {
        let first = self.history == History::Fresh;
        self.history = History::Running;
        self.weights = if first { (2.0, -1.0) } else { (1.5, -0.5) };
        let factors = if first { &self.half } else { factors };
        match resting {
            None => advance(factors, force_n, state, h, limit_m),
            Some(sleep) => sleep.advance(factors, force_n, state, h, limit_m),
        }
    }

    /// Keeps the velocities of the half step and gives the state those of the full step. Held nodes have that of
    /// their handle.
    pub(crate) fn close(&mut self, factors: &[NodeFactors], state: &mut TissueState, resting: Option<&Sleep>) {
        let (now, earlier) = self.weights;
        let close_node = |last: &mut Vec3, v: &mut Vec3, before: &Vec3, f: &NodeFactors| {
            *last = *v;
            if f.gain_s_per_kg > 0.0 {
                *v = *last * now + before * earlier;
            }
        };
        let (last, v) = (&mut self.velocity_m_per_s, &mut state.velocity_m_per_s);
        if let Some(sleep) = resting {
            sleep.awake().for_each(|n| close_node(&mut last[n], &mut v[n], &self.before_m_per_s[n], &factors[n]));
            return;
        }
        for (((last, v), before), f) in last.iter_mut().zip(v).zip(&self.before_m_per_s).zip(factors) {
            close_node(last, v, before, f);
        }
    }

    /// A node has come to rest.
    pub(crate) fn still(&mut self, node: usize) {
        self.velocity_m_per_s[node] = Vec3::zeros();
        self.before_m_per_s[node] = Vec3::zeros();
    }
}
