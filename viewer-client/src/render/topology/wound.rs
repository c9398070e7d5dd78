//! Walls of a tissue that has one layer only, and the bed at the bottom of a wound.

use super::curved::Curved;
use super::loops::{boundary_loops, chains};
use super::{ABSENT, BED, CUT, Plain, Topology, VESSEL};

/// Kinds of points below others in `shape.wgsl`.
const KIND_WALL: u32 = 1 << 24;
const KIND_BED: u32 = 2 << 24;
/// Depth of a wall's lower end, in the tissue.
const DEEPEST: u32 = 255 << 8;
/// Points across the bed.
const ACROSS: u32 = 6;
/// How much deeper the middle of a bed is, as a share of a single layer's depth.
const HOLLOW: f32 = 0.33;
/// How deep the border of a single layer's bed lies: the table is below the layer, and the bed above the table.
const BED_SHARE: f32 = 0.62;

/// Adds what is missing for the wound to have a depth.
pub(super) fn close(topology: &mut Topology, plain: &Plain<'_>, curved: &Curved, kind: u32) {
    let depth_m = topology.depth_m();
    if plain.deepest == 0 {
        topology.below_m = depth_m;
        for line in boundary_loops(plain.surface.iter()) {
            skirt(topology, plain, curved, &line, depth_m);
            if line.iter().any(|node| plain.edge[*node as usize]) {
                bed(topology, plain, curved, &line, [BED_SHARE * depth_m, HOLLOW * depth_m]);
            }
        }
    } else if kind != VESSEL {
        let innermost = plain.surface.iter().filter(|face| plain.layers[face[0] as usize] == plain.deepest);
        let beside = beside_edge(plain);
        for line in boundary_loops(innermost).into_iter().filter(|line| line.iter().any(|n| beside[*n as usize])) {
            // The inner surface faces inwards: down is along its normal.
            bed(topology, plain, curved, &line, [0.0, -HOLLOW * depth_m]);
        }
    }
}

/// Nodes that walls join to the wound edge, layer after layer.
pub(super) fn beside_edge(plain: &Plain<'_>) -> Vec<bool> {
    let mut beside = plain.edge.clone();
    for _ in 0..plain.deepest {
        let joined: Vec<u32> =
            plain.walls.iter().filter(|f| f.iter().any(|n| beside[*n as usize])).flatten().copied().collect();
        joined.iter().for_each(|n| beside[*n as usize] = true);
    }
    beside
}

fn below(topology: &mut Topology, made: [u32; 8]) -> u32 {
    topology.made.push(made);
    topology.vertices() as u32 - 1
}

/// The vertices along a loop of nodes, divided as the surface is.
fn divided(plain: &Plain<'_>, curved: &Curved, line: &[u32], closed: Closed) -> Vec<u32> {
    let vertex = |node: u32| plain.on_surface[node as usize];
    let mut vertices: Vec<u32> =
        line.windows(2).flat_map(|side| curved.along(vertex(side[0]), vertex(side[1]))).collect();
    if let (Some(&first), Some(&last)) = (line.first(), line.last()) {
        match closed {
            Closed::Yes => vertices.extend(curved.along(vertex(last), vertex(first))),
            Closed::No => vertices.push(vertex(last)),
        }
    }
    vertices
}

#[derive(Clone, Copy)]
enum Closed {
    Yes,
    No,
}

/// A wall that goes straight down from a loop.
fn skirt(topology: &mut Topology, plain: &Plain<'_>, curved: &Curved, line: &[u32], depth_m: f32) {
    let top = divided(plain, curved, line, Closed::Yes);
    let count = top.len();
    let mut ring = |depth_m: f32, info: u32| {
        let first = topology.vertices() as u32;
        for (i, &vertex) in top.iter().enumerate() {
            let (before, after) = (top[(i + count - 1) % count], top[(i + 1) % count]);
            below(topology, [vertex, before, after, ABSENT, 0, 0, depth_m.to_bits(), info]);
        }
        first
    };
    let upper = ring(0.0, CUT | KIND_WALL);
    let lower = ring(depth_m, CUT | DEEPEST | KIND_WALL);
    for i in 0..count as u32 {
        let j = (i + 1) % count as u32;
        topology.indices.extend([upper + i, lower + i, upper + j, upper + j, lower + i, lower + j]);
    }
}

/// A hollow from one side of the wound to the other.
fn bed(topology: &mut Topology, plain: &Plain<'_>, curved: &Curved, line: &[u32], [base_m, hollow_m]: [f32; 2]) {
    let [left, right] = chains(line, |node| plain.place(node)).map(|chain| divided(plain, curved, &chain, Closed::No));
    let rows = left.len().max(right.len());
    if left.len().min(right.len()) < 2 {
        return;
    }
    let on = |chain: &[u32], row: usize| chain[row * (chain.len() - 1) / (rows - 1)];
    let first = topology.vertices() as u32;
    for row in 0..rows {
        // Shallow at the tips.
        let along = row as f32 / (rows - 1) as f32;
        let hollow_m = hollow_m * 4.0 * along * (1.0 - along);
        for column in 0..=ACROSS {
            let share = column as f32 / ACROSS as f32;
            let depth_m = base_m + hollow_m * 4.0 * share * (1.0 - share);
            let (a, b) = (on(&left, row), on(&right, row));
            let info = BED | DEEPEST | KIND_BED;
            below(topology, [a, b, ABSENT, ABSENT, share.to_bits(), 0, depth_m.to_bits(), info]);
        }
    }
    let at = |row: usize, column: u32| first + row as u32 * (ACROSS + 1) + column;
    for row in 0..rows - 1 {
        for column in 0..ACROSS {
            let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
            topology.indices.extend([a, b, c, c, b, d]);
        }
    }
}
