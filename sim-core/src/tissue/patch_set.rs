//! Patches: weighted node sets that stand for suture points (a node with its mesh neighbours).
//!
//! Centroid `x_j = Σ w_k x_k` with `Σ w_k = 1`; a force `F` on the patch acts on node `k` as `w_k F`.
//! A point load on a single node has no mesh limit, a patch load converges; that is why suture
//! points are patches. All patches of a scene lie in one flat array and are named by [`PatchId`].
//! Deliberately absent: how patches are chosen on a surface (the models build them).

use crate::vector::Vec3;

/// How far the weights of a patch may be from 1 in sum: rounding of a division by their own sum.
const WEIGHT_SUM_TOLERANCE: f64 = 1e-9;

/// Names a patch of a [`PatchSet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PatchId(pub u32);

/// Patches in compressed rows.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchSet {
    start: Vec<u32>,
    node: Vec<u32>,
    weight: Vec<f64>,
}

/// Why patches are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PatchError {
    /// The patch cannot be used.
    #[error("patch {patch}: {what}")]
    Patch {
        /// Index of the patch.
        patch: usize,
        /// What is wrong and what is needed.
        what: &'static str,
    },
}

impl Default for PatchSet {
    fn default() -> Self {
        Self { start: vec![0], node: Vec::new(), weight: Vec::new() }
    }
}

impl PatchSet {
    /// Collects patches over a network of `node_count` nodes: per patch its nodes and their weights.
    ///
    /// # Errors
    /// [`PatchError`]: no node, a node that does not exist or is named twice, weights that are not
    /// above 0 or do not sum to 1.
    pub fn new<'a>(
        node_count: usize,
        patches: impl IntoIterator<Item = (&'a [u32], &'a [f64])>,
    ) -> Result<Self, PatchError> {
        let mut set = Self::default();
        for (patch, (nodes, weights)) in patches.into_iter().enumerate() {
            check(patch, node_count, nodes, weights)?;
            set.node.extend_from_slice(nodes);
            set.weight.extend_from_slice(weights);
            set.start.push(u32::try_from(set.node.len()).unwrap_or(u32::MAX));
        }
        Ok(set)
    }

    /// Number of patches.
    #[must_use]
    pub fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// True without patches.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True when the set holds this patch.
    #[must_use]
    pub fn contains(&self, patch: PatchId) -> bool {
        (patch.0 as usize) < self.len()
    }

    /// Nodes of a patch.
    #[must_use]
    pub fn nodes(&self, patch: PatchId) -> &[u32] {
        &self.node[self.range(patch)]
    }

    /// Weights of the nodes of a patch.
    #[must_use]
    pub fn weights(&self, patch: PatchId) -> &[f64] {
        &self.weight[self.range(patch)]
    }

    /// Weighted mean over a patch of a per-node vector: centroid from positions, velocity from velocities.
    #[must_use]
    pub fn mean(&self, patch: PatchId, per_node: &[Vec3]) -> Vec3 {
        let members = self.nodes(patch).iter().zip(self.weights(patch));
        members.fold(Vec3::zeros(), |sum, (&node, &w)| sum + per_node[node as usize] * w)
    }

    /// Translational mobility of the centroid, `Σ w_k² μ_k` with `μ_k` the displacement of node `k` in
    /// one step per newton.
    #[must_use]
    pub fn mobility(&self, patch: PatchId, node_mobility: &[f64]) -> f64 {
        let members = self.nodes(patch).iter().zip(self.weights(patch));
        members.fold(0.0, |sum, (&node, &w)| sum + w * w * node_mobility[node as usize])
    }

    fn range(&self, patch: PatchId) -> std::ops::Range<usize> {
        let i = patch.0 as usize;
        self.start[i] as usize..self.start[i + 1] as usize
    }
}

fn check(patch: usize, node_count: usize, nodes: &[u32], weights: &[f64]) -> Result<(), PatchError> {
    let error = |what| Err(PatchError::Patch { patch, what });
    if nodes.is_empty() || nodes.len() != weights.len() {
        return error("must name at least one node and give one weight per node");
    }
    if nodes.iter().any(|&n| n as usize >= node_count) {
        return error("names a node that does not exist");
    }
    if nodes.iter().enumerate().any(|(i, n)| nodes[..i].contains(n)) {
        return error("names a node twice");
    }
    if !weights.iter().all(|w| w.is_finite() && *w > 0.0) {
        return error("weights must be finite and above 0");
    }
    if (weights.iter().sum::<f64>() - 1.0).abs() > WEIGHT_SUM_TOLERANCE {
        return error("weights must sum to 1");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centroid_and_mobility_of_two_nodes() {
        let set = PatchSet::new(3, [(&[0_u32, 2][..], &[0.25, 0.75][..])]).unwrap();
        let x = [Vec3::new(1.0, 0.0, 0.0), Vec3::repeat(f64::NAN), Vec3::new(5.0, 4.0, 0.0)];
        assert_eq!(set.mean(PatchId(0), &x), Vec3::new(4.0, 3.0, 0.0));
        assert_eq!(set.mobility(PatchId(0), &[2.0, 9.0, 4.0]), 0.0625 * 2.0 + 0.5625 * 4.0);
    }

    #[test]
    fn unusable_patches_are_refused() {
        let cases: [(&[u32], &[f64]); 6] = [
            (&[], &[]),
            (&[0], &[0.5, 0.5]),
            (&[7], &[1.0]),
            (&[1, 1], &[0.5, 0.5]),
            (&[0, 1], &[1.5, -0.5]),
            (&[0, 1], &[0.5, 0.4]),
        ];
        for (nodes, weights) in cases {
            assert!(PatchSet::new(3, [(nodes, weights)]).is_err(), "{nodes:?} {weights:?}");
        }
    }
}
