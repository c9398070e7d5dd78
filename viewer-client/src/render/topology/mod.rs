//! What the graphics adapter must know once per outline to make the tissue's vertices from its nodes.
//!
//! A node has a vertex on its surface and another on the wall that it belongs to, so that a cut keeps its sharp edge.
//! Coarse faces are divided into n² parts on a curved patch (`shape.wgsl`). A tissue of one layer gets walls of its own
//! at its rim and along its wound, and every wound that does not lead into a lumen gets a bed. Nothing in the outline is
//! trusted: a face that names an absent node is left out and counted.

mod curved;
mod hidden;
mod loops;
mod wound;

use curved::Curved;
use protocol::scene_frame::{FrameNode, OutlineParts};

/// Kind of a scene on the wire: a vessel, whose wound leads into its lumen.
const VESSEL: u32 = 2;
/// A face is divided into at most the square of this.
const MOST_PARTS: u32 = 4;
/// How far a single layer reaches down, as a share of the tissue's diagonal.
const DEPTH_SHARE: f32 = 0.055;
/// Marks an absent vertex.
const ABSENT: u32 = u32::MAX;

/// Materials of `tissue.wgsl`.
const OUTER: u32 = 0;
const CUT: u32 = 1;
const INNER: u32 = 2;
const BED: u32 = 3;

/// Buffers of `shape.wgsl`, and the triangles.
#[derive(Debug, Default)]
pub(super) struct Topology {
    /// Node, first face, number of faces, material | depth · 255 << 8 | edge << 16.
    pub(super) plain: Vec<[u32; 4]>,
    /// The other two corners of a vertex's faces, as nodes.
    pub(super) faces: Vec<[u32; 2]>,
    /// Points on faces, then points below others.
    pub(super) made: Vec<[u32; 8]>,
    /// How many of them lie on faces.
    pub(super) curved: u32,
    /// Three vertices a triangle; the outer surface first.
    pub(super) indices: Vec<u32>,
    /// How many of them are the outer surface's.
    pub(super) outer: u32,
    /// Corners of the box around the nodes.
    pub(super) low_m: [f32; 3],
    /// The other corner.
    pub(super) high_m: [f32; 3],
    /// How far the drawn tissue reaches below its lowest node.
    pub(super) below_m: f32,
    /// Faces that could not be drawn.
    pub(super) left_out: usize,
}

/// Faces and vertices at nodes.
struct Plain<'o> {
    nodes: &'o [FrameNode],
    layers: &'o [u32],
    deepest: u32,
    edge: Vec<bool>,
    /// Faces within a layer.
    surface: Vec<[u32; 3]>,
    /// Those of them that can be seen.
    seen: Vec<[u32; 3]>,
    /// Faces from one layer to another; the corner that is alone in its layer is last.
    walls: Vec<[u32; 3]>,
    /// Vertex of a node on its surface, [`ABSENT`] for none.
    on_surface: Vec<u32>,
    /// Vertex of a node on a wall.
    on_wall: Vec<u32>,
}

impl Topology {
    /// Vertices in all.
    pub(super) fn vertices(&self) -> usize {
        self.plain.len() + self.made.len()
    }

    /// Builds it for the nodes of a frame with about as many triangles as wanted.
    pub(super) fn build(parts: &OutlineParts<'_>, nodes: &[FrameNode], kind: u32, wanted: usize) -> Self {
        let mut topology = Self::default();
        (topology.low_m, topology.high_m) = bounds(nodes);
        let mut plain = Plain::sort(parts, nodes, &mut topology);
        plain.seen = hidden::seen(&plain, kind);
        topology.lay_vertices(&mut plain);
        let parts_per_edge = ((wanted as f64 / plain.seen.len().max(1) as f64).sqrt() as u32).clamp(1, MOST_PARTS);
        let mut curved = Curved::new(parts_per_edge);
        let outer = |face: &&[u32; 3]| plain.layers[face[0] as usize] == 0;
        let vertices = |face: &[u32; 3]| face.map(|n| plain.on_surface[n as usize]);
        plain.seen.iter().filter(outer).for_each(|face| curved.divide(&mut topology, vertices(face)));
        topology.outer = topology.indices.len() as u32;
        plain.seen.iter().filter(|f| !outer(f)).for_each(|face| curved.divide(&mut topology, vertices(face)));
        plain.walls.iter().for_each(|face| curved.divide_wall(&mut topology, &plain, *face));
        topology.curved = topology.made.len() as u32;
        wound::close(&mut topology, &plain, &curved, kind);
        topology
    }

    /// How deep a single layer is shown, metres.
    fn depth_m(&self) -> f32 {
        let size: f32 = self.low_m.iter().zip(self.high_m).map(|(l, h)| (h - l) * (h - l)).sum();
        DEPTH_SHARE * size.sqrt()
    }

