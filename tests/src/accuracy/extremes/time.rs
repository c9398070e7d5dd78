//! Steps and damping at their ends: statics over dt = 0.1 to 20 ms, unusable steps, no drag, immense drag, sub-steps.

use super::nets::{self, ENERGY_GROWTH, SKIN_K, farthest_m, loaded, relax, run, skin_sheet, solver};
use super::rig::small_skin;
use super::{Ending, Named, Outcome};
use sim_core::scene::step::Scene;
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("statics at dt = 0.1 … 20 ms", statics),
    ("dt = 0, negative, not a number, infinite", unusable_steps),
    ("a scene of 0, negative, infinite or no rate", unusable_rates),
    ("c = 0 over 1e5 steps", undamped),
    ("c = 1e6 N·s/m: creep", creep),
    ("c of Table 2: energy only falls", dissipation),
    ("1, 4 and 16 sub-steps", substeps),
];

/// Equilibrium of a loaded sheet must not know the step that led to it.
fn statics() -> Outcome {
    let side = 9;
    let rest = skin_sheet(side, SKIN_K, 1e-4, 0.05);
    let at_rest = |period_s: f64| {
        let mut solver = solver(rest.clone(), period_s);
        run(&mut solver, &mut loaded([(side * side / 2, Vec3::new(0.05, 0.02, 0.04))]), 2.0);
        (solver.state().position_m.clone(), solver.stability().number)
    };
    let (reference, _) = at_rest(1e-4);
    let size = farthest_m(&reference, &rest.rest_m);
    let mut worst: f64 = 0.0;
    let mut numbers = Vec::new();
    for ms in [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0] {
        let (x, number) = at_rest(ms * 1e-3);
        worst = worst.max(farthest_m(&x, &reference) / size);
        numbers.push(format!("{ms} ms: {number:.2}"));
    }
    let note =
        format!("equilibrium of a pull of {:.2} mm against the one at 0.1 ms; S = {}", size * 1e3, numbers.join(", "));
    Outcome::measured(Ending::Correct, note, worst, 1e-6, "relative difference")
}

fn unusable_steps() -> Outcome {
    let ask = |period_s: f64| {
        TissueSolver::new(skin_sheet(5, SKIN_K, 1e-4, 3.0), PatchSet::default(), SolverParams::with_period(period_s))
            .err()
            .map(|e| e.to_string())
    };
    let first = Outcome::refusal(ask(0.0), "solver period is 0");
    [-1e-3, f64::NAN, f64::INFINITY]
        .into_iter()
        .fold(first, |all, period_s| all.and(&Outcome::refusal(ask(period_s), "must be finite and above 0")))
}

fn unusable_rates() -> Outcome {
    let ask = |rate_hz: f64| {
        let mut config = small_skin();
        config.solver.rate_hz = rate_hz;
        Scene::new(&config, None).err().map(|e| e.to_string())
    };
    let first = Outcome::refusal(ask(0.0), "solver.rate_hz is 0");
    [-200.0, f64::NAN, f64::INFINITY]
        .into_iter()
        .fold(first, |all, rate_hz| all.and(&Outcome::refusal(ask(rate_hz), "allowed is 10 to 10000")))
}

/// Without drag the semi-implicit step keeps a shadow energy: the true one ripples and may not drift.
fn undamped() -> Outcome {
    const STEPS: usize = 100_000;
    const WINDOW: usize = 1_000;
    let side = 5;
    let net = skin_sheet(side, SKIN_K, 1e-3, 0.0);
    let params = SolverParams { substeps: SubstepPolicy::Demanded(1), ..SolverParams::with_period(5e-4) };
    let mut solver = TissueSolver::new(net.clone(), PatchSet::default(), params).expect("inside the limit");
    let mut state = solver.state().clone();
    state.position_m[side * side / 2] += Vec3::new(2e-4, 1e-4, 3e-4);
    solver.reset(&state).expect("a state of this net");
    let rest_j = nets::energy_j(&net, &net.rest_state());
    let mut mean_of_window = || {
        let mut sum = 0.0;
        for _ in 0..WINDOW {
            solver.step(&mut Stages::default());
            sum += nets::energy_j(&net, solver.state()) - rest_j;
        }
        sum / WINDOW as f64
    };
    let means: Vec<f64> = (0..STEPS / WINDOW).map(|_| mean_of_window()).collect();
    let (early, late) = (means[..10].iter().sum::<f64>() / 10.0, means[90..].iter().sum::<f64>() / 10.0);
    let largest = means.iter().fold(f64::MIN, |a, &b| a.max(b));
    let note = format!(
        "mean energy of the last 10 % against the first 10 % of the run; no window above {:.4} of the first",
        largest / early
    );
    // Modes exchange energy, and each mode's true energy differs from its shadow by O(ω dt): some per cent of ripple.
    Outcome::measured(Ending::Correct, note, (late / early - 1.0).abs(), 0.02, "relative drift")
        .require(largest / early < 1.05, "no window's mean grows by 5 %")
}

