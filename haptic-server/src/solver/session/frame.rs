//! The nodes of a frame: where they are, what pulls at them, who sleeps, who is in the hand.
//!
//! Spring force and strain of a node are the largest of its springs; they are measured here, at the rate of the views, never in
//! a step of the tissue. Written into memory that is reused; nothing is allocated once it is large enough.

use protocol::scene_frame::{AWAKE, FrameNode, HELD};
use protocol::wire::Field;
use sim_core::scene::step::Scene;
use sim_core::tissue::handle::{HandleSlot, MAX_HANDLES};
use sim_core::tissue::spring_load::measure;

/// Shows every node of a scene.
pub(super) fn show_nodes(scene: &Scene, nodes: &mut Vec<FrameNode>) {
    let solver = scene.solver();
    let position_m = &solver.state().position_m;
    nodes.clear();
    nodes.extend(position_m.iter().map(|x| FrameNode {
        position_m: [x.x as f32, x.y as f32, x.z as f32],
        flags: AWAKE,
        ..FrameNode::EMPTY
    }));
    for (node, force_n) in scene.stages().attachments.iter().flat_map(|a| a.follower_forces()) {
        nodes[node as usize].attachment_force_n += force_n as f32;
    }
    measure(solver.network(), position_m, |load| {
        let (force_n, strain) = (load.force_n.abs() as f32, load.strain.abs() as f32);
        for node in load.nodes {
            let node = &mut nodes[node as usize];
            node.spring_force_n = node.spring_force_n.max(force_n);
            node.strain = node.strain.max(strain);
        }
    });
    for node in solver.sleeping_nodes() {
        nodes[node as usize].flags &= !AWAKE;
    }
    for (patch, _) in (0..MAX_HANDLES).filter_map(|slot| solver.handle(HandleSlot(slot))) {
        for &node in solver.patches().nodes(patch) {
            nodes[node as usize].flags |= HELD;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::scene::config::{IntegratorReading, SceneConfig};
    use sim_core::scene::presets;
    use sim_core::scene::sleep::SleepReading;
    use sim_core::scene::step::ServoInput;
    use sim_core::scene::suturing::HandInput;
    use sim_core::vector::Vec3;

    /// Largest difference from the reference, of the value: rounding to `f32`.
    const SINGLE: f64 = 1e-7;

    fn hand(position_m: Vec3, press_count: u32, handle_m: Option<Vec3>) -> ServoInput {
        let mut handles_m = [None; MAX_HANDLES];
        handles_m[0] = handle_m;
        ServoInput {
            hand: HandInput { position_m, press_count, release_count: 0 },
            second: None,
            port_epoch: 0,
            handles_m,
        }
    }

    /// A scene whose first left point is held 3 mm above the wound.
    fn held(config: &SceneConfig) -> Scene {
        let mut scene = Scene::new(config, None).expect("a preset");
        let start_m = scene.places()[0].left_m;
        scene.step(Some(&hand(start_m, 0, None)));
        for step in 0..20_u32 {
            let up = Vec3::z() * (3e-3 * f64::from(step.min(10)) / 10.0);
            let input = hand(start_m, 1, Some(start_m + up));
            scene.step(Some(&ServoInput { port_epoch: scene.grips().epoch(), ..input }));
        }
        scene
    }

    /// The rows of each node, one by one: another path through the network than the product's.
    fn reference(scene: &Scene, node: usize) -> (f64, f64) {
        let edges = &scene.solver().network().half_edges;
        let x = &scene.solver().state().position_m;
        let mut most = (0.0_f64, 0.0_f64);
        for e in edges.row(node) {
            let way = x[edges.neighbour[e] as usize] - x[node];
            let length = way.dot(&way).sqrt();
            let slack = edges.pulls_only[e] && length < edges.rest_length_m[e];
            let force = if slack { 0.0 } else { edges.stiffness_n_per_m[e] * (length - edges.rest_length_m[e]) };
            most = (most.0.max(force.abs()), most.1.max((length / edges.rest_length_m[e] - 1.0).abs()));
        }
        most
    }

    #[test]
    fn force_and_strain_are_the_largest_of_the_springs_at_each_node() {
        for config in [presets::skin(), presets::liver(), presets::vessel()] {
            let scene = held(&config);
            let mut nodes = Vec::new();
            show_nodes(&scene, &mut nodes);
            assert_eq!(nodes.len(), scene.solver().network().node_count());
            for (index, node) in nodes.iter().enumerate() {
                let (force_n, strain) = reference(&scene, index);
                let (shown_n, shown) = (f64::from(node.spring_force_n), f64::from(node.strain));
                assert!((shown_n - force_n).abs() <= SINGLE * force_n, "{}: node {index}", config.name);
                // The reference divides first: rounding of l/l0 near 1.
                assert!((shown - strain).abs() <= SINGLE * strain + 1e-15, "{}: node {index}", config.name);
            }
            let most = nodes.iter().map(|n| n.strain).fold(0.0, f32::max);
            assert!(most > 0.1, "{}: a point pulled up by 3 mm strains its springs, {most}", config.name);
            let again = nodes.clone();
            let room = nodes.capacity();
            show_nodes(&scene, &mut nodes);
            assert_eq!((&nodes, nodes.capacity()), (&again, room), "memory is reused");
        }
    }

    #[test]
    fn the_nodes_in_the_hand_and_those_asleep_are_marked() {
        let mut config = presets::skin();
        (config.solver.integrator, config.solver.sleep) = (IntegratorReading::SemiImplicit, SleepReading::On);
        let mut scene = Scene::new(&config, None).expect("a preset that sleeps");
        let mut nodes = Vec::new();
        let asleep = (0..2_000).any(|_| {
            scene.step(None);
            scene.solver().awake_nodes() == Some(0)
        });
        assert!(asleep, "{:?}", scene.solver().awake_nodes());
        show_nodes(&scene, &mut nodes);
        assert!(nodes.iter().all(|n| n.flags == 0));

        let start_m = scene.places()[0].left_m;
        scene.step(Some(&hand(start_m, 0, None)));
        scene.step(Some(&hand(start_m, 1, None)));
        show_nodes(&scene, &mut nodes);
        let (patch, _) = scene.solver().handle(HandleSlot(0)).expect("the press takes the point");
        let of_patch = scene.solver().patches().nodes(patch);
        let marked: Vec<u32> = (0..).zip(&nodes).filter(|(_, n)| n.flags & HELD != 0).map(|(i, _)| i).collect();
        let mut expected = of_patch.to_vec();
        expected.sort_unstable();
        assert_eq!(marked, expected);
        let awake = nodes.iter().filter(|n| n.flags & AWAKE != 0).count();
        assert_eq!(Some(awake), scene.solver().awake_nodes());
        assert!(awake >= of_patch.len() && of_patch.iter().all(|&n| nodes[n as usize].flags & AWAKE != 0));
        assert!(awake < nodes.len(), "the far side sleeps on");
    }

    #[test]
    fn where_nobody_may_sleep_all_are_awake() {
        let mut nodes = Vec::new();
        show_nodes(&Scene::new(&presets::vessel(), None).expect("a preset"), &mut nodes);
        assert!(nodes.iter().all(|n| n.flags == AWAKE));
    }
}
