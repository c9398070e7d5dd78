//! Suture points in pairs, left and right of the wound: where they lie and which nodes they move.
//!
//! N stations stand at (k + ½)/N of the wound; at each, the point of a side is the node nearest to
//! `bite` from the wound edge. A point is a patch ([`super::patch_select`]), because a single pulled
//! node passes its neighbours. The wound-edge nodes of the station measure the gap.

use super::model::TissueError;
use super::patch_select::PatchSelector;
use super::{cut::Cut, lattice::LayeredSurface, network::SpringNetwork, params::WoundParams};

/// The nodes that a suture point moves; its position is their weighted centroid.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Nodes, by index.
    pub nodes: Vec<u32>,
    /// Weights, above 0, of sum 1.
    pub weights: Vec<f64>,
}

/// One suture point.
#[derive(Clone, Debug, PartialEq)]
pub struct SuturePoint {
    /// The node on the surface layer at its middle.
    pub node: u32,
    /// What it moves.
    pub patch: Patch,
}

/// Partners on both sides of the wound.
#[derive(Clone, Debug, PartialEq)]
pub struct SuturePair {
    /// On the left side.
    pub left: SuturePoint,
    /// On the right side.
    pub right: SuturePoint,
    /// Wound-edge node of the left side at this station.
    pub left_edge: u32,
    /// Wound-edge node of the right side at this station.
    pub right_edge: u32,
}

const MEND: &str = "ask for fewer pairs, a smaller patch radius or a longer wound, or refine the mesh";

/// Chooses the pairs along a wound (wound frame: x across, y along).
pub(super) fn choose_pairs(
    network: &SpringNetwork,
    layers: &LayeredSurface,
    cut: &Cut,
    sides: &[i8],
    wound: &WoundParams,
) -> Result<Vec<SuturePair>, TissueError> {
    let y = |node: u32| network.rest_m[node as usize].y;
    let (first, last) = (y(cut.path[0]), y(cut.path[cut.path.len() - 1]));
    let right = cut.right();
    let mut selector = PatchSelector::new(network, layers, sides, wound);
    let mut pairs: Vec<SuturePair> = Vec::new();
    for k in 0..wound.pairs {
        let station = first + (last - first) * (f64::from(k) + 0.5) / f64::from(wound.pairs);
        let nearest =
            (0..right.len()).min_by(|&i, &j| (y(right[i]) - station).abs().total_cmp(&(y(right[j]) - station).abs()));
        let Some(at) = nearest else {
            return Err(TissueError::Pairs { what: "the wound has no edge".to_owned(), remedy: MEND });
        };
        let (left_edge, right_edge) = (cut.left()[at], right[at]);
        if pairs.iter().any(|p| p.left_edge == left_edge) {
            return Err(TissueError::Pairs {
                what: format!(
                    "{} pairs do not fit on a wound of {} edge nodes a side: pair {} has none of its own",
                    wound.pairs,
                    right.len(),
                    k + 1
                ),
                remedy: MEND,
            });
        }
        let left = selector.point(left_edge, -1, station, k)?;
        let right = selector.point(right_edge, 1, station, k)?;
        pairs.push(SuturePair { left, right, left_edge, right_edge });
    }
    Ok(pairs)
}
