//! A follower between a spring and an attachment that is projected once per step: stability over β and dt.
//!
//! One node on the ray from the suture point, held outward by springs of K in all, beyond its rest distance. The step is the
//! solver's: Eq. (2) with implicit drag, then Eq. (1). With w = K dt²/(m + c dt) and s = m/(m + c dt) Jury's test gives
//! - velocity corrected by the projection: β w < 1 + β + 2 β s, i.e. β K dt² < (1 + 3β) m + (1 + β) c dt;
//! - velocity left as printed: β w < (1 + β)(1 + s), i.e. β K dt² < (1 + β)(2m + c dt).
//!
//! β = 1 gives K dt² < 4m + 2c dt in both; smaller β only widens the region.

use super::boundary::Boundary;
use super::probe::{DISTURBANCE, Motion, bisect, edge_width, edge_windows, grows};
use crate::accuracy::section::Effort;
use sim_core::kinematics::attachment::project;
use sim_core::kinematics::integrate::{NodeState, step_implicit_drag};
use sim_core::tissue::regulation::ProjectedVelocity;
use sim_core::vector::Vec3;

/// K, newtons per metre: a skin node between two neighbours.
pub(super) const STIFFNESS_N_PER_M: f64 = 320.0;
/// Mass of the follower, kilograms.
pub(super) const MASS_KG: f64 = 5.5e-5;
/// Drag of the follower, newton seconds per metre.
pub(super) const DRAG_N_S_PER_M: f64 = 0.2;
/// Rest distance of the attachment, metres.
const REST_M: f64 = 0.01;
/// Where the springs alone would hold the follower, metres.
const PULLED_M: f64 = 0.02;

/// The follower.
pub(super) struct Follower {
    node: [Vec3; 1],
    velocity: Vec3,
    rest: [Vec3; 1],
    beta: f64,
    mode: ProjectedVelocity,
    dt_s: f64,
}

impl Follower {
    pub(super) fn new(beta: f64, mode: ProjectedVelocity, dt_s: f64) -> Self {
        let mut follower =
            Self { node: [Vec3::x() * REST_M], velocity: Vec3::zeros(), rest: [Vec3::zeros()], beta, mode, dt_s };
        follower.rest = [Vec3::x() * follower.equilibrium_m()];
        follower.node = [follower.rest[0] + Vec3::x() * (DISTURBANCE * REST_M)];
        // As printed, the velocity of the equilibrium is not zero: the step goes out, the projection comes back.
        if mode == ProjectedVelocity::Literal {
            follower.velocity = Vec3::x() * ((1.0 / beta - 1.0) * (follower.rest[0].x - REST_M) / dt_s);
        }
        follower
    }

    /// Where the node is after a step of its equilibrium.
    fn equilibrium_m(&self) -> f64 {
        let (k, c, dt, beta) = (STIFFNESS_N_PER_M, DRAG_N_S_PER_M, self.dt_s, self.beta);
        // Stiffness that the projection amounts to: with corrected velocity inertia counts, as printed only drag.
        let inertia = if self.mode == ProjectedVelocity::Corrected { MASS_KG } else { 0.0 };
        let held = (1.0 - beta) * (inertia + c * dt) / (beta * dt * dt);
        (k * PULLED_M + held * REST_M) / (k + held)
    }
}

impl Motion for Follower {
    fn step(&mut self) {
        let node = NodeState { position_m: self.node[0], velocity_m_per_s: self.velocity };
        let force = Vec3::x() * (STIFFNESS_N_PER_M * (PULLED_M - node.position_m.x));
        let after = step_implicit_drag(node, force, MASS_KG, DRAG_N_S_PER_M, self.dt_s);
        let projected = project(Vec3::zeros(), after.position_m, REST_M, self.beta);
        self.velocity = match self.mode {
            ProjectedVelocity::Corrected => after.velocity_m_per_s + (projected - after.position_m) / self.dt_s,
            ProjectedVelocity::Literal => after.velocity_m_per_s,
        };
        self.node = [projected];
    }

    fn position_m(&self) -> &[Vec3] {
        &self.node
    }

    fn rest_m(&self) -> &[Vec3] {
        &self.rest
    }

    fn spacing_m(&self) -> f64 {
        REST_M
    }
}

/// Longest stable step, seconds: the positive root of a dt² − b dt − c = 0.
pub(super) fn longest_step_s(beta: f64, mode: ProjectedVelocity) -> f64 {
    let (m, c) = (MASS_KG, DRAG_N_S_PER_M);
    let free = match mode {
        ProjectedVelocity::Corrected => (1.0 + 3.0 * beta) * m,
        ProjectedVelocity::Literal => (1.0 + beta) * 2.0 * m,
    };
    let (a, b) = (beta * STIFFNESS_N_PER_M, (1.0 + beta) * c);
    (b + (b * b + 4.0 * a * free).sqrt()) / (2.0 * a)
}

/// Name of a form.
pub(super) fn name(mode: ProjectedVelocity) -> &'static str {
    match mode {
        ProjectedVelocity::Corrected => "projection, velocity corrected",
        ProjectedVelocity::Literal => "projection, velocity as printed",
    }
}

/// Boundaries over β.
pub(super) fn boundaries(effort: Effort) -> Vec<Boundary> {
    let betas: &[f64] = if effort == Effort::Full { &[1.0, 0.9, 0.8, 0.6, 0.4, 0.2] } else { &[1.0, 0.8, 0.4] };
    let modes = [ProjectedVelocity::Corrected, ProjectedVelocity::Literal];
    let edge = |mode, beta| {
        let formula = longest_step_s(beta, mode);
        Boundary {
            topology: "follower of an attachment".to_owned(),
            integrator: name(mode).to_owned(),
            at: format!("β = {beta}, K = {STIFFNESS_N_PER_M} N/m, m = 0.055 g, c = {DRAG_N_S_PER_M} N·s/m"),
            quantity: "dt (s)",
            measured: bisect(formula / 10.0, formula * 10.0, edge_width(effort), |dt| {
                grows(&mut Follower::new(beta, mode, dt), edge_windows(effort))
            }),
            formula: Some(formula),
        }
    };
    modes.into_iter().flat_map(|mode| betas.iter().map(move |beta| edge(mode, *beta))).collect()
}
