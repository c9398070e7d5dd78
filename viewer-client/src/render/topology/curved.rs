//! Division of faces into smaller ones on a curved patch. Points on a common edge are shared, and a wall takes its
//! points from the surface's vertices, so that nothing gapes.

use super::{ABSENT, Plain, Topology};
use std::collections::HashMap;

/// Points of divided edges.
pub(super) struct Curved {
    parts: u32,
    /// First of the points between two vertices of the surface, from the lower to the higher one.
    edges: HashMap<(u32, u32), u32>,
    /// The same between two vertices of a wall.
    wall_edges: HashMap<(u32, u32), u32>,
}

/// A point on a face: `1 − b − c` of the first corner.
fn point(corners: [u32; 3], other: u32, share_b: f32, share_c: f32, info: u32) -> [u32; 8] {
    let [a, b, c] = corners;
    [a, b, c, other, share_b.to_bits(), share_c.to_bits(), 0, info]
}

impl Curved {
    pub(super) fn new(parts: u32) -> Self {
        Self { parts, edges: HashMap::new(), wall_edges: HashMap::new() }
    }

    fn share(&self, step: u32) -> f32 {
        step as f32 / self.parts as f32
    }

    fn add(topology: &mut Topology, made: [u32; 8]) -> u32 {
        topology.made.push(made);
        topology.vertices() as u32 - 1
    }

    /// Divides a face of the surface.
    pub(super) fn divide(&mut self, topology: &mut Topology, corners: [u32; 3]) {
        let n = self.parts;
        if n == 1 {
            topology.indices.extend(corners);
            return;
        }
        let [a, b, c] = corners;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            self.edge(topology, from, to);
        }
        let info = topology.plain[a as usize][3] & 0xffff;
        let inside = topology.vertices() as u32;
        for j in 1..n - 1 {
            for i in 1..n - j {
                Self::add(topology, point(corners, ABSENT, self.share(i), self.share(j), info));
            }
        }
        // Row j of the inside begins after the rows before it.
        let inner = |i: u32, j: u32| inside + (1..j).map(|row| n - 1 - row).sum::<u32>() + i - 1;
        // i steps towards b, j towards c.
        let at = |i: u32, j: u32| match (i, j) {
            (0, 0) => a,
            _ if i == n => b,
            _ if j == n => c,
            (i, 0) => self.on_edge(a, b, i),
            (0, j) => self.on_edge(a, c, j),
            (i, j) if i + j == n => self.on_edge(b, c, j),
            (i, j) => inner(i, j),
        };
        for j in 0..n {
            for i in 0..n - j {
                topology.indices.extend([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < n {
                    topology.indices.extend([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }

    /// Divides a face of a wall along its edge that lies in one layer.
    pub(super) fn divide_wall(&mut self, topology: &mut Topology, plain: &Plain<'_>, [p, q, apex]: [u32; 3]) {
        let wall = |node: u32| plain.on_wall[node as usize];
        let surface = |node: u32| plain.on_surface[node as usize];
        let whole = [wall(p), wall(q), wall(apex)];
        let in_layer = plain.layers[p as usize] == plain.layers[q as usize];
        if self.parts == 1 || !in_layer || surface(p) == ABSENT || surface(q) == ABSENT {
            topology.indices.extend(whole);
            return;
        }
        let (low, high) = if surface(p) < surface(q) { (p, q) } else { (q, p) };
        let parts = self.parts;
        let share = |step: u32| step as f32 / parts as f32;
        let first = *self.wall_edges.entry((low, high)).or_insert_with(|| {
            let info = topology.plain[wall(p) as usize][3] & 0xffff;
            let corners = [surface(low), surface(high), wall(low)];
            let first = topology.vertices() as u32;
            for step in 1..parts {
                Self::add(topology, point(corners, wall(high), share(step), 0.0, info));
            }
            first
        });
        let at = |step: u32| match step {
            0 => whole[0],
            _ if step == self.parts => whole[1],
            _ if p == low => first + step - 1,
            _ => first + self.parts - step - 1,
        };
        for step in 0..self.parts {
            topology.indices.extend([at(step), at(step + 1), whole[2]]);
        }
    }

    fn edge(&mut self, topology: &mut Topology, from: u32, to: u32) {
        let (low, high) = (from.min(to), from.max(to));
        if self.edges.contains_key(&(low, high)) {
            return;
        }
        self.edges.insert((low, high), topology.vertices() as u32);
        let info = topology.plain[low as usize][3] & 0xffff;
        for step in 1..self.parts {
            Self::add(topology, point([low, high, low], ABSENT, self.share(step), 0.0, info));
        }
    }

    /// The point that many steps from one vertex of a divided edge towards the other.
    fn on_edge(&self, from: u32, to: u32, step: u32) -> u32 {
        let first = self.edges.get(&(from.min(to), from.max(to))).copied().unwrap_or(from);
        if from < to { first + step - 1 } else { first + self.parts - step - 1 }
    }

    /// The vertices of a divided edge from one end up to, but without, the other.
    pub(super) fn along(&self, from: u32, to: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::once(from).chain((1..self.parts).map(move |step| self.on_edge(from, to, step)))
    }
}
