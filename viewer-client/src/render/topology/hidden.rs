//! Faces that nobody can see: inner surfaces of a body that outer surface, walls and the wound's bed close on all sides.
//!
//! A liver's inner shell is half of its faces. What touches a wall is kept: walls and beds hang on its points.

use super::loops::{boundary_loops, sides_used_once};
use super::{Plain, VESSEL, wound};

/// The faces of the surfaces without those that are hidden.
pub(super) fn seen(plain: &Plain<'_>, kind: u32) -> Vec<[u32; 3]> {
    let layer = |face: &[u32; 3]| plain.layers[face[0] as usize];
    let innermost = || plain.surface.iter().filter(|face| layer(face) == plain.deepest);
    let mut outer = plain.surface.iter().filter(|face| layer(face) == 0).peekable();
    let between_is_shut = plain.deepest > 0
        && outer.peek().is_some()
        && sides_used_once(outer.chain(&plain.walls).chain(innermost())).is_empty();
    // A vessel is open at its ends; elsewhere a bed lies in every hole of the innermost surface that the wound has made.
    let inside_is_shut = between_is_shut && kind != VESSEL && {
        let beside = wound::beside_edge(plain);
        let bedded = boundary_loops(innermost()).into_iter().filter(|line| line.iter().any(|n| beside[*n as usize]));
        bedded.map(|line| line.len()).sum::<usize>() == sides_used_once(innermost()).len()
    };
    let mut on_wall = vec![false; plain.layers.len()];
    plain.walls.iter().flatten().for_each(|node| on_wall[*node as usize] = true);
    let is_hidden = |face: &[u32; 3]| match layer(face) {
        0 => false,
        of if of == plain.deepest => inside_is_shut,
        _ => between_is_shut,
    };
    let is_seen = |face: &&[u32; 3]| !is_hidden(face) || face.iter().any(|node| on_wall[*node as usize]);
    plain.surface.iter().filter(is_seen).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::super::Topology;
    use protocol::scene_frame::{FrameNode, OutlineParts};
    use protocol::wire::Field;

    /// Squares along an edge of the box.
    const SQUARES: i32 = 6;

    /// A box within a box, two layers of nodes; without the middle square on top of both, and walls from rim to rim.
    struct Boxes {
        nodes: Vec<FrameNode>,
        layers: Vec<u32>,
        shells: [Vec<u32>; 2],
        walls: Vec<u32>,
        edges: Vec<u32>,
    }

    fn boxes() -> Boxes {
        let mut places: Vec<[i32; 3]> = Vec::new();
        let mut outer = Vec::new();
        let mut rim = Vec::new();
        for (axis, side, u, v) in (0..3).flat_map(|axis| {
            let squares = (0..SQUARES).flat_map(|u| (0..SQUARES).map(move |v| (u, v)));
            [0, SQUARES].into_iter().flat_map(move |side| squares.clone().map(move |(u, v)| (axis, side, u, v)))
        }) {
            let mut corner = |du: i32, dv: i32| {
                let mut at = [side; 3];
                (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (u + du, v + dv);
                let known = places.iter().position(|p| *p == at);
                known.unwrap_or_else(|| {
                    places.push(at);
                    places.len() - 1
                }) as u32
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let around = if side == 0 { [a, d, c, b] } else { [a, b, c, d] };
            if (axis, side, u, v) == (2, SQUARES, SQUARES / 2, SQUARES / 2) {
                rim.extend(around);
            } else {
                let [a, b, c, d] = around;
                outer.extend([a, b, c, a, c, d]);
            }
        }
        let count = places.len() as u32;
        let node = |p: &[i32; 3], scale: f32| FrameNode {
            position_m: p.map(|c| (c - SQUARES / 2) as f32 * scale),
            ..FrameNode::EMPTY
        };
        let nodes = [1.0e-3, 0.8e-3].into_iter().flat_map(|scale| places.iter().map(move |p| node(p, scale))).collect();
        let inner = outer.chunks(3).flat_map(|f| [f[0] + count, f[2] + count, f[1] + count]).collect();
        let sides = (0..4).map(|i| (rim[i], rim[(i + 1) % 4]));
        let walls = sides.flat_map(|(a, b)| [a, b, a + count, b, b + count, a + count]).collect();
        let layers = (0..2 * count).map(|node| node / count).collect();
        Boxes { nodes, layers, shells: [outer, inner], walls, edges: rim }
    }

    /// Faces that are drawn with all corners at nodes of the inner surface.
    fn inner_faces(boxes: &Boxes, walls: &[u32], kind: u32) -> usize {
        let triangles: Vec<u32> = boxes.shells.iter().flatten().chain(walls).copied().collect();
        let parts = OutlineParts { triangles: &triangles, layers: &boxes.layers, pairs: &[], edges: &boxes.edges };
        let t = Topology::build(&parts, &boxes.nodes, kind, 1);
        let is_inner = |v: &u32| t.plain.get(*v as usize).is_some_and(|vertex| vertex[3] & 0xff == super::super::INNER);
        t.indices.as_chunks::<3>().0.iter().filter(|face| face.iter().all(is_inner)).count()
    }

    #[test]
    fn an_inner_surface_is_drawn_only_where_it_can_be_seen() {
        let boxes = boxes();
        let all = boxes.shells[1].len() / 3;
        // The bed closes the hole: what is left are the faces around its four corners.
        let around_the_hole = {
            let rim: Vec<u32> = boxes.edges.iter().map(|n| n + boxes.nodes.len() as u32 / 2).collect();
            boxes.shells[1].chunks(3).filter(|face| face.iter().any(|n| rim.contains(n))).count()
        };
        assert!(around_the_hole * 4 < all);
        assert_eq!(inner_faces(&boxes, &boxes.walls, 1), around_the_hole);
        // A vessel has no bed: one looks in.
        assert_eq!(inner_faces(&boxes, &boxes.walls, super::VESSEL), all);
        // The same layers, all numbered one deeper: there is nothing in front of them.
        let deeper = Boxes { layers: boxes.layers.iter().map(|layer| layer + 1).collect(), ..boxes };
        assert_eq!(inner_faces(&deeper, &deeper.walls, 1), 2 * all);
        let boxes = Boxes { layers: deeper.layers.iter().map(|layer| layer - 1).collect(), ..deeper };
        // A wall is missing: one looks in between.
        assert_eq!(inner_faces(&boxes, &boxes.walls[6..], 1), all);
    }
}
