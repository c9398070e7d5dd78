//! A suture point as a patch: a node with its neighbours on the same side of the wound, under weights that
//! sum to 1, so that a pull does not drag one node through its neighbour.
//!
//! Position and velocity are the weighted centroid `Σ w_i x_i`; a force on the point reaches the nodes as
//! `w_i F` (its transpose, so work is conserved). A patch that translates rigidly collects plain sums: the
//! force on it is `Σ F_i`, its mass `Σ m_i`. SI units; nodes are indices into the flat arrays of the scene.
//!
//! Deliberately absent: choosing the nodes and weights (scene building), prescribing them (tissue).

use crate::vector::Vec3;

/// Largest deviation of the weight sum from 1: what summing a few hundred rounded weights can cost.
const WEIGHT_SUM_TOLERANCE: f64 = 1e-9;

/// Nodes and weights of one patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch<'a> {
    nodes: &'a [u32],
    weights: &'a [f64],
}

/// Why a patch is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PatchError {
    /// Lists of different length, or empty.
    #[error("a patch has {nodes} nodes and {weights} weights: give one weight per node, and at least one node")]
    Length {
        /// Number of nodes.
        nodes: usize,
        /// Number of weights.
        weights: usize,
    },
    /// A weight below zero or not finite, or a sum that is not 1.
    #[error("patch weights sum to {sum}: give finite weights of at least 0 that sum to 1")]
    Weights {
        /// Their sum.
        sum: f64,
    },
    /// A node that does not exist.
    #[error("patch names node {node}, the scene has {count}: name nodes of this scene")]
    Node {
        /// The index.
        node: u32,
        /// Nodes there are.
        count: usize,
    },
}

impl<'a> Patch<'a> {
    /// A patch on nodes of a scene with `node_count` nodes.
    ///
    /// # Errors
    /// [`PatchError`]: lists of different length, weights that do not sum to 1, unknown nodes.
    pub fn new(nodes: &'a [u32], weights: &'a [f64], node_count: usize) -> Result<Self, PatchError> {
        if nodes.is_empty() || nodes.len() != weights.len() {
            return Err(PatchError::Length { nodes: nodes.len(), weights: weights.len() });
        }
        let sum: f64 = weights.iter().sum();
        let usable = weights.iter().all(|w| *w >= 0.0) && (sum - 1.0).abs() <= WEIGHT_SUM_TOLERANCE;
        if !usable {
            return Err(PatchError::Weights { sum });
        }
        if let Some(&node) = nodes.iter().find(|n| **n as usize >= node_count) {
            return Err(PatchError::Node { node, count: node_count });
        }
        Ok(Self { nodes, weights })
    }

    /// Nodes of the patch.
    #[must_use]
    pub fn nodes(&self) -> &'a [u32] {
        self.nodes
    }

    /// Weighted centroid `Σ w_i x_i` of positions or velocities.
    #[must_use]
    pub fn centroid(&self, values: &[Vec3]) -> Vec3 {
        self.nodes.iter().zip(self.weights).fold(Vec3::zeros(), |sum, (n, w)| sum + values[*n as usize] * *w)
    }

    /// Plain sum `Σ F_i` of nodal forces: the force on the rigidly translating patch.
    #[must_use]
    pub fn sum(&self, values: &[Vec3]) -> Vec3 {
        self.nodes.iter().fold(Vec3::zeros(), |sum, n| sum + values[*n as usize])
    }

    /// Plain sum of a scalar per node (mass, drag).
    #[must_use]
    pub fn sum_scalar(&self, values: &[f64]) -> f64 {
        self.nodes.iter().map(|n| values[*n as usize]).sum()
    }

    /// Adds `w_i F` to each node's force.
    pub fn distribute(&self, force_n: Vec3, nodal_force_n: &mut [Vec3]) {
        for (n, w) in self.nodes.iter().zip(self.weights) {
            nodal_force_n[*n as usize] += force_n * *w;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [u32; 3] = [0, 2, 3];
    const WEIGHTS: [f64; 3] = [0.5, 0.25, 0.25];

    #[test]
    fn centroid_and_sum_against_hand_values() {
        let x =
            [Vec3::new(1.0, 0.0, 0.0), Vec3::new(9.0, 9.0, 9.0), Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, 0.0, 4.0)];
        let patch = Patch::new(&NODES, &WEIGHTS, x.len()).expect("valid");
        assert_eq!(patch.centroid(&x), Vec3::new(0.5, 0.5, 1.0));
        assert_eq!(patch.sum(&x), Vec3::new(1.0, 2.0, 4.0));
        assert_eq!(patch.sum_scalar(&[1.0, 10.0, 2.0, 3.0]), 6.0);
    }

    #[test]
    fn distributed_force_does_the_same_work_as_the_force_on_the_centroid() {
        let motion =
            [Vec3::new(0.1, 0.2, 0.3), Vec3::new(5.0, 5.0, 5.0), Vec3::new(-0.2, 0.4, 0.1), Vec3::new(0.3, 0.0, -0.5)];
        let patch = Patch::new(&NODES, &WEIGHTS, 4).expect("valid");
        let force = Vec3::new(1.0, -2.0, 0.5);
        let mut nodal = [Vec3::zeros(); 4];
        patch.distribute(force, &mut nodal);
        let nodal_work: f64 = nodal.iter().zip(&motion).map(|(f, u)| f.dot(u)).sum();
        assert!((nodal_work - force.dot(&patch.centroid(&motion))).abs() < 1e-15);
        assert!((patch.sum(&nodal) - force).norm() < 1e-15);
        assert_eq!(nodal[1], Vec3::zeros());
    }

    #[test]
    fn bad_patches_are_refused() {
        assert!(matches!(Patch::new(&NODES, &WEIGHTS[..2], 4), Err(PatchError::Length { .. })));
        assert!(matches!(Patch::new(&[], &[], 4), Err(PatchError::Length { .. })));
        assert!(matches!(Patch::new(&NODES, &[0.5, 0.5, 0.5], 4), Err(PatchError::Weights { .. })));
        assert!(matches!(Patch::new(&NODES, &[1.5, -0.25, -0.25], 4), Err(PatchError::Weights { .. })));
        assert!(matches!(Patch::new(&NODES, &[f64::NAN, 0.5, 0.5], 4), Err(PatchError::Weights { .. })));
        assert!(matches!(Patch::new(&NODES, &WEIGHTS, 3), Err(PatchError::Node { node: 3, count: 3 })));
    }
}
