//! Pairs as springs inside an implicit step (`couplings`): tension and tangent at given positions.

use super::{COINCIDENT_M, PairSense, Pairs};
use crate::tissue::couplings::{Active, Bond, HARD_RATIO};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::Vec3;

impl Pairs {
    /// Tensions at `position_m`. A rigid pair between two patches that may not move has none.
    pub(crate) fn stretch(&mut self, patches: &PatchSet, position_m: &[Vec3], bound: &[f64], active: &mut Active) {
        for (index, p) in self.pairs.iter_mut().enumerate() {
            let c = &p.constraint;
            let d = patches.mean(c.a, position_m) - patches.mean(c.b, position_m);
            let length = d.norm();
            p.direction = if length < COINCIDENT_M { Vec3::zeros() } else { d / length };
            p.excess_m = length - c.target_m;
            (p.tension_n, p.axial_n_per_m) = (0.0, 0.0);
            let gives = softness(patches, c.a, bound) + softness(patches, c.b, bound);
            let stiffest = if gives > 0.0 { HARD_RATIO / gives } else { f64::MAX };
            let stiffness = c.stiffness_n_per_m.min(stiffest);
            if p.direction == Vec3::zeros() || (gives == 0.0 && c.stiffness_n_per_m.is_infinite()) {
                continue;
            }
            let (lowest, highest) = match c.sense {
                PairSense::PullOnly => (0.0, c.max_force_n),
                PairSense::PushOnly => (-c.max_force_n, 0.0),
                PairSense::TwoSided => (-c.max_force_n, c.max_force_n),
            };
            let wanted = stiffness * p.excess_m;
            p.tension_n = wanted.clamp(lowest, highest);
            let follows = wanted > lowest && wanted < highest;
            p.axial_n_per_m = if follows { stiffness } else { 0.0 };
            active.pairs += u32::from(p.tension_n != 0.0);
            active.note(index, if follows { 1 } else { 2 + u64::from(wanted >= highest) });
        }
    }

    /// Patches and spring of the pairs that act or would.
    pub(crate) fn bonds(&self) -> impl Iterator<Item = (PatchId, PatchId, Bond)> {
        let acting = self.pairs.iter().filter(|p| p.tension_n != 0.0 || p.axial_n_per_m != 0.0);
        acting.map(|p| {
            let bond = Bond {
                direction: p.direction,
                tension_n: p.tension_n,
                axial_n_per_m: p.axial_n_per_m,
                // A pair that pushes would have a negative one: left out, as for compressed springs.
                transverse_n_per_m: p.tension_n.max(0.0) / (p.excess_m + p.constraint.target_m),
            };
            (p.constraint.a, p.constraint.b, bond)
        })
    }
}

/// Displacement of a patch per newton, its nodes taken one by one with their neighbours held.
fn softness(patches: &PatchSet, patch: PatchId, bound: &[f64]) -> f64 {
    let nodes = patches.nodes(patch).iter().zip(patches.weights(patch));
    nodes.map(|(&node, &w)| if bound[node as usize] > 0.0 { w * w / bound[node as usize] } else { 0.0 }).sum()
}
