//! Rims, wound edges and neighbours of small outlines, found by hand.

use super::*;
use protocol::wire::Field;

/// A flat sheet of 3 × 2 quads without the middle of the lower row, in one layer.
fn sheet() -> (Vec<FrameNode>, Vec<u32>) {
    let nodes = (0..12u32)
        .map(|i| FrameNode { position_m: [(i % 4) as f32 * 1e-3, (i / 4) as f32 * 1e-3, 0.0], ..FrameNode::EMPTY })
        .collect();
    let quads = [0u32, 2, 4, 5, 6];
    let triangles = quads.iter().flat_map(|q| [*q, q + 1, q + 5, *q, q + 5, q + 4]).collect();
    (nodes, triangles)
}

fn built(triangles: &[u32], layers: &[u32], edges: &[u32], nodes: &[FrameNode], kind: u32, wanted: usize) -> Topology {
    Topology::build(&OutlineParts { triangles, layers, pairs: &[], edges }, nodes, kind, wanted)
}

#[test]
fn every_index_names_a_vertex_and_no_pass_reads_what_it_writes() {
    let (nodes, triangles) = sheet();
    for wanted in [1, 40, 90, 1000] {
        let t = built(&triangles, &[0; 12], &[1, 2], &nodes, 0, wanted);
        assert!(t.indices.iter().all(|i| (*i as usize) < t.vertices()), "{wanted}");
        let (plain, curved) = (t.plain.len() as u32, t.curved);
        for (i, made) in t.made.iter().enumerate() {
            let before = if (i as u32) < curved { plain } else { plain + curved };
            let read = made[..4].iter().filter(|v| **v != ABSENT);
            assert!(read.clone().all(|v| *v < before), "{wanted}: point {i} reads {read:?} of {before}");
        }
        assert_eq!(t.faces.len(), 3 * triangles.len() / 3);
    }
}

#[test]
fn a_face_becomes_the_square_of_its_parts() {
    let (nodes, triangles) = sheet();
    let faces = triangles.len() / 3;
    // Walls and bed are no part of this: a closed count of the surface comes from its material.
    let drawn = |wanted| {
        let t = built(&triangles, &[0; 12], &[], &nodes, 0, wanted);
        let surface = |v: u32| (v as usize) < t.plain.len() + t.curved as usize;
        t.indices.as_chunks::<3>().0.iter().filter(|f| f.iter().all(|v| surface(*v))).count()
    };
    assert_eq!([1, faces * 4, faces * 9, faces * 16, faces * 900].map(drawn), [1, 4, 9, 16, 16].map(|n| n * faces));
}

#[test]
fn divided_neighbours_share_the_points_of_their_edge() {
    let (nodes, triangles) = sheet();
    let t = built(&triangles, &[0; 12], &[], &nodes, 0, 1000);
    // A surface without the walls: every edge inside is used twice, those of the rim once.
    let plain = t.plain.len() as u32 + t.curved;
    let faces: Vec<[u32; 3]> =
        t.indices.as_chunks::<3>().0.iter().filter(|f| f.iter().all(|v| *v < plain)).copied().collect();
    let loops = loops::boundary_loops(faces.iter());
    assert_eq!(loops.len(), 1);
    // Rim of the sheet with its notch: 12 sides of 4 parts.
    assert_eq!(loops[0].len(), 12 * 4);
}

#[test]
fn faces_that_name_nothing_are_left_out() {
    let (nodes, mut triangles) = sheet();
    triangles.extend([0, 1, 99, 3, 3, 4]);
    let t = built(&triangles, &[0; 12], &[77], &nodes, 0, 1);
    assert_eq!(t.left_out, 2);
    let nothing = built(&[], &[], &[], &[], 0, 1000);
    assert!(nothing.indices.is_empty() && nothing.vertices() == 0);
    let nodes_missing = built(&triangles, &[0; 12], &[], &nodes[..2], 1, 1000);
    assert_eq!(nodes_missing.left_out, triangles.len() / 3);
}

#[test]
fn a_wall_between_layers_has_vertices_of_its_own() {
    let (mut nodes, triangles) = sheet();
    nodes.extend(
        nodes.clone().iter().map(|n| FrameNode { position_m: [n.position_m[0], n.position_m[1], -1e-3], ..*n }),
    );
    let layers: Vec<u32> = (0..24).map(|i| i / 12).collect();
    let wall = [1, 13, 2, 2, 13, 14];
    let faces: Vec<u32> = triangles.iter().copied().chain(triangles.iter().map(|n| n + 12)).chain(wall).collect();
    let t = built(&faces, &layers, &[], &nodes, 2, 1);
    assert_eq!(t.plain.len(), 24 + 4);
    let materials: Vec<u32> = t.plain.iter().map(|v| v[3] & 0xff).collect();
    let count = |material| materials.iter().filter(|m| **m == material).count();
    assert_eq!([OUTER, CUT, INNER].map(count), [12, 4, 12]);
    // Four parts: the wall takes the surface's points between its nodes.
    let t = built(&faces, &layers, &[], &nodes, 2, 100_000);
    let walls = t.made[..t.curved as usize].iter().filter(|m| m[3] != ABSENT);
    assert_eq!(walls.count(), 2 * 3);
}

#[test]
fn chains_meet_at_the_tips() {
    let place =
        |node: u32| [[0.0, 3.0], [1.0, 1.0], [1.0, -1.0], [0.0, -3.0], [-1.0, -1.0], [-1.0, 1.0]][node as usize];
    let [left, right] = loops::chains(&[1, 2, 3, 4, 5, 0], |n| [place(n)[0], place(n)[1], 0.0]);
    assert_eq!((left.first(), left.last()), (right.first(), right.last()));
    assert_eq!(left.len() + right.len(), 8);
}
