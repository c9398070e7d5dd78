//! Parameters of the tissue solver, and the choice of its sub-steps in words.
//!
//! The stability number decides (`stability`): automatic sub-steps keep `S` below its target,
//! demanded sub-steps are refused when `S ≥ 1`. A refusal says which mass or which step would do.
//! Deliberately absent: running on silently where the integrator must blow up.

use crate::finite::is_finite;
use crate::tissue::choice::{Choice, ChoiceParams, choose};
use crate::tissue::integrator::Integrator;
use crate::tissue::network::{SpringFamily, SpringNetwork, TissueState};
use crate::tissue::newton::NewtonParams;
use crate::tissue::port::PortParams;
use crate::tissue::sleep::params::SleepParams;
use crate::tissue::stability::{
    Stability, SubstepReason, TARGET_NUMBER, Tangent, fewest_substeps, lambda_max, stability_number,
};
use crate::tissue::sweep::Precision;
use crate::vector::Vec3;

/// Longest search for a step that would do, in sub-steps.
const SUBSTEP_SEARCH_LIMIT: u32 = 1_000_000;

/// Sub-steps of XPBD where none are demanded: small steps with one iteration each beat more iterations.
const XPBD_SUBSTEPS: u32 = 10;

/// How the sub-steps of a period are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubstepPolicy {
    /// As few as the stability number asks for, refused above `max`.
    Automatic {
        /// Most sub-steps.
        max: u32,
    },
    /// This many; refused where they cannot be stable.
    Demanded(u32),
}

/// Parameters of a [`crate::tissue::solver::TissueSolver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverParams {
    /// Solver period, seconds.
    pub period_s: f64,
    /// Integrator.
    pub integrator: Integrator,
    /// Choice of sub-steps.
    pub substeps: SubstepPolicy,
    /// Chooses integrator and sub-steps instead, at load and at every reassessment; `None` takes those above.
    pub automatic: Option<ChoiceParams>,
    /// Farthest one stage (Eq. (2), then the constraints) moves a free node in one period, in mesh spacings: half a
    /// spacing each.
    pub displacement_limit_spacings: f64,
    /// Farthest a handle moves in one period, in mesh spacings: a hand at 0.8 m/s on a 2 mm mesh at 5 ms.
    pub handle_limit_spacings: f64,
    /// Numbers of the force sweeps of the explicit integrators; BDF2 and XPBD always take double precision.
    pub precision: Precision,
    /// How far the steps of BDF2 are solved.
    pub newton: NewtonParams,
    /// Sweeps over all springs per sub-step of XPBD.
    pub xpbd_iterations: u32,
    /// The ports of the handles.
    pub port: PortParams,
    /// Nodes at rest are left out of the steps, where the integrator can; `None` never leaves one out.
    pub sleep: Option<SleepParams>,
}

impl SolverParams {
    /// Defaults for a period: semi-implicit, automatic sub-steps.
    #[must_use]
    pub fn with_period(period_s: f64) -> Self {
        Self {
            period_s,
            integrator: Integrator::SemiImplicit,
            substeps: SubstepPolicy::Automatic { max: 64 },
            automatic: None,
            displacement_limit_spacings: 0.5,
            handle_limit_spacings: 2.0,
            precision: Precision::Double,
            newton: NewtonParams::default(),
            xpbd_iterations: 1,
            port: PortParams::default(),
            sleep: None,
        }
    }

