//! The mass-spring model itself (§2.1.1, Eq. (2) and (3) on whole networks) against closed forms.

use crate::tissue_rig::{HAND, POINT, loaded, run, solver, solver_at};
use sim_core::tissue::energy;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::patch_set::PatchSet;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use sim_core::tissue::stability::{Tangent, lambda_max};
use sim_core::vector::Vec3;
use suture_tests::closed_forms::{
    SpringMassDamper, catenary_sag_m, chain_frequency, explicit_mass_limit_kg, hanging_tensions_n,
    lattice_membrane_n_per_m, spring_ring_displacement_m, thin_ring_displacement_m,
};
use suture_tests::generators::{chain, cloud, on_rim, pre_strained, ring, sheet, with_fixed};
use suture_tests::reference::ReferenceNetwork;

/// k of skin, newtons per metre.
const SKIN_K: f64 = 160.0;

#[test]
fn eq2_network_converges_with_order_one_to_the_closed_form() {
    let system = SpringMassDamper { mass_kg: 2e-3, drag_n_s_per_m: 0.2, stiffness_n_per_m: SKIN_K };
    let error = |period_s: f64| {
        let network = chain(2, 0.01, SKIN_K / 2.0, system.mass_kg, system.drag_n_s_per_m);
        let mut solver = solver(network, period_s);
        let mut state = solver.state().clone();
        state.position_m[1].x += 1e-3;
        solver.reset(&state).expect("a state of this network");
        run(&mut solver, &mut Stages::default(), 0.02);
        (solver.state().position_m[1].x - 0.01 - system.displacement_m(1e-3, 0.0, 0.02)).abs()
    };
    let order = (error(2e-5) / error(1e-5)).log2();
    assert!((order - 1.0).abs() < 0.05, "order {order}");
}

#[test]
fn eq3_chain_has_the_dispersion_of_the_closed_form() {
    let (links, mass, h) = (20, 1e-4, 1e-4);
    for mode in [1, 2, 7, 19] {
        let network = chain(links, 0.01, SKIN_K, mass, 0.0);
        let mut params = SolverParams::with_period(h);
        params.substeps = SubstepPolicy::Demanded(1);
        let mut solver = TissueSolver::new(network, PatchSet::default(), params).expect("h is inside the limit");
        let shape = |i: usize| (std::f64::consts::PI * (mode * i) as f64 / links as f64).sin();
        let mut state = solver.state().clone();
        (0..=links).for_each(|i| state.position_m[i].x += 1e-4 * shape(i));
        solver.reset(&state).expect("a state of this network");
        let amplitude = |solver: &TissueSolver| -> f64 {
            let position = &solver.state().position_m;
            (0..=links).map(|i| (position[i].x - 0.01 * i as f64) * shape(i)).sum()
        };
        let mut last = [amplitude(&solver); 2];
        let (mut up, mut down) = (0.0, 0.0);
        for step in 0..2000 {
            solver.step(&mut Stages::default());
            let now = amplitude(&solver);
            if step > 0 {
                // The scheme obeys q⁺ − 2q + q⁻ = −h²ω²q exactly, whatever h.
                up -= (now - 2.0 * last[1] + last[0]) * last[1];
                down += last[1] * last[1];
            }
            last = [last[1], now];
        }
        let (measured, expected) = ((up / down).sqrt() / h, chain_frequency(SKIN_K, mass, links, mode));
        assert!((measured / expected - 1.0).abs() < 1e-6, "mode {mode}: {measured} against {expected}");
    }
}

#[test]
fn eq3_hanging_chain_has_the_exact_link_tensions() {
    let (links, stiffness, weight) = (10, 400.0, 0.05);
    let network = with_fixed(chain(links, 0.01, stiffness, 1e-3, 0.5), |i| i == 0);
    let mut solver = solver(network, 1e-3);
    run(&mut solver, &mut loaded((1..=links).map(|i| (i, Vec3::x() * weight))), 3.0);
    let position = &solver.state().position_m;
    for (link, expected) in hanging_tensions_n(&vec![weight; links]).into_iter().enumerate() {
        let tension = stiffness * ((position[link + 1] - position[link]).norm() - 0.01);
        assert!((tension / expected - 1.0).abs() < 1e-9, "link {link}: {tension} against {expected}");
    }
}

