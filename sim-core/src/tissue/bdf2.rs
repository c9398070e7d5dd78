//! Second-order backward differences (BDF2): implicit, stable at any step.
//!
//! With `(a₀, a₁, a₂) = (3/2, −2, 1/2)`: `v⁺ = (a₀ x⁺ + a₁ x + a₂ x⁻)/h` and `m (a₀ v⁺ + a₁ v + a₂ v⁻)/h + c v⁺ = F(x⁺) + f`.
//! Both in one unknown: `D (x⁺ − b) = F(x⁺)` with `D = a₀² m/h² + a₀ c/h`, `x̂ = −(a₁ x + a₂ x⁻)/a₀`, `v̂` likewise and
//! `b = x̂ + (a₀ m v̂/h + f)/D`; `newton` solves it. The first step, and the first after any event (reset, grasp, release,
//! another topology, stitch or attachment, a literal projection, a cut displacement), is implicit Euler,
//! `(a₀, a₁, a₂) = (1, −1, 0)`: one such step keeps the order. Attachments and pairs are in the solve (`couplings`),
//! nodes in a hand are where it will be at the end. Deliberately absent: a choice of the step by an error estimate.

use crate::finite::is_finite;
use crate::tissue::couplings::Couplings;
use crate::tissue::integrator::AdvanceCounts;
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::newton::{Hold, Newton, NewtonParams, NewtonView, Solved, cap};
use crate::tissue::patch_set::PatchSet;
use crate::tissue::regulation::Attachments;
use crate::tissue::scheme::History;
use crate::tissue::solver::Stages;
use crate::tissue::sweep::SpringSweep;
use crate::vector::Vec3;

/// `a₀` of the running scheme, for the stiffness that a hand feels.
pub(crate) const LEADING: f64 = 1.5;

/// A component of a load counts up to this many times what takes a node to its limit with all its neighbours held.
const LOAD_CAP: f64 = 1e3;

/// Coefficients of a difference quotient.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Quotient {
    now: f64,
    last: f64,
    before: f64,
}

const EULER: Quotient = Quotient { now: 1.0, last: -1.0, before: 0.0 };
const BDF2: Quotient = Quotient { now: LEADING, last: -2.0, before: 0.5 };

/// What a step works on.
pub(crate) struct Surroundings<'a> {
    pub(crate) network: &'a SpringNetwork,
    pub(crate) patches: &'a PatchSet,
    /// 0 where a node may not move.
    pub(crate) mobility_m_per_n: &'a [f64],
    pub(crate) params: &'a NewtonParams,
    pub(crate) h: f64,
    pub(crate) limit_m: f64,
    pub(crate) spacing_m: f64,
}

/// The scheme with its history; all memory is kept.
#[derive(Clone, Debug)]
pub(crate) struct Bdf2 {
    history: History,
    /// Stages that the history is of.
    engaged: u64,
    /// Quotient that the matrix has the resistances of.
    prepared: Option<Quotient>,
    hold: Hold,
    before: TissueState,
    /// `x̂` and `b`, metres.
    hat_m: Vec<Vec3>,
    free_m: Vec<Vec3>,
    newton: Newton,
}

