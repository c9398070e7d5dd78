//! Algorithm 1: relaxed long-range attachments (LRA) of the nodes around a suture point.
//!
//! `d_i = d_i⁰ + β max(|x_j − x_i| − d_i⁰, 0)` (Zhang et al., Eq. (1)). Mode `Paper`: one literal
//! projection per step, `x_i ← x_j + d_i (x_i − x_j)/|x_i − x_j|`, `d_i` starting from `d_i⁰` each time
//! (no ratchet), suture points in fixed order; a free suture point feels no reaction. Mode `Compliant` (default): β becomes a stiffness once,
//! at a reference step, and one-sided links of that stiffness are solved at the end of the step
//! (`link_solve`), so that forces do not depend on the step. Nodes of attached patches follow nobody;
//! fixed and prescribed nodes are skipped. Deliberately absent: where the `d_i⁰` come from (geodesic
//! distances are measured by the models).

use crate::kinematics::attachment::{check_relaxation, project, stiffness_from_relaxation};
use crate::tissue::constraint::PatchResponse;
use crate::tissue::couplings::{Active, Bond};
use crate::tissue::link_solve::{Correction, Link, LinkTable, StepView};
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::Vec3;

/// How the relaxed attachments act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RegulationMode {
    /// One literal projection per step with β.
    Paper(ProjectedVelocity),
    /// β as a stiffness, converted once.
    Compliant {
        /// Step at which β means what the paper's projection per step does, seconds.
        reference_step_s: f64,
    },
}

/// Velocity after a literal projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProjectedVelocity {
    /// Changed by the displacement over the step.
    Corrected,
    /// Left as it is, as printed.
    Literal,
}

/// Whether an attachment acts: regulation starts when the suture begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engagement {
    /// Not yet, or no more.
    Idle,
    /// Acts.
    Engaged,
}

/// One suture point with the nodes that follow it.
#[derive(Clone, Debug, PartialEq)]
pub struct AttachmentSpec {
    /// The suture point.
    pub patch: PatchId,
    /// Followers: node and initial distance `d_i⁰`, metres.
    pub followers: Vec<(u32, f64)>,
}

/// Why attachments are refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AttachmentError {
    /// β outside its range.
    #[error("relaxation beta is {0}; it must lie in 0 (hard tether) to 1 (no constraint)")]
    Relaxation(f64),
    /// Reference step not usable.
    #[error("reference step of the relaxation is {0} s; it must be finite and above 0")]
    ReferenceStep(f64),
    /// A suture point or follower that cannot be used.
    #[error("attachment {attachment}: {what}")]
    Attachment {
        /// Index of the attachment.
        attachment: usize,
        /// What is wrong and what is needed.
        what: &'static str,
    },
}

/// All attachments of a scene with their tensions.
#[derive(Clone, Debug)]
pub struct Attachments {
    mode: RegulationMode,
    relaxation: f64,
    engaged: Vec<Engagement>,
    table: LinkTable,
}

impl Attachments {
    /// Builds the links, all idle. Followers that are fixed, members of an attached patch or at
    /// distance 0 get no link; with β = 1 there is no link at all.
    ///
    /// # Errors
    /// [`AttachmentError`]: β outside 0 to 1, reference step not above 0, patches or nodes that do not
    /// exist or are named twice, distances not finite.
    pub fn new(
        network: &SpringNetwork,
        patches: &PatchSet,
        specs: &[AttachmentSpec],
        relaxation: f64,
        mode: RegulationMode,
    ) -> Result<Self, AttachmentError> {
        let relaxation = check_relaxation(relaxation).map_err(|_| AttachmentError::Relaxation(relaxation))?;
        // The literal mode reports its reaction from the displacement and needs no stiffness.
        let stiffness = |node: usize| match mode {
            RegulationMode::Paper(_) => f64::INFINITY,
            RegulationMode::Compliant { reference_step_s } => {
                let (m, c) = (network.mass_kg[node], network.drag_n_s_per_m[node]);
                stiffness_from_relaxation(relaxation, m, c, reference_step_s)
            }
        };
        if let RegulationMode::Compliant { reference_step_s } = mode
            && !(reference_step_s.is_finite() && reference_step_s > 0.0)
        {
            return Err(AttachmentError::ReferenceStep(reference_step_s));
        }
        for (attachment, spec) in specs.iter().enumerate() {
            check_spec(attachment, spec, &specs[..attachment], network, patches)?;
        }
        let mut leads_or_stays: Vec<bool> = network.fixed.iter().map(|&f| f != 0).collect();
        for &node in specs.iter().flat_map(|s| patches.nodes(s.patch)) {
            leads_or_stays[node as usize] = true;
        }
        let mut table = LinkTable::default();
        for spec in specs {
            let followers = spec
                .followers
                .iter()
                .filter(|(node, rest)| relaxation < 1.0 && *rest > 0.0 && !leads_or_stays[*node as usize]);
            table.add(spec.patch, followers.map(|&(node, rest)| Link::new(node, rest, stiffness(node as usize))));
        }
        table.find_shared(network.node_count());
        Ok(Self { mode, relaxation, engaged: vec![Engagement::Idle; specs.len()], table })
    }

