//! The three scenes of the paper with the values of Table 2.
//!
//! | | k (N/mm) | c (N·s/m) | β |
//! |---|---|---|---|
//! | skin | 0.16 | 3 | 0.8 |
//! | liver | 0.18 | 3 | 0.6 |
//! | hepatic vessel | 0.27 | 2 | 0.4 |
//!
//! The paper gives no size, mass or step. Sizes are anatomical, densities and thicknesses from tissue data;
//! c is taken per node at the preset's own mean spacing (for the vessel: mean over its layers).

use super::config::{
    AttachmentConfig, AttachmentReading, ControlConfig, ControlReading, DistanceReading, DragReading,
    IntegratorReading, KinematicsReading, LineConfig, MaterialConfig, PrecisionReading, SceneConfig, SolverConfig,
    SpringLawReading, SutureConfig, TissueConfig, VelocityReading, WoundConfig,
};
use super::sleep::SleepReading;

/// One row of Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table2 {
    /// k, N/mm.
    pub stiffness_n_per_mm: f64,
    /// c, N·s/m.
    pub drag_n_s_per_m: f64,
    /// β.
    pub beta: f64,
}

/// Table 2, skin.
pub const SKIN: Table2 = Table2 { stiffness_n_per_mm: 0.16, drag_n_s_per_m: 3.0, beta: 0.8 };
/// Table 2, liver.
pub const LIVER: Table2 = Table2 { stiffness_n_per_mm: 0.18, drag_n_s_per_m: 3.0, beta: 0.6 };
/// Table 2, hepatic vascular.
pub const VESSEL: Table2 = Table2 { stiffness_n_per_mm: 0.27, drag_n_s_per_m: 2.0, beta: 0.4 };

/// β is converted at the step of a 60 Hz display loop: the paper names no step, and its platform drew by
/// OpenGL on a desktop screen.
const BETA_REFERENCE_MS: f64 = 1000.0 / 60.0;

/// EA of 3-0 silk: modulus 8.7 GPa (Naleway et al. 2015) on a diameter of 0.2 mm, newtons.
const SILK_3_0_N: f64 = 273.0;

/// Skin: a sheet of 60 × 44 mm with a slit of 30 mm.
#[must_use]
pub fn skin() -> SceneConfig {
    SceneConfig {
        name: "skin".into(),
        tissue: TissueConfig::Utsm { width_mm: 60.0, length_mm: 44.0, spacing_mm: 2.0, pre_strain: 0.05 },
        material: material(SKIN, 2.0, 1100.0, 1.75),
        wound: wound(32.0, 3.0, 1.75),
        suture: suture(2.0, 2.1),
        attachment: Some(attachment(SKIN, 6.0)),
        line: Some(line()),
        control: Some(control()),
        solver: solver(),
    }
}

/// Liver: an organ of 90 × 64 × 44 mm with a slit of 32 mm through both shells.
#[must_use]
pub fn liver() -> SceneConfig {
    SceneConfig {
        name: "liver".into(),
        tissue: TissueConfig::Vosm {
            half_axes_mm: [45.0, 32.0, 22.0],
            taper: 0.35,
            subdivisions: 4,
            mesh: None,
            mesh_unit_mm: 1.0,
            wound_near_mm: [0.0, 0.0, 10_000.0],
            wound_along: [0.0, 1.0, 0.0],
            shell_distance_mm: 3.0,
            free_radius_mm: 35.0,
        },
        material: material(LIVER, 2.5, 1060.0, 3.0),
        wound: wound(36.0, 4.0, 5.0),
        suture: suture(3.0, 2.6),
        attachment: Some(attachment(LIVER, 8.0)),
        line: Some(line()),
        control: Some(control()),
        solver: solver(),
    }
}

/// Hepatic vessel: a tube of 12 mm diameter with three layers and a slit of 21 mm.
#[must_use]
pub fn vessel() -> SceneConfig {
    SceneConfig {
        name: "vessel".into(),
        tissue: TissueConfig::Ttsm { radius_mm: 6.0, length_mm: 36.0, wall_mm: 1.5, layers: 3, around: 18, along: 26 },
        material: material(VESSEL, 1.59, 1060.0, 0.5),
        wound: wound(21.0, 2.0, 1.5),
        suture: suture(2.0, 1.5),
        attachment: Some(attachment(VESSEL, 4.5)),
        line: Some(line()),
        control: Some(control()),
        solver: solver(),
    }
}

/// The scene of that name.
#[must_use]
pub fn by_name(name: &str) -> Option<SceneConfig> {
    match name {
        "skin" => Some(skin()),
        "liver" => Some(liver()),
        "vessel" => Some(vessel()),
        _ => None,
    }
}

fn material(row: Table2, reference_mm: f64, density_kg_per_m3: f64, thickness_mm: f64) -> MaterialConfig {
    MaterialConfig {
        stiffness_n_per_mm: row.stiffness_n_per_mm,
        drag_n_s_per_m: row.drag_n_s_per_m,
        drag: DragReading::PerArea,
        drag_reference_mm: reference_mm,
        density_kg_per_m3,
        thickness_mm,
    }
}

fn wound(length_mm: f64, gap_mm: f64, depth_mm: f64) -> WoundConfig {
    WoundConfig { length_mm, gap_mm, depth_mm, contact_stiffness_n_per_mm: Some(2.0) }
}

fn suture(bite_mm: f64, patch_radius_mm: f64) -> SutureConfig {
    SutureConfig {
        pairs: 4,
        bite_mm,
        patch_radius_mm,
        capture_radius_mm: 4.0,
        closed_gap_mm: 0.3,
        point_mass_g: 2.0,
        spring_law: SpringLawReading::default(),
        kinematics: KinematicsReading::default(),
    }
}

fn attachment(row: Table2, radius_mm: f64) -> AttachmentConfig {
    AttachmentConfig {
        beta: row.beta,
        mode: AttachmentReading::Compliant,
        radius_mm,
        beta_reference_ms: BETA_REFERENCE_MS,
        distance: DistanceReading::Geodesic,
        velocity: VelocityReading::Corrected,
    }
}

fn line() -> LineConfig {
    LineConfig {
        length_mm: 300.0,
        axial_stiffness_n: SILK_3_0_N,
        links: 40,
        friction: 0.0,
        knot_hold_n: 0.4,
        stitch_stiffness_n_per_mm: 5.0,
    }
}

fn control() -> ControlConfig {
    ControlConfig { mode: ControlReading::On, distance_floor_mm: 2.0, rate_mm_per_s: 5.0, tear_force_n: 3.3 }
}

fn solver() -> SolverConfig {
    SolverConfig {
        rate_hz: 200.0,
        integrator: IntegratorReading::Automatic,
        precision: PrecisionReading::Double,
        max_substeps: 64,
        port_rings: 4,
        threads: None,
        sleep: SleepReading::default(),
        sleep_tolerance_nm: None,
    }
}
