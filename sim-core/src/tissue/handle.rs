//! Handles: patches that a hand moves. Their nodes are prescribed and translate rigidly.
//!
//! Node `k` of a grasped patch sits at `x_h + o_k`, the offsets `o_k` frozen at capture so that the
//! centroid is `x_h`. Over the sub-steps of a period the handle goes from its last to its new
//! position in a straight line. Deliberately absent: why a handle moves (the servo integrates it).

use crate::finite::is_finite;
use crate::tissue::network::TissueState;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::Vec3;

/// Handles of one scene, at most.
pub const MAX_HANDLES: usize = 4;

/// Names a handle, 0 to [`MAX_HANDLES`] − 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HandleSlot(pub usize);

/// Why a patch cannot be grasped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraspError {
    /// No such handle, or it already holds a patch.
    #[error("handle {0} is not free; there are {MAX_HANDLES} handles, release it first")]
    Slot(usize),
    /// No such patch.
    #[error("patch {0} does not exist")]
    Patch(u32),
    /// The patch shares a node with one that is already held.
    #[error("patch {0} shares nodes with a patch that is already held; release that one first")]
    Overlap(u32),
}

/// One grasped patch.
#[derive(Clone, Debug)]
pub(crate) struct Handle {
    pub(crate) patch: PatchId,
    pub(crate) position_m: Vec3,
    pub(crate) velocity_m_per_s: Vec3,
    target_m: Vec3,
    offsets_m: Vec<Vec3>,
}

impl Handle {
    /// Takes a patch where it is.
    pub(crate) fn grasp(patch: PatchId, patches: &PatchSet, position_m: &[Vec3]) -> Self {
        let center = patches.mean(patch, position_m);
        let offsets_m = patches.nodes(patch).iter().map(|&n| position_m[n as usize] - center).collect();
        Self { patch, position_m: center, velocity_m_per_s: Vec3::zeros(), target_m: center, offsets_m }
    }

    /// Sets where the handle shall be at the end of the next period; not finite: the target stays.
    pub(crate) fn lead(&mut self, target_m: Vec3) -> bool {
        let usable = is_finite(&target_m);
        if usable {
            self.target_m = target_m;
        }
        usable
    }

    /// End of the next period's way, cut to `limit_m`, and whether it was cut.
    pub(crate) fn next_stop(&self, limit_m: f64) -> (Vec3, bool) {
        let way = self.target_m - self.position_m;
        let length = way.norm();
        if length <= limit_m {
            return (self.target_m, false);
        }
        // Divided first: the length of a far target may overflow in a product.
        (self.position_m + (way / length) * limit_m, true)
    }

    /// Puts the nodes where the handle is at `center` with `velocity`.
    pub(crate) fn place(&mut self, patches: &PatchSet, state: &mut TissueState, center: Vec3, velocity: Vec3) {
        self.position_m = center;
        self.velocity_m_per_s = velocity;
        for (&node, offset) in patches.nodes(self.patch).iter().zip(&self.offsets_m) {
            state.position_m[node as usize] = center + offset;
            state.velocity_m_per_s[node as usize] = velocity;
        }
    }
}
