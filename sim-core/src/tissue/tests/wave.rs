//! Waves, momentum and energy of free motion against closed forms.
//!
//! Chain dispersion `ω = 2 √(k/m) sin(q h/2)`; a free body keeps its momentum and angular momentum; a
//! symplectic step without drag keeps its energy bounded; with drag the energy only falls.

use super::{Net, Rim, SKIN};
use crate::tissue::energy::{angular_momentum_n_m_s, kinetic_j, momentum_n_s, spring_j};
use crate::tissue::network::{Spring, SpringFamily, SpringNetwork};
use crate::tissue::patch_set::PatchSet;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::SolverParams;
use crate::vector::Vec3;
use std::f64::consts::PI;

fn solver(network: SpringNetwork, period_s: f64) -> TissueSolver {
    TissueSolver::new(network, PatchSet::default(), SolverParams::with_period(period_s)).unwrap()
}

#[test]
fn a_chain_swings_at_its_dispersion_frequency() {
    let (nodes, k, m, spacing) = (41_usize, 100.0, 1e-3, 1e-2);
    let x: Vec<Vec3> = (0..nodes).map(|i| Vec3::new(i as f64 * spacing, 0.0, 0.0)).collect();
    let springs = (0..nodes as u32 - 1).map(|a| Spring {
        a,
        b: a + 1,
        stiffness_n_per_m: k,
        rest_length_m: spacing,
        family: SpringFamily::Structural,
    });
    let springs = springs.collect();
    let mut fixed = vec![0; nodes];
    (fixed[0], fixed[nodes - 1]) = (1, 1);
    let network = SpringNetwork::new(x, vec![m; nodes], vec![0.0; nodes], fixed, springs).unwrap();
    let mode = 2.0;
    let phase = mode * PI / (nodes as f64 - 1.0);
    let omega = 2.0 * (k / m).sqrt() * (phase / 2.0).sin();
    let h = 1e-5;
    let mut solver = solver(network, h);
    let mut state = solver.state().clone();
    let shape: Vec<f64> = (0..nodes).map(|i| (i as f64 * phase).sin()).collect();
    for (v, s) in state.velocity_m_per_s.iter_mut().zip(&shape) {
        v.x = 1e-3 * s;
    }
    solver.reset(&state).unwrap();
    let amplitude = |solver: &TissueSolver| {
        let shifts = solver.state().position_m.iter().zip(&solver.network().rest_m).map(|(x, r)| (x - r).x);
        shifts.zip(&shape).map(|(u, s)| u * s).sum::<f64>()
    };
    // Time between the first and the 21st upward crossing of zero: 20 periods.
    let (mut crossings, mut last) = (Vec::new(), 0.0);
    let mut stages = Stages::default();
    for step in 1.. {
        solver.step(&mut stages);
        let now = amplitude(&solver);
        if last < 0.0 && now >= 0.0 {
            crossings.push((f64::from(step) - now / (now - last)) * h);
        }
        last = now;
        if crossings.len() == 21 {
            break;
        }
    }
    let measured = 2.0 * PI * 20.0 / (crossings[20] - crossings[0]);
    // (ω h)²/24 = 4e-7 of the symplectic step at ω = 310/s, h = 10 µs, and the crossings' interpolation.
    assert!((measured / omega - 1.0).abs() < 1e-6, "{measured} against {omega}");
}

#[test]
fn a_free_body_keeps_its_momentum() {
    let net = Net { side: 7, drag_n_s_per_m: 0.0, rest_ratio: 1.0, rim: Rim::Free, ..SKIN };
    let mut solver = solver(net.build(), 1e-3);
    let mut state = solver.state().clone();
    for (i, v) in state.velocity_m_per_s.iter_mut().enumerate() {
        let i = i as f64;
        *v = Vec3::new(0.1 + 0.01 * (i * 1.7).sin(), -0.05, 0.02 * (i * 0.9).cos());
    }
    solver.reset(&state).unwrap();
    let (p, l) = (momentum_n_s(solver.network(), &state), angular_momentum_n_m_s(solver.network(), &state));
    let mut stages = Stages::default();
    for _ in 0..500 {
        assert_eq!(solver.step(&mut stages).saturated, 0);
    }
    let (p1, l1) =
        (momentum_n_s(solver.network(), solver.state()), angular_momentum_n_m_s(solver.network(), solver.state()));
    // Rounding of some thousand steps, relative to the momentum itself.
    assert!((p1 - p).norm() < 1e-12 * p.norm(), "{p} became {p1}");
    assert!((l1 - l).norm() < 1e-11 * l.norm(), "{l} became {l1}");
}

#[test]
fn energy_is_bounded_without_drag_and_only_falls_with_it() {
    for drag in [0.0, 0.02] {
        let mut solver = solver(Net { drag_n_s_per_m: drag, ..SKIN }.build(), 1e-4);
        let mut state = solver.state().clone();
        state.velocity_m_per_s[60] = Vec3::new(0.05, 0.02, 0.1);
        solver.reset(&state).unwrap();
        let energy =
            |s: &TissueSolver| kinetic_j(s.network(), s.state()) + spring_j(s.network(), &s.state().position_m);
        let rest = spring_j(solver.network(), &solver.network().rest_m);
        let first = energy(&solver) - rest;
        let mut stages = Stages::default();
        let mut largest: f64 = 0.0;
        for _ in 0..5000 {
            solver.step(&mut stages);
            largest = largest.max(energy(&solver) - rest);
        }
        let last = energy(&solver) - rest;
        // The energy of a symplectic step swings by about ω_max h/2 = 0.2; it must not drift away.
        assert!(largest < 1.3 * first, "drag {drag}: {first} J rose to {largest} J");
        assert_eq!(last < 0.1 * first, drag > 0.0, "drag {drag}: {first} J became {last} J");
    }
}

#[test]
fn equal_inputs_give_equal_bits() {
    let run = || {
        let mut solver = solver(SKIN.build(), 5e-3);
        let mut state = solver.state().clone();
        state.velocity_m_per_s[48] = Vec3::new(0.05, 0.02, 0.1);
        solver.reset(&state).unwrap();
        let mut stages = Stages::default();
        for _ in 0..50 {
            solver.step(&mut stages);
        }
        solver.state().clone()
    };
    assert_eq!(run(), run());
}
