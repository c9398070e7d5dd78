//! Two-sided virtual coupling between the stylus and the suture point that it holds.
//!
//! `F = Kvc·(x_d − o − x) + Bvc·(v_d − v)` on the point, the opposite on the hand; `o` is the offset at
//! capture, so that taking a point never makes it jump. Metres, newtons, newton seconds per metre.
//! Source: Colgate's virtual coupling in the shape that Zhang et al., §2.2 ask for (force feedback equal to
//! the hand's force and opposite to it).
//!
//! Deliberately absent: saturation (the servo's safety stage) and friction of the hand.

use crate::kinematics::integrate::NodeState;
use crate::vector::Vec3;

/// Stiffness and damping of the coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingParams {
    /// `Kvc`, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// `Bvc`, newton seconds per metre.
    pub damping_n_s_per_m: f64,
}

/// `Kvc` and `Bvc` that stayed stable in every hand-attached case tried, and that an Omni can render
/// (`Bvc` is five times the `Kvc·T/2` that a 1 kHz hold needs).
pub const DEFAULT_COUPLING: CouplingParams = CouplingParams { stiffness_n_per_m: 400.0, damping_n_s_per_m: 1.0 };

/// Where the stylus is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StylusState {
    /// Position, metres, scene frame.
    pub position_m: Vec3,
    /// Velocity, metres per second.
    pub velocity_m_per_s: Vec3,
}

/// Force of the coupling on the suture point, newtons; the hand gets the opposite.
#[must_use]
pub fn coupling_force(params: CouplingParams, stylus: StylusState, offset_m: Vec3, node: NodeState) -> Vec3 {
    (stylus.position_m - offset_m - node.position_m) * params.stiffness_n_per_m
        + (stylus.velocity_m_per_s - node.velocity_m_per_s) * params.damping_n_s_per_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn capture_starts_without_force_and_pulls_towards_the_stylus() {
        let node = NodeState { position_m: Vec3::new(0.01, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
        let mut stylus = StylusState { position_m: Vec3::new(0.013, 0.001, 0.0), velocity_m_per_s: Vec3::zeros() };
        let offset = stylus.position_m - node.position_m;
        assert!(coupling_force(DEFAULT_COUPLING, stylus, offset, node).norm() < 1e-12);
        stylus.position_m.x += 0.002;
        stylus.velocity_m_per_s.x = 0.1;
        let f = coupling_force(DEFAULT_COUPLING, stylus, offset, node);
        assert!((f - Vec3::new(0.9, 0.0, 0.0)).norm() < 1e-12);
    }
}
