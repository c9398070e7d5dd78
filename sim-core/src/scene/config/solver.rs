//! How a scene is stepped: rate, integrator, precision.
//!
//! Absent: what the names mean (`tissue::integrator`, `tissue::sweep`), the choice itself (`tissue::choice`).

use serde::{Deserialize, Serialize};

use crate::scene::sleep::SleepReading;

/// Time stepping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolverConfig {
    /// Solver rate, hertz.
    pub rate_hz: f64,
    /// Integrator; automatic when left out.
    #[serde(default)]
    pub integrator: IntegratorReading,
    /// Numbers of the force sweeps; double when left out.
    #[serde(default)]
    pub precision: PrecisionReading,
    /// Hands for the spring forces of a big mesh; the sweep is not divided when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub threads: Option<u32>,
    /// More sub-steps than this per step are refused for an integrator by name; the automatic choice goes by their cost.
    pub max_substeps: u32,
    /// Rings of nodes around a handle that enter its port stiffness.
    pub port_rings: u32,
    /// Whether nodes at rest are left out of the steps.
    #[serde(default)]
    pub sleep: SleepReading,
    /// How far a node at rest may be from where its springs want it, nanometres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleep_tolerance_nm: Option<f64>,
}

/// Precision by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PrecisionReading {
    /// `f64` throughout.
    #[default]
    Double,
    /// Spring forces in `f32`, for the explicit integrators.
    Single,
}

/// Integrator by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IntegratorReading {
    /// Chosen at load by the stability number and the time budget.
    #[default]
    Automatic,
    /// Semi-implicit Euler, implicit drag.
    SemiImplicit,
    /// Eq. (2)–(3) as printed: explicit drag.
    PaperExplicit,
    /// Staggered Verlet, Crank–Nicolson drag.
    Verlet,
    /// Implicit: second-order backward differences.
    Bdf2,
    /// Extended position-based dynamics, for comparison.
    Xpbd,
}
