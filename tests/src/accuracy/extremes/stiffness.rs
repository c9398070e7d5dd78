//! Stiff, soft and uneven: k over seven decades at Table 2's c, masses over six decades, stiffness that overflows.
//!
//! Scenes are taken as their file gives them: the solver sub-steps or refuses by the stability number. Where a scene runs,
//! a hand takes a suture point and pulls it 5 mm to the side; the force must stay within the device's limits. Where masses
//! are uneven, the reference is Runge–Kutta on the edge list.

use super::nets::{self, SKIN_K, loaded, network, skin_sheet, try_solver};
use super::rig::{SessionRig, small_skin};
use super::{Ending, Named, Outcome};
use crate::reference::ReferenceNetwork;
use sim_core::scene::step::Scene;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::network::SpringNetwork;
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("k × 1e-3 at Table 2's c", || scaled(1e-3)),
    ("k × 1e-2 at Table 2's c", || scaled(1e-2)),
    ("k × 1e-1 at Table 2's c", || scaled(1e-1)),
    ("k × 1e1 at Table 2's c", || scaled(1e1)),
    ("k × 1e2 at Table 2's c", || scaled(1e2)),
    ("k × 1e3 at Table 2's c", || scaled(1e3)),
    ("k × 1e4 at Table 2's c", || scaled(1e4)),
    ("k = 0: springs that do nothing", springless),
    ("a spring of 1e300 N/m", overflowing_spring),
    ("a scene of 1e300 N/mm", overflowing_scene),
    ("masses over six decades, 1e-6 to 1 kg", uneven_masses),
    ("1e-6 kg beside 1 kg", light_beside_heavy),
];

/// Skin with k scaled: pulled 5 mm by a hand, or refused with the stability number.
fn scaled(factor: f64) -> Outcome {
    let mut config = small_skin();
    config.material.stiffness_n_per_mm *= factor;
    match SessionRig::new(&config) {
        Err(error) => Outcome::refusal(Some(error.to_string()), "S ="),
        Ok(mut rig) => {
            rig.hold_left();
            rig.pull(Vec3::new(-0.005, 0.0, 0.0), 100);
            rig.run(200);
            let stability = *rig.session.procedure().scene().solver().stability();
            let note = format!("5 mm pull; {stability}; steady force {:.3} N", rig.force_n.norm());
            let breach = rig.findings.breach.clone();
            let ending = if rig.findings.cut > 0 { Ending::Clamped } else { Ending::Correct };
            // BDF2 is stable at any S; its number says what an explicit step would have had.
            let limit = if stability.integrator == Integrator::Bdf2 { f64::INFINITY } else { 1.0 };
            Outcome::measured(ending, note, stability.number, limit, "S")
                .require(breach.is_none(), breach.as_deref().unwrap_or(""))
                .require(rig.force_n.norm() > 0.0, "the hand feels the tissue")
        }
    }
}

/// Springs without stiffness: every node creeps under its load alone, v → F/c.
fn springless() -> Outcome {
    let n = 17;
    let net = skin_sheet(n, 0.0, nets::NODE_KG, nets::SKIN_C);
    let mut solver = nets::solver(net, 5e-3);
    let node = n * n / 2;
    let start = solver.state().position_m[node];
    nets::run(&mut solver, &mut loaded([(node, Vec3::z() * 0.003)]), 1.0);
    let way = (solver.state().position_m[node] - start).z;
    Outcome::measured(
        Ending::Correct,
        "creep of a loaded node against F t / c",
        // The start-up takes m/c = 16 µs of the second.
        (way / (0.003 / nets::SKIN_C) - 1.0).abs(),
        1e-4,
        "relative error",
    )
}

