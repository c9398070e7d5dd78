//! What the three tissue models are once built: one [`Tissue`], whichever model made it.
//!
//! Every tissue stands in the wound frame: the middle of the wound is the origin, x points across it
//! (left to right), y along it, z out of the tissue. Node order: layer by layer, outside first, in
//! each layer the surface vertices and then the twins of the right wound edge. SI units.
//! Source: Zhang et al., §2.1.1. Deliberately absent: anything that changes after the build.

use super::area::{node_areas, node_drags, node_masses};
use super::cut::Cut;
use super::lattice::{LayeredSurface, springs};
use super::network::{NetworkError, SpringNetwork};
use super::params::{MaterialParams, WoundParams};
use super::suture_pair::{SuturePair, choose_pairs};
use crate::units::UnitError;
use crate::vector::Vec3;

/// Which of the paper's models a tissue is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TissueKind {
    /// Uniform tissue suture model: a quad sheet (skin).
    Utsm,
    /// Volumetric organ suture model: a triangular shell and its inner shell (liver).
    Vosm,
    /// Tubiform tissue suture model: a quad tube of several layers (hepatic vessel).
    Ttsm,
}

/// How the inner shell of a volumetric organ came out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellReport {
    /// Vertices of the surface that had to be moved because a face was folded back there.
    pub smoothed_vertices: u32,
    /// Vertices whose offset had to be smaller than asked, so that nothing crosses.
    pub shrunk_vertices: u32,
    /// The smallest offset, metres.
    pub smallest_offset_m: f64,
}

/// A built tissue.
#[derive(Clone, Debug, PartialEq)]
pub struct Tissue {
    /// Which model.
    pub kind: TissueKind,
    /// Nodes and springs.
    pub network: SpringNetwork,
    /// Surfaces of all layers and the walls of rim and wound, for drawing, seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Layer of each node, 0 outside.
    pub layer: Vec<u8>,
    /// −1 left of the wound, +1 right of it, 0 at its tips and below an incomplete cut.
    pub side: Vec<i8>,
    /// Suture points, in order along the wound.
    pub pairs: Vec<SuturePair>,
    /// Wound edge on the surface as a loop: a tip, the left edge, the other tip, the right edge back.
    pub wound_edge: Vec<u32>,
    /// Mean length of the surface's edges (the lattice spacing), metres.
    pub spacing_m: f64,
    /// Distance between the tips as built, metres.
    pub wound_length_m: f64,
    /// Left to right, unit.
    pub across: Vec3,
    /// Along the wound, unit.
    pub along: Vec3,
    /// Out of the tissue, unit.
    pub outward: Vec3,
    /// The inner shell, where there is one.
    pub shell: Option<ShellReport>,
}

/// Why a tissue cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TissueError {
    /// A parameter outside its range.
    #[error("{name} is {found}, outside {low} to {high}: give a value in that range")]
    Parameter {
        /// Which parameter.
        name: &'static str,
        /// The value found.
        found: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
    /// A parameter outside the range of its unit.
    #[error(transparent)]
    Unit(#[from] UnitError),
    /// More nodes than a scene may have.
    #[error(
        "the tissue would have {nodes} nodes (about {megabytes} MB), at most {MAX_NODES} are allowed: take a coarser spacing or fewer layers"
    )]
    TooLarge {
        /// Number of nodes.
        nodes: u64,
        /// Memory of network and springs.
        megabytes: u64,
    },
    /// A surface that cannot be used.
    #[error("the surface cannot be used: {what}; mend the mesh")]
    Mesh {
        /// What is wrong and where.
        what: String,
    },
    /// A wound that does not fit.
    #[error("the wound does not fit: {what}; {remedy}")]
    Wound {
        /// What is wrong and where.
        what: String,
        /// How to mend it.
        remedy: &'static str,
    },
    /// Suture points that do not fit.
    #[error("the suture points do not fit: {what}; {remedy}")]
    Pairs {
        /// What is wrong and where.
        what: String,
        /// How to mend it.
        remedy: &'static str,
    },
    /// The network refused what was built.
    #[error(transparent)]
    Network(#[from] NetworkError),
}

/// Most nodes of a tissue.
pub const MAX_NODES: u64 = 1 << 18;
/// Memory of one node with its springs while building, bytes (13 springs, twice, and candidates).
const BYTES_PER_NODE: u64 = 2400;

/// Refuses counts above [`MAX_NODES`] before anything is allocated.
pub(super) fn check_count(nodes: f64) -> Result<(), TissueError> {
    if nodes <= MAX_NODES as f64 {
        return Ok(());
    }
    let nodes = nodes as u64;
    Err(TissueError::TooLarge { nodes, megabytes: nodes.saturating_mul(BYTES_PER_NODE) / 1_000_000 })
}

/// What a model hands over for the part of the build that all have in common.
pub(super) struct Blueprint<'a> {
    pub(super) kind: TissueKind,
    pub(super) layers: LayeredSurface,
    pub(super) cut: Cut,
    pub(super) fixed: Vec<u8>,
    pub(super) layer_thickness_m: f64,
    pub(super) pre_strain: f64,
    pub(super) material: &'a MaterialParams,
    pub(super) wound: &'a WoundParams,
    pub(super) shell: Option<ShellReport>,
}

impl Blueprint<'_> {
    /// Springs, masses, suture points and drawing of a layered, cut surface in the wound frame.
    pub(super) fn build(self) -> Result<Tissue, TissueError> {
        let Self { layers, cut, material, wound, .. } = self;
        let areas = node_areas(&layers);
        let network = SpringNetwork::new(
            layers.position_m.clone(),
            node_masses(&areas, material, self.layer_thickness_m),
            node_drags(&areas, material),
            self.fixed,
            springs(&layers, material, self.pre_strain)?,
        )?;
        let side = node_sides(&layers, &cut);
        let pairs = choose_pairs(&network, &layers, &cut, &side, wound)?;
        let (first, last) = (cut.path[0], cut.path[cut.path.len() - 1]);
        let mut wound_edge = vec![first];
        wound_edge.extend_from_slice(cut.left());
        wound_edge.push(last);
        wound_edge.extend(cut.right().into_iter().rev());
        Ok(Tissue {
            kind: self.kind,
            triangles: layers.triangles(),
            layer: layers.layer_of_nodes(),
            side,
            pairs,
            wound_edge,
            spacing_m: mean_edge(&layers),
            wound_length_m: network.rest_m[last as usize].y - network.rest_m[first as usize].y,
            across: Vec3::x(),
            along: Vec3::y(),
            outward: Vec3::z(),
            shell: self.shell,
            network,
        })
    }
}

/// A node lies on the side of its surface vertex, whatever way its layer leans.
fn node_sides(layers: &LayeredSurface, cut: &Cut) -> Vec<i8> {
    let lateral: Vec<f64> = layers.position_m[..layers.start[1] as usize].iter().map(|p| p.x).collect();
    let surface = cut.sides(&lateral);
    let mut sides = Vec::with_capacity(layers.position_m.len());
    for count in layers.start.windows(2).map(|w| (w[1] - w[0]) as usize) {
        let mut layer = surface[..count].to_vec();
        if count < surface.len() {
            cut.path.iter().for_each(|v| layer[*v as usize] = 0);
        }
        sides.append(&mut layer);
    }
    sides
}

fn mean_edge(layers: &LayeredSurface) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in layers.faces[0].iter().flat_map(|f| f.edges()) {
        sum += (layers.position_m[a as usize] - layers.position_m[b as usize]).norm();
        count += 1.0;
    }
    sum / count
}
