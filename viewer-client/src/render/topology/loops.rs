//! Closed lines along which a surface ends: the rim, and the wound.

use std::collections::HashMap;

/// Sides that only one of these faces has, from node to node in that face's direction.
pub(super) fn sides_used_once<'f>(faces: impl Iterator<Item = &'f [u32; 3]>) -> Vec<(u32, u32)> {
    let mut sides: Vec<(u32, u32, u32)> = faces
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(from, to)| (from.min(to), from.max(to), from))
        .collect();
    sides.sort_unstable();
    let alone = sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|uses| uses.len() == 1);
    alone.map(|uses| (uses[0].2, uses[0].0 ^ uses[0].1 ^ uses[0].2)).collect()
}

/// Loops of the nodes along the boundary of some faces, in the faces' own direction (the surface to the left).
pub(super) fn boundary_loops<'f>(faces: impl Iterator<Item = &'f [u32; 3]>) -> Vec<Vec<u32>> {
    let ends = sides_used_once(faces);
    let mut next: HashMap<u32, u32> = ends.iter().copied().collect();
    let mut loops = Vec::new();
    for (start, _) in ends {
        let mut line = Vec::new();
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            line.push(at);
            at = to;
        }
        if line.len() > 2 && at == start {
            loops.push(line);
        }
    }
    loops
}

/// Cuts a loop at its two points that are farthest apart: two chains from the first tip to the second, tips included.
pub(super) fn chains(line: &[u32], place: impl Fn(u32) -> [f32; 3]) -> [Vec<u32>; 2] {
    let farthest = |from: usize| {
        let origin = place(line[from]);
        let distance = |node: u32| -> f32 { place(node).iter().zip(origin).map(|(p, o)| (p - o) * (p - o)).sum() };
        (0..line.len()).max_by(|&i, &j| distance(line[i]).total_cmp(&distance(line[j]))).unwrap_or(0)
    };
    let first = farthest(0);
    let second = farthest(first);
    let walk = |from: usize, to: usize| -> Vec<u32> {
        let steps = (to + line.len() - from) % line.len();
        (0..=steps).map(|step| line[(from + step) % line.len()]).collect()
    };
    let mut back = walk(second, first);
    back.reverse();
    [walk(first, second), back]
}
