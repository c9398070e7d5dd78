//! One servo tick of the suture points that the hand holds or pulls.
//!
//! `m·a = F_couple + F_line + [f* − S(x − x*)] − c·v` (Zhang et al., Eq. (2) and (3), with the tissue as an
//! affine port), stiffness and damping taken at the end of the tick: per handle one 3 × 3 system
//! `(m + Δt(c + B) + Δt²(Kvc + S))·v⁺ = m·v + Δt·[…]`, symmetric positive definite. SI units.
//!
//! A pulled line ties right and left point by one scalar, its tension: `v⁺ = u + T·w` for each point, so `T`
//! follows from one linear equation and is the same in both; a negative `T` is a slack line, `T = 0`. With friction the
//! ratio of the tensions (`capstan`) is found together with the sliding speed that it causes. The port is trusted
//! within its radius: beyond, the spring term keeps its size and turns with the displacement.
//!
//! Deliberately absent: choosing the rung (age of the port), filtering and limiting the device force
//! (the servo's safety stage), extrapolating the port by its velocity.

use crate::kinematics::capstan::{capstan_ratio, self_consistent_ratio};
use crate::kinematics::coupling::{CouplingParams, StylusState, coupling_force};
use crate::kinematics::integrate::NodeState;
use crate::kinematics::line_pull::{LineParams, measure, pull};
use crate::kinematics::node_equation::{Load, NodeEquation};
use crate::vector::Vec3;

pub use crate::kinematics::node_equation::{AffinePort, PortRung, TickFlags};

/// Result of a tick in which the needle holds a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldTick {
    /// The point after the tick.
    pub node: NodeState,
    /// Force of the coupling on the point, newtons.
    pub applied_force_n: Vec3,
    /// Force on the hand: the opposite.
    pub device_force_n: Vec3,
    /// Force of the tissue on the point as used, newtons.
    pub tissue_force_n: Vec3,
    /// Flags.
    pub flags: TickFlags,
}

/// Result of a tick in which the line pulls a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulledTick {
    /// Right point after the tick.
    pub right: NodeState,
    /// Left point after the tick.
    pub left: NodeState,
    /// Tension above the tissue, newtons, at least 0.
    pub tension_n: f64,
    /// `F_hand` on the right point, newtons.
    pub hand_force_n: Vec3,
    /// `F_link` on the right point, newtons; the left point gets the opposite.
    pub link_force_n: Vec3,
    /// Force on the hand: `−F_hand`.
    pub device_force_n: Vec3,
    /// Force of the tissue on the right point as used, newtons.
    pub right_tissue_force_n: Vec3,
    /// Force of the tissue on the left point as used, newtons.
    pub left_tissue_force_n: Vec3,
    /// Flags of the right point.
    pub right_flags: TickFlags,
    /// Flags of the left point.
    pub left_flags: TickFlags,
}

/// Stiffness and damping that one rung multiplies.
pub(super) fn damping_factor(rung: PortRung) -> f64 {
    match rung {
        PortRung::Affine | PortRung::Frozen => 1.0,
        PortRung::OneRing => 2.0,
    }
}

fn moved(node: NodeState, velocity_m_per_s: Vec3, dt: f64) -> NodeState {
    NodeState { position_m: node.position_m + velocity_m_per_s * dt, velocity_m_per_s }
}

fn stopped(node: NodeState) -> NodeState {
    NodeState { velocity_m_per_s: Vec3::zeros(), ..node }
}

pub(super) fn finite(v: Vec3) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// One tick of a held point. `offset_m` is stylus minus point at capture. A `dt_s` that is not above 0 moves nothing.
#[must_use]
pub fn tick_held(
    node: NodeState,
    port: &AffinePort,
    stylus: StylusState,
    offset_m: Vec3,
    coupling: CouplingParams,
    rung: PortRung,
    dt_s: f64,
) -> HeldTick {
    let dt = dt_s.max(0.0);
    let coupling = CouplingParams { damping_n_s_per_m: coupling.damping_n_s_per_m * damping_factor(rung), ..coupling };
    let mut equation = NodeEquation::new(node, port, rung);
    let after = if rung == PortRung::Frozen {
        stopped(node)
    } else {
        // The coupling's pull as it would be with the point at rest: its damping on the point is in the matrix.
        let load = Load {
            stiffness: coupling.stiffness_n_per_m,
            damping: coupling.damping_n_s_per_m,
            force: coupling_force(coupling, stylus, offset_m, stopped(node)),
            line_direction: Vec3::zeros(),
        };
        let (velocity, _) = equation.solve(node, port, &load, dt);
        moved(node, velocity, dt)
    };
    let applied_force_n = coupling_force(coupling, stylus, offset_m, after);
    let tissue_force_n = equation.tissue_force(after.velocity_m_per_s, dt);
    let sound = [after.position_m, after.velocity_m_per_s, applied_force_n, tissue_force_n].into_iter().all(finite);
    if equation.flags.contained || !sound {
        let zero = Vec3::zeros();
        let flags = TickFlags { contained: true, ..equation.flags };
        return HeldTick {
            node: stopped(node),
            applied_force_n: zero,
            device_force_n: zero,
            tissue_force_n: zero,
            flags,
        };
    }
    HeldTick { node: after, applied_force_n, device_force_n: -applied_force_n, tissue_force_n, flags: equation.flags }
}

