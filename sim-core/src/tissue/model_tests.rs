//! What holds for every tissue, whichever model built it: distances along the cut mesh, suture
//! points, drawing.

use super::geodesic::{DistanceKind, neighbours_within};
use super::model::Tissue;
use super::network::{SpringFamily, SpringNetwork};
use super::params::WoundParams;
use super::test_support::{liver, material, mm, wound};
use super::ttsm::TtsmParams;
use super::utsm::{HeldRim, UtsmParams};

fn closed_slit() -> Tissue {
    let mut wound = wound(20.0, 0.0, 2.0);
    wound.pairs = 2;
    wound.patch_radius = mm(2.0);
    super::utsm::build(&UtsmParams {
        width: mm(40.0),
        length: mm(40.0),
        spacing: mm(2.0),
        thickness: mm(2.0),
        held: HeldRim::BeyondTips,
        pre_strain: 0.05,
        material: material(0.16, 3.0, 2.0),
        wound,
    })
    .unwrap()
}

/// All distances from one node by relaxing every spring until nothing changes (Bellman–Ford).
fn distances_by_relaxation(network: &SpringNetwork, from: u32) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; network.node_count()];
    distance[from as usize] = 0.0;
    loop {
        let mut changed = false;
        for s in &network.springs {
            if matches!(s.family, SpringFamily::Bend | SpringFamily::Diagonal) {
                continue;
            }
            let (a, b) = (s.a as usize, s.b as usize);
            let length = (network.rest_m[a] - network.rest_m[b]).norm();
            for (i, j) in [(a, b), (b, a)] {
                if distance[i] + length < distance[j] {
                    distance[j] = distance[i] + length;
                    changed = true;
                }
            }
        }
        if !changed {
            return distance;
        }
    }
}

#[test]
fn geodesic_goes_round_the_tip_of_the_wound() {
    let tissue = closed_slit();
    let network = &tissue.network;
    let [left, right] = [tissue.pairs[0].left_edge, tissue.pairs[0].right_edge];
    let found = neighbours_within(network, left, 1.0, DistanceKind::Geodesic);
    let at = |node: u32| found.iter().find(|f| f.0 == node).unwrap().1;
    // Both edges lie on one line: to the nearer tip and back.
    let to_tip = 0.01 - network.rest_m[left as usize].y.abs();
    assert!((at(right) - 2.0 * to_tip).abs() < 1.0e-12, "{} against {}", at(right), 2.0 * to_tip);
    let brute = distances_by_relaxation(network, left);
    let fixed = network.fixed.iter().filter(|f| **f == 1).count();
    assert_eq!(found.len(), network.node_count() - 1 - fixed);
    assert!(found.windows(2).all(|w| w[0].0 < w[1].0));
    for (node, d) in &found {
        // Sums of the same edges in another order.
        assert!((d - brute[*node as usize]).abs() < 1.0e-12, "node {node}");
    }
}

#[test]
fn radius_and_kind_decide_the_neighbours() {
    let tissue = closed_slit();
    let (network, [left, right]) = (&tissue.network, [tissue.pairs[1].left_edge, tissue.pairs[1].right_edge]);
    let near = |r: f64, kind| neighbours_within(network, left, r, kind);
    // 2 mm along the edge twice and one step away from it; the diagonals are 2.83 mm long.
    assert_eq!(near(0.0021, DistanceKind::Geodesic).len(), 3);
    assert_eq!(near(0.0029, DistanceKind::Geodesic).len(), 5);
    // The straight reading also ties the opposite edge and side; the twin at distance 0 is no neighbour.
    let straight = near(0.0021, DistanceKind::Euclidean);
    assert_eq!(straight.len(), 3 + 2 + 1);
    assert!(straight.iter().all(|n| n.0 != right));
    assert!(neighbours_within(network, u32::MAX, 1.0, DistanceKind::Geodesic).is_empty());
}

