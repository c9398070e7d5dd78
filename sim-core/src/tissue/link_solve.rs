//! Compliant attachment links, solved at the end of the step.
//!
//! Link of follower `i` and suture point `j` with overshoot `C` at the predicted positions, follower
//! mobility `μ = h²/(m + c h)` and stiffness `K`: `λ = (C − n·s)/(1/K + μ)`, follower displacement
//! `−μ λ n`. The patch displacement `s` of a free suture point solves
//! `(I/W + Σ n nᵀ/(1/K + μ)) s = Σ n C/(1/K + μ) + pairs`; a prescribed one has `s = 0`. So `λ = K C⁺`
//! holds at the end of the step, whatever its length. A node that follows several points is solved
//! with all its links in one 3 × 3 system: no order dependence, and infeasible links meet in the middle.
//! Deliberately absent: averaging of separate corrections, which makes the force depend on the step.

use crate::finite::is_finite;
use crate::tissue::constraint::PatchResponse;
use crate::tissue::network::TissueState;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::{Mat3, Vec3};

mod implicit;

/// A link of a shared follower is at most this many times as stiff as the follower's own `1/μ`. Hard links
/// (β = 0) that contradict each other keep their overshoot, and their force is overshoot × stiffness: 100
/// leaves 1 % of an overshoot that can be undone and keeps that force finite, as in `condensation`.
const HARD_STIFFNESS_RATIO: f64 = 100.0;

/// Followers closer to the suture point than this have no direction, metres.
const COINCIDENT_M: f64 = 1e-9;

/// Most passes to find the links that pull on a free patch; each drops at least one.
const ACTIVE_SET_PASSES: usize = 8;

/// What a constraint needs to know of the step.
pub(crate) struct StepView<'a> {
    pub(crate) patches: &'a PatchSet,
    /// Displacement per newton in one step, by node; 0 where it may not move.
    pub(crate) mobility_m_per_n: &'a [f64],
    pub(crate) h: f64,
    pub(crate) limit_m: f64,
}

/// What a stage did to the nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Correction {
    pub(crate) acting: u32,
    pub(crate) saturated: u32,
    pub(crate) contained: u32,
}

impl Correction {
    /// Moves one node by `shift`, changes its velocity by `speed_per_m · shift`, and counts.
    pub(crate) fn apply(
        &mut self,
        view: &StepView<'_>,
        state: &mut TissueState,
        node: usize,
        mut shift: Vec3,
        speed_per_m: f64,
    ) {
        self.acting += 1;
        if !is_finite(&shift) {
            self.contained += 1;
            return;
        }
        let length = shift.norm();
        if length > view.limit_m {
            shift *= view.limit_m / length;
            self.saturated += 1;
        }
        state.position_m[node] += shift;
        state.velocity_m_per_s[node] += shift * speed_per_m;
    }
}

/// One link; the last four are of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) node: u32,
    pub(crate) rest_m: f64,
    pub(crate) stiffness_n_per_m: f64,
    shared: bool,
    /// From the suture point to the follower.
    pub(crate) direction: Vec3,
    excess_m: f64,
    softness_m_per_n: f64,
    pub(crate) tension_n: f64,
}

impl Link {
    pub(crate) fn new(node: u32, rest_m: f64, stiffness_n_per_m: f64) -> Self {
        Self {
            node,
            rest_m,
            stiffness_n_per_m,
            shared: false,
            direction: Vec3::zeros(),
            excess_m: 0.0,
            softness_m_per_n: 0.0,
            tension_n: 0.0,
        }
    }

    fn relax(&mut self) {
        self.excess_m = 0.0;
        self.tension_n = 0.0;
    }
}

/// Links of all attachments in compressed rows, and the followers that several attachments share.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinkTable {
    patch: Vec<PatchId>,
    /// End of each attachment's links.
    end: Vec<usize>,
    links: Vec<Link>,
    /// Per shared follower, its links as (attachment, link).
    shared: Vec<Vec<(usize, usize)>>,
}

impl LinkTable {
    pub(crate) fn add(&mut self, patch: PatchId, links: impl Iterator<Item = Link>) {
        self.patch.push(patch);
        self.links.extend(links);
        self.end.push(self.links.len());
    }

    /// Marks followers that occur more than once.
    pub(crate) fn find_shared(&mut self, node_count: usize) {
        let mut by_node: Vec<Vec<(usize, usize)>> = vec![Vec::new(); node_count];
        for attachment in 0..self.patch.len() {
            for link in self.range(attachment) {
                by_node[self.links[link].node as usize].push((attachment, link));
            }
        }
        self.shared = by_node.into_iter().filter(|links| links.len() > 1).collect();
        for &(_, link) in self.shared.iter().flatten() {
            self.links[link].shared = true;
        }
    }

    fn range(&self, attachment: usize) -> std::ops::Range<usize> {
        let start = if attachment == 0 { 0 } else { self.end[attachment - 1] };
        start..self.end[attachment]
    }

    pub(crate) fn patches(&self) -> &[PatchId] {
        &self.patch
    }

    pub(crate) fn links(&self, attachment: usize) -> &[Link] {
        &self.links[self.range(attachment)]
    }

