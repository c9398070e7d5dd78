//! Force sweeps in single precision, for any mesh: eight springs side by side from both ends, or four once each.
//!
//! A position in `f32` would lose what matters: 60 mm is good to 4 nm then, 2 µN on a spring of Table 2. So a node is two
//! numbers per axis, `x = h + l` with `h` the nearest `f32`, and a spring is `d = (h_b − h_a) + (l_b − l_a)`: its rounding
//! is a share of `d`, not of `x`. `f = (k − k L/|d|) d` is good to [`SINGLE_TOLERANCE`] of `k (L + |d|)`. Springs that are
//! almost as long as at rest lose most, in relation to their own small force. Sums are single too; the result is `f64`.

use super::dispatch::{Kernel, Lanes};
use crate::tissue::force::COINCIDENT_M;
use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;

/// Error of a node's force, as a share of `Σ k (L + |d|)` over its springs: six roundings of 2⁻²⁴.
pub const SINGLE_TOLERANCE: f64 = 4.0e-7;
/// Least squared length.
pub(super) const FLOOR: f32 = (COINCIDENT_M * COINCIDENT_M) as f32;
/// Where the node beyond the last one lies: no node comes near.
const BEYOND_M: f32 = 1.0e6;

/// A node's four numbers in one register.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(16))]
struct Node([f32; 4]);

/// Springs side by side: other nodes, stiffness (N/m), `k L` (N). Places without a spring hold zeros and the node beyond
/// the last one.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Bundle<const LANES: usize> {
    stiffness: [f32; LANES],
    preload: [f32; LANES],
    other: [u32; LANES],
}

/// The springs of a network in bundles by node.
#[derive(Clone, Debug)]
enum Bundles {
    /// Once, from the lower node.
    Lower(Vec<Bundle<4>>),
    /// From both.
    Both(Vec<Bundle<8>>),
}

/// From which ends the springs are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ends {
    /// Once, from the lower node.
    Lower,
    /// From both.
    Both,
}

/// A network in single precision.
#[derive(Clone, Debug)]
pub(super) struct Singles {
    bundles: Bundles,
    start: Vec<u32>,
    high: Vec<Node>,
    low: Vec<Node>,
    force: Vec<Node>,
}

impl Singles {
    pub(super) fn new(network: &SpringNetwork, ends: Ends) -> Self {
        let count = network.node_count();
        let (bundles, start) = match ends {
            Ends::Lower => {
                let (bundles, start) = bundles(network, |node, other| other > node);
                (Bundles::Lower(bundles), start)
            }
            Ends::Both => {
                let (bundles, start) = bundles(network, |_, _| true);
                (Bundles::Both(bundles), start)
            }
        };
        let nodes = vec![Node::default(); count + 1];
        let mut high = nodes.clone();
        high[count] = Node([BEYOND_M, BEYOND_M, BEYOND_M, 0.0]);
        Self { bundles, start, high, low: nodes.clone(), force: nodes }
    }

    /// The kernel of one sweep.
    pub(super) fn sweep<'a>(&'a mut self, position_m: &'a [Vec3], force_n: &'a mut [Vec3]) -> SingleSweep<'a> {
        SingleSweep { singles: self, position_m, force_n }
    }
}

/// Those half-springs of each node that are `seen`, in bundles, and where the bundles of each node begin.
fn bundles<const LANES: usize>(
    network: &SpringNetwork,
    seen: impl Fn(usize, usize) -> bool,
) -> (Vec<Bundle<LANES>>, Vec<u32>) {
    let count = network.node_count();
    let (mut start, mut bundles) = (vec![0_u32; count + 1], Vec::new());
    let edges = &network.half_edges;
    for node in 0..count {
        let row: Vec<usize> = edges.row(node).filter(|&e| seen(node, edges.neighbour[e] as usize)).collect();
        for chunk in row.chunks(LANES) {
            let mut bundle = Bundle { stiffness: [0.0; LANES], preload: [0.0; LANES], other: [count as u32; LANES] };
            for (lane, &e) in chunk.iter().enumerate() {
                bundle.other[lane] = edges.neighbour[e];
                bundle.stiffness[lane] = edges.stiffness_n_per_m[e] as f32;
                bundle.preload[lane] = (edges.stiffness_n_per_m[e] * edges.rest_length_m[e]) as f32;
            }
            bundles.push(bundle);
        }
        start[node + 1] = bundles.len() as u32;
    }
    (bundles, start)
}

/// A coordinate as the nearest `f32` and what that leaves.
#[inline(always)]
pub(super) fn halves(x: f64) -> (f32, f32) {
    let high = x as f32;
    (high, (x - f64::from(high)) as f32)
}

/// One sweep; writes all forces.
pub(super) struct SingleSweep<'a> {
    singles: &'a mut Singles,
    position_m: &'a [Vec3],
    force_n: &'a mut [Vec3],
}

