//! Tests of the servo tick: force balance, closed forms, a fine Runge–Kutta reference, stability, passivity.

use super::*;
use crate::kinematics::capstan::sliding_direction;
use crate::kinematics::coupling::DEFAULT_COUPLING;
use crate::kinematics::line_pull::pull;
use crate::vector::Mat3;
use proptest::prelude::*;

mod motion;

/// Servo tick, seconds.
const DT: f64 = 1e-3;
/// Rounding on forces of a few newtons.
const ROUND_N: f64 = 1e-10;

const LINE: LineParams =
    LineParams { stiffness_n_per_m: 400.0, damping_n_s_per_m: 1.0, rest_length_m: 0.046, friction: 0.0 };

/// Skin-like port: 2 g, Table 2's drag, an anisotropic condensed stiffness.
fn port() -> AffinePort {
    AffinePort {
        position_m: Vec3::new(0.004, 0.001, 0.0),
        velocity_m_per_s: Vec3::zeros(),
        force_n: Vec3::new(-0.1, 0.05, 0.02),
        stiffness_n_per_m: Mat3::new(320.0, 40.0, 10.0, 40.0, 280.0, -20.0, 10.0, -20.0, 90.0),
        one_ring_n_per_m: Mat3::new(640.0, 0.0, 0.0, 0.0, 640.0, 0.0, 0.0, 0.0, 300.0),
        trust_radius_m: 0.02,
        mass_kg: 2e-3,
        drag_n_s_per_m: 3.0,
    }
}

fn left_port() -> AffinePort {
    AffinePort { position_m: Vec3::new(-0.004, 0.0, 0.0), ..port() }
}

fn node(x: f64, y: f64, z: f64) -> NodeState {
    NodeState { position_m: Vec3::new(x, y, z), velocity_m_per_s: Vec3::new(0.01, -0.02, 0.005) }
}

fn stylus() -> StylusState {
    StylusState { position_m: Vec3::new(0.01, 0.002, 0.04), velocity_m_per_s: Vec3::new(0.05, 0.0, 0.08) }
}

fn momentum_rate(before: NodeState, after: NodeState, port: &AffinePort) -> Vec3 {
    (after.velocity_m_per_s - before.velocity_m_per_s) * (port.mass_kg / DT)
        + after.velocity_m_per_s * port.drag_n_s_per_m
}

#[test]
fn eq3_held_tick_balances_coupling_tissue_drag_and_inertia() {
    let (before, port) = (node(0.0045, 0.001, 0.0005), port());
    for rung in [PortRung::Affine, PortRung::OneRing] {
        let tick = tick_held(before, &port, stylus(), Vec3::new(0.005, 0.0, 0.03), DEFAULT_COUPLING, rung, DT);
        let missing = momentum_rate(before, tick.node, &port) - tick.applied_force_n - tick.tissue_force_n;
        assert!(missing.norm() < ROUND_N, "{missing}");
        assert_eq!(tick.device_force_n, -tick.applied_force_n);
        assert!((tick.node.position_m - before.position_m - tick.node.velocity_m_per_s * DT).norm() < 1e-15);
        // The port's force at the new place, evaluated from its definition.
        let s = if rung == PortRung::Affine { port.stiffness_n_per_m } else { port.one_ring_n_per_m };
        let expected = port.force_n - s * (tick.node.position_m - port.position_m);
        assert!((tick.tissue_force_n - expected).norm() < ROUND_N);
    }
}

