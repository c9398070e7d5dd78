//! Shapes that a mesh should not have: no length, one place for two nodes, cells turned over, tubes inside out, far origins.

use super::nets::{
    self, NODE_KG, SKIN_C, SKIN_K, SPACING_M, farthest_m, loaded, network, relax, run, skin_sheet, solver,
};
use super::rig::small_skin;
use super::{Ending, Named, Outcome};
use haptic_server::solver::mesh_obj::{ObjLimits, read_obj};
use sim_core::scene::config::TissueConfig;
use sim_core::scene::presets;
use sim_core::scene::step::Scene;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};
use sim_core::tissue::solver::Stages;
use sim_core::tissue::solver_params::SolverParams;
use sim_core::tissue::triangle_mesh::TriangleMesh;
use sim_core::vector::Vec3;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("zero rest length", zero_rest_length),
    ("coincident nodes joined by a spring with length", coincident),
    ("springs twice between two nodes, or from a node to itself", duplicate_springs),
    ("cells without area at load", flat_cells),
    ("a cell turned over in a run", turned_over),
    ("inverted tube: wall thicker than the radius", || inverted_tube(7.0)),
    ("inverted tube: negative wall", || inverted_tube(-1.5)),
    ("an organ inside out", organ_inside_out),
    ("tissue at 1e6 mm from the origin", far_from_the_origin),
    ("a mesh with 1e6 mm coordinates", far_mesh),
    ("suture line of length 0", line_without_length),
    ("a wound as long as the sheet, wider than the sheet", wound_beyond_the_sheet),
];

/// A node on a spring of no length, begun at the anchor: rests at F/k.
fn zero_rest_length() -> Outcome {
    let x = [Vec3::zeros(), Vec3::zeros()];
    let net = network(&x, 1e-3, 0.5, &[(0, 1, 100.0, 0.0)]);
    let net = SpringNetwork::new(net.rest_m, net.mass_kg, net.drag_n_s_per_m, vec![1, 0], net.springs)
        .expect("one anchor keeps the network valid");
    let force = Vec3::new(0.0, 0.03, 0.04);
    let mut solver = solver(net, 1e-3);
    let report = run(&mut solver, &mut loaded([(1, force)]), 1.0);
    let off = (solver.state().position_m[1] - force / 100.0).norm() / 5e-4;
    Outcome::measured(Ending::Correct, "rest of a loaded node at F/k", off, 1e-9, "relative error")
        .require(report.contained == 0, "nothing had to be contained")
}

/// Two nodes in one place with a spring of 4 mm: no direction, so no force; counted.
fn coincident() -> Outcome {
    let x = [Vec3::new(0.1, 0.2, 0.3); 2];
    let mut solver = solver(network(&x, 1e-3, 3.0, &[(0, 1, SKIN_K, 4e-3)]), 1e-3);
    let before = solver.state().clone();
    let report = run(&mut solver, &mut Stages::default(), 0.5);
    let moved = farthest_m(&solver.state().position_m, &before.position_m);
    let mut apart = before;
    apart.position_m[1].x += 1e-9;
    solver.reset(&apart).expect("finite");
    let growth = relax(&mut solver, &mut Stages::default(), 2.0);
    let [a, b] = [0, 1].map(|i| solver.state().position_m[i]);
    let note = "no force and counted while coincident; a nanometre apart they spring to their length";
    Outcome::measured(Ending::Clamped, note, moved, 0.0, "m moved while coincident")
        .require(report.coincident > 0, "coincident springs are counted")
        .require(growth <= nets::ENERGY_GROWTH, "the energy only falls")
        .require(((b - a).norm() / 4e-3 - 1.0).abs() < 1e-6, "they end at the rest length")
}

fn duplicate_springs() -> Outcome {
    let ask = |pairs: [(u32, u32); 2]| {
        let spring =
            |(a, b)| Spring { a, b, stiffness_n_per_m: 1.0, rest_length_m: 0.01, family: SpringFamily::Structural };
        let x = vec![Vec3::zeros(), Vec3::x(), Vec3::y()];
        let made = SpringNetwork::new(x, vec![1.0; 3], vec![0.0; 3], vec![0; 3], pairs.map(spring).to_vec());
        made.err().map(|e| e.to_string())
    };
    Outcome::refusal(ask([(0, 1), (1, 0)]), "joined twice").and(&Outcome::refusal(ask([(0, 1), (2, 2)]), "to itself"))
}

/// A tetrahedron of which one corner lies on an edge.
fn flat_cells() -> Outcome {
    let text = "v 0 0 0\nv 10 0 0\nv 5 0 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let words = read_obj(text.as_bytes(), "flat.obj", 1e-3, ObjLimits::default())
        .map_or_else(|e| Some(e.to_string()), |mesh| mesh.check_closed().err().map(|e| e.to_string()));
    Outcome::refusal(words, "no area")
}

/// Cells of a sheet of `side` × `side` nodes that are turned over in its plane, counted as triangles.
fn turned_cells(x: &[Vec3], side: usize) -> usize {
    let area = |a: usize, b: usize, c: usize| (x[b] - x[a]).cross(&(x[c] - x[a])).z;
    let cells = (0..(side - 1) * (side - 1)).map(|i| i / (side - 1) * side + i % (side - 1));
    cells.flat_map(|i| [area(i, i + 1, i + side + 1), area(i, i + side + 1, i + side)]).filter(|a| *a < 0.0).count()
}

