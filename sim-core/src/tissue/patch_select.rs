//! Which nodes a suture point takes: a middle node `bite` from the wound edge and the nodes of its
//! side within the patch radius along the surface, optionally with their images on the cut layers
//! ("the surface and inner layer … were simultaneously sutured", Zhang et al., §2.1.2).
//!
//! Weight of a node at distance d: w ∝ 1 − d/(2r), the same on every layer, Σ w = 1. Fixed nodes
//! and the tips are left out; no node belongs to two points.

use super::geodesic::WalkGraph;
use super::model::TissueError;
use super::network::{SpringFamily, SpringNetwork};
use super::params::{PatchDepth, WoundParams};
use super::suture_pair::{Patch, SuturePoint};
use super::{lattice::LayeredSurface, params::MIN_LENGTH_M};

const MEND: &str = "ask for fewer pairs, a smaller patch radius or bite, or a longer wound, or refine the mesh";

/// Chooses points one by one and remembers the nodes that are taken.
pub(super) struct PatchSelector<'a> {
    network: &'a SpringNetwork,
    layers: &'a LayeredSurface,
    sides: &'a [i8],
    wound: &'a WoundParams,
    surface: WalkGraph,
    taken_by: Vec<Option<u32>>,
}

impl<'a> PatchSelector<'a> {
    pub(super) fn new(
        network: &'a SpringNetwork,
        layers: &'a LayeredSurface,
        sides: &'a [i8],
        wound: &'a WoundParams,
    ) -> Self {
        let end = layers.start[1];
        let surface = WalkGraph::new(network, |s| {
            s.b < end && matches!(s.family, SpringFamily::Structural | SpringFamily::Shear)
        });
        Self { network, layers, sides, wound, surface, taken_by: vec![None; network.node_count()] }
    }

    /// The point of one side at a station of the wound; `pair` counts from 0.
    pub(super) fn point(&mut self, edge: u32, side: i8, station: f64, pair: u32) -> Result<SuturePoint, TissueError> {
        let refuse = |what: String| Err(TissueError::Pairs { what, remedy: MEND });
        let origin = self.network.rest_m[edge as usize];
        let miss = |node: u32| {
            let x = self.network.rest_m[node as usize];
            let from_edge = (x.x - origin.x).hypot(x.z - origin.z);
            (from_edge - self.wound.bite.get()).hypot(x.y - station)
        };
        let usable = |node: &u32| self.sides[*node as usize] == side && self.network.fixed[*node as usize] == 0;
        let middle = (0..self.layers.start[1]).filter(usable).min_by(|a, b| miss(*a).total_cmp(&miss(*b)));
        let Some(node) = middle else {
            return refuse(format!("pair {} has no free node beside the wound", pair + 1));
        };
        let radius = self.wound.patch_radius.get();
        let around: Vec<(u32, f64)> =
            self.surface.within(node, radius).into_iter().filter(|(n, _)| usable(n)).collect();
        let deepest = match self.wound.patch_depth {
            PatchDepth::Surface => 1,
            PatchDepth::CutLayers => self.layers.faces.len(),
        };
        let cut_layer =
            |layer: &usize| self.layers.start[layer + 1] - self.layers.start[*layer] == self.layers.start[1];
        let mut entries: Vec<(u32, f64)> = Vec::new();
        for layer in (0..deepest).filter(cut_layer) {
            for &(n, d) in &around {
                let weight = 1.0 - d / (2.0 * radius.max(MIN_LENGTH_M));
                let image = self.layers.node(layer, self.layers.vertex[n as usize]);
                entries.extend(image.filter(|i| self.network.fixed[*i as usize] == 0).map(|i| (i, weight)));
            }
        }
        for &(n, _) in &entries {
            if let Some(other) = self.taken_by[n as usize] {
                return refuse(format!("the patches of pairs {} and {} overlap at node {n}", other + 1, pair + 1));
            }
            self.taken_by[n as usize] = Some(pair);
        }
        entries.sort_unstable_by_key(|e| e.0);
        let total: f64 = entries.iter().map(|e| e.1).sum();
        let (nodes, weights) = entries.into_iter().map(|(n, w)| (n, w / total)).unzip();
        Ok(SuturePoint { node, patch: Patch { nodes, weights } })
    }
}