/// One spring, and a chain of them: eigenvalues whose squares overflow must not come out as none at all.
fn overflowing_spring() -> Outcome {
    let chain = |k: f64, nodes: usize| {
        let x: Vec<Vec3> = (0..nodes).map(|i| Vec3::new(0.01 * i as f64, 0.001 * (i % 2) as f64, 0.0)).collect();
        let springs: Vec<_> = (1..nodes as u32).map(|b| (b - 1, b, k, 0.01)).collect();
        try_solver(network(&x, 1e-3, 3.0, &springs), 1e-3).err().map(|e| e.to_string())
    };
    let single = Outcome::refusal(chain(1e300, 2), "S =");
    [(1e150, 2), (1e160, 9), (1e300, 9), (1e300, 60)]
        .into_iter()
        .fold(single, |all, (k, nodes)| all.and(&Outcome::refusal(chain(k, nodes), "S =")))
}

fn overflowing_scene() -> Outcome {
    let mut config = small_skin();
    config.material.stiffness_n_per_mm = 1e300;
    Outcome::refusal(Scene::new(&config, None).err().map(|e| e.to_string()), "stiffness is")
}

/// Relative error of the displacements at `end_s` against Runge–Kutta at `reference_dt_s`.
fn error_against_reference(net: SpringNetwork, load: (usize, Vec3), end_s: f64, reference_dt_s: f64) -> (f64, String) {
    let mut reference = ReferenceNetwork::new(&net, &net.rest_state());
    reference.load_n[load.0] = load.1.into();
    reference.run(reference_dt_s, (end_s / reference_dt_s).round() as usize);
    let rest = net.rest_m.clone();
    let mut solver = match try_solver(net, 5e-3) {
        Ok(solver) => solver,
        Err(error) => return (f64::NAN, error.to_string()),
    };
    nets::run(&mut solver, &mut loaded([load]), end_s);
    let (mut off, mut size) = (0.0, 0.0);
    for ((x, r), start) in solver.state().position_m.iter().zip(&reference.position_m).zip(&rest) {
        off += (x - Vec3::from(*r)).norm_squared();
        size += (Vec3::from(*r) - start).norm_squared();
    }
    ((off / size).sqrt(), solver.stability().to_string())
}

/// A pre-strained sheet with masses 10^-6 to 10^0 kg in a fixed disorder.
fn uneven_masses() -> Outcome {
    let n = 7;
    let even = skin_sheet(n, SKIN_K, 1.0, 0.05);
    let mass = (0..n * n).map(|i| 10_f64.powf(-6.0 * ((i * 29) % (n * n)) as f64 / (n * n - 1) as f64)).collect();
    let net = SpringNetwork::new(even.rest_m, mass, even.drag_n_s_per_m, even.fixed, even.springs)
        .expect("masses above zero keep the network valid");
    let (error, stability) = error_against_reference(net, (n * n / 2, Vec3::new(0.5, 0.2, 0.3)), 0.1, 1e-5);
    let note = format!("displacements at 0.1 s against Runge–Kutta at 10 µs; {stability}");
    Outcome::measured(Ending::Correct, note, error, 0.01, "relative error")
}

/// A chain wall – 1 kg – 1e-6 kg – 1 kg, struck.
fn light_beside_heavy() -> Outcome {
    let x: Vec<Vec3> = (0..4).map(|i| Vec3::new(0.01 * f64::from(i), 0.0, 0.0)).collect();
    let springs = [(0, 1, SKIN_K, 0.01), (1, 2, SKIN_K, 0.01), (2, 3, SKIN_K, 0.01)];
    let net = network(&x, 1.0, 0.01, &springs);
    let net =
        SpringNetwork::new(net.rest_m, vec![1.0, 1.0, 1e-6, 1.0], net.drag_n_s_per_m, vec![1, 0, 0, 0], net.springs)
            .expect("a valid chain");
    let (error, stability) = error_against_reference(net, (3, Vec3::new(0.5, 0.0, 0.0)), 0.3, 1e-5);
    let note = format!("displacements at 0.3 s against Runge–Kutta at 10 µs; {stability}");
    Outcome::measured(Ending::Correct, note, error, 0.01, "relative error")
}
