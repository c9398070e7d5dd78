//! The automatic choice of the integrator, at load and when the topology changes, with its reason in words.
//!
//! In this order: (a) semi-implicit Euler in one step per period where `S = λ h²/(4m + 2ch) < 0.8`: nothing is cheaper.
//! (b) Else an explicit form in sub-steps, when `n ×` cost of a step fits the budget, a share of the period: Verlet,
//! orders more accurate, unless drag lets semi-implicit Euler do with less than half its sub-steps; that first-order
//! form only while it costs about as much as one implicit step, beyond which second order reaches its error sooner.
//! (c) Else BDF2, unless an explicit form is cheaper than that too. Costs are counted, never measured (equal scenes give
//! equal choices): named nanoseconds per spring and node, and for BDF2 the linear iterations of a trial solve, a shift
//! of one node in the middle. Deliberately absent: XPBD and the paper's explicit form.

use crate::tissue::bdf2::LEADING;
use crate::tissue::integrator::Integrator;
use crate::tissue::network::SpringNetwork;
use crate::tissue::newton::{NewtonParams, trial_iterations};
use crate::tissue::stability::{TARGET_NUMBER, Tangent, fewest_substeps, stability_number};
use crate::vector::Vec3;
use std::fmt;

// Medians of the accuracy report on a sheet of 1246 springs (stencil) and a liver of 2106 (gather), one thread: explicit step
// 6.4 and 13.3 us, implicit step without its linear iterations 72 and 95 us, linear iteration 8.5 and 12.1 us. These
// constants give 9.0 and 13.2, 67 and 97, 8.5 and 12.2 us.

/// Explicit step: force of one spring, nanoseconds.
const SPRING_NS: f64 = 5.0;
/// Explicit step: motion of one node, nanoseconds.
const NODE_NS: f64 = 8.0;
/// Implicit step, each Newton iteration: tangent of one spring, nanoseconds.
const TANGENT_SPRING_NS: f64 = 27.0;
/// Implicit step, each Newton iteration: blocks and residual of one node, nanoseconds.
const TANGENT_NODE_NS: f64 = 45.0;
/// Implicit step, each linear iteration: product with one spring, nanoseconds.
const PRODUCT_SPRING_NS: f64 = 4.5;
/// Implicit step, each linear iteration: vectors of one node, nanoseconds.
const PRODUCT_NODE_NS: f64 = 8.3;
/// Products of a Newton iteration beyond those of its linear iterations: the size of the right-hand side.
const EXTRA_PRODUCTS: f64 = 1.0;

/// Verlet is taken where it needs at most this many times the sub-steps of semi-implicit Euler: at the same number of
/// steps its error is smaller by orders.
const WORTH_FOR_SECOND_ORDER: u32 = 2;

/// Semi-implicit sub-steps are taken while they cost at most this many implicit steps: with errors of about `1.0 h` and
/// `24 h²` per second of step (smooth pulls of 0.15 s), both then reach the same error at the same cost.
const WORTH_FOR_FIRST_ORDER: f64 = 1.5;

/// How an integrator is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChoiceParams {
    /// Share of the period that a step may cost.
    pub budget_share: f64,
    /// Most sub-steps.
    pub max_substeps: u32,
}

impl Default for ChoiceParams {
    fn default() -> Self {
        Self { budget_share: 0.5, max_substeps: 1000 }
    }
}

/// Why this integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChoiceReason {
    /// (a) One semi-implicit step is stable.
    OneStep,
    /// (b) Verlet's sub-steps fit the budget.
    SecondOrderFits,
    /// (b) Drag lets semi-implicit Euler do with far fewer sub-steps, and they fit.
    DragRules,
    /// (c) No explicit form fits the budget.
    TooStiff,
    /// Nothing fits the budget: the cheapest.
    Cheapest,
}

/// An integrator with its sub-steps, the reason, and the figures behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Integrator.
    pub integrator: Integrator,
    /// Sub-steps per period.
    pub substeps: u32,
    /// Why.
    pub reason: ChoiceReason,
    /// `S` of one semi-implicit step per period.
    pub one_step_number: f64,
    /// Sub-steps that semi-implicit Euler and Verlet need; `None` above the most allowed.
    pub needed: [Option<u32>; 2],
    /// Estimated cost of a period with the integrator taken, nanoseconds; 0 where it did not matter.
    pub cost_ns: f64,
    /// What it may cost, nanoseconds.
    pub budget_ns: f64,
}

