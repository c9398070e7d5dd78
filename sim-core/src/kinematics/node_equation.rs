//! The linear system of one handle in a servo tick.
//!
//! `(m + Δt(c + B) + Δt²(Kvc + S))·v⁺ = m·v + Δt·[f* − S(x − x*) + F]` (Zhang et al., Eq. (2) and (3), stiffness
//! and damping taken at the end of the tick): symmetric positive definite, one Cholesky factor, up to two right
//! sides (`u` without the line, `w` per newton of line tension). SI units.
//!
//! The port is trusted within its radius: beyond, the spring term keeps the size it has on the sphere and turns
//! with the displacement. Deliberately absent: which forces act (`port_tick`).

use crate::kinematics::integrate::NodeState;
use crate::vector::{Mat3, Vec3};

/// The tissue as one handle feels it: `f = f* − S(x − x*)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffinePort {
    /// Expansion point `x*`, metres.
    pub position_m: Vec3,
    /// Velocity at `x*`, metres per second (for reports and blending; the tick does not extrapolate).
    pub velocity_m_per_s: Vec3,
    /// Tissue force at `x*`, newtons.
    pub force_n: Vec3,
    /// Condensed step stiffness `S`, newtons per metre.
    pub stiffness_n_per_m: Mat3,
    /// One-ring stiffness: all neighbours held, the safe upper bound, newtons per metre.
    pub one_ring_n_per_m: Mat3,
    /// The affine law is trusted for `|x − x*|` up to this, metres.
    pub trust_radius_m: f64,
    /// Mass of the suture point with its patch, kilograms, above 0.
    pub mass_kg: f64,
    /// Drag of the suture point, newton seconds per metre, at least 0.
    pub drag_n_s_per_m: f64,
}

/// Rung of the late-solver ladder that the tick stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortRung {
    /// The port as published.
    Affine,
    /// One-ring stiffness, coupling and line damping doubled.
    OneRing,
    /// The suture points stand still.
    Frozen,
}

/// What happened to one handle in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickFlags {
    /// The point is outside the trust radius: the affine force is clamped there.
    pub beyond_trust: bool,
    /// The stiffness made the system indefinite; an isotropic upper bound stood in for it.
    pub stiffness_replaced: bool,
    /// The literal form would have needed more sub-steps than a tick has; the implicit one stood in for it.
    pub literal_refused: bool,
    /// The result was not finite: the point stays, forces are zero.
    pub contained: bool,
}

/// The tissue's side of one node equation, ready to solve.
pub(super) struct NodeEquation {
    stiffness: Mat3,
    spring_force: Vec3,
    pub(super) flags: TickFlags,
}

impl NodeEquation {
    /// Stiffness and force at the start of the tick; beyond the trust radius both are scaled so that the spring
    /// term `S(x − x*)` keeps the size it has on the sphere.
    pub(super) fn new(node: NodeState, port: &AffinePort, rung: PortRung) -> Self {
        let matrix = match rung {
            PortRung::Affine | PortRung::Frozen => port.stiffness_n_per_m,
            PortRung::OneRing => port.one_ring_n_per_m,
        };
        let away = node.position_m - port.position_m;
        let distance = away.norm();
        let radius = port.trust_radius_m.max(0.0);
        let beyond_trust = distance > radius;
        let scale = if beyond_trust { radius / distance } else { 1.0 };
        let stiffness = (matrix + matrix.transpose()) * (0.5 * scale);
        let flags = TickFlags { beyond_trust, ..TickFlags::default() };
        Self { stiffness, spring_force: port.force_n - stiffness * away, flags }
    }

    /// `(m + Δt(c + B) + Δt²(K + S))⁻¹` applied to the momentum without the line (`u`) and to `Δt·h` (`w`).
    pub(super) fn solve(&mut self, node: NodeState, port: &AffinePort, load: &Load, dt: f64) -> (Vec3, Vec3) {
        let isotropic = port.mass_kg + dt * (port.drag_n_s_per_m + load.damping) + dt * dt * load.stiffness;
        let system = |s: &Mat3| Mat3::identity() * isotropic + s * (dt * dt);
        let factor = system(&self.stiffness).cholesky().or_else(|| {
            self.flags.stiffness_replaced = true;
            let away = node.position_m - port.position_m;
            let bound = Mat3::identity() * self.stiffness.row_iter().map(|r| r.abs().sum()).fold(0.0, f64::max);
            self.spring_force += (self.stiffness - bound) * away;
            self.stiffness = bound;
            system(&bound).cholesky()
        });
        let Some(factor) = factor else {
            self.flags.contained = true;
            return (Vec3::zeros(), Vec3::zeros());
        };
        let momentum = node.velocity_m_per_s * port.mass_kg + (self.spring_force + load.force) * dt;
        (factor.solve(&momentum), factor.solve(&(load.line_direction * dt)))
    }

    /// `f* − S(x⁺ − x*)`: the tissue's force at the end of the tick.
    pub(super) fn tissue_force(&self, velocity: Vec3, dt: f64) -> Vec3 {
        self.spring_force - self.stiffness * velocity * dt
    }
}

/// What else acts on the node: a coupling (stiffness, damping, force at the start) and a line direction.
#[derive(Default)]
pub(super) struct Load {
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    pub(super) force: Vec3,
    pub(super) line_direction: Vec3,
}