/// Relative error of the sag of a nearly inextensible chain of `links` against the catenary.
fn sag_error(links: usize) -> f64 {
    let (length, span, weight) = (1.2, 1.0, 9.81);
    let (link, node_weight) = (length / links as f64, weight / links as f64);
    // The largest tension is below the weight; it stretches a link by at most 1e-5 of its length.
    let stiffness = weight / (1e-5 * link);
    let built = chain(links, link, stiffness, node_weight / 9.81, 4.0 * node_weight);
    let mut state = built.rest_state();
    for (i, x) in state.position_m.iter_mut().enumerate() {
        let s = i as f64 / links as f64;
        *x = Vec3::new(span * s, 0.0, -1.3 * s * (1.0 - s));
    }
    let ends = [state.position_m[0], state.position_m[links]];
    let network =
        SpringNetwork::new(state.position_m.clone(), built.mass_kg, built.drag_n_s_per_m, built.fixed, built.springs);
    let mut params = SolverParams::with_period(1e-3);
    params.displacement_limit_spacings = 100.0;
    let mut solver = TissueSolver::new(network.expect("valid"), PatchSet::default(), params).expect("stable");
    run(&mut solver, &mut loaded((1..links).map(|i| (i, Vec3::z() * -node_weight))), 8.0);
    let lowest = solver.state().position_m.iter().map(|x| x.z).fold(0.0, f64::min);
    assert_eq!([solver.state().position_m[0], solver.state().position_m[links]], ends, "the ends are held");
    (-lowest / catenary_sag_m(length, span) - 1.0).abs()
}

#[test]
fn eq3_suspended_chain_tends_to_the_catenary_with_order_two() {
    let (coarse, fine) = (sag_error(10), sag_error(20));
    assert!(coarse < 1e-2 && ((coarse / fine).log2() - 2.0).abs() < 0.1, "{coarse} {fine}");
}

#[test]
fn table2_stiffness_is_a_membrane_of_four_thirds_k() {
    let (n, h, strain) = (9, 0.005, 1e-5);
    let mut solver = solver(sheet(n, n, h, SKIN_K, 1e-4, 0.05), 1e-4);
    let line_force = lattice_membrane_n_per_m(SKIN_K) * strain;
    let pull = |i: usize| {
        let share = if i / n == 0 || i / n == n - 1 { 0.5 } else { 1.0 };
        let sign = f64::from(u8::from(i % n == n - 1)) - f64::from(u8::from(i.is_multiple_of(n)));
        (i, Vec3::x() * (sign * share * line_force * h))
    };
    run(&mut solver, &mut loaded((0..n * n).map(pull)), 0.6);
    let x = &solver.state().position_m;
    let size = h * (n - 1) as f64;
    let along = (x[n * n / 2 + n / 2] - x[n * n / 2 - n / 2]).x / size - 1.0;
    let across = (x[n * (n - 1) + n / 2] - x[n / 2]).y / size - 1.0;
    // The strain itself is the size of the geometric nonlinearity.
    assert!((along / strain - 1.0).abs() < 1e-4, "E t is off: strain {along}");
    assert!((-across / along - 1.0 / 3.0).abs() < 1e-4, "Poisson ratio {}", -across / along);
}

#[test]
fn eq3_ring_under_pressure_widens_by_the_closed_form() {
    let (links, radius, stiffness, force) = (64, 0.005, 270.0, 1e-5);
    let mut solver = solver(ring(links, radius, stiffness, 1e-5, 0.01), 1e-4);
    let built = solver.state().position_m.clone();
    run(&mut solver, &mut loaded((0..links).map(|i| (i, built[i] * (force / radius)))), 1.0);
    let widened = solver.state().position_m.iter().map(|x| x.norm()).sum::<f64>() / links as f64 - radius;
    let exact = spring_ring_displacement_m(force, stiffness, links);
    assert!((widened / exact - 1.0).abs() < 1e-3, "{widened} against {exact}");
    let arc = 2.0 * std::f64::consts::PI * radius / links as f64;
    let thin = thin_ring_displacement_m(force / arc, radius, stiffness * arc);
    assert!((widened / thin - 1.0).abs() < 2e-3, "{widened} against the thin wall's {thin}");
}

