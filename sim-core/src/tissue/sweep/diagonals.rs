//! Finds what is regular in a network, with no knowledge of its geometry: springs with the same distance of their node
//! numbers, `offset = b − a`, lie on a diagonal of the stiffness matrix. Where a diagonal is well filled over a stretch
//! of lower nodes, its springs become a [`Stretch`] of consecutive places; places without a spring (wound, rim) hold
//! `k = k L = 0`. All other springs stay as they are, for another kernel.
//!
//! The diagonal format of sparse matrices, cut into stretches and blocks of [`BLOCK`] nodes that fit the first cache.

use super::aligned::Aligned;
use crate::tissue::network::Spring;

/// Nodes of a block; a multiple of the widest vector.
pub(super) const BLOCK: usize = 256;
/// Stretches begin and end at multiples of this: one cache line of `f64`.
pub(super) const GRAIN: usize = 8;
/// A longer gap between two springs of a diagonal ends a stretch.
const LONGEST_GAP: u32 = 8;
/// Share of places that must hold a spring: below it, another kernel is faster.
const LEAST_FILL: f64 = 0.4;

/// Consecutive places of one diagonal within one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    /// First lower node.
    pub(super) start: usize,
    /// Places.
    pub(super) len: usize,
    /// Upper minus lower node.
    pub(super) offset: usize,
    /// First place in the arrays.
    pub(super) place: usize,
}

/// The regular part of a network.
#[derive(Clone, Debug)]
pub(super) struct Diagonals {
    /// Block by block, shorter offsets first.
    pub(super) stretches: Vec<Stretch>,
    /// Stiffness by place, newtons per metre.
    pub(super) stiffness: Aligned<f64>,
    /// `k L` by place, newtons.
    pub(super) preload: Aligned<f64>,
    /// Springs on the diagonals.
    pub(super) springs: usize,
}

impl Diagonals {
    /// Splits springs (sorted by lower, then upper node) into the regular part and the rest, which keeps its order.
    pub(super) fn find(springs: &[Spring]) -> (Self, Vec<Spring>) {
        let mut order: Vec<u32> = (0..springs.len() as u32).collect();
        let offset = |i: u32| springs[i as usize].b - springs[i as usize].a;
        let lower = |i: u32| springs[i as usize].a;
        order.sort_by_key(|&i| (offset(i), lower(i)));
        let mut regular = vec![false; springs.len()];
        let mut stretches = Vec::new();
        let same_run = |a: &u32, b: &u32| offset(*a) == offset(*b) && lower(*b) - lower(*a) <= LONGEST_GAP;
        for run in order.chunk_by(same_run) {
            let (first, last) = (lower(run[0]) as usize, lower(run[run.len() - 1]) as usize);
            let start = first / GRAIN * GRAIN;
            let end = (last + 1).next_multiple_of(GRAIN);
            if (run.len() as f64) < LEAST_FILL * (end - start) as f64 {
                continue;
            }
            run.iter().for_each(|&i| regular[i as usize] = true);
            let mut at = start;
            while at < end {
                let stop = end.min((at / BLOCK + 1) * BLOCK);
                stretches.push(Stretch { start: at, len: stop - at, offset: offset(run[0]) as usize, place: 0 });
                at = stop;
            }
        }
        stretches.sort_by_key(|s| (s.start / BLOCK, s.offset, s.start));
        let mut places = 0;
        for stretch in &mut stretches {
            stretch.place = places;
            places += stretch.len;
        }
        let mut found = Self { stretches, stiffness: Aligned::new(places), preload: Aligned::new(places), springs: 0 };
        let mut rest = Vec::new();
        for (spring, &is_regular) in springs.iter().zip(&regular) {
            if is_regular { found.put(spring) } else { rest.push(*spring) }
        }
        (found, rest)
    }

    fn put(&mut self, spring: &Spring) {
        let key = ((spring.a as usize) / BLOCK, (spring.b - spring.a) as usize, spring.a as usize);
        let after = self.stretches.partition_point(|s| (s.start / BLOCK, s.offset, s.start) <= key);
        let stretch = self.stretches[after - 1];
        let place = stretch.place + (spring.a as usize - stretch.start);
        self.stiffness.get_mut()[place] = spring.stiffness_n_per_m;
        self.preload.get_mut()[place] = spring.stiffness_n_per_m * spring.rest_length_m;
        self.springs += 1;
    }
}
