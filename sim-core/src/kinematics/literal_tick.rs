//! One servo tick of the suture points in the literal form of Eq. (2) and (3): every force, the drag included, at time t.
//!
//! `a = (F_hand + F_link + F_tissue(x) − c·v)/m, v⁺ = v + a·h, x⁺ = x + v⁺·h` (Zhang et al.), stable only for
//! `K·h² + 2c·h < 4m`. A tick therefore is cut into as many sub-steps `h` as that takes, `K` and `c` being bounds on what the
//! point feels from tissue, coupling and line. Where [`MAX_SUBSTEPS`] do not suffice the tick takes the implicit form and
//! says so in its flags; a scene for which that is known is refused at load. SI units.
//!
//! Deliberately absent: dry friction of the line (a form with every force at time t has no stable step for it), motion
//! of the stylus within the tick.

use crate::kinematics::coupling::{CouplingParams, StylusState, coupling_force};
use crate::kinematics::integrate::{NodeState, literal_max_dt_s};
use crate::kinematics::line_pull::{LINE_STIFFNESS_SHARE, LineParams, measure, pull};
use crate::kinematics::node_equation::{AffinePort, NodeEquation, PortRung, TickFlags};
use crate::kinematics::port_tick::{HeldTick, PulledTick, damping_factor, finite, tick_held, tick_pulled};
use crate::kinematics::suture_point::{SuturePointForces, damping_force, step_as_printed};
use crate::vector::Vec3;

/// Most sub-steps of a tick: some ten microseconds for a pulled pair.
pub const MAX_SUBSTEPS: u32 = 64;

/// Share of the longest stable step that a sub-step has.
pub const STEP_SHARE: f64 = 0.8;

/// Sub-steps that keep the literal form stable for a point of this mass; `None` when [`MAX_SUBSTEPS`] do not suffice.
#[must_use]
pub fn literal_substeps(stiffness_n_per_m: f64, drag_n_s_per_m: f64, mass_kg: f64, dt_s: f64) -> Option<u32> {
    let longest_s = STEP_SHARE * literal_max_dt_s(stiffness_n_per_m, mass_kg, drag_n_s_per_m);
    let needed = (dt_s / longest_s).ceil().max(1.0);
    (needed <= f64::from(MAX_SUBSTEPS)).then_some(needed as u32)
}

/// Bound on the stiffness of the tissue.
fn tissue_stiffness(port: &AffinePort, rung: PortRung) -> f64 {
    let matrix = if rung == PortRung::OneRing { &port.one_ring_n_per_m } else { &port.stiffness_n_per_m };
    matrix.row_iter().map(|r| r.abs().sum()).fold(0.0, f64::max)
}

/// Tissue force and flags at the present place.
fn tissue(node: NodeState, port: &AffinePort, rung: PortRung) -> (Vec3, TickFlags) {
    let equation = NodeEquation::new(node, port, rung);
    (equation.tissue_force(Vec3::zeros(), 0.0), equation.flags)
}

/// One sub-step of one point.
fn stepped(node: NodeState, port: &AffinePort, [hand_n, link_n, spring_n]: [Vec3; 3], h: f64) -> NodeState {
    let damping_n = damping_force(port.drag_n_s_per_m, node.velocity_m_per_s);
    step_as_printed(node, &SuturePointForces { hand_n, link_n, spring_n, damping_n }, port.mass_kg, h)
}

/// One tick of a held point, literally; arguments as in [`tick_held`].
#[must_use]
pub fn tick_held_literal(
    node: NodeState,
    port: &AffinePort,
    stylus: StylusState,
    offset_m: Vec3,
    coupling: CouplingParams,
    rung: PortRung,
    dt_s: f64,
) -> HeldTick {
    let implicit = || tick_held(node, port, stylus, offset_m, coupling, rung, dt_s);
    if rung == PortRung::Frozen || dt_s <= 0.0 {
        return implicit();
    }
    let damped = CouplingParams { damping_n_s_per_m: coupling.damping_n_s_per_m * damping_factor(rung), ..coupling };
    let stiffness = tissue_stiffness(port, rung) + damped.stiffness_n_per_m;
    let Some(count) = literal_substeps(stiffness, port.drag_n_s_per_m + damped.damping_n_s_per_m, port.mass_kg, dt_s)
    else {
        let mut tick = implicit();
        tick.flags.literal_refused = true;
        return tick;
    };
    let mut after = node;
    let mut flags = TickFlags::default();
    for _ in 0..count {
        let hand_n = coupling_force(damped, stylus, offset_m, after);
        let (spring_n, seen) = tissue(after, port, rung);
        flags.beyond_trust |= seen.beyond_trust;
        after = stepped(after, port, [hand_n, Vec3::zeros(), spring_n], dt_s / f64::from(count));
    }
    let applied_force_n = coupling_force(damped, stylus, offset_m, after);
    let (tissue_force_n, _) = tissue(after, port, rung);
    if ![after.position_m, after.velocity_m_per_s, applied_force_n, tissue_force_n].into_iter().all(finite) {
        return implicit();
    }
    HeldTick { node: after, applied_force_n, device_force_n: -applied_force_n, tissue_force_n, flags }
}