/// Chooses for the tangent at `position_m`.
#[must_use]
pub fn choose(
    network: &SpringNetwork,
    position_m: &[Vec3],
    period_s: f64,
    newton: &NewtonParams,
    params: &ChoiceParams,
) -> Choice {
    let tangent = Tangent::at(network, position_m);
    let one_step_number = stability_number(&tangent, network, Integrator::SemiImplicit, period_s);
    let budget_ns = params.budget_share * period_s * 1e9;
    let mut choice = Choice {
        integrator: Integrator::SemiImplicit,
        substeps: 1,
        reason: ChoiceReason::OneStep,
        one_step_number,
        needed: [Some(1), None],
        cost_ns: explicit_ns(network),
        budget_ns,
    };
    if one_step_number < TARGET_NUMBER {
        return choice;
    }
    let explicit = [Integrator::SemiImplicit, Integrator::Verlet];
    choice.needed = explicit.map(|integrator| {
        let found = fewest_substeps(&tangent, network, integrator, period_s, TARGET_NUMBER, params.max_substeps);
        found.map(|(n, _)| n)
    });
    let [drag_helped, second_order] = choice.needed;
    let (integrator, substeps, reason) = match (drag_helped, second_order) {
        (Some(few), Some(many)) if many <= WORTH_FOR_SECOND_ORDER * few => {
            (Integrator::Verlet, many, ChoiceReason::SecondOrderFits)
        }
        (Some(few), _) => (Integrator::SemiImplicit, few, ChoiceReason::DragRules),
        (None, Some(many)) => (Integrator::Verlet, many, ChoiceReason::SecondOrderFits),
        (None, None) => (Integrator::Bdf2, 1, ChoiceReason::TooStiff),
    };
    (choice.integrator, choice.substeps, choice.reason) = (integrator, substeps, reason);
    choice.cost_ns = explicit_ns(network) * f64::from(substeps);
    let fits = choice.cost_ns <= budget_ns;
    if integrator == Integrator::Verlet && fits {
        return choice;
    }
    let implicit = implicit_ns(network, position_m, period_s, newton);
    if integrator == Integrator::SemiImplicit && fits && choice.cost_ns <= WORTH_FOR_FIRST_ORDER * implicit {
        return choice;
    }
    if integrator == Integrator::Bdf2 || implicit < choice.cost_ns {
        (choice.integrator, choice.substeps, choice.reason) = (Integrator::Bdf2, 1, ChoiceReason::TooStiff);
        choice.cost_ns = implicit;
    } else {
        choice.reason = ChoiceReason::Cheapest;
    }
    choice
}

/// Cost of one explicit step, nanoseconds.
fn explicit_ns(network: &SpringNetwork) -> f64 {
    SPRING_NS * network.springs.len() as f64 + NODE_NS * network.node_count() as f64
}

/// Cost of one step of BDF2, nanoseconds.
fn implicit_ns(network: &SpringNetwork, position_m: &[Vec3], period_s: f64, newton: &NewtonParams) -> f64 {
    let (springs, nodes) = (network.springs.len() as f64, network.node_count() as f64);
    let product = PRODUCT_SPRING_NS * springs + PRODUCT_NODE_NS * nodes;
    let tangent = TANGENT_SPRING_NS * springs + TANGENT_NODE_NS * nodes;
    let iterations = f64::from(trial_iterations(network, position_m, period_s / LEADING, newton));
    let each = explicit_ns(network) + tangent + product * (EXTRA_PRODUCTS + iterations);
    each * f64::from(newton.iterations)
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let needs = |n: Option<u32>| n.map_or_else(|| "too many".to_owned(), |n| n.to_string());
        let [semi, verlet] = self.needed.map(needs);
        let (s, name) = (self.one_step_number, self.integrator.name());
        let (cost, budget) = (self.cost_ns * 1e-3, self.budget_ns * 1e-3);
        write!(f, "{name} x {}: ", self.substeps)?;
        match self.reason {
            ChoiceReason::OneStep => write!(f, "S = {s:.3} < {TARGET_NUMBER} for one semi-implicit step per period"),
            ChoiceReason::SecondOrderFits => write!(
                f,
                "S = {s:.3} in one step; {verlet} Verlet steps ({semi} semi-implicit) at about {cost:.0} us fit the {budget:.0} us budget"
            ),
            ChoiceReason::DragRules => write!(
                f,
                "S = {s:.3} in one step; drag lets {semi} semi-implicit steps do ({verlet} Verlet), about {cost:.0} us of the {budget:.0} us budget"
            ),
            ChoiceReason::TooStiff => write!(
                f,
                "S = {s:.3} in one step; {semi} semi-implicit or {verlet} Verlet steps cost more than one implicit step of about {cost:.0} us (budget {budget:.0} us)"
            ),
            ChoiceReason::Cheapest => write!(
                f,
                "S = {s:.3} in one step; nothing fits the {budget:.0} us budget; this is the cheapest at about {cost:.0} us"
            ),
        }
    }
}