/// Drag of 1e6: nodes creep back from one side, never past their place.
fn creep() -> Outcome {
    let side = 9;
    let node = side * side / 2;
    let net = skin_sheet(side, SKIN_K, nets::NODE_KG, 1e6);
    let mut solver = solver(net.clone(), 5e-3);
    let mut state = solver.state().clone();
    state.position_m[node] += Vec3::new(1e-3, 0.0, 0.0);
    solver.reset(&state).expect("a state of this net");
    let mut watch = nets::EnergyWatch::start(&solver);
    let (mut flips, mut last) = (0_u32, 1e-3);
    for _ in 0..2_000 {
        solver.step(&mut Stages::default());
        watch.look(&solver);
        let now = (solver.state().position_m[node] - net.rest_m[node]).x;
        flips += u32::from(now < 0.0 || now > last);
        last = now;
    }
    // Rate λ/c with λ = (4 k sides and diagonals, softened by the neighbours that give way) below 6 k.
    let expected = 1e-3 * (1.0 - 3.5 * SKIN_K / 1e6 * 10.0);
    let note = format!(
        "sign flips or steps away in 10 s; 1 mm crept to {:.6} mm, about {:.6} mm by λ t/c",
        last * 1e3,
        expected * 1e3
    );
    Outcome::measured(Ending::Correct, note, f64::from(flips), 0.0, "flips")
        .require(watch.growth() <= ENERGY_GROWTH, "the energy only falls")
        .require(last < 1e-3 && last > 0.9e-3, "it creeps at the rate of k/c")
}

fn dissipation() -> Outcome {
    let side = 17;
    let mut worst = f64::MIN;
    for period_s in [1e-3, 5e-3] {
        let mut solver = solver(skin_sheet(side, SKIN_K, nets::NODE_KG, nets::SKIN_C), period_s);
        let mut state = solver.state().clone();
        for (i, x) in state.position_m.iter_mut().enumerate() {
            if solver.network().fixed[i] == 0 {
                *x += Vec3::new((i as f64 * 1.7).sin(), (i as f64 * 2.3).cos(), (i as f64 * 0.9).sin()) * 1e-3;
            }
        }
        solver.reset(&state).expect("a state of this net");
        worst = worst.max(relax(&mut solver, &mut Stages::default(), 2.0));
    }
    let note = "largest growth of the energy of a sheet disturbed by 1 mm, at 1 and 5 ms";
    Outcome::measured(Ending::Correct, note, worst, ENERGY_GROWTH, "relative growth")
}

/// The same motion by 1, 4 and 16 sub-steps: the difference is of first order and small.
fn substeps() -> Outcome {
    let side = 9;
    let net = skin_sheet(side, SKIN_K, 1e-3, nets::SKIN_C);
    let at = |count: u32| {
        let params = SolverParams { substeps: SubstepPolicy::Demanded(count), ..SolverParams::with_period(1e-3) };
        let mut solver = TissueSolver::new(net.clone(), PatchSet::default(), params).expect("inside the limit");
        run(&mut solver, &mut loaded([(side * side / 2, Vec3::new(0.3, 0.1, 0.2))]), 0.05);
        solver.state().position_m.clone()
    };
    let finest = at(64);
    let size = farthest_m(&finest, &net.rest_m);
    let off: Vec<f64> = [1, 4, 16].map(|count| farthest_m(&at(count), &finest) / size).to_vec();
    let note =
        format!("displacements after 50 ms against 64 sub-steps: {:.1e}, {:.1e}, {:.1e}", off[0], off[1], off[2]);
    Outcome::measured(Ending::Correct, note, off[0], 0.08, "relative difference")
        .require(off[1] < off[0] && off[2] < off[1], "the difference falls with the sub-step")
}
