//! From what a scene file says to a tissue at rest: millimetres and N/mm become SI here, once.

use super::config::{DragReading as DragChoice, IntegratorReading, MaterialConfig, SceneConfig, TissueConfig};
use super::plan::in_range;
use crate::suture_line::line::SutureLineError;
use crate::tissue::integrator::Integrator;
use crate::tissue::model::{Tissue, TissueError};
use crate::tissue::params::{DragReading, FamilyFactors, MaterialParams, PatchDepth, WoundParams};
use crate::tissue::patch_set::PatchError;
use crate::tissue::port::PortParams;
use crate::tissue::regulation::AttachmentError;
use crate::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use crate::tissue::triangle_mesh::TriangleMesh;
use crate::tissue::ttsm::{self, TtsmParams};
use crate::tissue::utsm::{self, HeldRim, UtsmParams};
use crate::tissue::vosm::{self, HeldRegion, OrganSurface, VosmParams, WoundSite};
use crate::units::{KilogramsPerCubicMetre, Metres, NewtonSecondsPerMetre, NewtonsPerMetre, UnitError};
use crate::vector::Vec3;

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
    /// Suture control without a suture line.
    #[error("the scene has a [control] section but no [line]; add [line] or remove [control]")]
    ControlWithoutLine,
    /// A mesh is named but was not loaded, or the other way round.
    #[error("the scene names the mesh {0} but none was imported; load the scene with its folder")]
    MeshMissing(String),
    /// Organ parameters were asked of another model.
    #[error("the scene's tissue is not an organ; set model = \"vosm\"")]
    NotAnOrgan,
    /// The procedure is empty.
    #[error("a procedure needs at least one scene")]
    NoScene,
    /// The tissue cannot be built.
    #[error(transparent)]
    Tissue(#[from] TissueError),
    /// A unit out of range.
    #[error(transparent)]
    Unit(#[from] UnitError),
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
    let mm = Metres::from_mm;
    let surface_wound = wound(config, PatchDepth::Surface)?;
    let deep_wound = wound(config, PatchDepth::CutLayers)?;
    let tissue = match &config.tissue {
        TissueConfig::Utsm { width_mm, length_mm, spacing_mm, pre_strain } => utsm::build(&UtsmParams {
            width: mm(*width_mm)?,
            length: mm(*length_mm)?,
            spacing: mm(*spacing_mm)?,
            thickness: mm(config.material.thickness_mm)?,
            held: HeldRim::All,
            pre_strain: *pre_strain,
            material,
            wound: surface_wound,
        })?,
        TissueConfig::Vosm { .. } => vosm::build(&vosm_params(config, mesh, material, deep_wound)?)?,
        TissueConfig::Ttsm { radius_mm, length_mm, wall_mm, layers, around, along } => ttsm::build(&TtsmParams {
            radius: mm(*radius_mm)?,
            length: mm(*length_mm)?,
            wall: mm(*wall_mm)?,
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
        shell_distance: Metres::from_mm(*shell_distance_mm)?,
        layer_thickness: Metres::from_mm(config.material.thickness_mm)?,
        held: HeldRegion::Beyond(Metres::from_mm(*free_radius_mm)?),
        site: WoundSite { near_m: Vec3::from(*wound_near_mm) * 1e-3, along: Vec3::from(*wound_along) },
        material,
        wound,
    })
}

fn material(m: &MaterialConfig) -> Result<MaterialParams, SceneError> {
    let drag = NewtonSecondsPerMetre::new(m.drag_n_s_per_m)?;
    Ok(MaterialParams {
        stiffness: NewtonsPerMetre::from_n_per_mm(m.stiffness_n_per_mm)?,
        factors: FamilyFactors::default(),
        drag: match m.drag {
            DragChoice::PerNode => DragReading::PerNode(drag),
            DragChoice::PerArea => DragReading::PerArea { drag, spacing: Metres::from_mm(m.drag_reference_mm)? },
        },
        density: KilogramsPerCubicMetre::new(m.density_kg_per_m3)?,
    })
}

fn wound(config: &SceneConfig, patch_depth: PatchDepth) -> Result<WoundParams, SceneError> {
    Ok(WoundParams {
        length: Metres::from_mm(config.wound.length_mm)?,
        gap: Metres::from_mm(config.wound.gap_mm)?,
        depth: Metres::from_mm(config.wound.depth_mm)?,
        pairs: config.suture.pairs,
        bite: Metres::from_mm(config.suture.bite_mm)?,
        patch_radius: Metres::from_mm(config.suture.patch_radius_mm)?,
        patch_depth,
    })
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
            IntegratorReading::SemiImplicit => Integrator::SemiImplicit,
            IntegratorReading::PaperExplicit => Integrator::PaperExplicit,
        },
        substeps: SubstepPolicy::Automatic { max: s.max_substeps },
        port: PortParams { rings: rings as u32, ..defaults.port },
        ..defaults
    })
}
