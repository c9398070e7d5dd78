//! Long runs of the servo tick: stability, rest, and no energy for the hand.

use super::*;
use std::f64::consts::TAU;

/// A point slower than this is at rest: 0.1 µm per tick, far below what any encoder resolves.
const STILL_M_PER_S: f64 = 1e-4;

#[test]
fn ticks_are_stable_for_any_mass_and_stiffness() {
    for mass in [1e-9, 1e-6, 2e-3, 1.0] {
        for k in [0.0, 1.0, 1e3, 1e6] {
            let make = |x: f64| AffinePort {
                position_m: Vec3::new(x, 0.0, 0.0),
                force_n: Vec3::zeros(),
                stiffness_n_per_m: Mat3::identity() * k,
                mass_kg: mass,
                drag_n_s_per_m: 0.0,
                ..port()
            };
            let (right_port, left_port) = (make(0.004), make(-0.004));
            let still = StylusState { velocity_m_per_s: Vec3::zeros(), ..stylus() };
            let (mut right, mut left) = (node(0.0045, 0.001, 0.0005), node(-0.004, 0.0, 0.0002));
            let mut held = right;
            for _ in 0..20_000 {
                let tick = tick_pulled((right, &right_port), (left, &left_port), still, &LINE, PortRung::Affine, DT);
                (right, left) = (tick.right, tick.left);
                held = tick_held(held, &right_port, still, Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, DT).node;
                let worst = right.position_m.norm().max(left.position_m.norm()).max(held.position_m.norm());
                assert!(worst < 0.2, "mass {mass} k {k}: {worst} m");
            }
            let fastest =
                right.velocity_m_per_s.norm().max(left.velocity_m_per_s.norm()).max(held.velocity_m_per_s.norm());
            // Without drag a soft point goes on swinging for long; from 1 N/mm on the implicit tick has calmed it.
            assert!(k < 1e3 || fastest < STILL_M_PER_S, "mass {mass} k {k}: {fastest} m/s");
        }
    }
}

#[test]
fn points_that_the_line_has_pulled_together_lie_still() {
    // 3 N where 1.3 N already close the gap: the segment below the tissue ends inside its soft zone.
    let make = |x: f64| AffinePort {
        position_m: Vec3::new(x, 0.0, 0.0),
        force_n: Vec3::zeros(),
        stiffness_n_per_m: Mat3::identity() * 300.0,
        ..port()
    };
    let (right_port, left_port) = (make(0.004), make(-0.004));
    let stylus = StylusState { position_m: Vec3::new(0.004, 0.0, 0.06), velocity_m_per_s: Vec3::zeros() };
    let (mut right, mut left) = (node(0.004, 0.0, 0.0), node(-0.004, 0.0, 0.0));
    let mut tension = 0.0;
    for _ in 0..4000 {
        let tick = tick_pulled((right, &right_port), (left, &left_port), stylus, &LINE, PortRung::Affine, DT);
        (right, left, tension) = (tick.right, tick.left, tick.tension_n);
    }
    assert!(tension > 1.5, "{tension}");
    assert!((right.position_m - left.position_m).norm() < 2e-4);
    assert!(right.velocity_m_per_s.norm() < STILL_M_PER_S && left.velocity_m_per_s.norm() < STILL_M_PER_S);
}

/// Work done on the tick by a hand that moves the stylus on an ellipse for some cycles, force held between ticks.
fn work_of_hand(hertz: f64, amplitude_m: f64, mut force: impl FnMut(StylusState) -> Vec3) -> f64 {
    let place = |t: f64| {
        let (s, c) = (TAU * hertz * t).sin_cos();
        StylusState {
            position_m: Vec3::new(0.01 + amplitude_m * s, 0.5 * amplitude_m * c, 0.04 + amplitude_m * s),
            velocity_m_per_s: Vec3::new(c, -0.5 * s, c) * (amplitude_m * TAU * hertz),
        }
    };
    let ticks_per_cycle = (1.0 / (hertz * DT)).round() as usize;
    let mut work = 0.0;
    for k in 0..12 * ticks_per_cycle {
        let device = force(place(k as f64 * DT));
        // The first cycles load the tissue; passivity is asked of the steady motion.
        if k >= 4 * ticks_per_cycle {
            work -= device.dot(&(place((k + 1) as f64 * DT).position_m - place(k as f64 * DT).position_m));
        }
    }
    work
}

#[test]
fn a_hand_on_a_closed_path_never_gains_energy_from_a_tick() {
    for rung in [PortRung::Affine, PortRung::OneRing, PortRung::Frozen] {
        for hertz in [0.5, 2.0, 8.0, 20.0] {
            for amplitude in [0.0005, 0.005] {
                let (right_port, left_port) = (port(), left_port());
                let mut held = node(0.004, 0.001, 0.0);
                let work = work_of_hand(hertz, amplitude, |stylus| {
                    let tick =
                        tick_held(held, &right_port, stylus, Vec3::new(0.006, 0.0, 0.04), DEFAULT_COUPLING, rung, DT);
                    held = tick.node;
                    tick.device_force_n
                });
                assert!(work >= 0.0, "held {rung:?} {hertz} Hz {amplitude} m: {work} J");
                let (mut right, mut left) = (node(0.004, 0.001, 0.0), node(-0.004, 0.0, 0.0));
                for rest in [0.042, 0.048] {
                    let line = LineParams { rest_length_m: rest, ..LINE };
                    let work = work_of_hand(hertz, amplitude, |stylus| {
                        let tick = tick_pulled((right, &right_port), (left, &left_port), stylus, &line, rung, DT);
                        (right, left) = (tick.right, tick.left);
                        tick.device_force_n
                    });
                    // A line only resists along itself: to rounding it may give back all it got.
                    assert!(work >= -1e-9, "pulled {rung:?} {hertz} Hz {amplitude} m rest {rest}: {work} J");
                }
            }
        }
    }
}

