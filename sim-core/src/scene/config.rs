//! What a scene file says. Units are in the key names (millimetres, N/mm, N·s/m as in Table 2); they are
//! converted once, in `scene::build`. Presets with Table 2's values are in `scene::presets`.
//!
//! An optional section that is left out is a stage that the scene does not have.

mod solver;

pub use solver::{IntegratorReading, PrecisionReading, SolverConfig};

use serde::{Deserialize, Serialize};

/// One scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneConfig {
    /// Name for reports.
    pub name: String,
    /// Shape of the tissue.
    pub tissue: TissueConfig,
    /// Table 2 and what it leaves open.
    pub material: MaterialConfig,
    /// The wound.
    pub wound: WoundConfig,
    /// Suture points.
    pub suture: SutureConfig,
    /// Relaxed Long Range Attachments; left out: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attachment: Option<AttachmentConfig>,
    /// The suture line; left out: points can be held but nothing can be tied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<LineConfig>,
    /// Suture control; left out: off, and it cannot be switched on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub control: Option<ControlConfig>,
    /// Time stepping.
    pub solver: SolverConfig,
}

/// The three models of §2.1.1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "lowercase", deny_unknown_fields)]
pub enum TissueConfig {
    /// Uniform Tissue Suture Model: a sheet of quads.
    Utsm {
        /// Width across the wound, millimetres.
        width_mm: f64,
        /// Length along the wound, millimetres.
        length_mm: f64,
        /// Node spacing, millimetres.
        spacing_mm: f64,
        /// Strain built into the rest lengths, 0 to 0.5.
        pre_strain: f64,
    },
    /// Volumetric Organ Suture Model: a triangle shell and its shrunken image.
    Vosm {
        /// Half axes of the organ made without a mesh, millimetres.
        #[serde(default = "default_half_axes")]
        half_axes_mm: [f64; 3],
        /// How far that organ thins towards one end, 0 (ellipsoid) to 1.
        #[serde(default = "default_taper")]
        taper: f64,
        /// Subdivisions of that organ (4 gives 2562 nodes per shell).
        #[serde(default = "default_subdivisions")]
        subdivisions: u32,
        /// Closed triangle mesh (OBJ) in the scene's folder.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mesh: Option<String>,
        /// Millimetres per unit of that mesh.
        #[serde(default = "default_mesh_unit")]
        mesh_unit_mm: f64,
        /// The middle of the wound is the vertex nearest to this point of the mesh, millimetres; a far point
        /// picks the vertex farthest out in its direction.
        #[serde(default = "default_wound_near")]
        wound_near_mm: [f64; 3],
        /// Direction of the wound in the frame of the mesh.
        #[serde(default = "default_wound_along")]
        wound_along: [f64; 3],
        /// Distance of the inner shell, millimetres.
        shell_distance_mm: f64,
        /// Nodes farther than this from the wound are held, millimetres.
        free_radius_mm: f64,
    },
    /// Tubiform Tissue Suture Model: a tube of several quad layers.
    Ttsm {
        /// Outer radius, millimetres.
        radius_mm: f64,
        /// Length, millimetres.
        length_mm: f64,
        /// Wall thickness, millimetres.
        wall_mm: f64,
        /// Layers, at least 2.
        layers: u32,
        /// Nodes around.
        around: u32,
        /// Cells along.
        along: u32,
    },
}

fn default_half_axes() -> [f64; 3] {
    [45.0, 32.0, 22.0]
}

fn default_taper() -> f64 {
    0.35
}

fn default_wound_near() -> [f64; 3] {
    [0.0, 0.0, 10_000.0]
}

fn default_wound_along() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn default_subdivisions() -> u32 {
    4
}

fn default_mesh_unit() -> f64 {
    1.0
}

/// Table 2 and what it leaves open.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialConfig {
    /// k of Table 2, N/mm.
    pub stiffness_n_per_mm: f64,
    /// c of Table 2, N·s/m.
    pub drag_n_s_per_m: f64,
    /// Whether c is meant per node or, converted once at `drag_reference_mm`, per area.
    pub drag: DragReading,
    /// Node spacing at which c per node and c per area agree, millimetres.
    pub drag_reference_mm: f64,
    /// Density, kg/m³.
    pub density_kg_per_m3: f64,
    /// Thickness that the masses stand for (per layer), millimetres.
    pub thickness_mm: f64,
}