/// The middle node is dragged past its neighbours, held there, and let go.
fn turned_over() -> Outcome {
    let side = 17;
    let node = side * side / 2;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let mut solver = nets::solver_at(net.clone(), node as u32, SolverParams::with_period(5e-3));
    let hand = HandleSlot(0);
    solver.grasp(hand, nets::POINT).expect("free");
    let start = solver.state().position_m[node];
    let mut stages = Stages::default();
    for step in 1..=100 {
        // Not along a line of the lattice: there the neighbour is pushed ahead for ever.
        solver.lead(hand, start + Vec3::new(2.5, 1.0, 0.0) * (SPACING_M * f64::from(step) / 100.0));
        solver.step(&mut stages);
    }
    run(&mut solver, &mut stages, 0.5);
    let turned = turned_cells(&solver.state().position_m, side);
    solver.release(hand);
    let mut released = solver.state().clone();
    released.velocity_m_per_s.fill(Vec3::zeros());
    solver.reset(&released).expect("finite");
    let growth = relax(&mut solver, &mut stages, 4.0);
    let left = farthest_m(&solver.state().position_m, &net.rest_m);
    let note =
        format!("{turned} triangles were turned over; distance from the rest shape 4 s after the node was let go");
    Outcome::measured(Ending::Correct, note, left, 1e-5, "m")
        .require(turned > 0, "cells were turned over")
        .require(growth <= nets::ENERGY_GROWTH, "the energy only falls")
}

fn inverted_tube(wall_mm: f64) -> Outcome {
    let mut config = presets::vessel();
    if let TissueConfig::Ttsm { wall_mm: wall, .. } = &mut config.tissue {
        *wall = wall_mm;
    }
    let reason = if wall_mm > 0.0 { "wall thickness as a share of the radius" } else { "length is" };
    Outcome::refusal(Scene::new(&config, None).err().map(|e| e.to_string()), reason)
}

fn organ_inside_out() -> Outcome {
    let mut config = presets::liver();
    if let TissueConfig::Vosm { mesh, .. } = &mut config.tissue {
        *mesh = Some("organ.obj".to_owned());
    }
    let mut organ = TriangleMesh::lobe(Vec3::new(0.045, 0.032, 0.022), 0.35, 3).expect("a valid lobe");
    organ.faces.iter_mut().for_each(|f| f.swap(0, 1));
    Outcome::refusal(Scene::new(&config, Some(&organ)).err().map(|e| e.to_string()), "faces look inward")
}

/// The same pull at the origin and a kilometre away: positions keep 1e-13 m there, forces 2e-11 N.
fn far_from_the_origin() -> Outcome {
    let side = 9;
    let near = skin_sheet(side, SKIN_K, 1e-4, 0.05);
    let shift = Vec3::new(1e3, -1e3, 1e3);
    let moved = near.rest_m.iter().map(|x| x + shift).collect();
    let far = SpringNetwork::new(
        moved,
        near.mass_kg.clone(),
        near.drag_n_s_per_m.clone(),
        near.fixed.clone(),
        near.springs.clone(),
    )
    .expect("moving a network keeps it valid");
    let pulled = |net: SpringNetwork| {
        let rest = net.rest_m.clone();
        let mut solver = solver(net, 1e-3);
        run(&mut solver, &mut loaded([(side * side / 2, Vec3::new(0.05, 0.02, 0.04))]), 1.0);
        solver.state().position_m.iter().zip(rest).map(|(x, r)| x - r).collect::<Vec<Vec3>>()
    };
    let (here, there) = (pulled(near), pulled(far));
    let size = here.iter().map(Vec3::norm).fold(0.0, f64::max);
    let note = "displacements against the same pull at the origin";
    Outcome::measured(Ending::Correct, note, farthest_m(&here, &there) / size, 1e-6, "relative difference")
}

fn far_mesh() -> Outcome {
    let mut config = presets::liver();
    if let TissueConfig::Vosm { mesh, .. } = &mut config.tissue {
        *mesh = Some("organ.obj".to_owned());
    }
    let mut organ = TriangleMesh::lobe(Vec3::new(0.045, 0.032, 0.022), 0.35, 3).expect("a valid lobe");
    organ.vertices_m.iter_mut().for_each(|v| v.x += 1e3);
    Outcome::refusal(Scene::new(&config, Some(&organ)).err().map(|e| e.to_string()), "within 100 m")
}

fn line_without_length() -> Outcome {
    let ask = |length_mm: f64| {
        let mut config = small_skin();
        config.line.as_mut().expect("the preset has a line").length_mm = length_mm;
        Scene::new(&config, None).err().map(|e| e.to_string())
    };
    Outcome::refusal(ask(0.0), "length_m = 0").and(&Outcome::refusal(ask(f64::NAN), "length_m = NaN"))
}

fn wound_beyond_the_sheet() -> Outcome {
    let ask = |length_mm: f64, gap_mm: f64| {
        let mut config = small_skin();
        (config.wound.length_mm, config.wound.gap_mm) = (length_mm, gap_mm);
        Scene::new(&config, None).err().map(|e| e.to_string())
    };
    Outcome::refusal(ask(24.0, 2.0), "reaches the rim").and(&Outcome::refusal(ask(16.0, 30.0), "leaves no room"))
}