impl Bdf2 {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        Self {
            history: History::Fresh,
            engaged: 0,
            prepared: None,
            hold: Hold::Held,
            before: network.rest_state(),
            hat_m: network.rest_m.clone(),
            free_m: network.rest_m.clone(),
            newton: Newton::new(network),
        }
    }

    /// The next step is the first of a history; nodes of `mobility` 0 may not move from now on.
    pub(crate) fn restart(&mut self, mobility_m_per_n: &[f64]) {
        self.history = History::Fresh;
        self.prepared = None;
        let free = mobility_m_per_n.iter().all(|m| *m > 0.0);
        self.hold = if free { Hold::Free } else { Hold::Held };
    }

    /// The next step is the first of a history of the same system.
    pub(crate) fn forget(&mut self) {
        self.history = History::Fresh;
    }

    /// One step. On entry `force_n` holds the loads, and nodes in a hand are where they shall end.
    pub(crate) fn step(
        &mut self,
        around: &Surroundings<'_>,
        springs: &mut SpringSweep,
        state: &mut TissueState,
        force_n: &mut [Vec3],
        stages: &mut Stages,
    ) -> (AdvanceCounts, Solved) {
        let engaged = engaged(stages);
        if engaged != self.engaged {
            (self.engaged, self.history) = (engaged, History::Fresh);
        }
        let quotient = if self.history == History::Fresh { EULER } else { BDF2 };
        let (a0, h) = (quotient.now, around.h);
        if self.prepared != Some(quotient) {
            self.newton.matrix.resist(around.network, around.mobility_m_per_n, a0 * a0 / (h * h), a0 / h);
            self.prepared = Some(quotient);
        }
        self.predict(quotient, around, state, force_n);
        let attachments = stages.attachments.as_mut().map(|a| a as &mut Attachments);
        let mut couplings = Couplings::new(around.patches, attachments, stages.pairs.as_mut());
        let view = NewtonView {
            network: around.network,
            free_m: &self.free_m,
            start_m: &self.before.position_m,
            h,
            limit_m: around.limit_m,
            spacing_m: around.spacing_m,
            hold: self.hold,
            params: around.params,
        };
        let solved = self.newton.solve(&view, springs, &mut couplings, &mut state.position_m, force_n);
        (self.close(a0 / h, around, state), solved)
    }

    /// `x̂`, `b`, and the prediction `x + h v` in the state; what the state was goes into the history.
    fn predict(&mut self, q: Quotient, around: &Surroundings<'_>, state: &mut TissueState, load_n: &[Vec3]) {
        let (last, before) = (-q.last / q.now, -q.before / q.now);
        for (node, &d) in self.newton.matrix.resistance().iter().enumerate() {
            let (x, v) = (state.position_m[node], state.velocity_m_per_s[node]);
            if d > 0.0 {
                let hat = x * last + self.before.position_m[node] * before;
                let speed = v * last + self.before.velocity_m_per_s[node] * before;
                let load = cap(load_n[node], LOAD_CAP * self.newton.matrix.bound()[node] * around.limit_m);
                let inertia = q.now * around.network.mass_kg[node] / around.h;
                self.hat_m[node] = hat;
                self.free_m[node] = hat + (speed * inertia + load) / d;
                let way = v * around.h;
                let length = way.norm();
                let share = if length > around.limit_m { around.limit_m / length } else { 1.0 };
                state.position_m[node] = x + way * share;
            }
            self.before.position_m[node] = x;
            self.before.velocity_m_per_s[node] = v;
        }
    }

    /// Velocities. A solution that is not finite is dropped whole, one beyond the displacement limit is cut.
    fn close(&mut self, per_s: f64, around: &Surroundings<'_>, state: &mut TissueState) -> AdvanceCounts {
        let mut counts = AdvanceCounts::default();
        let usable = state.position_m.iter().all(is_finite);
        self.history = if usable { History::Running } else { History::Fresh };
        // A node at the limit was put there by the solve: it may lie a rounding inside.
        let limit_m = around.limit_m * (1.0 - 1e-9);
        for (node, _) in around.mobility_m_per_n.iter().enumerate().filter(|(_, m)| **m > 0.0) {
            let (x, before) = (&mut state.position_m[node], self.before.position_m[node]);
            let v = &mut state.velocity_m_per_s[node];
            if !usable {
                (*x, *v) = (before, Vec3::zeros());
                counts.contained += 1;
                continue;
            }
            let way = *x - before;
            let length = way.norm();
            if length > limit_m {
                let way = way * (around.limit_m / length);
                (*x, *v) = (before + way, way / around.h);
                counts.saturated += 1;
                self.history = History::Fresh;
            } else {
                *v = (*x - self.hat_m[node]) * per_s;
            }
        }
        counts
    }
}

/// Changes when attachments are switched or pairs come and go.
fn engaged(stages: &Stages) -> u64 {
    let pairs = stages.pairs.as_ref().map_or(0, |p| p.len() as u64);
    let attachments = stages.attachments.as_ref().map_or(0, |a| a.engaged_mark());
    attachments.wrapping_mul(0x1_0000).wrapping_add(pairs)
}