/// How c of Table 2 is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DragReading {
    /// The same c on every node: the physics then depends on the resolution.
    PerNode,
    /// c scaled by node area.
    PerArea,
}

/// A straight slit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WoundConfig {
    /// Length, millimetres.
    pub length_mm: f64,
    /// Largest opening before relaxation, millimetres.
    pub gap_mm: f64,
    /// Depth, millimetres.
    pub depth_mm: f64,
    /// Stiffness with which edges that touch at a suture pair resist going through each other, N/mm; left out: they do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_stiffness_n_per_mm: Option<f64>,
}

/// Suture points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SutureConfig {
    /// Pairs along the wound.
    pub pairs: u32,
    /// Distance of the points from the wound edge, millimetres.
    pub bite_mm: f64,
    /// Nodes within this path length of a suture point move with it, millimetres.
    pub patch_radius_mm: f64,
    /// A press takes a point within this distance of the stylus, millimetres.
    pub capture_radius_mm: f64,
    /// Edge gap that counts as closed, millimetres.
    pub closed_gap_mm: f64,
    /// Mass of a suture point with needle (m_j of Eq. (3)), grams.
    pub point_mass_g: f64,
    /// How the springs at a suture point are read.
    #[serde(default)]
    pub spring_law: SpringLawReading,
    /// How the suture points move in the servo's ticks.
    #[serde(default)]
    pub kinematics: KinematicsReading,
}

/// The d_i of Eq. (3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringLawReading {
    /// The plain distance: springs of stiffness k that pull and push.
    #[default]
    Bilateral,
    /// That of Eq. (1): stiffness k·β, pulling only.
    PaperTension,
}

/// When the forces of Eq. (3) are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KinematicsReading {
    /// Stiffness and drag at the end of the tick: stable for every mass.
    #[default]
    ImplicitDrag,
    /// Everything at its start, as printed, in as many sub-steps as that takes.
    Literal,
}

/// Relaxed Long Range Attachments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachmentConfig {
    /// β of Table 2, 0 (hard) to 1 (none).
    pub beta: f64,
    /// How β acts.
    pub mode: AttachmentReading,
    /// Surrounding nodes are those within this distance of the suture point, millimetres.
    pub radius_mm: f64,
    /// Step at which β is converted to a stiffness, milliseconds.
    pub beta_reference_ms: f64,
    /// How distance is measured.
    pub distance: DistanceReading,
    /// Velocity of a node after a projection, in mode paper.
    #[serde(default)]
    pub velocity: VelocityReading,
}

/// Velocity of a projected node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VelocityReading {
    /// Changed by the displacement over the step.
    #[default]
    Corrected,
    /// Left as it is, as printed: a held node at rest then has a velocity.
    Literal,
}

/// How β acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AttachmentReading {
    /// Eq. (1) in every step, as printed: the tissue stiffens with the step rate.
    Paper,
    /// β converted once: the force does not depend on the step.
    Compliant,
}

/// How the initial distance is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DistanceReading {
    /// Along the cut mesh.
    Geodesic,
    /// Straight, also across the wound.
    Euclidean,
}

/// The suture line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineConfig {
    /// Length, millimetres.
    pub length_mm: f64,
    /// Axial stiffness EA, newtons.
    pub axial_stiffness_n: f64,
    /// Links of the free part, 1 to 63.
    pub links: u32,
    /// Friction of the line in a suture point, 0 reproduces the paper.
    pub friction: f64,
    /// Force that a tied stitch holds before its knot slips, newtons.
    pub knot_hold_n: f64,
    /// Stiffness of the line in a tied stitch, N/mm.
    pub stitch_stiffness_n_per_mm: f64,
}

/// Suture control (Algorithm 2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlConfig {
    /// Mode at start.
    pub mode: ControlReading,
    /// Floor on D_o in the relative error, millimetres.
    pub distance_floor_mm: f64,
    /// Fastest adjustment, millimetres per second.
    pub rate_mm_per_s: f64,
    /// The tissue tears at this holding force, newtons.
    pub tear_force_n: f64,
}

/// How Algorithm 2 acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlReading {
    /// Not at all.
    Off,
    /// Rate-limited compliant constraint with hysteresis.
    On,
    /// As printed: positions are set.
    Paper,
}