    /// Number of attachments.
    #[must_use]
    pub fn len(&self) -> usize {
        self.engaged.len()
    }

    /// True without attachments.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.engaged.is_empty()
    }

    /// How the attachments act.
    #[must_use]
    pub fn mode(&self) -> RegulationMode {
        self.mode
    }

    /// Switches one attachment and lets its links go; an index that does not exist changes nothing.
    pub fn engage(&mut self, attachment: usize, engagement: Engagement) {
        if let Some(slot) = self.engaged.get_mut(attachment).filter(|slot| **slot != engagement) {
            *slot = engagement;
            self.table.release(attachment);
        }
    }

    /// Index of the attachment of a patch.
    #[must_use]
    pub fn of_patch(&self, patch: PatchId) -> Option<usize> {
        self.table.patches().iter().position(|p| *p == patch)
    }

    /// Changes when an attachment is switched.
    pub(crate) fn engaged_mark(&self) -> u64 {
        let on = self.engaged.iter().enumerate().filter(|(_, e)| **e == Engagement::Engaged);
        on.fold(0, |mark, (index, _)| mark.wrapping_mul(31).wrapping_add(index as u64 + 1))
    }

    /// Tensions of the engaged attachments at given positions, for an implicit step.
    pub(crate) fn stretch(&mut self, patches: &PatchSet, position_m: &[Vec3], bound: &[f64], active: &mut Active) {
        for attachment in (0..self.engaged.len()).filter(|&a| self.engaged[a] == Engagement::Engaged) {
            self.table.stretch(attachment, patches, position_m, bound, active);
        }
    }

    /// Follower and spring of each link of an attachment that pulls, for an implicit step.
    pub(crate) fn bonds(&self, attachment: usize) -> impl Iterator<Item = (u32, Bond)> {
        self.table.bonds(attachment)
    }

    /// Patch of an attachment.
    pub(crate) fn patch(&self, attachment: usize) -> PatchId {
        self.table.patches()[attachment]
    }

    /// What a suture point feels at most of its links, all of them pulling, newtons per metre.
    pub(crate) fn total_stiffness_n_per_m(&self, attachment: usize, network: &SpringNetwork, step_s: f64) -> f64 {
        self.table.links(attachment).iter().map(|l| self.stiffness_n_per_m(l, network, step_s)).sum()
    }

    /// Stiffness that a link amounts to; in the literal mode it depends on the step.
    pub(crate) fn stiffness_n_per_m(&self, link: &Link, network: &SpringNetwork, step_s: f64) -> f64 {
        match self.mode {
            RegulationMode::Compliant { .. } => link.stiffness_n_per_m,
            RegulationMode::Paper(_) => {
                let node = link.node as usize;
                let (m, c) = (network.mass_kg[node], network.drag_n_s_per_m[node]);
                stiffness_from_relaxation(self.relaxation, m, c, step_s)
            }
        }
    }

    /// Links of all attachments, engaged or not.
    #[must_use]
    pub fn link_count(&self) -> usize {
        (0..self.len()).map(|a| self.table.links(a).len()).sum()
    }

    /// What the links take, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.link_count() * size_of::<Link>()
    }

    /// Force of the followers on the suture point at the end of the last step, newtons.
    #[must_use]
    pub fn reaction_n(&self, attachment: usize) -> Vec3 {
        self.table.links(attachment).iter().fold(Vec3::zeros(), |sum, l| sum + l.direction * l.tension_n)
    }

    /// Followers that are pulled at the end of the last step, each with the force of one link on it, newtons.
    pub fn follower_forces(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        (0..self.len()).flat_map(|a| self.pulling(a).map(|link| (link.node, link.tension_n)))
    }

    /// Links of an attachment that pull at the end of the last step: follower, direction from the
    /// suture point to it, stiffness in newtons per metre.
    pub(crate) fn pulling(&self, attachment: usize) -> impl Iterator<Item = &Link> {
        self.table.links(attachment).iter().filter(|l| l.tension_n > 0.0)
    }

    /// First half, before pairs are solved: finds the links that pull and how the patches give way.
    pub(crate) fn open(&mut self, view: &StepView<'_>, state: &TissueState, responses: &mut [PatchResponse]) {
        if let RegulationMode::Compliant { .. } = self.mode {
            for attachment in (0..self.engaged.len()).filter(|&a| self.engaged[a] == Engagement::Engaged) {
                self.table.open(attachment, view, &state.position_m, responses);
            }
        }
    }

    /// Second half, after pairs are solved: moves the followers.
    pub(crate) fn close(
        &mut self,
        view: &StepView<'_>,
        state: &mut TissueState,
        responses: &[PatchResponse],
    ) -> Correction {
        match self.mode {
            RegulationMode::Compliant { .. } => self.table.close(view, state, responses),
            RegulationMode::Paper(velocity) => self.project_all(view, state, velocity),
        }
    }

    /// Algorithm 1, literally: every engaged attachment in order, every follower once.
    fn project_all(&mut self, view: &StepView<'_>, state: &mut TissueState, velocity: ProjectedVelocity) -> Correction {
        let mut done = Correction::default();
        for attachment in (0..self.engaged.len()).filter(|&a| self.engaged[a] == Engagement::Engaged) {
            let center = view.patches.mean(self.table.patches()[attachment], &state.position_m);
            for link in self.table.links_mut(attachment) {
                let node = link.node as usize;
                let from = state.position_m[node];
                let mobility = view.mobility_m_per_n[node];
                link.tension_n = 0.0;
                if mobility == 0.0 {
                    continue;
                }
                let shift = project(center, from, link.rest_m, self.relaxation) - from;
                if shift == Vec3::zeros() {
                    continue;
                }
                link.direction = (from - center).normalize();
                link.tension_n = shift.norm() / mobility;
                let speed = match velocity {
                    ProjectedVelocity::Corrected => 1.0 / view.h,
                    ProjectedVelocity::Literal => 0.0,
                };
                done.apply(view, state, node, shift, speed);
            }
        }
        done
    }
}

fn check_spec(
    attachment: usize,
    spec: &AttachmentSpec,
    earlier: &[AttachmentSpec],
    network: &SpringNetwork,
    patches: &PatchSet,
) -> Result<(), AttachmentError> {
    let error = |what| Err(AttachmentError::Attachment { attachment, what });
    if !patches.contains(spec.patch) {
        return error("its patch does not exist");
    }
    if earlier.iter().any(|e| e.patch == spec.patch) {
        return error("its patch is already attached; one attachment per suture point");
    }
    if spec.followers.iter().any(|(node, _)| *node as usize >= network.node_count()) {
        return error("a follower names a node that does not exist");
    }
    if spec.followers.iter().any(|(_, rest)| !(rest.is_finite() && *rest >= 0.0)) {
        return error("a follower's distance must be finite and at least 0");
    }
    let mut nodes: Vec<u32> = spec.followers.iter().map(|(node, _)| *node).collect();
    nodes.sort_unstable();
    if nodes.windows(2).any(|w| w[0] == w[1]) {
        return error("names a follower twice");
    }
    Ok(())
}
