//! From what a scene file says to a tissue at rest: millimetres and N/mm become SI here, once.

use super::config::{
    DragReading as DragChoice, IntegratorReading, MaterialConfig, PrecisionReading, SceneConfig, SolverConfig,
    TissueConfig,
};
use super::plan::{built, in_range};
use super::sleep::sleep_params;
use crate::absent::INNER_LAYERS;
use crate::kinematics::literal_tick::MAX_SUBSTEPS;
use crate::suture_line::line::SutureLineError;
use crate::tissue::choice::ChoiceParams;
use crate::tissue::integrator::Integrator;
use crate::tissue::model::{Tissue, TissueError};
use crate::tissue::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use crate::tissue::patch_set::PatchError;
use crate::tissue::port::PortParams;
use crate::tissue::regulation::AttachmentError;
use crate::tissue::settle::{SettleEnd, Settled};
use crate::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use crate::tissue::sweep::Precision;
use crate::tissue::triangle_mesh::TriangleMesh;
use crate::tissue::ttsm::{self, TtsmParams};
use crate::tissue::utsm::{self, HeldRim, UtsmParams};
use crate::tissue::vosm::{self, HeldRegion, OrganSurface, VosmParams, WoundSite};
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre, UnitError};
use crate::vector::Vec3;

/// Most suture pairs of a scene: 32 suture points with at most 48 constraints, swept in every sub-step; the paper's
/// whole procedure has 12 pairs.
const MAX_PAIRS: f64 = 16.0;