#[test]
fn eq2_free_body_keeps_momentum_and_angular_momentum() {
    let network = cloud(11, 24);
    let mut state = network.rest_state();
    for (i, v) in state.velocity_m_per_s.iter_mut().enumerate() {
        *v = Vec3::new(0.1 * (i as f64).sin(), 0.05, 0.1 * (i as f64 * 2.3).cos());
    }
    let mut solver = solver(network, 1e-4);
    solver.reset(&state).expect("a state of this network");
    let network = solver.network().clone();
    let (p, l) = (energy::momentum_n_s(&network, &state), energy::angular_momentum_n_m_s(&network, &state));
    let total =
        |s: &TissueSolver| energy::kinetic_j(&network, s.state()) + energy::spring_j(&network, &s.state().position_m);
    let before = total(&solver);
    let mut largest: f64 = 0.0;
    for _ in 0..10_000 {
        run(&mut solver, &mut Stages::default(), 1e-4);
        largest = largest.max(total(&solver));
    }
    let (p_end, l_end) =
        (energy::momentum_n_s(&network, solver.state()), energy::angular_momentum_n_m_s(&network, solver.state()));
    assert!((p_end - p).norm() < 1e-12 * p.norm().max(1e-3), "{}", (p_end - p).norm());
    assert!((l_end - l).norm() < 1e-12 * l.norm().max(1e-3), "{}", (l_end - l).norm());
    // A symplectic step does not keep the energy, but it may not pump it either.
    assert!(largest < 1.1 * before, "{largest} from {before}");
}

/// Normal force on the middle of a flat sheet, held at its rim, whose middle is led `depth_m` down.
fn normal_force_n(network: SpringNetwork, depth_m: f64, settle_s: f64) -> f64 {
    let middle = network.node_count() / 2;
    let mut solver = solver_at(network, middle as u32, SolverParams::with_period(5e-4));
    let start = solver.state().position_m[middle];
    solver.grasp(HAND, POINT).expect("the middle is free");
    for step in 1..=200 {
        assert!(solver.lead(HAND, start - Vec3::z() * (depth_m * f64::from(step) / 200.0)));
        solver.step(&mut Stages::default());
    }
    run(&mut solver, &mut Stages::default(), settle_s);
    solver.port(HAND, &Stages::default()).expect("held").force_n.z
}

#[test]
fn eq3_flat_sheet_carries_across_its_plane_by_its_pre_tension() {
    let (n, h) = (33, 0.1 / 32.0);
    let flat = with_fixed(sheet(n, n, h, SKIN_K, 1e-4, 0.02), |i| on_rim(i, n, n));
    let network = pre_strained(flat, 0.05);
    let expected = transverse_stiffness(&network, n * n / 2);
    let stiffness = normal_force_n(network, 1e-5, 0.4) / 1e-5;
    assert!((stiffness / expected - 1.0).abs() < 1e-3, "{stiffness} against the lattice Laplacian's {expected}");
}

#[test]
fn eq3_flat_sheet_without_pre_tension_answers_with_the_cube_of_the_depth() {
    let (n, h) = (9, 0.0125);
    let force_n = |depth_m: f64| {
        let flat = with_fixed(sheet(n, n, h, SKIN_K, 1e-5, 0.002), |i| on_rim(i, n, n));
        normal_force_n(flat, depth_m, 6.0)
    };
    let (one, two) = (force_n(0.0005), force_n(0.001));
    assert!((two / one - 8.0).abs() < 0.1, "{one} {two}");
}

