//! Nodes at rest are left out of the steps: by motion, never by distance, and tile by tile.
//!
//! A tile whose nodes all have had little force and little speed for [`params::QUIET_PERIODS`] periods stops: velocities 0,
//! positions as they are; that takes kinetic energy only. Nothing changes in it until a node of another tile moves, so only
//! its nodes with a spring to an awake tile are looked at, before each sub-step; one of them above its waking force wakes
//! the tile. Whatever writes to a node (handle, load, pair, link, shift from outside) wakes its tile: tiles that such a
//! thing acts on never sleep. A sleeping tile is held by the ground: up to `Σ m v` of its limits is lost with every one.
//! Work per step: `b ·` awake nodes + the borders between awake and sleeping tiles, whatever the size of the mesh. While
//! more than half of the nodes are awake, the forces are those of the ordinary sweep over all.
//! Deliberately absent: implicit and position-based integrators, which solve for all nodes at once; single precision, where
//! the two sweeps differ by more than a waking force.

pub mod params;
pub(crate) mod tiles;

use crate::tissue::force::{COINCIDENT_M, push, row_force};
use crate::tissue::integrator::{AdvanceCounts, NodeFactors, advance_node};
use crate::tissue::load::Loads;
use crate::tissue::network::{SpringNetwork, TissueState};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::sweep::SpringSweep;
use crate::tissue::sweep::tiles::TileSweep;
use crate::vector::Vec3;
use params::{QUIET_PERIODS, RestLimits, SleepParams};
use tiles::TileMap;

/// Whether a tile moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rest {
    Awake {
        /// Periods since a node of it moved noticeably.
        quiet: u8,
    },
    Asleep,
}

/// Who is awake, and the sweep over them.
#[derive(Clone, Debug)]
pub(crate) struct Sleep {
    map: TileMap,
    limits: Vec<RestLimits>,
    sweep: TileSweep,
    rest: Vec<Rest>,
    /// Awake tiles, in the order in which they woke.
    awake: Vec<u32>,
    awake_nodes: usize,
}

/// What a force sweep visited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Visited {
    pub(crate) coincident: u32,
    pub(crate) half_springs: u64,
}

impl Sleep {
    /// All awake.
    pub(crate) fn new(network: &SpringNetwork, params: &SleepParams) -> Self {
        let map = TileMap::new(network);
        let mut sleep = Self {
            limits: (0..network.node_count()).map(|node| RestLimits::of(network, node, params)).collect(),
            sweep: TileSweep::new(network, &map),
            rest: vec![Rest::Asleep; map.len()],
            awake: Vec::with_capacity(map.len()),
            awake_nodes: 0,
            map,
        };
        sleep.wake_all();
        sleep
    }

    pub(crate) fn wake_all(&mut self) {
        (0..self.map.len() as u32).for_each(|tile| self.wake(tile));
    }

    /// A node is written to, or will be.
    pub(crate) fn touch(&mut self, node: u32) {
        self.wake(self.map.tile_of(node));
    }

    /// A patch is written to.
    pub(crate) fn touch_patch(&mut self, patches: &PatchSet, patch: PatchId) {
        patches.nodes(patch).iter().for_each(|&n| self.touch(n));
    }

    /// Loads act.
    pub(crate) fn touch_loaded(&mut self, loads: &Loads, patches: &PatchSet) {
        let nodes = self.limits.len();
        loads.nodes.iter().filter(|l| (l.node as usize) < nodes).for_each(|l| self.touch(l.node));
        loads.patches.iter().filter(|l| patches.contains(l.patch)).for_each(|l| self.touch_patch(patches, l.patch));
    }

    fn wake(&mut self, tile: u32) {
        let rest = &mut self.rest[tile as usize];
        if *rest == Rest::Asleep {
            self.awake.push(tile);
            self.awake_nodes += self.map.own(tile).len();
        }
        *rest = Rest::Awake { quiet: 0 };
    }

    pub(crate) fn awake_nodes(&self) -> usize {
        self.awake_nodes
    }

    pub(crate) fn all_awake(&self) -> bool {
        self.awake_nodes == self.limits.len()
    }

    #[inline]
    fn is_awake(&self, node: u32) -> bool {
        self.rest[self.map.tile_of(node) as usize] != Rest::Asleep
    }

    /// Nodes of awake tiles.
    pub(crate) fn awake(&self) -> impl Iterator<Item = usize> {
        self.awake.iter().flat_map(|&tile| self.map.nodes(tile)).map(|&n| n as usize)
    }

    /// Nodes of sleeping tiles.
    pub(crate) fn asleep(&self) -> impl Iterator<Item = u32> {
        let tiles = (0_u32..).zip(&self.rest).filter(|(_, rest)| **rest == Rest::Asleep);
        tiles.flat_map(|(tile, _)| self.map.nodes(tile)).copied()
    }

