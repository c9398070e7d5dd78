//! Too many, one, none: nodes, springs, suture pairs. Where cost is the claim, the springs visited are counted.

use super::nets::{NODE_KG, SKIN_C, SKIN_K, network, run, skin_sheet, solver};
use super::rig::small_skin;
use super::{Ending, Named, Outcome};
use sim_core::scene::config::TissueConfig;
use sim_core::scene::step::Scene;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::solver::Stages;
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("a scene of 1e6 nodes", million_nodes),
    ("work per step over the mesh size", linear_work),
    ("all nodes pinned", all_pinned),
    ("no node", no_node),
    ("one node", one_node),
    ("nodes without springs", no_spring),
    ("a scene of one cell", one_cell),
    ("0 suture pairs", || pairs(0)),
    ("500 suture pairs", || pairs(500)),
    ("more pairs than the wound has edge nodes", || pairs(16)),
];

fn million_nodes() -> Outcome {
    let mut config = small_skin();
    config.tissue = TissueConfig::Utsm { width_mm: 2000.0, length_mm: 2000.0, spacing_mm: 2.0, pre_strain: 0.05 };
    let words = Scene::new(&config, None).err().map(|e| e.to_string());
    Outcome::refusal(words.clone(), "MB), at most 262144 are allowed").and(&Outcome::refusal(words, "100200"))
}

/// Springs visited per spring and sub-step must be the same on 33², 65² and 129² nodes.
fn linear_work() -> Outcome {
    let work = |side: usize| {
        let mut solver = solver(skin_sheet(side, SKIN_K, NODE_KG, SKIN_C), 5e-3);
        let report = solver.step(&mut Stages::default());
        report.half_springs as f64 / (solver.network().springs.len() as f64 * f64::from(report.substeps))
    };
    let [small, middle, large] = [33, 65, 129].map(work);
    let note = format!("half-springs visited per spring and sub-step: {small}, {middle}, {large}");
    Outcome::measured(Ending::Correct, note, (large - small).abs().max((middle - small).abs()), 0.0, "difference")
}

/// Steps a network for 100 periods; the state must keep its bits.
fn stays(net: SpringNetwork) -> Outcome {
    let nodes = net.node_count();
    let mut solver = solver(net, 5e-3);
    let before = solver.state().clone();
    let report = run(&mut solver, &mut Stages::default(), 0.5);
    let changed = f64::from(u8::from(*solver.state() != before));
    let note = format!("{nodes} nodes after 100 steps: the state keeps its bits");
    Outcome::measured(Ending::Correct, note, changed, 0.0, "changed states")
        .require((report.saturated, report.contained) == (0, 0), "nothing had to be held back")
}

fn all_pinned() -> Outcome {
    let net = skin_sheet(9, SKIN_K, NODE_KG, SKIN_C);
    let pinned = SpringNetwork::new(net.rest_m, net.mass_kg, net.drag_n_s_per_m, vec![1; 81], net.springs);
    stays(pinned.expect("pinning keeps a network valid"))
}

fn no_node() -> Outcome {
    stays(network(&[], 1.0, 0.0, &[]))
}

fn one_node() -> Outcome {
    stays(network(&[Vec3::new(0.1, -0.2, 0.3)], NODE_KG, SKIN_C, &[]))
}

fn no_spring() -> Outcome {
    let places: Vec<Vec3> = (0..10).map(|i| Vec3::new(f64::from(i), 0.5, 0.0)).collect();
    stays(network(&places, NODE_KG, SKIN_C, &[])).and(&stays(network(&places, NODE_KG, 0.0, &[])))
}

fn one_cell() -> Outcome {
    let mut config = small_skin();
    config.tissue = TissueConfig::Utsm { width_mm: 2.0, length_mm: 2.0, spacing_mm: 2.0, pre_strain: 0.0 };
    let long = Scene::new(&config, None).err().map(|e| e.to_string());
    config.wound.length_mm = 0.1;
    Outcome::refusal(long, "reaches the rim")
        .and(&Outcome::refusal(Scene::new(&config, None).err().map(|e| e.to_string()), "needs 2"))
}

fn pairs(count: u32) -> Outcome {
    let mut config = small_skin();
    config.suture.pairs = count;
    let reason = if (1..=16).contains(&count) { "pairs do not fit on a wound" } else { "suture.pairs is" };
    Outcome::refusal(Scene::new(&config, None).err().map(|e| e.to_string()), reason)
}
