//! Forces on a suture point.
//!
//! `F_hand + F_link + F_spring + F_damping = m_j·a`, `F_spring = Σ_{i∈σ(j)} k (d_i − d_i⁰) û_{j→i}`,
//! `F_damping = −c·v_j` (Zhang et al., Eq. (3); the sum runs over the neighbours of j). SI units.
//!
//! `d_i` may be read in two ways, and both are here: the plain distance gives the bilateral spring of a
//! mass-spring model; the `d_i` of Eq. (1) gives `k·β·max(‖x_i − x_j‖ − d_i⁰, 0)`, which only pulls and is
//! softer by β. Scenes run the bilateral law.
//!
//! Deliberately absent: where `F_hand` and `F_link` come from (`line_pull`) and the reaction of the
//! attachments, which the tissue adds.

use crate::kinematics::attachment::relaxed_distance;
use crate::kinematics::integrate::{NodeState, step_literal};
use crate::vector::Vec3;

/// How the `d_i` of Eq. (3) is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpringLaw {
    /// `d_i = ‖x_i − x_j‖`: pulls and pushes with `k`.
    Bilateral,
    /// `d_i` of Eq. (1): pulls only, with `k·β`.
    PaperTension,
}

/// Neighbours of one suture point, one entry per spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours<'a> {
    /// Positions, metres.
    pub position_m: &'a [Vec3],
    /// Rest lengths `d_i⁰`, metres.
    pub rest_length_m: &'a [f64],
    /// Stiffnesses, newtons per metre.
    pub stiffness_n_per_m: &'a [f64],
    /// Relaxation β of Eq. (1); the bilateral law ignores it.
    pub beta: f64,
}

/// The four forces of Eq. (3), newtons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SuturePointForces {
    /// Hand, along the suture line above the tissue.
    pub hand_n: Vec3,
    /// Suture line below the tissue.
    pub link_n: Vec3,
    /// Springs to the neighbours.
    pub spring_n: Vec3,
    /// Drag.
    pub damping_n: Vec3,
}

/// Eq. (3), second line: force of the neighbours on the point at `position_m`. A neighbour that coincides
/// with the point has no direction and is skipped.
#[must_use]
pub fn spring_force(law: SpringLaw, position_m: Vec3, neighbours: &Neighbours<'_>) -> Vec3 {
    let springs = neighbours.position_m.iter().zip(neighbours.rest_length_m).zip(neighbours.stiffness_n_per_m);
    springs.fold(Vec3::zeros(), |sum, ((x, rest), k)| {
        let away = x - position_m;
        let distance = away.norm();
        if distance == 0.0 {
            return sum;
        }
        let d = match law {
            SpringLaw::Bilateral => distance,
            SpringLaw::PaperTension => relaxed_distance(*rest, neighbours.beta, distance),
        };
        sum + away * (k * (d - rest) / distance)
    })
}

/// Eq. (3), third line: `−c·v`.
#[must_use]
pub fn damping_force(drag_n_s_per_m: f64, velocity_m_per_s: Vec3) -> Vec3 {
    velocity_m_per_s * -drag_n_s_per_m
}

impl SuturePointForces {
    /// Left side of Eq. (3), first line.
    #[must_use]
    pub fn total_n(&self) -> Vec3 {
        self.hand_n + self.link_n + self.spring_n + self.damping_n
    }

    /// `a` of Eq. (3).
    #[must_use]
    pub fn acceleration_m_per_s2(&self, mass_kg: f64) -> Vec3 {
        self.total_n() / mass_kg
    }
}

