//! What must be conserved or must not matter: momentum, angular momentum, rigid motion, numbering, frame, repetition.

use super::nets::{NODE_KG, SKIN_C, SKIN_K, farthest_m, loaded, run, skin_sheet, solver};
use super::rig::{SessionRig, small_skin};
use super::{Ending, Named, Outcome};
use crate::generators::{cloud, sheet};
use sim_core::tissue::energy::{angular_momentum_n_m_s, momentum_n_s};
use sim_core::tissue::network::{Spring, SpringNetwork};
use sim_core::tissue::solver::Stages;
use sim_core::vector::{Mat3, Vec3};

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("free body: momentum", || free_body(Kept::Momentum)),
    ("free body: angular momentum", || free_body(Kept::AngularMomentum)),
    ("rigid motion of a free sheet", rigid_motion),
    ("nodes numbered in another order", renumbered),
    ("tissue turned in space", turned),
    ("equal inputs, to the bit", repeated),
];

#[derive(Clone, Copy)]
enum Kept {
    Momentum,
    AngularMomentum,
}

fn free_body(kept: Kept) -> Outcome {
    let net = cloud(11, 24);
    let mut solver = solver(net.clone(), 1e-4);
    let mut state = solver.state().clone();
    for (i, v) in state.velocity_m_per_s.iter_mut().enumerate() {
        *v = Vec3::new(0.1 * (i as f64).sin(), 0.05, 0.1 * (i as f64 * 2.3).cos());
    }
    solver.reset(&state).expect("a state of this net");
    let measure = |s: &sim_core::tissue::solver::TissueSolver| match kept {
        Kept::Momentum => momentum_n_s(&net, s.state()),
        Kept::AngularMomentum => angular_momentum_n_m_s(&net, s.state()),
    };
    let before = measure(&solver);
    let mut worst: f64 = 0.0;
    for _ in 0..10_000 {
        solver.step(&mut Stages::default());
        worst = worst.max((measure(&solver) - before).norm());
    }
    let note = "24 nodes, uneven masses and springs, 1e4 steps of 0.1 ms";
    Outcome::measured(Ending::Correct, note, worst / before.norm(), 1e-12, "relative change")
}

/// A free sheet that flies without drag keeps its shape; one that turns keeps its energy and is not slowed.
fn rigid_motion() -> Outcome {
    let net = sheet(9, 9, 5e-3, SKIN_K, NODE_KG, 0.0);
    let velocity = Vec3::new(0.3, -0.2, 0.1);
    let mut solver = solver(net.clone(), 1e-3);
    let mut state = solver.state().clone();
    state.velocity_m_per_s.fill(velocity);
    solver.reset(&state).expect("a state of this net");
    let report = run(&mut solver, &mut Stages::default(), 1.0);
    let flown: Vec<Vec3> = solver.state().position_m.iter().map(|x| x - velocity).collect();
    let off = farthest_m(&flown, &net.rest_m);
    Outcome::measured(Ending::Correct, "shape after a flight of 0.37 m", off, 1e-12, "m")
        .require(report.saturated == 0, "no limit acted")
}

/// A fixed disorder of 0 … n − 1.
fn shuffled(n: usize) -> Vec<usize> {
    // 29 has no factor in common with 81 or 289.
    (0..n).map(|i| (i * 29 + 7) % n).collect()
}

fn renumbered() -> Outcome {
    let side = 9;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let place = shuffled(net.node_count());
    let mut rest = net.rest_m.clone();
    let mut fixed = net.fixed.clone();
    for (i, &p) in place.iter().enumerate() {
        rest[p] = net.rest_m[i];
        fixed[p] = net.fixed[i];
    }
    let moved = |s: &Spring| Spring { a: place[s.a as usize] as u32, b: place[s.b as usize] as u32, ..*s };
    let springs = net.springs.iter().rev().map(moved).collect();
    let other = SpringNetwork::new(rest, net.mass_kg.clone(), net.drag_n_s_per_m.clone(), fixed, springs)
        .expect("another order keeps a network valid");
    let load = Vec3::new(0.5, 0.2, 0.3);
    let node = side * side / 2;
    let pulled = |net: SpringNetwork, node: usize| {
        let mut solver = solver(net, 5e-3);
        run(&mut solver, &mut loaded([(node, load)]), 1.0);
        solver.state().position_m.clone()
    };
    let first = pulled(net.clone(), node);
    let second = pulled(other, place[node]);
    let back: Vec<Vec3> = place.iter().map(|&p| second[p]).collect();
    let size = farthest_m(&first, &net.rest_m);
    let note = "displacements of a pulled sheet under another numbering and order of springs";
    Outcome::measured(Ending::Correct, note, farthest_m(&first, &back) / size, 1e-12, "relative difference")
}

fn turned() -> Outcome {
    let side = 9;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let turn: Mat3 = *nalgebra::Rotation3::from_euler_angles(0.7, -1.1, 2.3).matrix();
    let rest = net.rest_m.iter().map(|x| turn * x).collect();
    let other = SpringNetwork::new(
        rest,
        net.mass_kg.clone(),
        net.drag_n_s_per_m.clone(),
        net.fixed.clone(),
        net.springs.clone(),
    )
    .expect("a turned network is valid");
    let load = Vec3::new(0.5, 0.2, 0.3);
    let pulled = |net: SpringNetwork, load: Vec3| {
        let mut solver = solver(net, 5e-3);
        run(&mut solver, &mut loaded([(side * side / 2, load)]), 1.0);
        solver.state().position_m.clone()
    };
    let first = pulled(net.clone(), load);
    let back: Vec<Vec3> = pulled(other, turn * load).iter().map(|x| turn.transpose() * x).collect();
    let size = farthest_m(&first, &net.rest_m);
    let note = "displacements of a pulled sheet, turned back, against the same without turning";
    Outcome::measured(Ending::Correct, note, farthest_m(&first, &back) / size, 1e-11, "relative difference")
}

fn repeated() -> Outcome {
    let run = || {
        let mut rig = SessionRig::new(&small_skin()).expect("the scene loads");
        rig.hold_left();
        rig.take_line();
        rig.pull(Vec3::new(0.0, 0.0, 0.006), 100);
        rig.run(100);
        let force: Vec<u64> = rig.force_n.iter().map(|f| f.to_bits()).collect();
        (rig.tissue_bits(), force)
    };
    let (first, second) = (run(), run());
    let differing = first.0.iter().zip(&second.0).chain(first.1.iter().zip(&second.1)).filter(|(a, b)| a != b).count();
    Outcome::measured(
        Ending::Correct,
        "numbers that differ between two equal sessions",
        differing as f64,
        0.0,
        "numbers",
    )
}
