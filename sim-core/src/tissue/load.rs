//! Forces from outside: on single nodes (weights, test loads) and on patches (drag of the suture line).
//!
//! Held constant over one period. A force that is not finite is left out and counted. Deliberately
//! absent: springs, attachments and stitches, which have their own files.

use crate::finite::finite_or;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::Vec3;

/// A force on one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeForce {
    /// Node index.
    pub node: u32,
    /// Force, newtons.
    pub force_n: Vec3,
}

/// A force on a patch, spread over its nodes by their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchForce {
    /// Patch.
    pub patch: PatchId,
    /// Force, newtons.
    pub force_n: Vec3,
}

/// All forces from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loads {
    /// On nodes.
    pub nodes: Vec<NodeForce>,
    /// On patches.
    pub patches: Vec<PatchForce>,
}

impl Loads {
    /// Adds the loads to the node forces. Nodes and patches that do not exist are skipped. Returns
    /// the number of forces left out because they are not finite.
    pub fn add(&self, patches: &PatchSet, force_n: &mut [Vec3]) -> u32 {
        let mut contained = 0;
        for load in &self.nodes {
            if let Some(f) = force_n.get_mut(load.node as usize) {
                *f += finite_or(load.force_n, Vec3::zeros(), &mut contained);
            }
        }
        for load in self.patches.iter().filter(|l| patches.contains(l.patch)) {
            let force = finite_or(load.force_n, Vec3::zeros(), &mut contained);
            for (&node, &w) in patches.nodes(load.patch).iter().zip(patches.weights(load.patch)) {
                force_n[node as usize] += force * w;
            }
        }
        contained
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_load_keeps_its_resultant_and_bad_loads_are_left_out() {
        let patches = PatchSet::new(3, [(&[0_u32, 1][..], &[0.25, 0.75][..])]).unwrap();
        let on_patch = |x| PatchForce { patch: PatchId(0), force_n: Vec3::new(x, 0.0, 0.0) };
        let loads = Loads {
            nodes: vec![
                NodeForce { node: 2, force_n: Vec3::new(0.0, 1.0, 0.0) },
                NodeForce { node: 9, force_n: Vec3::repeat(1.0) },
            ],
            patches: vec![on_patch(4.0), on_patch(f64::NAN)],
        };
        let mut force = vec![Vec3::zeros(); 3];
        assert_eq!(loads.add(&patches, &mut force), 1);
        let expected = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
        assert_eq!(force, expected);
    }
}
