//! Eq. (3): `F_hand + F_link + F_spring + F_damping = a·m_j`, its spring sum, its drag, and the suture line's two
//! forces, which have one magnitude; the hand feels the opposite of F_hand.

use proptest::prelude::*;
use sim_core::kinematics::coupling::StylusState;
use sim_core::kinematics::integrate::NodeState;
use sim_core::kinematics::line_pull::{LineParams, pull};
use sim_core::kinematics::port_tick::{AffinePort, PortRung, tick_pulled};
use sim_core::kinematics::suture_point::{Neighbours, SpringLaw, SuturePointForces, damping_force, spring_force};
use sim_core::vector::{Mat3, Vec3};
use std::f64::consts::PI;
use suture_tests::generators::cloud;
use suture_tests::reference::ReferenceNetwork;

/// Rounding of a sum of some ten forces of some newtons.
const FORCE_ROUNDING_N: f64 = 1e-12;

const STYLUS: Vec3 = Vec3::new(0.004, 0.001, 0.03);
const RIGHT: Vec3 = Vec3::new(0.003, 0.0, 0.001);
const LEFT: Vec3 = Vec3::new(-0.003, 0.0005, 0.0);

fn resting(position_m: Vec3) -> NodeState {
    NodeState { position_m, velocity_m_per_s: Vec3::zeros() }
}

fn line(friction: f64, rest_length_m: f64) -> LineParams {
    LineParams { stiffness_n_per_m: 400.0, damping_n_s_per_m: 1.0, rest_length_m, friction }
}

#[test]
fn eq3_each_force_accelerates_by_its_share_of_the_mass() {
    let mass = 0.002;
    let unit = [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, -1.0, 0.5)];
    let forces = SuturePointForces { hand_n: unit[0], link_n: unit[1], spring_n: unit[2], damping_n: unit[3] };
    let expected = Vec3::new(1000.0, 0.0, 750.0);
    assert!((forces.acceleration_m_per_s2(mass) - expected).norm() < 1e-9, "{}", forces.acceleration_m_per_s2(mass));
    let drag = damping_force(3.0, Vec3::new(0.1, 0.0, -0.2));
    assert!((drag - Vec3::new(-0.3, 0.0, 0.6)).norm() < FORCE_ROUNDING_N);
}

proptest! {
    #[test]
    fn eq3_spring_sum_agrees_with_the_edge_list_reference(seed in 0_u64..1_000_000, nodes in 3_usize..12) {
        let network = cloud(seed, nodes);
        let mut state = network.rest_state();
        for (i, x) in state.position_m.iter_mut().enumerate() {
            *x += Vec3::new(0.01 * (i as f64).sin(), 0.01 * (i as f64 * 1.7).cos(), 0.002 * i as f64);
        }
        let reference = ReferenceNetwork::new(&network, &state);
        let expected = reference.spring_forces_n(&reference.position_m);
        for (node, want) in expected.iter().enumerate() {
            let row = network.half_edges.row(node);
            let positions: Vec<Vec3> =
                network.half_edges.neighbour[row.clone()].iter().map(|n| state.position_m[*n as usize]).collect();
            let neighbours = Neighbours {
                position_m: &positions,
                rest_length_m: &network.half_edges.rest_length_m[row.clone()],
                stiffness_n_per_m: &network.half_edges.stiffness_n_per_m[row],
                beta: 0.5,
            };
            let force = spring_force(SpringLaw::Bilateral, state.position_m[node], &neighbours);
            prop_assert!((force - Vec3::from(*want)).norm() < FORCE_ROUNDING_N * 100.0, "node {node}");
        }
    }
}

#[test]
fn eq3_with_the_distance_of_eq1_pulls_with_k_beta_and_never_pushes() {
    let neighbour = [Vec3::new(0.012, 0.0, 0.0)];
    let force = |rest: f64, law| {
        let rest = [rest];
        let neighbours =
            Neighbours { position_m: &neighbour, rest_length_m: &rest, stiffness_n_per_m: &[160.0], beta: 0.8 };
        spring_force(law, Vec3::zeros(), &neighbours).x
    };
    // 2 mm too long: k·2 mm = 0.32 N, times β = 0.256 N. 2 mm too short: −0.32 N and nothing.
    assert!((force(0.010, SpringLaw::Bilateral) - 0.32).abs() < FORCE_ROUNDING_N);
    assert!((force(0.010, SpringLaw::PaperTension) - 0.256).abs() < FORCE_ROUNDING_N);
    assert!((force(0.014, SpringLaw::Bilateral) + 0.32).abs() < FORCE_ROUNDING_N);
    assert_eq!(force(0.014, SpringLaw::PaperTension), 0.0);
}