/// Lets the stylus pull and recoil on a closed path; gives the energy that the hand got per cycle, the largest tension, the share
/// that friction took, and the least power of friction in any tick.
fn cycles(friction: f64, count: usize) -> (Vec<f64>, f64, f64, f64) {
    let make = |x: f64| AffinePort {
        position_m: Vec3::new(x, 0.0, 0.0),
        force_n: Vec3::zeros(),
        stiffness_n_per_m: Mat3::identity() * 300.0,
        ..port()
    };
    let (right_port, left_port) = (make(0.004), make(-0.004));
    let line = LineParams { friction, rest_length_m: 0.028, ..LINE };
    let rest = |x: f64| NodeState { position_m: Vec3::new(x, 0.0, 0.0), velocity_m_per_s: Vec3::zeros() };
    let (mut right, mut left) = (rest(0.004), rest(-0.004));
    let (ticks, mut to_hand) = (1000_usize, Vec::new());
    let (mut most_n, mut taken_j, mut least_w) = (0.0_f64, 0.0, f64::INFINITY);
    for cycle in 0..count {
        let mut energy_j = 0.0;
        for tick in 0..ticks {
            let phase = TAU * (cycle * ticks + tick) as f64 / ticks as f64;
            // From slack to 8 mm beyond the rest length, on an ellipse, so that the bend changes too.
            let stylus = StylusState {
                position_m: Vec3::new(0.004 + 0.006 * phase.sin(), 0.0, 0.022 - 0.006 * phase.cos()),
                velocity_m_per_s: Vec3::new(0.006 * phase.cos(), 0.0, 0.006 * phase.sin()) * TAU,
            };
            let geometry = measure(stylus.position_m, right.position_m, left.position_m);
            let out = tick_pulled((right, &right_port), (left, &left_port), stylus, &line, PortRung::Affine, DT);
            (right, left) = (out.right, out.left);
            energy_j += out.device_force_n.dot(&stylus.velocity_m_per_s) * DT;
            let speed = geometry.sliding_speed_m_per_s(right.velocity_m_per_s, left.velocity_m_per_s);
            let power_w = (out.tension_n - out.link_force_n.norm() / geometry.towards_left.norm()) * speed;
            least_w = least_w.min(power_w);
            taken_j += power_w * DT;
            most_n = most_n.max(out.tension_n);
        }
        to_hand.push(energy_j);
    }
    (to_hand, most_n, taken_j / count as f64, least_w)
}

#[test]
fn eq3_friction_of_the_line_takes_energy_whichever_way_it_slides() {
    let (smooth, smooth_n, nothing_j, _) = cycles(0.0, 4);
    let (rough, rough_n, taken_j, least_w) = cycles(0.3, 4);
    assert!(smooth_n > 0.7 && rough_n > smooth_n, "{smooth_n} N, {rough_n} N");
    assert!(nothing_j.abs() < 1e-15, "{nothing_j} J without friction");
    // Microwatts: what is left where the speed changes its sign within a tick.
    assert!(taken_j > 1e-5 && least_w > -1e-6, "{taken_j} J per cycle, at least {least_w} W");
    for (cycle, (smooth_j, rough_j)) in smooth.iter().zip(&rough).enumerate() {
        assert!(*smooth_j < 0.0 && *rough_j < 0.0, "cycle {cycle}: {smooth_j} J, {rough_j} J to the hand");
        assert!(rough_j < smooth_j, "cycle {cycle}: friction costs the hand {smooth_j} J against {rough_j} J");
    }
}

#[test]
fn eq3_friction_holds_a_gap_that_is_still() {
    // Pulled with 1 N and let back to 0.8 N: within the cone e^{±μθ} the gap stays, without friction it opens by a fifth.
    let gap_after = |friction: f64| {
        let make = |x: f64| AffinePort {
            position_m: Vec3::new(x, 0.0, 0.0),
            force_n: Vec3::zeros(),
            stiffness_n_per_m: Mat3::identity() * 300.0,
            ..port()
        };
        let (right_port, left_port) = (make(0.004), make(-0.004));
        let line = LineParams { friction, rest_length_m: 0.028, ..LINE };
        let (mut right, mut left) = (node(0.004, 0.0, 0.0), node(-0.004, 0.0, 0.0));
        let mut gap_m = [0.0; 2];
        for (stop, height) in [0.030, 0.0292].into_iter().enumerate() {
            let stylus = StylusState { position_m: Vec3::new(0.004, 0.0, height), velocity_m_per_s: Vec3::zeros() };
            for _ in 0..500 {
                let out = tick_pulled((right, &right_port), (left, &left_port), stylus, &line, PortRung::Affine, DT);
                (right, left) = (out.right, out.left);
            }
            gap_m[stop] = (right.position_m - left.position_m).norm();
        }
        gap_m[1] - gap_m[0]
    };
    let (free, held) = (gap_after(0.0), gap_after(0.3));
    // Half a second at the held speed.
    assert!(held < 0.5 * crate::kinematics::capstan::HELD_SPEED_M_PER_S, "{held} m with friction");
    assert!(free > 4.0 * held.max(5e-5), "{free} m without friction");
}