#[test]
fn geodesic_of_a_vessel_runs_through_the_wall_not_the_lumen() {
    let tissue = super::ttsm::build(&vessel()).unwrap();
    let top = tissue.pairs[0].left_edge;
    let found = neighbours_within(&tissue.network, top, 0.2, DistanceKind::Geodesic);
    let brute = distances_by_relaxation(&tissue.network, top);
    assert!(found.iter().all(|(n, d)| (d - brute[*n as usize]).abs() < 1.0e-12));
    let bottom = tissue.network.rest_m.iter().map(|x| x.z).fold(0.0, f64::min);
    let farthest = found.iter().filter(|(n, _)| tissue.network.rest_m[*n as usize].z < bottom + 1.0e-4);
    assert!(farthest.clone().count() > 0 && farthest.clone().all(|f| f.1 > 0.02));
}

pub(super) fn vessel() -> TtsmParams {
    let mut wound = wound(24.0, 2.0, 1.5);
    wound.bite = mm(2.0);
    wound.patch_radius = mm(2.0);
    TtsmParams {
        radius: mm(8.0),
        length: mm(60.0),
        wall: mm(1.5),
        layers: 3,
        cells_around: 32,
        cells_along: 40,
        material: material(0.27, 2.0, 1.5),
        wound,
    }
}

/// What every built tissue promises.
pub(super) fn check(tissue: &Tissue, wound: &WoundParams) {
    let network = &tissue.network;
    let nodes = network.node_count();
    assert_eq!((tissue.layer.len(), tissue.side.len()), (nodes, nodes));
    assert!(tissue.triangles.iter().flatten().all(|n| (*n as usize) < nodes));
    assert_eq!(tissue.pairs.len(), wound.pairs as usize);
    let mut owner = vec![0_usize; nodes];
    for (k, pair) in tissue.pairs.iter().enumerate() {
        for (point, edge, side) in [(&pair.left, pair.left_edge, -1), (&pair.right, pair.right_edge, 1)] {
            assert_eq!((tissue.side[edge as usize], tissue.side[point.node as usize]), (side, side));
            assert!(tissue.wound_edge.contains(&edge) && point.patch.nodes.contains(&point.node));
            assert_eq!(point.patch.nodes.len(), point.patch.weights.len());
            assert!((point.patch.weights.iter().sum::<f64>() - 1.0).abs() < 1.0e-12);
            assert!(point.patch.weights.iter().all(|w| *w > 0.0));
            for node in point.patch.nodes.iter().map(|n| *n as usize) {
                assert_eq!((tissue.side[node], network.fixed[node], owner[node]), (side, 0, 0), "pair {k}");
                owner[node] = k + 1;
            }
        }
    }
}

#[test]
fn presets_of_all_three_models_keep_the_promises() {
    let vessel = vessel();
    check(&super::ttsm::build(&vessel).unwrap(), &vessel.wound);
    let liver = liver();
    check(&super::vosm::build(&liver).unwrap(), &liver.wound);
    let tissue = closed_slit();
    assert_eq!((tissue.pairs.len(), tissue.wound_edge.len()), (2, 20));
}

#[test]
fn suture_points_lie_at_bite_and_station() {
    let tissue = super::ttsm::build(&vessel()).unwrap();
    for (k, pair) in (0..).zip(&tissue.pairs) {
        let station = 0.024 * ((f64::from(k) + 0.5) / 4.0 - 0.5);
        let at = |n: u32| tissue.network.rest_m[n as usize];
        // Half a cell of 1.5 mm either way.
        assert!((at(pair.left.node).y - station).abs() <= 0.00076);
        assert!(((at(pair.left.node) - at(pair.left_edge)).norm() - 0.002).abs() <= 0.00076);
        assert_eq!(at(pair.left.node).x, -at(pair.right.node).x);
    }
}

#[test]
fn drawing_is_a_closed_surface_where_the_body_is() {
    // Layers and walls of a two-layer organ: the outer shell, the inner one turned over and the
    // wound's walls close a body, so every edge is used as often one way as the other.
    let tissue = super::vosm::build(&liver()).unwrap();
    let mut directed: Vec<(u32, u32)> =
        tissue.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    directed.sort_unstable();
    for (a, b) in &directed {
        assert!(directed.binary_search(&(*b, *a)).is_ok(), "edge {a}–{b} is open");
    }
}

#[test]
fn crowded_suture_points_are_refused() {
    let mut params = vessel();
    params.wound.pairs = 12;
    let text = super::test_support::refusal(super::ttsm::build(&params));
    assert!(text.contains("overlap") && text.contains("fewer pairs"), "{text}");
}