    pub(crate) fn links_mut(&mut self, attachment: usize) -> &mut [Link] {
        let range = self.range(attachment);
        &mut self.links[range]
    }

    /// Lets go of all links of one attachment.
    pub(crate) fn release(&mut self, attachment: usize) {
        self.links_mut(attachment).iter_mut().for_each(Link::relax);
    }

    /// Finds the links that pull and how the patch gives way with its followers in tow.
    pub(crate) fn open(
        &mut self,
        attachment: usize,
        view: &StepView<'_>,
        position_m: &[Vec3],
        responses: &mut [PatchResponse],
    ) {
        let patch = self.patch[attachment];
        let center = view.patches.mean(patch, position_m);
        for link in self.links_mut(attachment) {
            link.relax();
            let mobility = view.mobility_m_per_n[link.node as usize];
            let away = position_m[link.node as usize] - center;
            let length = away.norm();
            if mobility > 0.0 && length > link.rest_m && length >= COINCIDENT_M {
                link.direction = away / length;
                link.excess_m = length - link.rest_m;
                link.softness_m_per_n = 1.0 / link.stiffness_n_per_m + mobility;
            }
        }
        let response = &mut responses[patch.0 as usize];
        let own = response.mobility.m11;
        if own > 0.0 {
            *response = self.tow(attachment, own);
        }
    }

    /// How a free patch gives way with its followers in tow. Links that the patch's own way would slacken
    /// are let go, a few at a time, so that what is left balances.
    fn tow(&mut self, attachment: usize, own_m_per_n: f64) -> PatchResponse {
        let mut response = PatchResponse::free(own_m_per_n);
        for _ in 0..ACTIVE_SET_PASSES {
            let (mut stiffness, mut pull) = (Mat3::identity() / own_m_per_n, Vec3::zeros());
            for link in self.links(attachment).iter().filter(|l| l.excess_m > 0.0) {
                let n = link.direction / link.softness_m_per_n;
                stiffness += n * link.direction.transpose();
                pull += n * link.excess_m;
            }
            let Some(mobility) = stiffness.try_inverse() else { return response };
            response = PatchResponse { mobility, shift_m: mobility * pull };
            let mut slack = 0;
            for link in self.links_mut(attachment).iter_mut().filter(|l| l.excess_m > 0.0) {
                if link.excess_m < link.direction.dot(&response.shift_m) {
                    link.relax();
                    slack += 1;
                }
            }
            if slack == 0 {
                break;
            }
        }
        response
    }

    /// Tensions with the final patch displacements, and the followers' displacements.
    pub(crate) fn close(
        &mut self,
        view: &StepView<'_>,
        state: &mut TissueState,
        responses: &[PatchResponse],
    ) -> Correction {
        let mut done = Correction::default();
        for attachment in 0..self.patch.len() {
            let s = responses[self.patch[attachment].0 as usize].shift_m;
            for link in self.links_mut(attachment).iter_mut().filter(|l| l.excess_m > 0.0 && !l.shared) {
                link.tension_n = ((link.excess_m - link.direction.dot(&s)) / link.softness_m_per_n).max(0.0);
                let node = link.node as usize;
                let shift = link.direction * (-link.tension_n * view.mobility_m_per_n[node]);
                done.apply(view, state, node, shift, 1.0 / view.h);
            }
        }
        for group in &self.shared {
            if let Some((node, shift)) = close_shared(&mut self.links, &self.patch, group, view, responses) {
                done.apply(view, state, node, shift, 1.0 / view.h);
            }
        }
        done
    }
}

/// Solves one follower of several suture points with all its links; links that would push drop out.
fn close_shared(
    links: &mut [Link],
    patch: &[PatchId],
    group: &[(usize, usize)],
    view: &StepView<'_>,
    responses: &[PatchResponse],
) -> Option<(usize, Vec3)> {
    let node = links[group.first()?.1].node as usize;
    let own = 1.0 / view.mobility_m_per_n[node];
    let excess = |l: &Link, a: usize| l.excess_m - l.direction.dot(&responses[patch[a].0 as usize].shift_m);
    let stiffness = |l: &Link| l.stiffness_n_per_m.min(HARD_STIFFNESS_RATIO * own);
    loop {
        let (mut matrix, mut pull) = (Mat3::identity() * own, Vec3::zeros());
        let mut pulling = 0;
        for &(attachment, link) in group.iter().filter(|(_, l)| links[*l].excess_m > 0.0) {
            let l = &links[link];
            let kn = l.direction * stiffness(l);
            matrix += kn * l.direction.transpose();
            pull -= kn * excess(l, attachment);
            pulling += 1;
        }
        if pulling == 0 {
            return None;
        }
        let shift = matrix.cholesky()?.solve(&pull);
        let mut dropped = false;
        for &(attachment, link) in group {
            let l = &links[link];
            if l.excess_m > 0.0 {
                let tension = stiffness(l) * (excess(l, attachment) + l.direction.dot(&shift));
                links[link].tension_n = tension.max(0.0);
                if tension < 0.0 {
                    links[link].excess_m = 0.0;
                    dropped = true;
                }
            }
        }
        if !dropped {
            return Some((node, shift));
        }
    }
}
