//! Orders of the integrators on the spring, mass and drag in closed form, through the solver itself.
//!
//! One node between two held ones on springs `k/2`: `m ẍ + c ẋ + k x = 0`, under-damped,
//! `x(t) = e^{−at}((x₀) cos ωt + ((v₀ + a x₀)/ω) sin ωt)`. Deliberately absent: nets, for which Runge–Kutta is the
//! reference (package of the tests).

use crate::tissue::handle::HandleSlot;
use crate::tissue::integrator::Integrator;
use crate::tissue::network::{Spring, SpringFamily, SpringNetwork};
use crate::tissue::newton::NewtonParams;
use crate::tissue::patch_set::PatchId;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::{SolverParams, SubstepPolicy};
use crate::vector::Vec3;

const MASS_KG: f64 = 0.01;
const STIFFNESS_N_PER_M: f64 = 200.0;
const END_S: f64 = 0.1;
const START_M: f64 = 0.01;
const START_M_PER_S: f64 = -0.4;

fn oscillator(drag_n_s_per_m: f64) -> SpringNetwork {
    let half = |a, b| Spring {
        a,
        b,
        stiffness_n_per_m: 0.5 * STIFFNESS_N_PER_M,
        rest_length_m: 0.1,
        family: SpringFamily::Structural,
    };
    let x = [0.0, 0.1, 0.2].map(|x| Vec3::new(x, 0.0, 0.0)).to_vec();
    let springs = vec![half(0, 1), half(1, 2)];
    SpringNetwork::new(x, vec![MASS_KG; 3], vec![drag_n_s_per_m; 3], vec![1, 0, 1], springs).unwrap()
}

fn solver(integrator: Integrator, drag: f64, period_s: f64, substeps: u32) -> TissueSolver {
    let network = oscillator(drag);
    let patches = super::even_patches(3, &[vec![1]]);
    let params = SolverParams {
        integrator,
        substeps: SubstepPolicy::Demanded(substeps),
        displacement_limit_spacings: 10.0,
        newton: NewtonParams::reference(),
        ..SolverParams::with_period(period_s)
    };
    let mut solver = TissueSolver::new(network, patches, params).unwrap();
    let mut state = solver.state().clone();
    state.position_m[1].x += START_M;
    state.velocity_m_per_s[1].x = START_M_PER_S;
    solver.reset(&state).unwrap();
    solver
}

/// Position and velocity in closed form.
fn exact(drag: f64, t: f64) -> (f64, f64) {
    let a = 0.5 * drag / MASS_KG;
    let w = (STIFFNESS_N_PER_M / MASS_KG - a * a).sqrt();
    let b = (START_M_PER_S + a * START_M) / w;
    let (sin, cos) = (w * t).sin_cos();
    let x = START_M * cos + b * sin;
    ((-a * t).exp() * x, (-a * t).exp() * (w * (b * cos - START_M * sin) - a * x))
}

/// Errors of position and velocity at the end.
fn errors(integrator: Integrator, drag: f64, periods: u32, substeps: u32) -> (f64, f64) {
    let mut solver = solver(integrator, drag, END_S / f64::from(periods), substeps);
    let mut stages = Stages::default();
    for _ in 0..periods {
        assert_eq!(solver.step(&mut stages).saturated, 0);
    }
    let (x, v) = exact(drag, END_S);
    let state = solver.state();
    ((state.position_m[1].x - 0.1 - x).abs(), (state.velocity_m_per_s[1].x - v).abs())
}

#[test]
fn each_integrator_has_its_order_on_the_damped_oscillator() {
    // (integrator, order, how far the measured order may lie off it at ω h = 0.018 → 0.009).
    for (integrator, order, off) in [
        (Integrator::SemiImplicit, 1.0, 0.05),
        (Integrator::PaperExplicit, 1.0, 0.05),
        (Integrator::Verlet, 2.0, 0.02),
        (Integrator::Bdf2, 2.0, 0.05),
        (Integrator::Xpbd, 1.0, 0.05),
    ] {
        for (periods, substeps) in [(800, 1), (100, 8)] {
            let (coarse, fine) =
                (errors(integrator, 0.2, periods, substeps), errors(integrator, 0.2, 2 * periods, substeps));
            // In the norm of the energy: either error alone passes through zero with the phase.
            let size = |e: (f64, f64)| (STIFFNESS_N_PER_M * e.0 * e.0 + MASS_KG * e.1 * e.1).sqrt();
            let found = (size(coarse) / size(fine)).log2();
            println!("{} {periods} x {substeps}: order {found:.3}, errors {coarse:?}", integrator.name());
            assert!((found - order).abs() < off, "{} {periods} x {substeps}: order {found}", integrator.name());
        }
    }
}

#[test]
fn verlet_gives_velocities_of_full_steps_to_second_order() {
    for substeps in [1, 3] {
        let (coarse, fine) =
            (errors(Integrator::Verlet, 0.2, 400, substeps).1, errors(Integrator::Verlet, 0.2, 800, substeps).1);
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.05, "{substeps} sub-steps: order {order} of the velocity");
    }
}

#[test]
fn verlet_keeps_its_order_over_grasp_and_release() {
    let error = |periods: u32| {
        let mut solver = solver(Integrator::Verlet, 0.2, END_S / f64::from(periods), 1);
        let mut stages = Stages::default();
        for period in 0..periods {
            if period == periods / 2 {
                // A hand that takes the node and lets it go at once changes its velocity to 0.
                solver.grasp(HandleSlot(0), PatchId(0)).unwrap();
                solver.release(HandleSlot(0));
            }
            solver.step(&mut stages);
        }
        solver.state().position_m[1].x
    };
    let (a, b, c) = (error(400), error(800), error(1600));
    let order = ((a - b) / (b - c)).log2();
    assert!((order - 2.0).abs() < 0.05, "order {order}");
}

#[test]
fn verlet_energy_does_not_drift_in_a_hundred_thousand_steps() {
    // ω h = 0.5: a coarse step, whose energy swings by about (ω h)²/4.
    let omega = (STIFFNESS_N_PER_M / MASS_KG).sqrt();
    let mut solver = solver(Integrator::Verlet, 0.0, 0.5 / omega, 1);
    let mut stages = Stages::default();
    let energy = |s: &TissueSolver| {
        let (x, v) = (s.state().position_m[1].x - 0.1, s.state().velocity_m_per_s[1].x);
        0.5 * STIFFNESS_N_PER_M * x * x + 0.5 * MASS_KG * v * v
    };
    let mut mean = [0.0; 2];
    let (window, mut largest) = (10_000, 0.0_f64);
    let first = energy(&solver);
    for step in 0..100_000 {
        solver.step(&mut stages);
        let now = energy(&solver);
        largest = largest.max(now);
        if step < window {
            mean[0] += now;
        } else if step >= 100_000 - window {
            mean[1] += now;
        }
    }
    println!("largest {} first {first} drift {:e}", largest / first, mean[1] / mean[0] - 1.0);
    assert!(largest < 1.4 * first, "{first} J rose to {largest} J");
    // Window ends cut the swing at different phases: 0.2 of amplitude over 10 000 steps.
    assert!((mean[1] / mean[0] - 1.0).abs() < 1e-4, "drift {}", mean[1] / mean[0] - 1.0);
}