#[test]
fn eq3_hand_and_link_have_the_directions_of_fig3_and_one_magnitude() {
    let length = (STYLUS - RIGHT).norm() + (RIGHT - LEFT).norm();
    let stylus = StylusState { position_m: STYLUS, velocity_m_per_s: Vec3::zeros() };
    let (tension, forces) = pull(&line(0.0, length - 0.005), stylus, resting(RIGHT), resting(LEFT));
    assert!((tension - 400.0 * 0.005).abs() < 1e-9, "{tension}");
    assert!((forces.hand_n - (STYLUS - RIGHT).normalize() * 2.0).norm() < 1e-9);
    assert!((forces.link_n - (LEFT - RIGHT).normalize() * 2.0).norm() < 1e-9);
    // θ by the law of cosines on the triangle of the three points; the gap closes at 10 mm/s, then opens as fast.
    let (d, l) = ((STYLUS - RIGHT).norm(), (LEFT - RIGHT).norm());
    let wrap = PI - ((d * d + l * l - (STYLUS - LEFT).norm_squared()) / (2.0 * d * l)).acos();
    for (speed, sign) in [(0.01, 1.0), (-0.01, -1.0)] {
        let velocity_m_per_s = (LEFT - RIGHT).normalize() * speed;
        let right = NodeState { position_m: RIGHT, velocity_m_per_s };
        let (_, rubbed) = pull(&line(0.3, length - 0.005), stylus, right, resting(LEFT));
        assert!((rubbed.link_n.norm() / rubbed.hand_n.norm() - (-0.3 * wrap * sign).exp()).abs() < 1e-12);
    }
    let (slack, none) = pull(&line(0.0, length + 0.001), stylus, resting(RIGHT), resting(LEFT));
    assert_eq!((slack, none.hand_n, none.link_n), (0.0, Vec3::zeros(), Vec3::zeros()), "a slack line pushes nothing");
}

#[test]
fn eq3_hand_feels_the_opposite_and_settles_where_the_tissue_balances_the_line() {
    let stiffness = 300.0;
    let port = |at: Vec3| AffinePort {
        position_m: at,
        velocity_m_per_s: Vec3::zeros(),
        force_n: Vec3::zeros(),
        stiffness_n_per_m: Mat3::identity() * stiffness,
        one_ring_n_per_m: Mat3::identity() * 2.0 * stiffness,
        trust_radius_m: 1.0,
        mass_kg: 2e-3,
        drag_n_s_per_m: 3.0,
    };
    let (right_port, left_port) = (port(RIGHT), port(LEFT));
    let stylus = StylusState { position_m: STYLUS, velocity_m_per_s: Vec3::zeros() };
    let line = line(0.0, 0.03);
    let (mut right, mut left) = (resting(RIGHT), resting(LEFT));
    let mut last = tick_pulled((right, &right_port), (left, &left_port), stylus, &line, PortRung::Affine, 1e-3);
    for _ in 0..2000 {
        assert_eq!(last.device_force_n, -last.hand_force_n);
        (right, left) = (last.right, last.left);
        last = tick_pulled((right, &right_port), (left, &left_port), stylus, &line, PortRung::Affine, 1e-3);
    }
    // Settled: spring of the tissue = line, on either point; computed from the positions alone.
    let (tension, forces) = pull(&line, stylus, last.right, last.left);
    assert!(tension > 0.1, "the line is taut: {tension}");
    assert!(((RIGHT - last.right.position_m) * stiffness + forces.hand_n + forces.link_n).norm() < 1e-9);
    assert!(((LEFT - last.left.position_m) * stiffness - forces.link_n).norm() < 1e-9);
    assert!((last.tension_n - tension).abs() < 1e-9);
}