    fn lay_vertices(&mut self, plain: &mut Plain<'_>) {
        let Plain { seen: surface, walls, on_surface, on_wall, .. } = plain;
        number(surface, on_surface, 0);
        let first_wall = on_surface.iter().filter(|v| **v != ABSENT).count() as u32;
        number(walls, on_wall, first_wall);
        let count = first_wall as usize + on_wall.iter().filter(|v| **v != ABSENT).count();
        self.plain = vec![[0; 4]; count];
        let corners = |faces: &[[u32; 3]], of: &[u32], visit: &mut dyn FnMut(u32, [u32; 3])| {
            for &[a, b, c] in faces {
                for turned in [[a, b, c], [b, c, a], [c, a, b]] {
                    visit(of[turned[0] as usize], turned);
                }
            }
        };
        for (faces, of) in [(&*surface, &*on_surface), (&*walls, &*on_wall)] {
            corners(faces, of, &mut |vertex, _| self.plain[vertex as usize][2] += 1);
        }
        let mut first = 0;
        for vertex in &mut self.plain {
            vertex[1] = first;
            first += vertex[2];
            vertex[2] = 0;
        }
        self.faces = vec![[0; 2]; first as usize];
        for (faces, of) in [(&*surface, &*on_surface), (&*walls, &*on_wall)] {
            corners(faces, of, &mut |vertex, [_, b, c]| {
                let vertex = &mut self.plain[vertex as usize];
                self.faces[(vertex[1] + vertex[2]) as usize] = [b, c];
                vertex[2] += 1;
            });
        }
        for node in 0..plain.layers.len() as u32 {
            let (on_surface, on_wall) = (plain.on_surface[node as usize], plain.on_wall[node as usize]);
            let outer = if plain.layers[node as usize] == 0 { OUTER } else { INNER };
            for (vertex, material) in [(on_surface, outer), (on_wall, CUT)] {
                if vertex != ABSENT {
                    let [at, .., info] = &mut self.plain[vertex as usize];
                    *at = node;
                    *info = material | plain.depth(node) << 8 | u32::from(plain.edge[node as usize]) << 16;
                }
            }
        }
    }
}

impl<'o> Plain<'o> {
    fn sort(parts: &OutlineParts<'o>, nodes: &'o [FrameNode], topology: &mut Topology) -> Self {
        let layers = parts.layers;
        let count = layers.len();
        let mut edge = vec![false; count];
        for node in parts.edges {
            if let Some(mark) = edge.get_mut(*node as usize) {
                *mark = true;
            }
        }
        let deepest = layers.iter().copied().max().unwrap_or(0);
        let (mut surface, mut walls) = (Vec::with_capacity(parts.triangles.len() / 3), Vec::new());
        for face in parts.triangles.as_chunks::<3>().0 {
            let &[a, b, c] = face;
            if face.iter().any(|n| *n as usize >= count.min(nodes.len())) || a == b || b == c || c == a {
                topology.left_out += 1;
                continue;
            }
            let layer = |node: u32| layers[node as usize];
            match (layer(a) == layer(b), layer(b) == layer(c), layer(c) == layer(a)) {
                (true, true, _) => surface.push([a, b, c]),
                (false, true, _) => walls.push([b, c, a]),
                (_, _, true) => walls.push([c, a, b]),
                _ => walls.push([a, b, c]),
            }
        }
        Self {
            nodes,
            layers,
            deepest,
            edge,
            surface,
            seen: Vec::new(),
            walls,
            on_surface: vec![ABSENT; count],
            on_wall: vec![ABSENT; count],
        }
    }

    /// Depth of a node in the tissue, 0 to 255.
    fn depth(&self, node: u32) -> u32 {
        (u64::from(self.layers[node as usize]) * 255 / u64::from(self.deepest.max(1))) as u32
    }

    fn place(&self, node: u32) -> [f32; 3] {
        self.nodes[node as usize].position_m
    }
}

/// Gives a vertex to every node of these faces.
fn number(faces: &[[u32; 3]], vertex_of: &mut [u32], mut next: u32) {
    for node in faces.iter().flatten() {
        let vertex = &mut vertex_of[*node as usize];
        if *vertex == ABSENT {
            *vertex = next;
            next += 1;
        }
    }
}

fn bounds(nodes: &[FrameNode]) -> ([f32; 3], [f32; 3]) {
    let reach = |start: f32, pick: fn(f32, f32) -> f32| {
        nodes.iter().fold([start; 3], |far, node| std::array::from_fn(|i| pick(far[i], node.position_m[i])))
    };
    if nodes.is_empty() {
        ([0.0; 3], [0.0; 3])
    } else {
        (reach(f32::INFINITY, f32::min), reach(f32::NEG_INFINITY, f32::max))
    }
}

#[cfg(test)]
mod tests;