#[test]
fn eq3_pulled_tick_balances_both_points_and_gives_the_hand_the_opposite() {
    let (right, left) = (node(0.0045, 0.001, 0.0005), node(-0.004, 0.0, 0.0002));
    let (right_port, left_port) = (port(), left_port());
    for friction in [0.0, 0.3] {
        let line = LineParams { friction, ..LINE };
        let tick = tick_pulled((right, &right_port), (left, &left_port), stylus(), &line, PortRung::Affine, DT);
        assert!(tick.tension_n > 0.5, "{}", tick.tension_n);
        let on_right = tick.hand_force_n + tick.link_force_n + tick.right_tissue_force_n;
        let on_left = tick.left_tissue_force_n - tick.link_force_n;
        assert!((momentum_rate(right, tick.right, &right_port) - on_right).norm() < ROUND_N);
        assert!((momentum_rate(left, tick.left, &left_port) - on_left).norm() < ROUND_N);
        assert_eq!(tick.device_force_n, -tick.hand_force_n);
        assert!((tick.hand_force_n.norm() - tick.tension_n).abs() < ROUND_N);
        let geometry = measure(stylus().position_m, right.position_m, left.position_m);
        let speed = geometry.sliding_speed_m_per_s(tick.right.velocity_m_per_s, tick.left.velocity_m_per_s);
        let ratio = capstan_ratio(friction * sliding_direction(speed), geometry.wrap_rad);
        // s is known to 1e-12, and its tanh is thousands of times as steep where the line is held.
        assert!((tick.link_force_n.norm() - ratio * tick.tension_n).abs() < 1e-7);
        // The tension belongs to the length at the end of the tick: second order in the motion of one tick.
        let (end, _) = pull(&line, stylus(), tick.right, tick.left);
        assert!((end - tick.tension_n).abs() < 0.02 * tick.tension_n, "{end} {}", tick.tension_n);
    }
}

#[test]
fn eq3_held_point_comes_to_rest_where_coupling_and_tissue_are_in_series() {
    let port = AffinePort { stiffness_n_per_m: Mat3::identity() * 300.0, force_n: Vec3::zeros(), ..port() };
    let start = NodeState { position_m: port.position_m, velocity_m_per_s: Vec3::zeros() };
    let reach = Vec3::new(0.007, 0.0, 0.0);
    let stylus = StylusState { position_m: port.position_m + reach, velocity_m_per_s: Vec3::zeros() };
    let mut state = start;
    let mut force = Vec3::zeros();
    for _ in 0..500 {
        let tick = tick_held(state, &port, stylus, Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, DT);
        (state, force) = (tick.node, tick.device_force_n);
    }
    let series = 400.0 * 300.0 / 700.0;
    assert!((force + reach * series).norm() < ROUND_N);
    assert!((state.position_m - start.position_m - reach * (400.0 / 700.0)).norm() < 1e-12);
}

/// Classical Runge–Kutta on positions and velocities of right and left point.
fn rk4(y: [Vec3; 4], dt: f64, rate: impl Fn([Vec3; 4]) -> [Vec3; 4]) -> [Vec3; 4] {
    let add = |k: [Vec3; 4], h: f64| std::array::from_fn(|i| y[i] + k[i] * h);
    let k1 = rate(y);
    let k2 = rate(add(k1, dt / 2.0));
    let k3 = rate(add(k2, dt / 2.0));
    let k4 = rate(add(k3, dt));
    std::array::from_fn(|i| y[i] + (k1[i] + k2[i] * 2.0 + k3[i] * 2.0 + k4[i]) * (dt / 6.0))
}

/// Position error of the right point after 20 ms of ticks of `dt` against the continuous equations.
fn pulled_error(dt: f64) -> f64 {
    let (right_port, left_port, stylus) =
        (port(), left_port(), StylusState { velocity_m_per_s: Vec3::zeros(), ..stylus() });
    let (mut right, mut left) = (node(0.0045, 0.001, 0.0005), node(-0.004, 0.0, 0.0002));
    let mut y = [right.position_m, right.velocity_m_per_s, left.position_m, left.velocity_m_per_s];
    let at = |x, v| NodeState { position_m: x, velocity_m_per_s: v };
    let tissue = |p: &AffinePort, x: Vec3| p.force_n - p.stiffness_n_per_m * (x - p.position_m);
    for _ in 0..2000 {
        y = rk4(y, 1e-5, |y| {
            let (_, line) = pull(&LINE, stylus, at(y[0], y[1]), at(y[2], y[3]));
            let on_right = line.hand_n + line.link_n + tissue(&right_port, y[0]) - y[1] * 3.0;
            let on_left = tissue(&left_port, y[2]) - line.link_n - y[3] * 3.0;
            [y[1], on_right / 2e-3, y[3], on_left / 2e-3]
        });
    }
    for _ in 0..(0.020 / dt).round() as usize {
        let tick = tick_pulled((right, &right_port), (left, &left_port), stylus, &LINE, PortRung::Affine, dt);
        (right, left) = (tick.right, tick.left);
    }
    (right.position_m - y[0]).norm() + (left.position_m - y[2]).norm()
}

