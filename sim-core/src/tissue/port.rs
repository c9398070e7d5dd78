//! The affine port of a handle: the tissue as the hand feels it until the next step.
//!
//! `F = f* − S (x − x*)`. `f*` in newtons: springs from outside the patch, attachment and pair reactions at
//! the end of the step. One-ring stiffness `K₁ = Σ k (n nᵀ + g (I − n nᵀ))` over the springs that cross the
//! patch boundary, plus pulling links. `S`: step stiffness of `condensation`, symmetric, eigenvalues
//! clamped to [least, largest of `K₁`]. Over-estimating is the safe side (numerics: haptic coupling).
//! Deliberately absent: the patch's own mass and drag in `S`; the servo's node equation has them.

use crate::tissue::condensation::{Condensation, Condensed};
use crate::tissue::constraint::Pairs;
use crate::tissue::force::{acts, eq3_spring_force, spring_stiffness};
use crate::tissue::handle::Handle;
use crate::tissue::network::SpringNetwork;
use crate::tissue::patch_set::PatchSet;
use crate::tissue::regulation::Attachments;
use crate::vector::{Mat3, Vec3};

/// Parameters of the ports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PortParams {
    /// Mesh rings around the patch that give way; the nodes beyond are held, which over-estimates `S`.
    pub rings: u32,
    /// Steps between two refreshes of the stiffnesses; `f*` is new in every step.
    pub refresh_steps: u32,
    /// Least eigenvalue of `S`, newtons per metre.
    pub minimum_stiffness_n_per_m: f64,
    /// The affine law is trusted for `|x − x*|` up to this, metres.
    pub trust_radius_m: f64,
    /// Relative residual at which a solve ends.
    pub tolerance: f64,
    /// Most iterations of a solve.
    pub max_iterations: u32,
}

impl Default for PortParams {
    fn default() -> Self {
        Self {
            rings: 3,
            refresh_steps: 4,
            minimum_stiffness_n_per_m: 1.0,
            trust_radius_m: 2e-3,
            tolerance: 1e-3,
            max_iterations: 40,
        }
    }
}

/// Affine port of one handle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port {
    /// Expansion point `x*`, metres.
    pub position_m: Vec3,
    /// Velocity there, metres per second.
    pub velocity_m_per_s: Vec3,
    /// Force of the tissue on the patch, newtons.
    pub force_n: Vec3,
    /// Step stiffness `S`, newtons per metre.
    pub step_stiffness_n_per_m: Mat3,
    /// One-ring stiffness, newtons per metre.
    pub one_ring_n_per_m: Mat3,
    /// The affine law is trusted up to this distance, metres.
    pub trust_radius_m: f64,
    /// Mass of the patch, kilograms.
    pub mass_kg: f64,
    /// Drag of the patch, newton seconds per metre.
    pub drag_n_s_per_m: f64,
}

/// What a port is measured on.
pub(crate) struct PortView<'a> {
    pub(crate) network: &'a SpringNetwork,
    pub(crate) patches: &'a PatchSet,
    pub(crate) position_m: &'a [Vec3],
    /// 0 where a node may not move.
    pub(crate) mobility_m_per_n: &'a [f64],
    pub(crate) attachments: Option<&'a Attachments>,
    pub(crate) pairs: Option<&'a Pairs>,
    /// Period of an implicit Euler step that resists as the solver's does.
    pub(crate) resisting_s: f64,
    pub(crate) substep_s: f64,
}

/// What of the constraints acts on a patch: when it changes, the kept stiffness is that of another system.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ActiveSet {
    pairs: u32,
    pair_stiffness_n_per_m: f64,
    links: u32,
}

impl ActiveSet {
    fn of(handle: &Handle, view: &PortView<'_>) -> Self {
        let mut set = Self::default();
        for (_, _, stiffness) in view.pairs.iter().flat_map(|p| p.acting_on(handle.patch)) {
            set.pairs += 1;
            set.pair_stiffness_n_per_m += stiffness;
        }
        let own = view.attachments.and_then(|a| a.of_patch(handle.patch).map(|index| a.pulling(index)));
        set.links = own.map_or(0, |links| links.count() as u32);
        set
    }
}

