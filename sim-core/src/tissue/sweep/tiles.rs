//! The force sweep over some tiles of a mesh: gathered, each node writes only its own force.
//!
//! Four springs side by side as in `quads`, seen from both ends, tile by tile: `F_a = Σ (k − k L/|d|) d` (Zhang et al.,
//! Eq. (3), second line). Positions are kept by own number (`sleep::tiles`); those of tiles that are left out must have
//! been noted since they last moved. The force on a node does not depend on which other tiles are swept.
//! Deliberately absent: what springs that only pull do not give; the caller takes it out.

use super::dispatch::{Kernel, KernelLevel, Lanes};
use super::quads::{BEYOND_M, Four, by_node, row_force};
use crate::tissue::network::SpringNetwork;
use crate::tissue::node::Node;
use crate::tissue::sleep::tiles::TileMap;
use crate::vector::Vec3;

/// All half-springs by own number, and where the nodes were last noted.
#[derive(Clone, Debug)]
pub(crate) struct TileSweep {
    start: Vec<u32>,
    fours: Vec<Four>,
    position: Vec<Node>,
}

impl TileSweep {
    /// Lays out a network; no position is noted yet.
    pub(crate) fn new(network: &SpringNetwork, map: &TileMap) -> Self {
        let count = network.node_count();
        let mut own = vec![0_u32; count];
        map.all_nodes().iter().zip(0..).for_each(|(&n, number)| own[n as usize] = number);
        let both = network.springs.iter().flat_map(|s| {
            let (a, b) = (own[s.a as usize], own[s.b as usize]);
            [(a, (b, *s)), (b, (a, *s))]
        });
        let (start, fours) = by_node(both.collect(), count);
        Self { start, fours, position: vec![Node([BEYOND_M, BEYOND_M, BEYOND_M, 0.0]); count + 1] }
    }

    /// Notes where the nodes of a tile are.
    pub(crate) fn note(&mut self, map: &TileMap, tile: u32, position_m: &[Vec3]) {
        for (own, &n) in self.position[map.own(tile)].iter_mut().zip(map.nodes(tile)) {
            *own = Node::from(&position_m[n as usize]);
        }
    }

    /// Notes the tiles and writes the force on their nodes. Returns the least squared distance it met.
    pub(crate) fn sweep(
        &mut self,
        level: KernelLevel,
        map: &TileMap,
        tiles: &[u32],
        position_m: &[Vec3],
        force_n: &mut [Vec3],
    ) -> f64 {
        tiles.iter().for_each(|&tile| self.note(map, tile, position_m));
        level.for_quads().run(SomeTiles { sweep: self, map, tiles, force_n })
    }
}

/// One sweep over noted tiles.
struct SomeTiles<'a> {
    sweep: &'a TileSweep,
    map: &'a TileMap,
    tiles: &'a [u32],
    force_n: &'a mut [Vec3],
}

impl Kernel for SomeTiles<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let Self { sweep: TileSweep { start, fours, position }, map, tiles, force_n } = self;
        let mut least = lanes.quad([f64::MAX; 4]);
        for &tile in tiles {
            for (own, &n) in map.own(tile).zip(map.nodes(tile)) {
                let row = &fours[start[own] as usize..start[own + 1] as usize];
                force_n[n as usize] = row_force(lanes, &position[own], row, position, &mut least).vector();
            }
        }
        lanes.array(least).into_iter().fold(f64::MAX, f64::min)
    }
}