    /// Wakes the sleeping neighbours of awake tiles that feel too much. Returns the half-springs looked at.
    pub(crate) fn wake_neighbours(
        &mut self,
        network: &SpringNetwork,
        factors: &[NodeFactors],
        position_m: &[Vec3],
    ) -> u64 {
        let mut looked_at = 0;
        // Tiles woken here have moved nobody yet.
        for index in 0..self.awake.len() {
            let tile = self.awake[index];
            for border in 0..self.map.borders(tile).len() {
                let border = &self.map.borders(tile)[border];
                if self.rest[border.tile as usize] != Rest::Asleep {
                    continue;
                }
                let feels = |n: &u32| {
                    let node = *n as usize;
                    looked_at += network.half_edges.row(node).len() as u64;
                    let force = row_force(&network.half_edges, node, position_m).0.norm_squared();
                    factors[node].gain_s_per_kg > 0.0 && !is_within(force, self.limits[node].wake_n2)
                };
                if self.map.border_nodes(border).iter().any(feels) {
                    self.wake(border.tile);
                }
            }
        }
        looked_at
    }

    /// Writes the spring force on every awake node; on sleeping ones it means nothing.
    pub(crate) fn forces(
        &mut self,
        springs: &mut SpringSweep,
        network: &SpringNetwork,
        position_m: &[Vec3],
        force_n: &mut [Vec3],
    ) -> Visited {
        if 2 * self.awake_nodes > self.limits.len() {
            let half_springs = network.half_edges.neighbour.len() as u64;
            return Visited { coincident: springs.sweep(position_m, force_n), half_springs };
        }
        if self.awake.is_empty() {
            return Visited::default();
        }
        let least = self.sweep.sweep(springs.level(), &self.map, &self.awake, position_m, force_n);
        for s in network.pulls_only.iter().map(|&i| &network.springs[i as usize]) {
            let awake = [self.is_awake(s.a), self.is_awake(s.b)];
            if awake != [false, false] {
                let (a, b) = (s.a as usize, s.b as usize);
                let pushed = push(&position_m[a], &position_m[b], s.stiffness_n_per_m, s.rest_length_m);
                if awake[0] {
                    force_n[a] -= pushed;
                }
                if awake[1] {
                    force_n[b] += pushed;
                }
            }
        }
        let touching = least < COINCIDENT_M * COINCIDENT_M;
        Visited {
            coincident: if touching { springs.count_coincident(position_m) } else { 0 },
            half_springs: self.awake.iter().map(|&tile| u64::from(self.map.half_springs(tile))).sum(),
        }
    }

    /// `integrator::advance` over the awake nodes.
    pub(crate) fn advance(
        &self,
        factors: &[NodeFactors],
        force_n: &[Vec3],
        state: &mut TissueState,
        h: f64,
        limit_m: f64,
    ) -> AdvanceCounts {
        let mut counts = AdvanceCounts::default();
        for node in self.awake() {
            let own = (&mut state.position_m[node], &mut state.velocity_m_per_s[node]);
            advance_node(own, &factors[node], &force_n[node], h, limit_m, &mut counts);
        }
        counts
    }

    /// Counts the quiet periods and lets tiles fall asleep; `still` is told of each node that does.
    pub(crate) fn close_period(
        &mut self,
        factors: &[NodeFactors],
        force_n: &[Vec3],
        state: &mut TissueState,
        mut still: impl FnMut(usize),
    ) {
        let Self { map, limits, sweep, rest, awake, awake_nodes } = self;
        awake.retain(|&tile| {
            let moves = |n: &u32| {
                let node = *n as usize;
                let limits = &limits[node];
                let force = force_n[node].norm_squared();
                !is_within(state.velocity_m_per_s[node].norm_squared(), limits.speed_m2_per_s2)
                    || (factors[node].gain_s_per_kg > 0.0 && !is_within(force, limits.sleep_n2))
            };
            let quiet = match rest[tile as usize] {
                Rest::Awake { quiet } if !map.nodes(tile).iter().any(moves) => quiet + 1,
                _ => 0,
            };
            rest[tile as usize] = Rest::Awake { quiet };
            if quiet < QUIET_PERIODS {
                return true;
            }
            rest[tile as usize] = Rest::Asleep;
            *awake_nodes -= map.own(tile).len();
            for &n in map.nodes(tile) {
                state.velocity_m_per_s[n as usize] = Vec3::zeros();
                still(n as usize);
            }
            sweep.note(map, tile, &state.position_m);
            false
        });
    }
}

/// False also for what is not a number.
fn is_within(squared: f64, limit_squared: f64) -> bool {
    squared <= limit_squared
}
