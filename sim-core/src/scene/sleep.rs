//! Whether nodes at rest sleep, as a scene file says it.
//!
//! `sleep_tolerance_nm` is how far a node at rest may be from where its own springs want it (`tissue::sleep`). Integrators
//! that solve for all nodes at once (BDF2, XPBD), the printed explicit form, and forces in single precision let nobody sleep:
//! `automatic` then does without, but a demand for it is refused.

use serde::{Deserialize, Serialize};

use super::build::SceneError;
use super::config::SolverConfig;
use super::plan::{built, in_range};
use crate::absent::SLEEP;
use crate::tissue::sleep::params::SleepParams;
use crate::tissue::solver::TissueSolver;

/// Nodes at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SleepReading {
    /// Sleep where the integrator can leave them out.
    Automatic,
    /// Must sleep.
    On,
    /// Are worked on like all others.
    #[default]
    Off,
}

/// What the solver is asked for.
pub(super) fn sleep_params(config: &SolverConfig) -> Result<Option<SleepParams>, SceneError> {
    if config.sleep != SleepReading::Off {
        built("solver", SLEEP)?;
    }
    let tolerance_m = match config.sleep_tolerance_nm {
        Some(nm) => in_range("solver.sleep_tolerance_nm", nm, 1e-3, 1e3, "0.001 to 1000")? * 1e-9,
        None => SleepParams::default().tolerance_m,
    };
    Ok((config.sleep != SleepReading::Off).then_some(SleepParams { tolerance_m }))
}

/// Refuses a demand that the integrator cannot meet.
pub(super) fn require_sleep(config: &SolverConfig, solver: &TissueSolver) -> Result<(), SceneError> {
    if config.sleep == SleepReading::On && solver.awake_nodes().is_none() {
        return Err(SceneError::Reading {
            key: "solver.sleep",
            found: "on",
            needs: "needs double precision and an integrator that moves each node by itself; leave solver.precision out and \
                    set solver.integrator = \"semi_implicit\" or \"verlet\", or set solver.sleep = \"automatic\"",
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::config::{IntegratorReading, PrecisionReading};
    use crate::scene::presets;
    use crate::scene::step::Scene;

    #[test]
    fn a_demand_is_refused_where_the_integrator_solves_for_all_nodes() {
        let mut config = presets::vessel();
        for integrator in [IntegratorReading::Bdf2, IntegratorReading::Xpbd, IntegratorReading::PaperExplicit] {
            (config.solver.integrator, config.solver.sleep) = (integrator, SleepReading::Automatic);
            config.solver.max_substeps = 10_000;
            assert_eq!(Scene::new(&config, None).unwrap().solver().awake_nodes(), None, "{integrator:?}");
            config.solver.sleep = SleepReading::On;
            let error = Scene::new(&config, None).unwrap_err().to_string();
            assert!(error.contains("solver.sleep") && error.contains("semi_implicit"), "{error}");
        }
    }

    #[test]
    fn a_demand_is_refused_in_single_precision() {
        let mut config = presets::vessel();
        (config.solver.integrator, config.solver.sleep) = (IntegratorReading::SemiImplicit, SleepReading::On);
        assert!(Scene::new(&config, None).is_ok());
        config.solver.precision = PrecisionReading::Single;
        let error = Scene::new(&config, None).unwrap_err().to_string();
        assert!(error.contains("double precision"), "{error}");
    }

    #[test]
    fn tolerances_out_of_range_are_refused() {
        for nm in [0.0, -1.0, f64::NAN, f64::INFINITY, 2e3] {
            let mut config = presets::skin();
            config.solver.sleep_tolerance_nm = Some(nm);
            let error = sleep_params(&config.solver).unwrap_err().to_string();
            assert!(error.contains("solver.sleep_tolerance_nm"), "{error}");
        }
    }
}
