//! Eq. (2): velocity first, then position with the new velocity; and the limits within which it may run.

use sim_core::kinematics::integrate::{
    NodeState, implicit_max_dt_s, implicit_stability_number, literal_min_mass_kg, literal_stability_number,
    step_implicit_drag, step_literal,
};
use sim_core::scene::presets::{LIVER, SKIN, Table2, VESSEL};
use sim_core::vector::Vec3;
use suture_tests::closed_forms::{SpringMassDamper, explicit_mass_limit_kg, implicit_drag_step_limit_s};

const ROWS: [Table2; 3] = [SKIN, LIVER, VESSEL];

fn at(x: f64, v: f64) -> NodeState {
    NodeState { position_m: Vec3::new(x, 0.0, 0.0), velocity_m_per_s: Vec3::new(v, 0.0, 0.0) }
}

/// One step of the oscillator with drag taken as printed.
fn literal(system: &SpringMassDamper, state: NodeState, dt: f64) -> NodeState {
    let force = -state.position_m * system.stiffness_n_per_m - state.velocity_m_per_s * system.drag_n_s_per_m;
    step_literal(state, force / system.mass_kg, dt)
}

/// One step of the oscillator with drag at the end of the step.
fn implicit(system: &SpringMassDamper, state: NodeState, dt: f64) -> NodeState {
    let force = -state.position_m * system.stiffness_n_per_m;
    step_implicit_drag(state, force, system.mass_kg, system.drag_n_s_per_m, dt)
}

/// Growth of the state over many steps (above 1: unstable), in a norm that weighs both parts.
fn growth(system: &SpringMassDamper, dt: f64, step: fn(&SpringMassDamper, NodeState, f64) -> NodeState) -> f64 {
    let norm = |s: NodeState| s.position_m.norm() + dt * s.velocity_m_per_s.norm();
    let mut state = at(1e-3, 0.0);
    for _ in 0..2000 {
        state = step(system, state, dt);
    }
    let early = norm(state);
    if early == 0.0 {
        return 0.0;
    }
    for _ in 0..2000 {
        state = step(system, state, dt);
    }
    norm(state) / early
}

#[test]
fn eq2_is_the_printed_recurrence() {
    let after = step_literal(at(0.02, -0.5), Vec3::new(30.0, 0.0, 0.0), 0.01);
    // v = −0.5 + 30·0.01 = −0.2, x = 0.02 − 0.2·0.01 = 0.018
    assert!((after.velocity_m_per_s.x + 0.2).abs() < 1e-15 && (after.position_m.x - 0.018).abs() < 1e-15);
}

#[test]
fn eq2_converges_with_order_one_in_both_forms() {
    let system = SpringMassDamper { mass_kg: 2e-3, drag_n_s_per_m: 0.2, stiffness_n_per_m: 160.0 };
    for step in [literal, implicit] {
        let error = |dt: f64| {
            let mut state = at(1e-3, 0.0);
            let steps = (0.02 / dt).round() as usize;
            (0..steps).for_each(|_| state = step(&system, state, dt));
            (state.position_m.x - system.displacement_m(1e-3, 0.0, 0.02)).abs()
        };
        let order = (error(2e-5) / error(1e-5)).log2();
        assert!((order - 1.0).abs() < 0.05, "order {order}");
    }
}

#[test]
fn eq2_stability_edges_are_the_closed_forms_and_the_iteration_agrees() {
    let dt = 1e-3;
    for row in ROWS {
        let (stiffness, drag) = (8.0 * row.stiffness_n_per_mm * 1e3, row.drag_n_s_per_m);
        let edge = explicit_mass_limit_kg(stiffness, drag, dt);
        assert!((literal_min_mass_kg(stiffness, drag, dt) / edge - 1.0).abs() < 1e-12);
        for (factor, stable) in [(0.99, false), (1.01, true)] {
            let system =
                SpringMassDamper { mass_kg: edge * factor, drag_n_s_per_m: drag, stiffness_n_per_m: stiffness };
            assert_eq!(literal_stability_number(stiffness, system.mass_kg, drag, dt) < 1.0, stable);
            assert_eq!(growth(&system, dt, literal) < 1.0, stable, "literal, {factor} of {edge} kg");
        }
        let mass = 1e-5;
        let limit = implicit_drag_step_limit_s(stiffness, mass, drag);
        assert!((implicit_max_dt_s(stiffness, mass, drag) / limit - 1.0).abs() < 1e-12);
        for (factor, stable) in [(1.01, false), (0.99, true)] {
            let system = SpringMassDamper { mass_kg: mass, drag_n_s_per_m: drag, stiffness_n_per_m: stiffness };
            assert_eq!(implicit_stability_number(stiffness, mass, drag, limit * factor) < 1.0, stable);
            assert_eq!(growth(&system, limit * factor, implicit) < 1.0, stable, "implicit, {factor} of {limit} s");
        }
    }
    // Skin, eight neighbours, 1 ms: 3·10⁻³/2 + 1280·10⁻⁶/4 = 1.82·10⁻³.
    assert!((explicit_mass_limit_kg(8.0 * 160.0, 3.0, 1e-3) - 1.82e-3).abs() < 1e-12);
}

#[test]
fn eq2_with_implicit_drag_holds_at_1_khz_for_every_mass_and_every_row() {
    for row in ROWS {
        for exponent in -9..=0 {
            let mass_kg = 10.0_f64.powi(exponent);
            let system = SpringMassDamper {
                mass_kg,
                drag_n_s_per_m: row.drag_n_s_per_m,
                stiffness_n_per_m: 4.0 * row.stiffness_n_per_mm * 1e3,
            };
            let ratio = growth(&system, 1e-3, implicit);
            assert!(ratio < 1.0, "mass 1e{exponent}: {ratio}");
        }
    }
}