/// One literal step of a suture point: Eq. (3) at time t, then Eq. (2). Stable only below
/// [`literal_max_dt_s`](crate::kinematics::integrate::literal_max_dt_s).
#[must_use]
pub fn step_as_printed(state: NodeState, forces: &SuturePointForces, mass_kg: f64, dt_s: f64) -> NodeState {
    step_literal(state, forces.acceleration_m_per_s2(mass_kg), dt_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding on forces of about a newton.
    const ROUND_N: f64 = 1e-14;
    /// Quad spacing, metres.
    const H: f64 = 0.0025;

    /// Wound-edge node of a quad sheet at the origin, wound towards +x: neighbours left, up, down and the two diagonals.
    fn edge_ring() -> ([Vec3; 5], [f64; 5]) {
        let x = [(-H, 0.0), (0.0, H), (0.0, -H), (-H, H), (-H, -H)].map(|(x, y)| Vec3::new(x, y, 0.0));
        (x, x.map(|v| v.norm()))
    }

    #[test]
    fn eq3_static_force_of_a_wound_edge_node_matches_the_closed_form() {
        // The node is pulled 1 mm across the wound; x-components written out spring by spring. All five are in
        // tension, so the paper's law is exactly β times the bilateral one.
        let (x, rest) = edge_ring();
        let u = 0.001;
        for (k, beta) in [(160.0, 0.8), (180.0, 0.6), (270.0, 0.4)] {
            let stiffness = [k, k, k, k / 2.0, k / 2.0];
            let ring = Neighbours { position_m: &x, rest_length_m: &rest, stiffness_n_per_m: &stiffness, beta };
            let side = (H * H + u * u).sqrt();
            let diagonal = ((H + u) * (H + u) + H * H).sqrt();
            let expected =
                -k * (u + 2.0 * (side - H) * u / side) - k * (diagonal - H * 2_f64.sqrt()) * (H + u) / diagonal;
            let bilateral = spring_force(SpringLaw::Bilateral, Vec3::new(u, 0.0, 0.0), &ring);
            assert!((bilateral - Vec3::new(expected, 0.0, 0.0)).norm() < ROUND_N);
            let paper = spring_force(SpringLaw::PaperTension, Vec3::new(u, 0.0, 0.0), &ring);
            assert!((paper - bilateral * beta).norm() < ROUND_N);
        }
    }

    #[test]
    fn eq3_bilateral_pushes_where_the_paper_law_is_silent() {
        let (x, rest) = ([Vec3::new(0.002, 0.0, 0.0)], [0.003]);
        let ring = Neighbours { position_m: &x, rest_length_m: &rest, stiffness_n_per_m: &[160.0], beta: 0.8 };
        let pushed = spring_force(SpringLaw::Bilateral, Vec3::zeros(), &ring);
        assert!((pushed - Vec3::new(-0.16, 0.0, 0.0)).norm() < ROUND_N);
        assert_eq!(spring_force(SpringLaw::PaperTension, Vec3::zeros(), &ring), Vec3::zeros());
        assert_eq!(spring_force(SpringLaw::Bilateral, x[0], &ring), Vec3::zeros());
    }

    #[test]
    fn eq3_is_the_negative_gradient_of_the_spring_energy() {
        let (x, rest) = edge_ring();
        let ring = Neighbours { position_m: &x, rest_length_m: &rest, stiffness_n_per_m: &[160.0; 5], beta: 1.0 };
        let energy = |p: Vec3| x.iter().zip(rest).map(|(n, l)| 80.0 * ((n - p).norm() - l).powi(2)).sum::<f64>();
        let p = Vec3::new(0.0007, -0.0004, 0.0009);
        let step = 1e-7;
        let gradient = Vec3::from_fn(|i, _| {
            let mut e = Vec3::zeros();
            e[i] = step;
            (energy(p + e) - energy(p - e)) / (2.0 * step)
        });
        // Central differences on a 0.1 mJ energy: rounding over 1e-7 m leaves about 1e-9 N.
        assert!((spring_force(SpringLaw::Bilateral, p, &ring) + gradient).norm() < 1e-8);
    }

    #[test]
    fn eq3_sums_the_four_forces_and_eq2_moves_the_point() {
        let forces = SuturePointForces {
            hand_n: Vec3::new(1.0, 0.0, 0.0),
            link_n: Vec3::new(0.0, 2.0, 0.0),
            spring_n: Vec3::new(0.0, 0.0, 4.0),
            damping_n: damping_force(3.0, Vec3::new(1.0, -1.0, 0.0)),
        };
        assert_eq!(forces.total_n(), Vec3::new(-2.0, 5.0, 4.0));
        assert_eq!(forces.acceleration_m_per_s2(0.5), Vec3::new(-4.0, 10.0, 8.0));
        let state = NodeState { position_m: Vec3::zeros(), velocity_m_per_s: Vec3::new(1.0, -1.0, 0.0) };
        let next = step_as_printed(state, &forces, 0.5, 0.25);
        assert_eq!(next.velocity_m_per_s, Vec3::new(0.0, 1.5, 2.0));
        assert_eq!(next.position_m, Vec3::new(0.0, 0.375, 0.5));
    }
}
