//! Attachments and pairs as one-sided springs inside an implicit step.
//!
//! Tension `T = K · excess⁺` at the end of the step, cut at the holding force; tangent `K n nᵀ + (T/l)(I − n nᵀ)` while it
//! pulls, without the first part while it is cut off. A patch feels forces by its weights and moves as their mean, so
//! that one link is a spring between a mean and a node, one pair between two means. A stiffness without limit (β = 0, a
//! rigid pair) counts as [`HARD_RATIO`] times what the nodes resist themselves. Attachments of mode `Paper` are not in
//! here: they are projected after the step.

use crate::tissue::constraint::Pairs;
use crate::tissue::node::Node;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::regulation::{Attachments, RegulationMode};
use crate::tissue::step_matrix::{StepMatrix, add_bar};
use crate::vector::Vec3;

/// Stiffest a link or pair may be beside its nodes: hard to 1e-4, and still far from the rounding of the solve.
pub(crate) const HARD_RATIO: f64 = 1e4;

/// What pulls: how many, and a mark that changes when others do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Active {
    pub(crate) links: u32,
    pub(crate) pairs: u32,
    pub(crate) mark: u64,
}

impl Active {
    pub(crate) fn note(&mut self, index: usize, state: u64) {
        // Any odd constant: sums of few distinct multiples do not meet by chance.
        self.mark = self.mark.wrapping_add((index as u64 * 4 + state).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    }
}

/// The stages that act within the solve.
pub(crate) struct Couplings<'a> {
    patches: &'a PatchSet,
    attachments: Option<&'a mut Attachments>,
    pairs: Option<&'a mut Pairs>,
}

/// One spring between means or nodes, as it acts now.
pub(crate) struct Bond {
    /// Unit.
    pub(crate) direction: Vec3,
    pub(crate) tension_n: f64,
    pub(crate) axial_n_per_m: f64,
    pub(crate) transverse_n_per_m: f64,
}

impl Bond {
    fn apply(&self, d: &Vec3) -> Vec3 {
        let along = self.direction.dot(d);
        self.direction * ((self.axial_n_per_m - self.transverse_n_per_m) * along) + d * self.transverse_n_per_m
    }
}

impl<'a> Couplings<'a> {
    pub(crate) fn new(
        patches: &'a PatchSet,
        attachments: Option<&'a mut Attachments>,
        pairs: Option<&'a mut Pairs>,
    ) -> Self {
        let compliant = attachments.filter(|a| matches!(a.mode(), RegulationMode::Compliant { .. }));
        Self { patches, attachments: compliant, pairs }
    }

    /// Tensions at `position_m`; `bound` is what nodes resist with all their neighbours held, 0 where they may not move.
    pub(crate) fn stretch(&mut self, position_m: &[Vec3], bound: &[f64]) -> Active {
        let mut active = Active::default();
        if let Some(attachments) = &mut self.attachments {
            attachments.stretch(self.patches, position_m, bound, &mut active);
        }
        if let Some(pairs) = &mut self.pairs {
            pairs.stretch(self.patches, position_m, bound, &mut active);
        }
        active
    }

    /// Adds the forces at the last stretch.
    pub(crate) fn add_forces(&self, force_n: &mut [Vec3]) {
        for attachments in self.attachments.iter() {
            for attachment in 0..attachments.len() {
                let mut sum = Vec3::zeros();
                for (node, bond) in attachments.bonds(attachment) {
                    let pull = bond.direction * bond.tension_n;
                    force_n[node as usize] -= pull;
                    sum += pull;
                }
                self.spread(attachments.patch(attachment), sum, force_n);
            }
        }
        for (a, b, bond) in self.pairs.iter().flat_map(|p| p.bonds()) {
            let pull = bond.direction * bond.tension_n;
            self.spread(a, -pull, force_n);
            self.spread(b, pull, force_n);
        }
    }

    /// Adds the parts on the diagonal of the matrix.
    pub(crate) fn add_blocks(&self, matrix: &mut StepMatrix) {
        for attachments in self.attachments.iter() {
            for attachment in 0..attachments.len() {
                for (node, bond) in attachments.bonds(attachment) {
                    add_bar(matrix.block_mut(node), &bond.direction, bond.axial_n_per_m, bond.transverse_n_per_m);
                    self.add_patch_blocks(attachments.patch(attachment), &bond, matrix);
                }
            }
        }
        for (a, b, bond) in self.pairs.iter().flat_map(|p| p.bonds()) {
            self.add_patch_blocks(a, &bond, matrix);
            self.add_patch_blocks(b, &bond, matrix);
        }
    }

    /// `image += K_c v` with the tangent at the last stretch.
    pub(crate) fn multiply(&self, v: &[Node], image: &mut [Node]) {
        for attachments in self.attachments.iter() {
            for attachment in 0..attachments.len() {
                let patch = attachments.patch(attachment);
                let mean = self.mean_shift(patch, v);
                let mut sum = Vec3::zeros();
                for (node, bond) in attachments.bonds(attachment) {
                    let f = bond.apply(&(v[node as usize].vector() - mean));
                    image[node as usize] += f;
                    sum += f;
                }
                self.spread(patch, -sum, image);
            }
        }
        for (a, b, bond) in self.pairs.iter().flat_map(|p| p.bonds()) {
            let f = bond.apply(&(self.mean_shift(a, v) - self.mean_shift(b, v)));
            self.spread(a, f, image);
            self.spread(b, -f, image);
        }
    }

    fn mean_shift(&self, patch: PatchId, v: &[Node]) -> Vec3 {
        let nodes = self.patches.nodes(patch).iter().zip(self.patches.weights(patch));
        nodes.fold(Vec3::zeros(), |sum, (&node, &w)| sum + v[node as usize].vector() * w)
    }

    fn spread<T: std::ops::AddAssign<Vec3>>(&self, patch: PatchId, force: Vec3, out: &mut [T]) {
        for (&node, &w) in self.patches.nodes(patch).iter().zip(self.patches.weights(patch)) {
            out[node as usize] += force * w;
        }
    }

    fn add_patch_blocks(&self, patch: PatchId, bond: &Bond, matrix: &mut StepMatrix) {
        for (&node, &w) in self.patches.nodes(patch).iter().zip(self.patches.weights(patch)) {
            let share = w * w;
            let (axial, transverse) = (share * bond.axial_n_per_m, share * bond.transverse_n_per_m);
            add_bar(matrix.block_mut(node), &bond.direction, axial, transverse);
        }
    }
}
