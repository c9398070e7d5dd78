//! The automatic choice on the skin net: which case of the rule, in words, and that its count of the cost is fair.

use super::{Net, SKIN, even_patches};
use crate::tissue::choice::{ChoiceParams, ChoiceReason};
use crate::tissue::integrator::Integrator;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::{SolverError, SolverParams};

fn chosen(net: Net, period_s: f64, automatic: ChoiceParams) -> TissueSolver {
    let params = SolverParams { automatic: Some(automatic), ..SolverParams::with_period(period_s) };
    let network = net.build();
    let patches = even_patches(network.node_count(), &[]);
    TissueSolver::new(network, patches, params).unwrap()
}

#[test]
fn each_case_of_the_rule_is_met_and_says_why() {
    let low_drag = |net: Net| Net { drag_n_s_per_m: net.mass_kg * 100.0, ..net };
    let stiff = |net: Net, by: f64| Net { stiffness_n_per_m: net.stiffness_n_per_m * by, ..net };
    let plenty = ChoiceParams::default();
    // 121 nodes, 380 springs: about 3 us a step. 0.001 of 5 ms is 5 us, one step.
    let tight = ChoiceParams { budget_share: 1e-3, ..plenty };
    for (net, budget, integrator, reason, word) in [
        (stiff(SKIN, 0.6), plenty, Integrator::SemiImplicit, ChoiceReason::OneStep, "one semi-implicit step"),
        (stiff(SKIN, 4.0), plenty, Integrator::SemiImplicit, ChoiceReason::DragRules, "drag lets"),
        (low_drag(SKIN), plenty, Integrator::Verlet, ChoiceReason::SecondOrderFits, "Verlet steps"),
        (low_drag(stiff(SKIN, 100.0)), tight, Integrator::Bdf2, ChoiceReason::TooStiff, "implicit step"),
        (stiff(SKIN, 30.0), plenty, Integrator::Bdf2, ChoiceReason::TooStiff, "implicit step"),
        (low_drag(stiff(SKIN, 0.1)), tight, Integrator::Verlet, ChoiceReason::Cheapest, "nothing fits"),
    ] {
        let solver = chosen(net, 5e-3, budget);
        let choice = *solver.choice().unwrap();
        println!("{choice}");
        assert_eq!((choice.integrator, choice.reason), (integrator, reason), "{choice}");
        assert_eq!((solver.params().integrator, solver.stability().integrator), (integrator, integrator));
        assert_eq!(solver.stability().substeps, choice.substeps);
        let words = choice.to_string();
        assert!(words.contains(word) && words.contains("S = ") && words.is_ascii() && words.len() < 250, "{words}");
    }
}

#[test]
fn the_choice_is_made_again_for_another_tangent() {
    let net = Net { drag_n_s_per_m: 0.0, rest_ratio: 1.0, ..SKIN };
    let mut solver = chosen(net, 5e-3, ChoiceParams::default());
    let before = solver.choice().unwrap().substeps;
    // Stretched to three times its length a spring resists sideways too.
    let mut state = solver.state().clone();
    state.position_m.iter_mut().for_each(|x| *x *= 3.0);
    solver.reset(&state).unwrap();
    solver.reassess().unwrap();
    assert!(solver.choice().unwrap().substeps > before, "{}", solver.choice().unwrap());
    assert_eq!(solver.step(&mut Stages::default()).substeps, solver.choice().unwrap().substeps);
}

#[test]
fn a_budget_that_is_no_number_is_refused() {
    for budget_share in [0.0, -1.0, f64::NAN] {
        let automatic = Some(ChoiceParams { budget_share, ..ChoiceParams::default() });
        let params = SolverParams { automatic, ..SolverParams::with_period(5e-3) };
        let refused = TissueSolver::new(SKIN.build(), even_patches(121, &[]), params).err();
        assert!(matches!(refused, Some(SolverError::Value { .. })), "{budget_share}: {refused:?}");
    }
}