impl Kernel for SingleSweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { singles: Singles { bundles, start, high, low, force }, position_m, force_n } = self;
        for ((high, low), p) in high.iter_mut().zip(&mut *low).zip(position_m) {
            let ((x, x_rest), (y, y_rest), (z, z_rest)) = (halves(p.x), halves(p.y), halves(p.z));
            (*high, *low) = (Node([x, y, z, 0.0]), Node([x_rest, y_rest, z_rest, 0.0]));
        }
        match bundles {
            Bundles::Lower(fours) => rows(lanes, start, fours, high, low, force),
            Bundles::Both(eights) => gather(lanes, start, eights, high, low, force),
        }
        for (f, own) in force_n.iter_mut().zip(&*force) {
            *f = Vec3::new(f64::from(own.0[0]), f64::from(own.0[1]), f64::from(own.0[2]));
        }
    }
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, start: &[u32], eights: &[Bundle<8>], high: &[Node], low: &[Node], force: &mut [Node]) {
    let zero = lanes.oct32([0.0; 8]);
    for (node, ends) in start.windows(2).enumerate() {
        let own_high = lanes.pair32(high[node].0, high[node].0);
        let own_low = lanes.pair32(low[node].0, low[node].0);
        let (mut x, mut y, mut z) = (zero, zero, zero);
        for eight in &eights[ends[0] as usize..ends[1] as usize] {
            let [a, b, c, d, e, f, g, h] = eight.other;
            let two = |p: u32, q: u32| (p as usize, q as usize);
            let [(a, e), (b, f), (c, g), (d, h)] = [two(a, e), two(b, f), two(c, g), two(d, h)];
            let highs = [
                lanes.sub_oct32(lanes.pair32(high[a].0, high[e].0), own_high),
                lanes.sub_oct32(lanes.pair32(high[b].0, high[f].0), own_high),
                lanes.sub_oct32(lanes.pair32(high[c].0, high[g].0), own_high),
                lanes.sub_oct32(lanes.pair32(high[d].0, high[h].0), own_high),
            ];
            let lows = [
                lanes.sub_oct32(lanes.pair32(low[a].0, low[e].0), own_low),
                lanes.sub_oct32(lanes.pair32(low[b].0, low[f].0), own_low),
                lanes.sub_oct32(lanes.pair32(low[c].0, low[g].0), own_low),
                lanes.sub_oct32(lanes.pair32(low[d].0, low[h].0), own_low),
            ];
            let [dx, dy, dz] = lanes.axes32([
                lanes.add_oct32(highs[0], lows[0]),
                lanes.add_oct32(highs[1], lows[1]),
                lanes.add_oct32(highs[2], lows[2]),
                lanes.add_oct32(highs[3], lows[3]),
            ]);
            let inverse = lanes.inverse_length_oct32([dx, dy, dz], FLOOR);
            let scale = lanes.neg_mul_add_oct32(lanes.oct32(eight.preload), inverse, lanes.oct32(eight.stiffness));
            x = lanes.mul_add_oct32(scale, dx, x);
            y = lanes.mul_add_oct32(scale, dy, y);
            z = lanes.mul_add_oct32(scale, dz, z);
        }
        force[node].0 = lanes.sums32([x, y, z]);
    }
}

#[inline(always)]
fn rows<L: Lanes>(lanes: L, start: &[u32], fours: &[Bundle<4>], high: &[Node], low: &[Node], force: &mut [Node]) {
    force.fill(Node::default());
    for (node, ends) in start.windows(2).enumerate() {
        let (own_high, own_low) = (lanes.quad32(high[node].0), lanes.quad32(low[node].0));
        let mut sum = lanes.quad32([0.0; 4]);
        for four in &fours[ends[0] as usize..ends[1] as usize] {
            let [p, q, r, s] = four.other;
            let d = [
                apart(lanes, &high[p as usize], own_high, &low[p as usize], own_low),
                apart(lanes, &high[q as usize], own_high, &low[q as usize], own_low),
                apart(lanes, &high[r as usize], own_high, &low[r as usize], own_low),
                apart(lanes, &high[s as usize], own_high, &low[s as usize], own_low),
            ];
            let inverse = lanes.inverse_root_quad32(lanes.squares32(d, FLOOR));
            let scale = lanes.neg_mul_add32(lanes.quad32(four.preload), inverse, lanes.quad32(four.stiffness));
            let scale = lanes.spread32(scale);
            for lane in 0..4 {
                sum = lanes.mul_add32(scale[lane], d[lane], sum);
                let at = &mut force[four.other[lane] as usize].0;
                *at = lanes.array32(lanes.neg_mul_add32(scale[lane], d[lane], lanes.quad32(*at)));
            }
        }
        force[node].0 = lanes.array32(lanes.add32(lanes.quad32(force[node].0), sum));
    }
}

/// `d = (h_b − h_a) + (l_b − l_a)`.
#[inline(always)]
fn apart<L: Lanes>(lanes: L, high: &Node, own_high: L::Quad32, low: &Node, own_low: L::Quad32) -> L::Quad32 {
    lanes.add32(lanes.sub32(lanes.quad32(high.0), own_high), lanes.sub32(lanes.quad32(low.0), own_low))
}
