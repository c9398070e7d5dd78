//! Attachments as printed and as a stiffness: one suture point of the skin, pulled by 5 mm and held.

use crate::accuracy::statics::Statics;
use crate::generators::{on_rim, sheet, with_fixed};
use sim_core::kinematics::attachment::relaxed_distance;
use sim_core::scene::presets;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::regulation::{AttachmentSpec, Attachments, Engagement, ProjectedVelocity, RegulationMode};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;

/// Nodes along a side.
const SIDE: usize = 17;
/// Cell of the skin preset, metres.
const CELL_M: f64 = 0.002;
/// Attachment radius of the skin preset, metres.
const RADIUS_M: f64 = 0.006;
/// Pull, metres, and its speed, metres per second.
const PULL: (f64, f64) = (0.005, 0.01);
/// The slowest motion of this sheet has died away a thousandfold by then, seconds.
const HOLD_S: f64 = 3.0;
/// Time over which the force is averaged: projected as printed, it never comes to rest, seconds.
const MEAN_S: f64 = 0.25;

/// The sheet with its suture point in the middle.
#[derive(Clone, Debug)]
pub struct Rig {
    network: SpringNetwork,
    patch: [u32; 5],
}

/// What is found at rest.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Projections per second: solver rate times its sub-steps, each of which projects once.
    pub projections_hz: f64,
    /// Force on the hand, mean over the last quarter of a second, newtons.
    pub force_n: f64,
    /// Half of the range that the force goes through in that time, newtons.
    pub chatter_n: f64,
    /// Its part that springs make.
    pub springs_n: f64,
    /// Force on the held rim.
    pub rim_n: f64,
    /// Farthest that a follower lies beyond its initial distance, metres.
    pub excess_m: f64,
    /// Fastest follower, metres per second.
    pub speed_m_per_s: f64,
}

impl Rig {
    /// Mass of a node: 1100 kg/m³ of 1.75 mm on cells of 2 mm, kilograms.
    pub const NODE_KG: f64 = 7.7e-6;

    /// The skin of Table 2.
    #[must_use]
    pub fn skin() -> Self {
        let row = presets::SKIN;
        let flat = sheet(SIDE, SIDE, CELL_M, row.stiffness_n_per_mm * 1e3, Self::NODE_KG, row.drag_n_s_per_m);
        let (middle, side) = ((SIDE * SIDE / 2) as u32, SIDE as u32);
        Self {
            network: with_fixed(flat, |i| on_rim(i, SIDE, SIDE)),
            patch: [middle, middle - 1, middle + 1, middle - side, middle + side],
        }
    }

    /// Eq. (1) in every step.
    #[must_use]
    pub fn paper(&self, velocity: ProjectedVelocity) -> RegulationMode {
        RegulationMode::Paper(velocity)
    }

    /// β converted once, at the presets' reference step.
    #[must_use]
    pub fn compliant(&self) -> RegulationMode {
        RegulationMode::Compliant { reference_step_s: 1.0 / 60.0 }
    }

    fn followers(&self) -> Vec<(u32, f64)> {
        let rest = &self.network.rest_m;
        let center = rest[self.patch[0] as usize];
        let away = |i: usize| (rest[i] - center).norm();
        let near = (0..rest.len()).filter(|i| away(*i) <= RADIUS_M && !self.patch.contains(&(*i as u32)));
        near.map(|i| (i as u32, away(i))).collect()
    }
}

/// Pulls the suture point and holds it at a solver rate; `None` when the solver refuses that.
#[must_use]
pub fn hold_at_rate(rig: &Rig, rate_hz: f64, mode: RegulationMode) -> Option<Held> {
    let patches = PatchSet::new(rig.network.node_count(), [(&rig.patch[..], &[0.2; 5][..])]).ok()?;
    let followers = rig.followers();
    let specs = [AttachmentSpec { patch: PatchId(0), followers: followers.clone() }];
    let mut params = SolverParams::with_period(1.0 / rate_hz);
    // The pull is to be measured, not the limits on what moves in one period.
    params.displacement_limit_spacings = 10.0;
    let mut solver = TissueSolver::new(rig.network.clone(), patches, params).ok()?;
    let mut attachments =
        Attachments::new(solver.network(), solver.patches(), &specs, presets::SKIN.beta, mode).ok()?;
    attachments.engage(0, Engagement::Engaged);
    let mut stages = Stages { attachments: Some(attachments), ..Stages::default() };
    let hand = HandleSlot(0);
    solver.grasp(hand, PatchId(0)).ok()?;
    let start = solver.handle(hand)?.1;
    let steps = (HOLD_S * rate_hz).round() as usize;
    let averaged = (MEAN_S * rate_hz).round().max(1.0) as usize;
    let (mut sum_n, mut range_n) = (Vec3::zeros(), (f64::INFINITY, 0.0_f64));
    for step in 1..=steps {
        solver.lead(hand, start + Vec3::x() * (PULL.1 * step as f64 / rate_hz).min(PULL.0));
        solver.step(&mut stages);
        if step + averaged > steps {
            let force_n = solver.port(hand, &stages)?.force_n;
            sum_n += force_n;
            range_n = (range_n.0.min(force_n.norm()), range_n.1.max(force_n.norm()));
        }
    }
    let port = solver.port(hand, &stages)?;
    let mut at_end = Statics::new(rig.network.clone(), 0.0);
    at_end.position_m.clone_from(&solver.state().position_m);
    let (center, x) = (port.position_m, &solver.state().position_m);
    let excess = |(node, rest): &(u32, f64)| (x[*node as usize] - center).norm() - rest;
    let speed = |(node, _): &(u32, f64)| solver.state().velocity_m_per_s[*node as usize].norm();
    Some(Held {
        projections_hz: rate_hz * f64::from(solver.stability().substeps),
        force_n: sum_n.norm() / averaged as f64,
        chatter_n: 0.5 * (range_n.1 - range_n.0),
        springs_n: at_end.force_on(|n| rig.patch.contains(&n)).norm(),
        rim_n: at_end.force_on(|n| rig.network.fixed[n as usize] != 0).norm(),
        excess_m: followers.iter().map(excess).fold(0.0, f64::max),
        speed_m_per_s: followers.iter().map(speed).fold(0.0, f64::max),
    })
}

/// Radius beyond `d_i⁰` after each of `steps` calls of Algorithm 1 when `d_i` is carried over and the node is held out by
/// `excess_m`.
#[must_use]
pub fn ratchet_m(excess_m: f64, beta: f64, steps: usize) -> Vec<f64> {
    let mut radius = 0.0;
    let call = |_| {
        radius = relaxed_distance(radius, beta, excess_m);
        radius
    };
    (0..steps).map(call).collect()
}