    /// Numbers that the force sweeps take with this integrator.
    #[must_use]
    pub fn sweep_precision(&self) -> Precision {
        match self.integrator {
            Integrator::Bdf2 | Integrator::Xpbd => Precision::Double,
            Integrator::SemiImplicit | Integrator::PaperExplicit | Integrator::Verlet => self.precision,
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`SolverError::Value`] names the first value that cannot be used.
    pub fn check(&self) -> Result<(), SolverError> {
        let p = &self.port;
        let positive = [
            ("solver period", self.period_s),
            ("displacement limit", self.displacement_limit_spacings),
            ("handle limit", self.handle_limit_spacings),
            ("trust radius of the port", p.trust_radius_m),
            ("tolerance of the port", p.tolerance),
            ("tolerance of Newton's method", self.newton.tolerance),
            ("tolerance of the linear solve", self.newton.linear_tolerance),
        ];
        let sleep = self.sleep.map(|s| ("tolerance of sleeping nodes", s.tolerance_m));
        if let Some(&(what, value)) = positive.iter().chain(&sleep).find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
            return Err(SolverError::Value { what, value });
        }
        if !(p.minimum_stiffness_n_per_m.is_finite() && p.minimum_stiffness_n_per_m >= 0.0) {
            return Err(SolverError::Value { what: "least stiffness of the port", value: p.minimum_stiffness_n_per_m });
        }
        if let Some(a) = self.automatic
            && !(a.budget_share.is_finite() && a.budget_share > 0.0 && a.max_substeps > 0)
        {
            return Err(SolverError::Value { what: "budget of the automatic choice", value: a.budget_share });
        }
        let (SubstepPolicy::Automatic { max: count } | SubstepPolicy::Demanded(count)) = self.substeps;
        if count == 0 {
            return Err(SolverError::Value { what: "number of sub-steps", value: 0.0 });
        }
        let counts = [
            ("number of XPBD sweeps", self.xpbd_iterations),
            ("number of Newton iterations", self.newton.iterations),
            ("number of linear iterations", self.newton.max_linear_iterations),
        ];
        if let Some(&(what, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return Err(SolverError::Value { what, value: 0.0 });
        }
        Ok(())
    }
}

/// Why a solver is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolverError {
    /// A parameter that cannot be used.
    #[error("{what} is {value}; it must be finite and above 0")]
    Value {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Patches of another network.
    #[error("a patch names a node beyond the {0} nodes of the network; build the patches from this network")]
    Patches(usize),
    /// A state that cannot be used.
    #[error("the state does not fit: {0}")]
    State(&'static str),
    /// The integrator must blow up.
    #[error(
        "{} must blow up here: S = {number:.3} at steps of {:.4} ms, and the limit {} needs S < 1; \
         it would take a node mass of {:.3} g instead of {:.3} g, or steps of at most {:.4} ms ({} per period); \
         choose another integrator, a shorter period, more sub-steps or heavier nodes",
        integrator.name(), step_s * 1e3, limit_formula(*integrator), mass_needed_kg * 1e3, mass_kg * 1e3,
        step_needed_s * 1e3, substeps_needed
    )]
    Unstable {
        /// Integrator.
        integrator: Integrator,
        /// Stability number at the step asked for.
        number: f64,
        /// Step asked for, seconds.
        step_s: f64,
        /// Lightest node, kilograms.
        mass_kg: f64,
        /// What it would have to weigh, all masses in proportion, kilograms.
        mass_needed_kg: f64,
        /// Step that would do, seconds.
        step_needed_s: f64,
        /// Sub-steps that would do.
        substeps_needed: u32,
    },
}

const fn limit_formula(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::SemiImplicit | Integrator::Bdf2 | Integrator::Xpbd => "lambda h^2 < 4 m + 2 c h",
        Integrator::Verlet => "lambda h^2 < 4 m",
        Integrator::PaperExplicit => "lambda h^2 + 2 c h < 4 m",
    }
}

/// Integrator and sub-steps where they are chosen automatically.
pub(crate) fn decide(
    network: &SpringNetwork,
    position_m: &[Vec3],
    params: SolverParams,
) -> (SolverParams, Option<Choice>) {
    let Some(automatic) = &params.automatic else { return (params, None) };
    let choice = choose(network, position_m, params.period_s, &params.newton, automatic);
    let substeps = SubstepPolicy::Demanded(choice.substeps);
    (SolverParams { integrator: choice.integrator, substeps, ..params }, Some(choice))
}

