//! Nodes in compact groups (tiles), and which nodes of a tile have a spring to which other tile.
//!
//! The built shape is halved across its widest extent until no part has more than [`TILE_NODES`] nodes: whatever way a
//! mesh numbers its nodes, a tile is a lump of it, with a short border. Nodes get an *own number*, tile by tile.
//! Made once from the network; deliberately absent: who is awake.

use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;
use std::ops::Range;

/// Most nodes of a tile: an 8 × 8 piece of a sheet.
pub(crate) const TILE_NODES: usize = 64;

/// Nodes of one tile that have a spring to another.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    /// The tile of the nodes.
    pub(crate) tile: u32,
    nodes: Range<usize>,
}

/// The tiles of a network.
#[derive(Clone, Debug)]
pub(crate) struct TileMap {
    /// First own number of each tile, and the number of nodes.
    start: Vec<u32>,
    /// Node of the network by own number.
    node: Vec<u32>,
    tile_of: Vec<u32>,
    /// Half-springs of each tile.
    half_springs: Vec<u32>,
    /// First border of each tile.
    border_start: Vec<u32>,
    borders: Vec<Border>,
    border_node: Vec<u32>,
}

impl TileMap {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        let count = network.node_count();
        let mut node: Vec<u32> = (0..count as u32).collect();
        let start = halve(&mut node, &network.rest_m);
        let mut tile_of = vec![0_u32; count];
        let mut half_springs = Vec::with_capacity(start.len());
        for (tile, ends) in start.windows(2).enumerate() {
            let own = &mut node[ends[0] as usize..ends[1] as usize];
            own.sort_unstable();
            own.iter().for_each(|&n| tile_of[n as usize] = tile as u32);
            half_springs.push(own.iter().map(|&n| network.half_edges.row(n as usize).len() as u32).sum());
        }
        let mut map = Self {
            start,
            node,
            tile_of,
            half_springs,
            border_start: Vec::new(),
            borders: Vec::new(),
            border_node: Vec::new(),
        };
        map.find_borders(network);
        map
    }

    /// For each tile, the nodes of its neighbours that feel it.
    fn find_borders(&mut self, network: &SpringNetwork) {
        let mut felt = Vec::new();
        for s in &network.springs {
            let (a, b) = (self.tile_of[s.a as usize], self.tile_of[s.b as usize]);
            if a != b {
                felt.extend([(a, b, s.b), (b, a, s.a)]);
            }
        }
        felt.sort_unstable();
        felt.dedup();
        self.border_start = vec![0; self.len() + 1];
        for pair in felt.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            let from = self.border_node.len();
            self.border_node.extend(pair.iter().map(|p| p.2));
            self.borders.push(Border { tile: pair[0].1, nodes: from..self.border_node.len() });
            self.border_start[pair[0].0 as usize + 1] += 1;
        }
        for tile in 0..self.len() {
            self.border_start[tile + 1] += self.border_start[tile];
        }
    }

    /// Number of tiles.
    pub(crate) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Nodes of the network by own number.
    pub(crate) fn all_nodes(&self) -> &[u32] {
        &self.node
    }

    /// Own numbers of a tile.
    #[inline]
    pub(crate) fn own(&self, tile: u32) -> Range<usize> {
        self.start[tile as usize] as usize..self.start[tile as usize + 1] as usize
    }

    /// Nodes of a tile, ascending.
    #[inline]
    pub(crate) fn nodes(&self, tile: u32) -> &[u32] {
        &self.node[self.own(tile)]
    }

    /// Tile of a node.
    #[inline]
    pub(crate) fn tile_of(&self, node: u32) -> u32 {
        self.tile_of[node as usize]
    }

    /// Half-springs of a tile's nodes.
    pub(crate) fn half_springs(&self, tile: u32) -> u32 {
        self.half_springs[tile as usize]
    }

    /// The neighbours of a tile.
    pub(crate) fn borders(&self, tile: u32) -> &[Border] {
        &self.borders[self.border_start[tile as usize] as usize..self.border_start[tile as usize + 1] as usize]
    }

    /// Nodes of a neighbour that feel the tile.
    pub(crate) fn border_nodes(&self, border: &Border) -> &[u32] {
        &self.border_node[border.nodes.clone()]
    }
}

/// Sorts the nodes into tiles and returns where each begins, and the end.
fn halve(node: &mut [u32], rest_m: &[Vec3]) -> Vec<u32> {
    let mut start = vec![0];
    let mut open = vec![(0, node.len())];
    while let Some((from, to)) = open.pop() {
        if to - from <= TILE_NODES {
            // Parts come off the stack from left to right.
            if to > from {
                start.push(to as u32);
            }
            continue;
        }
        let part = &mut node[from..to];
        let axis = widest(part, rest_m);
        let middle = part.len() / 2;
        let place = |n: &u32| rest_m[*n as usize][axis];
        part.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
        open.extend([(from + middle, to), (from, from + middle)]);
    }
    start
}

fn widest(part: &[u32], rest_m: &[Vec3]) -> usize {
    let first = rest_m[part[0] as usize];
    let (low, high) =
        part.iter().fold((first, first), |(l, h), n| (l.inf(&rest_m[*n as usize]), h.sup(&rest_m[*n as usize])));
    (high - low).imax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::tests::Net;
    use crate::tissue::tests::SKIN;

    #[test]
    fn every_node_lies_in_one_tile_and_borders_are_the_springs_between_tiles() {
        let network = Net { side: 37, ..SKIN }.build();
        let map = TileMap::new(&network);
        let mut seen = map.all_nodes().to_vec();
        seen.sort_unstable();
        assert_eq!(seen, (0..37 * 37).collect::<Vec<u32>>());
        let mut half_springs = 0;
        for tile in 0..map.len() as u32 {
            assert!((1..=TILE_NODES).contains(&map.nodes(tile).len()));
            assert!(map.nodes(tile).iter().all(|&n| map.tile_of(n) == tile));
            half_springs += map.half_springs(tile) as usize;
            // A lump: a piece of a sheet has no more border than four strips of its longest side.
            let listed: usize = map.borders(tile).iter().map(|b| map.border_nodes(b).len()).sum();
            assert!(listed <= 64, "tile {tile} has {listed} border nodes");
            for (other, node) in map.borders(tile).iter().flat_map(|b| map.border_nodes(b).iter().map(|n| (b.tile, n)))
            {
                assert_eq!(map.tile_of(*node), other);
            }
        }
        assert_eq!(half_springs, network.half_edges.neighbour.len());
        for s in &network.springs {
            let (a, b) = (map.tile_of(s.a), map.tile_of(s.b));
            let felt = |from: u32, to: u32, node: u32| {
                map.borders(from).iter().any(|x| x.tile == to && map.border_nodes(x).contains(&node))
            };
            assert!(a == b || (felt(a, b, s.b) && felt(b, a, s.a)));
        }
    }

    #[test]
    fn no_node_no_tile() {
        let nothing = SpringNetwork::new(Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new()).unwrap();
        assert_eq!(TileMap::new(&nothing).len(), 0);
    }
}