/// Stiffness of one node of a pre-strained flat network against its normal, by Gauss–Seidel on `Σ k ε/(1+ε) (w_j − w_i)`.
fn transverse_stiffness(network: &SpringNetwork, node: usize) -> f64 {
    let mut neighbours = vec![Vec::new(); network.node_count()];
    for s in &network.springs {
        let (a, b) = (s.a as usize, s.b as usize);
        let weight = s.stiffness_n_per_m * (1.0 - s.rest_length_m / (network.rest_m[b] - network.rest_m[a]).norm());
        neighbours[a].push((b, weight));
        neighbours[b].push((a, weight));
    }
    let mut w = vec![0.0; network.node_count()];
    w[node] = 1.0;
    for _ in 0..4000 {
        for i in (0..w.len()).filter(|i| *i != node && network.fixed[*i] == 0) {
            let (sum, weights) = neighbours[i].iter().fold((0.0, 0.0), |(s, t), (j, k)| (s + k * w[*j], t + k));
            w[i] = sum / weights;
        }
    }
    neighbours[node].iter().map(|(j, k)| k * (1.0 - w[*j])).sum()
}

/// Growth of a small disturbance under the printed explicit form, by forces of the edge-list reference.
fn literal_growth(network: &SpringNetwork, dt: f64) -> f64 {
    let mut state = network.rest_state();
    for (i, x) in state.position_m.iter_mut().enumerate().filter(|(i, _)| network.fixed[*i] == 0) {
        *x += Vec3::new(1e-9 * (i as f64 * 1.3).sin(), 1e-9 * (i as f64 * 0.7).cos(), 0.0);
    }
    let mut net = ReferenceNetwork::new(network, &state);
    let size = |net: &ReferenceNetwork| -> f64 {
        let off = net.position_m.iter().zip(&network.rest_m);
        off.map(|(x, r)| (Vec3::from(*x) - r).norm_squared()).sum::<f64>().sqrt()
    };
    let start = size(&net);
    for _ in 0..600 {
        let force = net.spring_forces_n(&net.position_m);
        for (i, pull) in force.iter().enumerate().filter(|(i, _)| network.fixed[*i] == 0) {
            let (drag, mass) = (network.drag_n_s_per_m[i], network.mass_kg[i]);
            for (d, f) in pull.iter().enumerate() {
                net.velocity_m_per_s[i][d] += dt * (f - drag * net.velocity_m_per_s[i][d]) / mass;
                net.position_m[i][d] += dt * net.velocity_m_per_s[i][d];
            }
        }
    }
    size(&net) / start
}

#[test]
fn eq2_printed_form_is_refused_exactly_where_it_blows_up() {
    let (n, h, dt, drag) = (13, 0.005, 1e-3, 3.0);
    let with_mass = |mass: f64| with_fixed(sheet(n, n, h, SKIN_K, mass, drag), |i| on_rim(i, n, n));
    let network = with_mass(1e-3);
    let lambda = lambda_max(&Tangent::at(&network, &network.rest_m));
    // Square lattice with diagonals of k/2: 6 k on an infinite sheet, a little less on a small one.
    assert!((5.7 * SKIN_K..6.0 * SKIN_K).contains(&lambda), "{lambda}");
    let edge = explicit_mass_limit_kg(lambda, drag, dt);
    for (factor, stable) in [(0.97, false), (1.03, true)] {
        let network = with_mass(edge * factor);
        let growth = literal_growth(&network, dt);
        assert!(if stable { growth < 1.0 } else { growth > 1e3 }, "{factor} of {edge} kg: grew {growth} times");
        let mut params = SolverParams::with_period(dt);
        params.integrator = Integrator::PaperExplicit;
        params.substeps = SubstepPolicy::Demanded(1);
        let built = TissueSolver::new(network, PatchSet::default(), params);
        assert_eq!(built.is_ok(), stable, "{factor} of {edge} kg");
        if let Err(refusal) = built {
            assert!(matches!(refusal, SolverError::Unstable { .. }), "{refusal}");
            let needed = format!("{:.3} g instead of", edge * 1e3);
            assert!(refusal.to_string().contains(&needed), "{refusal} does not say {needed}");
        }
    }
}