/// Chooses the sub-steps for the tangent at `position_m`.
pub(crate) fn assess(
    network: &SpringNetwork,
    position_m: &[Vec3],
    params: &SolverParams,
) -> Result<Stability, SolverError> {
    let tangent = Tangent::at(network, position_m);
    let (integrator, period_s) = (params.integrator, params.period_s);
    let number_of = |n: u32| stability_number(&tangent, network, integrator, period_s / f64::from(n));
    let chosen = match params.substeps {
        SubstepPolicy::Automatic { max } if integrator.is_stable_at_any_step() => {
            let substeps = if integrator == Integrator::Xpbd { XPBD_SUBSTEPS.min(max) } else { 1 };
            Some((substeps, number_of(substeps), SubstepReason::AnyIsStable))
        }
        SubstepPolicy::Automatic { max } => {
            fewest_substeps(&tangent, network, integrator, period_s, TARGET_NUMBER, max)
                .map(|(n, number)| (n, number, if n == 1 { SubstepReason::OneIsEnough } else { SubstepReason::Chosen }))
        }
        SubstepPolicy::Demanded(n) => {
            let number = number_of(n);
            let usable = number < 1.0 || integrator.is_stable_at_any_step();
            usable.then_some((n, number, SubstepReason::Demanded))
        }
    };
    let Some((substeps, number, reason)) = chosen else {
        return Err(refusal(&tangent, network, params));
    };
    let lambda_max_n_per_m = lambda_max(&tangent);
    Ok(Stability { integrator, period_s, substeps, lambda_max_n_per_m, number, reason })
}

fn refusal(tangent: &Tangent, network: &SpringNetwork, params: &SolverParams) -> SolverError {
    let (SubstepPolicy::Automatic { max: count } | SubstepPolicy::Demanded(count)) = params.substeps;
    let (integrator, period_s) = (params.integrator, params.period_s);
    let h = period_s / f64::from(count);
    let number = stability_number(tangent, network, integrator, h);
    let target = match params.substeps {
        SubstepPolicy::Automatic { .. } => TARGET_NUMBER,
        SubstepPolicy::Demanded(_) => 1.0,
    };
    let nodes = network.mass_kg.iter().zip(&network.drag_n_s_per_m);
    let (mass_kg, drag) = nodes.min_by(|a, b| a.0.total_cmp(b.0)).map_or((f64::NAN, f64::NAN), |(m, c)| (*m, *c));
    let helping_drag_kg = match integrator {
        Integrator::SemiImplicit | Integrator::Bdf2 | Integrator::Xpbd => 0.5 * drag * h,
        Integrator::PaperExplicit | Integrator::Verlet => 0.0,
    };
    let substeps_needed = fewest_substeps(tangent, network, integrator, period_s, target, SUBSTEP_SEARCH_LIMIT)
        .map_or(SUBSTEP_SEARCH_LIMIT, |(n, _)| n);
    SolverError::Unstable {
        integrator,
        number,
        step_s: h,
        mass_kg,
        mass_needed_kg: (mass_kg + helping_drag_kg) * number - helping_drag_kg,
        step_needed_s: period_s / f64::from(substeps_needed),
        substeps_needed,
    }
}

/// Checks that a state fits a network of `nodes` nodes.
pub(crate) fn check_state(state: &TissueState, nodes: usize) -> Result<(), SolverError> {
    if state.position_m.len() != nodes || state.velocity_m_per_s.len() != nodes {
        return Err(SolverError::State("it has another number of nodes than the network; use a state of this network"));
    }
    if !state.position_m.iter().chain(&state.velocity_m_per_s).all(is_finite) {
        return Err(SolverError::State("it holds a value that is not finite; restore an earlier state"));
    }
    Ok(())
}

/// Mean rest length of the structural springs, of all springs without those, or 1 m without any.
pub(crate) fn mean_spacing_m(network: &SpringNetwork) -> f64 {
    let mean = |structural_only: bool| {
        let kept = network.springs.iter().filter(|s| !structural_only || s.family == SpringFamily::Structural);
        let (sum, count) = kept.fold((0.0, 0_u32), |(sum, n), s| (sum + s.rest_length_m, n + 1));
        (count > 0 && sum > 0.0).then(|| sum / f64::from(count))
    };
    mean(true).or_else(|| mean(false)).unwrap_or(1.0)
}