/// One tick of a pulled pair, literally; arguments as in [`tick_pulled`]. The line is without friction.
#[must_use]
pub fn tick_pulled_literal(
    right: (NodeState, &AffinePort),
    left: (NodeState, &AffinePort),
    stylus: StylusState,
    line: &LineParams,
    rung: PortRung,
    dt_s: f64,
) -> PulledTick {
    let implicit = || tick_pulled(right, left, stylus, line, rung, dt_s);
    if rung == PortRung::Frozen || dt_s <= 0.0 {
        return implicit();
    }
    let damping_n_s_per_m = line.damping_n_s_per_m * damping_factor(rung);
    let line = LineParams { damping_n_s_per_m, friction: 0.0, ..*line };
    let (tension_n, _) = pull(&line, stylus, right.0, left.0);
    let geometry = measure(stylus.position_m, right.0.position_m, left.0.position_m);
    let turning = geometry.turning_stiffness_n_per_m(tension_n, 1.0);
    let count = |port: &AffinePort, turning: f64| {
        let stiffness = tissue_stiffness(port, rung) + LINE_STIFFNESS_SHARE * line.stiffness_n_per_m + turning;
        let drag = port.drag_n_s_per_m + LINE_STIFFNESS_SHARE * line.damping_n_s_per_m;
        literal_substeps(stiffness, drag, port.mass_kg, dt_s)
    };
    let (Some(for_right), Some(for_left)) = (count(right.1, turning.0), count(left.1, turning.1)) else {
        let mut tick = implicit();
        tick.right_flags.literal_refused = true;
        tick.left_flags.literal_refused = true;
        return tick;
    };
    let substeps = for_right.max(for_left);
    let h = dt_s / f64::from(substeps);
    let (mut r, mut l) = (right.0, left.0);
    let (mut right_flags, mut left_flags) = (TickFlags::default(), TickFlags::default());
    for _ in 0..substeps {
        let (_, forces) = pull(&line, stylus, r, l);
        let ((on_right, seen_right), (on_left, seen_left)) = (tissue(r, right.1, rung), tissue(l, left.1, rung));
        right_flags.beyond_trust |= seen_right.beyond_trust;
        left_flags.beyond_trust |= seen_left.beyond_trust;
        r = stepped(r, right.1, [forces.hand_n, forces.link_n, on_right], h);
        l = stepped(l, left.1, [Vec3::zeros(), -forces.link_n, on_left], h);
    }
    let (tension_n, forces) = pull(&line, stylus, r, l);
    let (right_tissue_force_n, left_tissue_force_n) = (tissue(r, right.1, rung).0, tissue(l, left.1, rung).0);
    let vectors = [r.position_m, r.velocity_m_per_s, l.position_m, l.velocity_m_per_s, forces.hand_n, forces.link_n];
    if !(vectors.into_iter().all(finite) && finite(right_tissue_force_n) && finite(left_tissue_force_n)) {
        return implicit();
    }
    PulledTick {
        right: r,
        left: l,
        tension_n,
        hand_force_n: forces.hand_n,
        link_force_n: forces.link_n,
        device_force_n: -forces.hand_n,
        right_tissue_force_n,
        left_tissue_force_n,
        right_flags,
        left_flags,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::coupling::DEFAULT_COUPLING;
    use crate::vector::Mat3;

    const PORT: AffinePort = AffinePort {
        position_m: Vec3::new(0.004, 0.0, 0.0),
        velocity_m_per_s: Vec3::new(0.0, 0.0, 0.0),
        force_n: Vec3::new(-0.1, 0.05, 0.0),
        stiffness_n_per_m: Mat3::new(320.0, 40.0, 0.0, 40.0, 280.0, 0.0, 0.0, 0.0, 90.0),
        one_ring_n_per_m: Mat3::new(640.0, 0.0, 0.0, 0.0, 640.0, 0.0, 0.0, 0.0, 300.0),
        trust_radius_m: 0.02,
        mass_kg: 2e-3,
        drag_n_s_per_m: 3.0,
    };
    const LINE: LineParams =
        LineParams { stiffness_n_per_m: 400.0, damping_n_s_per_m: 1.0, rest_length_m: 0.046, friction: 0.0 };

    fn resting(x: f64) -> NodeState {
        NodeState { position_m: Vec3::new(x, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() }
    }

    #[test]
    fn eq2_substeps_keep_the_number_below_its_limit_and_are_not_wasted() {
        for (k, c, m) in [(1000.0, 3.0, 2e-3), (320.0, 27.0, 2.1e-3), (2400.0, 0.5, 5e-4)] {
            let n = literal_substeps(k, c, m, 1e-3).expect("within the budget");
            let number = |n: f64| (k * (1e-3 / n).powi(2) + 2.0 * c * 1e-3 / n) / (4.0 * m);
            assert!(number(f64::from(n)) < 1.0, "{n}");
            assert!(n == 1 || number(f64::from(n - 1)) > 0.6, "{n}");
        }
        // 8 mg with 3 N·s/m: the damper alone needs 188 sub-steps with that margin, and 94 without.
        assert_eq!(literal_substeps(320.0, 3.0, 8e-6, 1e-3), None);
    }

    #[test]
    fn eq2_literal_and_implicit_ticks_come_to_the_same_rest() {
        let stylus = StylusState { position_m: Vec3::new(0.01, 0.002, 0.04), velocity_m_per_s: Vec3::zeros() };
        let left_port = AffinePort { position_m: Vec3::new(-0.004, 0.0, 0.0), ..PORT };
        let mut held = [resting(0.004); 2];
        let mut pulled = [(resting(0.004), resting(-0.004)); 2];
        let mut tension = [0.0; 2];
        for _ in 0..2000 {
            let offset = Vec3::new(0.004, 0.0, 0.03);
            held[0] = tick_held(held[0], &PORT, stylus, offset, DEFAULT_COUPLING, PortRung::Affine, 1e-3).node;
            let literal = tick_held_literal(held[1], &PORT, stylus, offset, DEFAULT_COUPLING, PortRung::Affine, 1e-3);
            assert!(!literal.flags.literal_refused);
            held[1] = literal.node;
            for (form, tick) in [tick_pulled, tick_pulled_literal].into_iter().enumerate() {
                let (r, l) = pulled[form];
                let out = tick((r, &PORT), (l, &left_port), stylus, &LINE, PortRung::Affine, 1e-3);
                pulled[form] = (out.right, out.left);
                tension[form] = out.tension_n;
            }
        }
        // Both have the same equilibrium; 2 s are hundreds of time constants.
        assert!((held[0].position_m - held[1].position_m).norm() < 1e-9);
        assert!((pulled[0].0.position_m - pulled[1].0.position_m).norm() < 1e-9);
        assert!((tension[0] - tension[1]).abs() < 1e-6 && tension[0] > 0.1, "{tension:?}");
    }

    #[test]
    fn eq2_one_substep_is_the_printed_step() {
        // 20 g need one sub-step: v⁺ = v + (F_couple + f* − c v)·Δt/m with every force at time t.
        let port = AffinePort { mass_kg: 0.02, ..PORT };
        let node = NodeState { velocity_m_per_s: Vec3::new(0.1, 0.0, -0.05), ..resting(0.004) };
        let stylus = StylusState { position_m: Vec3::new(0.01, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
        let tick = tick_held_literal(node, &port, stylus, Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, 1e-3);
        let couple = Vec3::new(0.006, 0.0, 0.0) * 400.0 - node.velocity_m_per_s;
        let expected = node.velocity_m_per_s + (couple + port.force_n - node.velocity_m_per_s * 3.0) * (1e-3 / 0.02);
        assert!((tick.node.velocity_m_per_s - expected).norm() < 1e-14);
        assert!((tick.node.position_m - node.position_m - expected * 1e-3).norm() < 1e-16);
    }

    #[test]
    fn a_point_too_light_takes_the_implicit_form_and_says_so() {
        let port = AffinePort { mass_kg: 8e-6, ..PORT };
        let stylus = StylusState { position_m: Vec3::new(0.01, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
        let arguments = (resting(0.004), Vec3::zeros(), PortRung::Affine);
        let tick = tick_held_literal(arguments.0, &port, stylus, arguments.1, DEFAULT_COUPLING, arguments.2, 1e-3);
        let implicit = tick_held(arguments.0, &port, stylus, arguments.1, DEFAULT_COUPLING, arguments.2, 1e-3);
        assert!(tick.flags.literal_refused && !implicit.flags.literal_refused);
        assert_eq!(tick.node, implicit.node);
    }
}
