//! Links as springs inside an implicit step (`couplings`): tension and tangent at given positions.

use super::{COINCIDENT_M, LinkTable};
use crate::tissue::couplings::{Active, Bond, HARD_RATIO};
use crate::tissue::patch_set::PatchSet;
use crate::vector::Vec3;

impl LinkTable {
    /// Tensions of the links of one attachment at `position_m`.
    pub(crate) fn stretch(
        &mut self,
        attachment: usize,
        patches: &PatchSet,
        position_m: &[Vec3],
        bound: &[f64],
        active: &mut Active,
    ) {
        let center = patches.mean(self.patch[attachment], position_m);
        for index in self.range(attachment) {
            let link = &mut self.links[index];
            link.relax();
            let bound = bound[link.node as usize];
            let away = position_m[link.node as usize] - center;
            let length = away.norm();
            if bound > 0.0 && length > link.rest_m && length >= COINCIDENT_M {
                let stiffness = link.stiffness_n_per_m.min(HARD_RATIO * bound);
                link.direction = away / length;
                link.excess_m = length - link.rest_m;
                link.softness_m_per_n = 1.0 / stiffness;
                link.tension_n = stiffness * link.excess_m;
                active.links += 1;
                // Pairs count from 0 too: links are told from them by the fourth state.
                active.note(index, 0);
            }
        }
    }

    /// Follower and spring of each link of an attachment that pulls.
    pub(crate) fn bonds(&self, attachment: usize) -> impl Iterator<Item = (u32, Bond)> {
        self.links(attachment).iter().filter(|l| l.tension_n > 0.0).map(|l| {
            let bond = Bond {
                direction: l.direction,
                tension_n: l.tension_n,
                axial_n_per_m: 1.0 / l.softness_m_per_n,
                transverse_n_per_m: l.tension_n / (l.rest_m + l.excess_m),
            };
            (l.node, bond)
        })
    }
}