#[test]
fn pulled_tick_converges_to_a_runge_kutta_reference_at_first_order() {
    let errors = [1e-3, 0.5e-3, 0.25e-3, 0.125e-3].map(pulled_error);
    assert!(errors[0] < 1e-4, "{errors:?}");
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        // First order: halving the tick halves the error.
        assert!((1.7..2.3).contains(&ratio), "{errors:?}");
    }
}

#[test]
fn beyond_the_trust_radius_the_spring_force_keeps_its_size() {
    let port = AffinePort { stiffness_n_per_m: Mat3::identity() * 300.0, force_n: Vec3::zeros(), ..port() };
    let force_at = |distance: f64| {
        let at =
            NodeState { position_m: port.position_m + Vec3::new(0.0, 0.0, distance), velocity_m_per_s: Vec3::zeros() };
        let stylus = StylusState { position_m: at.position_m, velocity_m_per_s: Vec3::zeros() };
        let tick = tick_held(at, &port, stylus, Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, 0.0);
        assert_eq!(tick.flags.beyond_trust, distance > 0.02, "{distance}");
        tick.tissue_force_n.z
    };
    assert!((force_at(0.01) + 3.0).abs() < ROUND_N);
    assert!((force_at(0.0199999) - force_at(0.0200001)).abs() < 1e-4);
    for distance in [0.03, 0.1, 1e3] {
        assert!((force_at(distance) + 6.0).abs() < 1e-9);
    }
}

#[test]
fn rungs_change_what_they_say_and_nothing_else() {
    let (before, port) = (node(0.0045, 0.001, 0.0005), port());
    let held = |port: &AffinePort, coupling, rung| {
        tick_held(before, port, stylus(), Vec3::new(0.005, 0.0, 0.03), coupling, rung, DT)
    };
    let one_ring = AffinePort { stiffness_n_per_m: port.one_ring_n_per_m, ..port };
    let doubled = CouplingParams { damping_n_s_per_m: 2.0, ..DEFAULT_COUPLING };
    assert_eq!(held(&port, DEFAULT_COUPLING, PortRung::OneRing), held(&one_ring, doubled, PortRung::Affine));
    let frozen = held(&port, DEFAULT_COUPLING, PortRung::Frozen);
    assert_eq!(frozen.node, NodeState { velocity_m_per_s: Vec3::zeros(), ..before });
    assert_eq!(
        frozen.applied_force_n,
        coupling_force(DEFAULT_COUPLING, stylus(), Vec3::new(0.005, 0.0, 0.03), frozen.node)
    );
    let left = node(-0.004, 0.0, 0.0);
    let pulled = tick_pulled((before, &port), (left, &left_port()), stylus(), &LINE, PortRung::Frozen, DT);
    let still = |n: NodeState| NodeState { velocity_m_per_s: Vec3::zeros(), ..n };
    let (tension, _) = pull(&LINE, stylus(), still(before), still(left));
    assert_eq!((pulled.right, pulled.left), (still(before), still(left)));
    assert!((pulled.tension_n - tension).abs() < ROUND_N);
}

#[test]
fn slack_line_leaves_hand_and_points_free() {
    let line = LineParams { rest_length_m: 0.1, ..LINE };
    let (right_port, left_port) = (port(), left_port());
    let (right, left) = (node(0.0045, 0.001, 0.0005), node(-0.004, 0.0, 0.0002));
    let tick = tick_pulled((right, &right_port), (left, &left_port), stylus(), &line, PortRung::Affine, DT);
    assert_eq!((tick.tension_n, tick.device_force_n), (0.0, Vec3::zeros()));
    assert!((momentum_rate(right, tick.right, &right_port) - tick.right_tissue_force_n).norm() < ROUND_N);
}