/// Extra drag of a point on which the line's directions turn faster than the tick can follow.
///
/// The directions belong to the start of the tick, so their turning stiffness `K_t = T/ℓ` is taken explicitly and
/// needs `K_t·Δt² < 4m + 2c·Δt` (Eq. (2), implicit drag). Up to half of that limit nothing is added; beyond, the
/// excess is met by the drag `Δt·(K_t − K_free)`, twice what stability asks. At 2 g, 3 Ns/m and 1 kHz this begins
/// where 3 N meet in a segment of 0.9 mm.
fn turning_drag_n_s_per_m(turning_n_per_m: f64, port: &AffinePort, dt: f64) -> f64 {
    let free = 2.0 * port.mass_kg + port.drag_n_s_per_m * dt;
    ((turning_n_per_m * dt * dt - free) / dt).max(0.0)
}

/// One tick of a pulled pair: the line runs from the stylus over the right point to the left one.
#[must_use]
pub fn tick_pulled(
    right: (NodeState, &AffinePort),
    left: (NodeState, &AffinePort),
    stylus: StylusState,
    line: &LineParams,
    rung: PortRung,
    dt_s: f64,
) -> PulledTick {
    let dt = dt_s.max(0.0);
    let damping = line.damping_n_s_per_m * damping_factor(rung);
    let geometry = measure(stylus.position_m, right.0.position_m, left.0.position_m);
    let mut right_equation = NodeEquation::new(right.0, right.1, rung);
    let mut left_equation = NodeEquation::new(left.0, left.1, rung);
    let (present_tension_n, _) = pull(line, stylus, right.0, left.0);
    let most_below = capstan_ratio(-line.friction, geometry.wrap_rad);
    let turning = geometry.turning_stiffness_n_per_m(present_tension_n, most_below);
    let solve = |equation: &mut NodeEquation, (node, port): (NodeState, &AffinePort), turning, line_direction| {
        if rung == PortRung::Frozen {
            return (Vec3::zeros(), Vec3::zeros());
        }
        let damping = turning_drag_n_s_per_m(turning, port, dt);
        equation.solve(node, port, &Load { damping, line_direction, ..Load::default() }, dt)
    };
    // T = k(L − L₀) + b·û·v_d + (kΔt + b)·Σ g·(u + T·w), solved for T; the denominator is at least 1 for ρ = 1.
    let (g_right, g_left) = (geometry.gradient_right(), geometry.gradient_left());
    let gain = line.stiffness_n_per_m * dt + damping;
    let tension = |(u_right, w_right): (Vec3, Vec3), (u_left, w_left): (Vec3, Vec3)| {
        let drive = line.stiffness_n_per_m * (geometry.length_m - line.rest_length_m)
            + damping * geometry.towards_stylus.dot(&stylus.velocity_m_per_s)
            + gain * (g_right.dot(&u_right) + g_left.dot(&u_left));
        let resistance = 1.0 - gain * (g_right.dot(&w_right) + g_left.dot(&w_left));
        (drive / resistance.max(1.0)).max(0.0)
    };
    let ratio = if line.friction == 0.0 {
        1.0
    } else {
        let (u_right, above) = solve(&mut right_equation, right, turning.0, geometry.towards_stylus);
        let (_, below) = solve(&mut right_equation, right, turning.0, geometry.towards_left);
        let (u_left, partner) = solve(&mut left_equation, left, turning.1, -geometry.towards_left);
        self_consistent_ratio(line.friction, geometry.wrap_rad, |ratio| {
            let (w_right, w_left) = (above + below * ratio, partner * ratio);
            let tension_n = tension((u_right, w_right), (u_left, w_left));
            geometry.sliding_speed_m_per_s(u_right + w_right * tension_n, u_left + w_left * tension_n)
        })
    };
    let (u_right, w_right) = solve(&mut right_equation, right, turning.0, geometry.right_direction(ratio));
    let (u_left, w_left) = solve(&mut left_equation, left, turning.1, geometry.left_direction(ratio));
    let tension_n = tension((u_right, w_right), (u_left, w_left));

    let right_after = moved(right.0, u_right + w_right * tension_n, dt);
    let left_after = moved(left.0, u_left + w_left * tension_n, dt);
    let forces = geometry.forces(tension_n, ratio);
    let right_tissue_force_n = right_equation.tissue_force(right_after.velocity_m_per_s, dt);
    let left_tissue_force_n = left_equation.tissue_force(left_after.velocity_m_per_s, dt);
    let vectors = [right_after.position_m, left_after.position_m, right_after.velocity_m_per_s].into_iter().chain([
        left_after.velocity_m_per_s,
        forces.hand_n,
        forces.link_n,
        right_tissue_force_n,
        left_tissue_force_n,
    ]);
    let sound = tension_n.is_finite() && vectors.into_iter().all(finite);
    let contained = right_equation.flags.contained || left_equation.flags.contained || !sound;
    if contained {
        return contained_pull(right.0, left.0, right_equation.flags, left_equation.flags);
    }
    PulledTick {
        right: right_after,
        left: left_after,
        tension_n,
        hand_force_n: forces.hand_n,
        link_force_n: forces.link_n,
        device_force_n: -forces.hand_n,
        right_tissue_force_n,
        left_tissue_force_n,
        right_flags: right_equation.flags,
        left_flags: left_equation.flags,
    }
}

fn contained_pull(right: NodeState, left: NodeState, right_flags: TickFlags, left_flags: TickFlags) -> PulledTick {
    let zero = Vec3::zeros();
    PulledTick {
        right: stopped(right),
        left: stopped(left),
        tension_n: 0.0,
        hand_force_n: zero,
        link_force_n: zero,
        device_force_n: zero,
        right_tissue_force_n: zero,
        left_tissue_force_n: zero,
        right_flags: TickFlags { contained: true, ..right_flags },
        left_flags: TickFlags { contained: true, ..left_flags },
    }
}

#[cfg(test)]
mod tests;