/// Why a scene is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A value out of range.
    #[error("{key} is {found}; allowed is {allowed}")]
    Value {
        /// Key in the scene file.
        key: &'static str,
        /// What was found.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Two choices that do not go together.
    #[error("{key} = \"{found}\" {needs}")]
    Reading {
        /// Key in the scene file.
        key: &'static str,
        /// What was chosen.
        found: &'static str,
        /// What it needs, and the remedy.
        needs: &'static str,
    },
    /// The literal form of Eq. (2) cannot be stable within its sub-steps.
    #[error(
        "suture.kinematics = \"literal\" must blow up at suture point {point}: K h^2 + 2 c h < 4 m does not hold with \
         K = {stiffness_n_per_m:.0} N/m, c = {drag_n_s_per_m:.2} N*s/m, m = {:.3} g even at h = {:.4} ms ({} sub-steps of a \
         1 kHz tick); set suture.point_mass_g {:.2} g higher, or use \"implicit_drag\"",
        mass_kg * 1e3, 1.0 / f64::from(MAX_SUBSTEPS), MAX_SUBSTEPS, (mass_needed_kg - mass_kg) * 1e3
    )]
    LiteralUnstable {
        /// Suture point, in order left, right by pair.
        point: usize,
        /// Bound on what it feels of tissue, coupling and line, newtons per metre.
        stiffness_n_per_m: f64,
        /// Bound on its drag, newton seconds per metre.
        drag_n_s_per_m: f64,
        /// Its mass, kilograms.
        mass_kg: f64,
        /// The mass that would do, kilograms.
        mass_needed_kg: f64,
    },
    /// Suture control without a suture line.
    #[error("the scene has a [control] section but no [line]; add [line] or remove [control]")]
    ControlWithoutLine,
    /// A stage that this build leaves out.
    #[error("this build leaves out what [{0}] asks for; take one with all features, or remove the section")]
    NotBuilt(&'static str),
    /// A mesh is named but was not loaded, or the other way round.
    #[error("the scene names the mesh {0} but none was imported; load the scene with its folder")]
    MeshMissing(String),
    /// Organ parameters were asked of another model.
    #[error("the scene's tissue is not an organ; set model = \"vosm\"")]
    NotAnOrgan,
    /// The procedure is empty.
    #[error("a procedure needs at least one scene")]
    NoScene,
    /// The tissue found no rest.
    #[error(
        "the tissue does not come to rest: {residual_n:.3e} N are left on a node after {iterations} iterations; \
         use a smaller pre_strain or a coarser, more regular mesh"
    )]
    Unsettled {
        /// Largest force left on a free node, newtons.
        residual_n: f64,
        /// Iterations used.
        iterations: u32,
    },
    /// The tissue cannot be built.
    #[error(transparent)]
    Tissue(#[from] TissueError),
    /// A quantity out of range.
    #[error("{key}: {error}")]
    Unit {
        /// Key in the scene file.
        key: &'static str,
        /// The quantity in SI units, and its range.
        error: UnitError,
    },
    /// Suture point patches cannot be used.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// Attachments cannot be used.
    #[error(transparent)]
    Attachment(#[from] AttachmentError),
    /// The suture line cannot be used.
    #[error(transparent)]
    Line(#[from] SutureLineError),
    /// The integrator cannot be used.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

/// Builds the tissue of a scene.
///
/// # Errors
/// [`SceneError`] with key or quantity, what was found and what is allowed.
pub fn build_tissue(config: &SceneConfig, mesh: Option<&TriangleMesh>) -> Result<Tissue, SceneError> {
    let material = material(&config.material)?;
    let surface_wound = wound(config, PatchDepth::Surface)?;
    let deep_wound = wound(config, PatchDepth::CutLayers)?;
    built("tissue", INNER_LAYERS || matches!(config.tissue, TissueConfig::Utsm { .. }))?;
    let tissue = match &config.tissue {
        TissueConfig::Utsm { width_mm, length_mm, spacing_mm, pre_strain } => utsm::build(&UtsmParams {
            width: metres("tissue.width_mm", *width_mm)?,
            length: metres("tissue.length_mm", *length_mm)?,
            spacing: metres("tissue.spacing_mm", *spacing_mm)?,
            thickness: metres("material.thickness_mm", config.material.thickness_mm)?,
            held: HeldRim::All,
            pre_strain: *pre_strain,
            material,
            wound: surface_wound,
        })?,
        TissueConfig::Vosm { .. } => vosm::build(&vosm_params(config, mesh, material, deep_wound)?)?,
        TissueConfig::Ttsm { radius_mm, length_mm, wall_mm, layers, around, along } => ttsm::build(&TtsmParams {
            radius: metres("tissue.radius_mm", *radius_mm)?,
            length: metres("tissue.length_mm", *length_mm)?,
            wall: metres("tissue.wall_mm", *wall_mm)?,
            layers: *layers,
            cells_around: *around,
            cells_along: *along,
            material,
            wound: deep_wound,
        })?,
    };
    Ok(tissue)
}

fn vosm_params(
    config: &SceneConfig,
    mesh: Option<&TriangleMesh>,
    material: MaterialParams,
    wound: WoundParams,
) -> Result<VosmParams, SceneError> {
    let TissueConfig::Vosm {
        half_axes_mm,
        taper,
        subdivisions,
        mesh: name,
        shell_distance_mm,
        free_radius_mm,
        wound_near_mm,
        wound_along,
        ..
    } = &config.tissue
    else {
        return Err(SceneError::NotAnOrgan);
    };
    let surface = match (name, mesh) {
        (None, _) => OrganSurface::Lobe {
            half_axes_m: Vec3::from(*half_axes_mm) * 1e-3,
            taper: *taper,
            subdivision: *subdivisions,
        },
        (Some(_), Some(mesh)) => OrganSurface::Mesh(mesh.clone()),
        (Some(name), None) => return Err(SceneError::MeshMissing(name.clone())),
    };
    Ok(VosmParams {
        surface,
        shell_distance: metres("tissue.shell_distance_mm", *shell_distance_mm)?,
        layer_thickness: metres("material.thickness_mm", config.material.thickness_mm)?,
        held: HeldRegion::Beyond(metres("tissue.free_radius_mm", *free_radius_mm)?),
        site: WoundSite { near_m: Vec3::from(*wound_near_mm) * 1e-3, along: Vec3::from(*wound_along) },
        material,
        wound,
    })
}

fn metres(key: &'static str, value_mm: f64) -> Result<Metres, SceneError> {
    Metres::from_mm(value_mm).map_err(|error| SceneError::Unit { key, error })
}

fn material(m: &MaterialConfig) -> Result<MaterialParams, SceneError> {
    let at = |key| move |error| SceneError::Unit { key, error };
    let drag = NewtonSecondsPerMetre::new(m.drag_n_s_per_m).map_err(at("material.drag_n_s_per_m"))?;
    let stiffness = NewtonsPerMetre::from_n_per_mm(m.stiffness_n_per_mm).map_err(at("material.stiffness_n_per_mm"))?;
    let density = KilogramsPerCubicMetre::new(m.density_kg_per_m3).map_err(at("material.density_kg_per_m3"))?;
    Ok(MaterialParams {
        stiffness,
        factors: FamilyFactors::default(),
        drag: match m.drag {
            DragChoice::PerNode => DragReading::PerNode(drag),
            DragChoice::PerArea => {
                DragReading::PerArea { drag, spacing: metres("material.drag_reference_mm", m.drag_reference_mm)? }
            }
        },
        density,
    })
}

fn wound(config: &SceneConfig, patch_depth: PatchDepth) -> Result<WoundParams, SceneError> {
    Ok(WoundParams {
        length: metres("wound.length_mm", config.wound.length_mm)?,
        gap: metres("wound.gap_mm", config.wound.gap_mm)?,
        depth: metres("wound.depth_mm", config.wound.depth_mm)?,
        pairs: in_range("suture.pairs", f64::from(config.suture.pairs), 1.0, MAX_PAIRS, "1 to 16")? as u32,
        bite: metres("suture.bite_mm", config.suture.bite_mm)?,
        patch_radius: metres("suture.patch_radius_mm", config.suture.patch_radius_mm)?,
        patch_depth,
    })
}

/// Accepts a tissue that has come to rest; any other would move by itself, and its distances would mean nothing.
pub(super) fn require_rest(settled: Settled) -> Result<Settled, SceneError> {
    match settled.end {
        SettleEnd::Converged => Ok(settled),
        SettleEnd::IterationsSpent | SettleEnd::Diverged => {
            Err(SceneError::Unsettled { residual_n: settled.residual_n, iterations: settled.iterations })
        }
    }
}

/// How many hands a scene asks for.
pub(super) fn hands(config: &SolverConfig) -> Result<Option<u32>, SceneError> {
    if let Some(threads) = config.threads {
        in_range("solver.threads", f64::from(threads), 1.0, 64.0, "1 to 64")?;
    }
    Ok(config.threads)
}

/// Solver parameters of a scene.
///
/// # Errors
/// [`SceneError::Value`] for a rate outside 10 Hz to 10 kHz or no sub-step at all.
pub fn solver_params(config: &SceneConfig) -> Result<SolverParams, SceneError> {
    let s = &config.solver;
    let rate = in_range("solver.rate_hz", s.rate_hz, 10.0, 10_000.0, "10 to 10000")?;
    in_range("solver.max_substeps", f64::from(s.max_substeps), 1.0, 100_000.0, "1 to 100000")?;
    let rings = in_range("solver.port_rings", f64::from(s.port_rings), 1.0, 64.0, "1 to 64")?;
    let defaults = SolverParams::with_period(1.0 / rate);
    Ok(SolverParams {
        integrator: match s.integrator {
            IntegratorReading::Automatic | IntegratorReading::SemiImplicit => Integrator::SemiImplicit,
            IntegratorReading::PaperExplicit => Integrator::PaperExplicit,
            IntegratorReading::Verlet => Integrator::Verlet,
            IntegratorReading::Bdf2 => Integrator::Bdf2,
            IntegratorReading::Xpbd => Integrator::Xpbd,
        },
        precision: match s.precision {
            PrecisionReading::Double => Precision::Double,
            PrecisionReading::Single => Precision::Single,
        },
        // What sub-steps cost decides here, not how many they are.
        automatic: (s.integrator == IntegratorReading::Automatic).then(ChoiceParams::default),
        substeps: SubstepPolicy::Automatic { max: s.max_substeps },
        port: PortParams { rings: rings as u32, ..defaults.port },
        sleep: sleep_params(s)?,
        ..defaults
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    #[test]
    fn a_tissue_that_found_no_rest_is_refused_with_what_is_left() {
        let end = |end| require_rest(Settled { residual_n: 0.25, iterations: 7, end });
        assert!(end(SettleEnd::Converged).is_ok());
        for spent in [SettleEnd::IterationsSpent, SettleEnd::Diverged] {
            let error = end(spent).unwrap_err();
            assert_eq!(error, SceneError::Unsettled { residual_n: 0.25, iterations: 7 });
            assert!(error.to_string().contains("2.500e-1 N") && error.to_string().contains("pre_strain"), "{error}");
        }
    }

    #[test]
    fn the_automatic_choice_goes_by_cost_and_not_by_the_limit_of_named_integrators() {
        let mut config = presets::skin();
        config.solver.max_substeps = 1;
        let params = solver_params(&config).unwrap();
        assert_eq!(params.automatic, Some(ChoiceParams::default()));
        assert_eq!(params.substeps, SubstepPolicy::Automatic { max: 1 });
    }

    #[test]
    fn a_quantity_out_of_range_names_its_key() {
        let mut config = presets::skin();
        config.wound.gap_mm = -1.0;
        let error = build_tissue(&config, None).unwrap_err().to_string();
        assert!(error.starts_with("wound.gap_mm: length is -0.001 m"), "{error}");
    }

    #[test]
    fn no_pair_and_more_than_a_scene_may_have_are_refused_before_the_tissue_is_built() {
        for pairs in [0, 17] {
            let mut config = presets::skin();
            config.suture.pairs = pairs;
            let expected = SceneError::Value { key: "suture.pairs", found: f64::from(pairs), allowed: "1 to 16" };
            assert_eq!(build_tissue(&config, None).unwrap_err(), expected);
        }
    }
}