/// Port of one handle slot with its kept condensation.
#[derive(Clone, Debug)]
pub(crate) struct PortSolver {
    condensation: Condensation,
    age_steps: u32,
    kept: Option<(ActiveSet, Condensed)>,
    enclosed: bool,
}

impl PortSolver {
    pub(crate) fn new(node_count: usize) -> Self {
        Self { condensation: Condensation::new(node_count), age_steps: 0, kept: None, enclosed: false }
    }

    /// Drops what was kept: another patch, other handles, another step.
    pub(crate) fn forget(&mut self) {
        self.kept = None;
        self.enclosed = false;
    }

    pub(crate) fn measure(&mut self, handle: &Handle, view: &PortView<'_>, params: &PortParams) -> Port {
        let nodes = view.patches.nodes(handle.patch);
        let (mut force_n, mut ring) = (Vec3::zeros(), Mat3::zeros());
        let edges = &view.network.half_edges;
        for &node in nodes {
            let x = &view.position_m[node as usize];
            for e in edges.row(node as usize) {
                let other = edges.neighbour[e];
                if nodes.contains(&other) {
                    continue;
                }
                let y = &view.position_m[other as usize];
                if !acts(edges, e, x, y) {
                    continue;
                }
                let (k, rest) = (edges.stiffness_n_per_m[e], edges.rest_length_m[e]);
                force_n += eq3_spring_force(x, y, k, rest);
                ring += spring_stiffness(x, y, k, rest);
            }
        }
        let attachment = view.attachments.and_then(|a| a.of_patch(handle.patch).map(|index| (a, index)));
        if let Some((attachments, index)) = attachment {
            force_n += attachments.reaction_n(index);
        }
        if let Some(pairs) = view.pairs {
            force_n += pairs.force_on(handle.patch);
        }
        let stiffness = self.stiffness(handle, ring, view, params);
        let sum = |per_node: &[f64]| nodes.iter().map(|&n| per_node[n as usize]).sum();
        Port {
            position_m: handle.position_m,
            velocity_m_per_s: handle.velocity_m_per_s,
            force_n,
            step_stiffness_n_per_m: stiffness.step,
            one_ring_n_per_m: stiffness.held,
            trust_radius_m: params.trust_radius_m,
            mass_kg: sum(&view.network.mass_kg),
            drag_n_s_per_m: sum(&view.network.drag_n_s_per_m),
        }
    }

    /// Step and one-ring stiffness: kept ones while they are young and the same constraints act, else new ones.
    fn stiffness(&mut self, handle: &Handle, ring: Mat3, view: &PortView<'_>, params: &PortParams) -> Condensed {
        self.age_steps += 1;
        let active = ActiveSet::of(handle, view);
        if let Some((_, kept)) = self.kept.filter(|(was, _)| self.age_steps < params.refresh_steps && *was == active) {
            return kept;
        }
        if !self.enclosed {
            self.condensation.enclose(handle.patch, view, params.rings);
            self.enclosed = true;
        }
        let found = self.condensation.condense(handle.patch, ring, view, params);
        let held = if found.held.iter().all(|v| v.is_finite()) { found.held } else { Mat3::zeros() };
        let most = held.symmetric_eigenvalues().max().max(params.minimum_stiffness_n_per_m);
        let step = if found.step.iter().all(|v| v.is_finite()) {
            clamp_eigenvalues(&found.step, params.minimum_stiffness_n_per_m, most)
        } else {
            Mat3::identity() * most
        };
        self.age_steps = 0;
        self.kept.insert((active, Condensed { step, held })).1
    }
}

/// The symmetric matrix with its eigenvalues clamped to `least..=most`.
fn clamp_eigenvalues(matrix: &Mat3, least: f64, most: f64) -> Mat3 {
    let eigen = matrix.symmetric_eigen();
    if eigen.eigenvalues.iter().all(|v| (least..=most).contains(v)) {
        return *matrix;
    }
    let clamped = Mat3::from_diagonal(&eigen.eigenvalues.map(|v| v.clamp(least, most)));
    eigen.eigenvectors * clamped * eigen.eigenvectors.transpose()
}