#[test]
fn indefinite_stiffness_is_replaced_by_a_bound() {
    let port = AffinePort { stiffness_n_per_m: Mat3::identity() * -1e5, ..port() };
    let tick =
        tick_held(node(0.0045, 0.001, 0.0), &port, stylus(), Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, DT);
    assert!(tick.flags.stiffness_replaced && !tick.flags.contained);
    let bound = AffinePort { stiffness_n_per_m: Mat3::identity() * 1e5, ..port };
    let same =
        tick_held(node(0.0045, 0.001, 0.0), &bound, stylus(), Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, DT);
    assert!((tick.node.position_m - same.node.position_m).norm() < 1e-12);
}

/// Values of every size a finite number can have, small ones more often.
fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![3 => -1.0..1.0_f64, 1 => proptest::num::f64::NORMAL, 1 => Just(0.0)]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(any_size()).prop_map(Vec3::from)
}

proptest! {
    #[test]
    fn finite_input_never_gives_nan(
        x in any_vector(), v in any_vector(), f in any_vector(), anchor in any_vector(), device in any_vector(),
        s in prop::array::uniform3(any_vector()), radius in any_size(), mass in any_size(), drag in any_size(),
        rest in any_size(), dt in any_size(),
    ) {
        let stiffness = Mat3::from_columns(&s);
        let port = AffinePort {
            position_m: anchor,
            velocity_m_per_s: v,
            force_n: f,
            stiffness_n_per_m: stiffness,
            one_ring_n_per_m: stiffness,
            trust_radius_m: radius,
            mass_kg: mass.abs(),
            drag_n_s_per_m: drag.abs(),
        };
        let state = NodeState { position_m: x, velocity_m_per_s: v };
        let stylus = StylusState { position_m: device, velocity_m_per_s: f };
        let line = LineParams { rest_length_m: rest, ..LINE };
        for rung in [PortRung::Affine, PortRung::OneRing, PortRung::Frozen] {
            let held = tick_held(state, &port, stylus, anchor, DEFAULT_COUPLING, rung, dt);
            let pulled = tick_pulled((state, &port), (NodeState { position_m: f, ..state }, &port), stylus, &line, rung, dt);
            for vector in [
                held.node.position_m, held.node.velocity_m_per_s, held.device_force_n, held.tissue_force_n,
                pulled.right.position_m, pulled.left.position_m, pulled.right.velocity_m_per_s,
                pulled.left.velocity_m_per_s, pulled.device_force_n, pulled.link_force_n,
            ] {
                prop_assert!(vector.iter().all(|c| c.is_finite()), "{held:?} {pulled:?}");
            }
            prop_assert!(pulled.tension_n >= 0.0 && pulled.tension_n.is_finite());
        }
    }

    #[test]
    fn tension_is_continuous_through_slack_and_taut(
        d in prop::array::uniform3(-0.05..0.05_f64), rest in 0.0..0.1_f64, nudge in prop::array::uniform3(-1e-6..1e-6_f64),
    ) {
        let (right_port, left_port) = (port(), left_port());
        let (right, left) = (node(0.004, 0.001, 0.0), node(-0.004, 0.0, 0.0));
        let line = LineParams { rest_length_m: rest, ..LINE };
        let at = |p: Vec3| {
            let stylus = StylusState { position_m: p, velocity_m_per_s: Vec3::new(0.1, 0.0, 0.1) };
            tick_pulled((right, &right_port), (left, &left_port), stylus, &line, PortRung::Affine, DT).tension_n
        };
        let (d, nudge) = (Vec3::from(d), Vec3::from(nudge));
        // Stiffness gives 400 N/m; a direction turns by at most |nudge| over the soft length, times 0.1 m/s, the forces
        // of the points and the tension of up to 30 N that they share.
        let bound = nudge.norm() * (400.0 + 100.0 / 1.1e-4);
        prop_assert!((at(d + nudge) - at(d)).abs() <= bound + 1e-12);
    }
}
