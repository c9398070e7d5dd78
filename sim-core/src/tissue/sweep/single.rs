//! Force sweeps in single precision, for any mesh: springs four side by side, from both ends or once each.
//!
//! Positions would lose what matters: 60 mm in `f32` is good to 4 nm, 2 µN on a spring of Table 2. So nodes are
//! displacements `u = x − X` from the built shape, and a spring is `d = D + u_b − u_a` with `D = X_b − X_a`; what is
//! rounded then is small. `f = (k − k L/|d|) d` is good to [`SINGLE_TOLERANCE`] of `k (L + |d|)`. Springs that are almost as
//! long as at rest lose most, in relation to their own small force. Sums are single too; the result is `f64`.

use super::dispatch::{Kernel, Lanes};
use crate::tissue::force::COINCIDENT_M;
use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;

/// Error of a node's force, as a share of `Σ k (L + |d|)` over its springs: six roundings of 2⁻²⁴.
pub const SINGLE_TOLERANCE: f64 = 4.0e-7;
/// Springs side by side.
const LANES: usize = 4;
/// Least squared length.
const FLOOR: f32 = (COINCIDENT_M * COINCIDENT_M) as f32;

/// A node's four numbers in one register.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(16))]
struct Node([f32; 4]);

/// Four springs: other nodes, vectors at rest (m), stiffness (N/m), `k L` (N).
#[derive(Clone, Copy, Debug, Default)]
struct Four {
    other: [u32; LANES],
    rest: [Node; LANES],
    stiffness: [f32; LANES],
    preload: [f32; LANES],
}

/// From which ends the springs are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ends {
    /// Once, from the lower node.
    Lower,
    /// From both.
    Both,
}

/// The springs of a network in fours by node.
#[derive(Clone, Debug)]
pub(super) struct Singles {
    ends: Ends,
    start: Vec<u32>,
    fours: Vec<Four>,
    built_m: Vec<Vec3>,
    shift: Vec<Node>,
    force: Vec<Node>,
}

impl Singles {
    pub(super) fn new(network: &SpringNetwork, ends: Ends) -> Self {
        let count = network.node_count();
        let (mut start, mut fours) = (vec![0_u32; count + 1], Vec::new());
        let edges = &network.half_edges;
        for node in 0..count {
            let seen = |e: &usize| ends == Ends::Both || edges.neighbour[*e] as usize > node;
            let row: Vec<usize> = edges.row(node).filter(seen).collect();
            for chunk in row.chunks(LANES) {
                let mut four = Four { other: [count as u32; LANES], ..Four::default() };
                for (lane, &e) in chunk.iter().enumerate() {
                    let other = edges.neighbour[e];
                    let d = network.rest_m[other as usize] - network.rest_m[node];
                    four.other[lane] = other;
                    four.rest[lane] = Node([d.x as f32, d.y as f32, d.z as f32, 0.0]);
                    four.stiffness[lane] = edges.stiffness_n_per_m[e] as f32;
                    four.preload[lane] = (edges.stiffness_n_per_m[e] * edges.rest_length_m[e]) as f32;
                }
                fours.push(four);
            }
            start[node + 1] = fours.len() as u32;
        }
        let nodes = vec![Node::default(); count + 1];
        Self { ends, start, fours, built_m: network.rest_m.clone(), shift: nodes.clone(), force: nodes }
    }

    /// The kernel of one sweep.
    pub(super) fn sweep<'a>(&'a mut self, position_m: &'a [Vec3], force_n: &'a mut [Vec3]) -> SingleSweep<'a> {
        SingleSweep { singles: self, position_m, force_n }
    }
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
        let Self { singles: Singles { ends, start, fours, built_m, shift, force }, position_m, force_n } = self;
        for ((u, x), built) in shift.iter_mut().zip(position_m).zip(&*built_m) {
            *u = Node([(x.x - built.x) as f32, (x.y - built.y) as f32, (x.z - built.z) as f32, 0.0]);
        }
        match ends {
            Ends::Lower => rows(lanes, start, fours, shift, force),
            Ends::Both => gather(lanes, start, fours, shift, force),
        }
        for (f, own) in force_n.iter_mut().zip(&*force) {
            *f = Vec3::new(f64::from(own.0[0]), f64::from(own.0[1]), f64::from(own.0[2]));
        }
    }
}

/// `d` of four springs of a node, and `k − k L/|d|` of each in all lanes.
#[inline(always)]
fn four_springs<L: Lanes>(lanes: L, four: &Four, own: L::Quad32, shift: &[Node]) -> ([L::Quad32; 4], [L::Quad32; 4]) {
    let [p, q, r, s] = four.other;
    let d = [
        lanes.add32(lanes.quad32(four.rest[0].0), lanes.sub32(lanes.quad32(shift[p as usize].0), own)),
        lanes.add32(lanes.quad32(four.rest[1].0), lanes.sub32(lanes.quad32(shift[q as usize].0), own)),
        lanes.add32(lanes.quad32(four.rest[2].0), lanes.sub32(lanes.quad32(shift[r as usize].0), own)),
        lanes.add32(lanes.quad32(four.rest[3].0), lanes.sub32(lanes.quad32(shift[s as usize].0), own)),
    ];
    let inverse = lanes.inverse_root_quad32(lanes.squares32(d, FLOOR));
    let scale = lanes.neg_mul_add32(lanes.quad32(four.preload), inverse, lanes.quad32(four.stiffness));
    (d, lanes.spread32(scale))
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, start: &[u32], fours: &[Four], shift: &[Node], force: &mut [Node]) {
    for (node, ends) in start.windows(2).enumerate() {
        let own = lanes.quad32(shift[node].0);
        let mut sum = lanes.quad32([0.0; 4]);
        for four in &fours[ends[0] as usize..ends[1] as usize] {
            let (d, scale) = four_springs(lanes, four, own, shift);
            for lane in 0..LANES {
                sum = lanes.mul_add32(scale[lane], d[lane], sum);
            }
        }
        force[node].0 = lanes.array32(sum);
    }
}

#[inline(always)]
fn rows<L: Lanes>(lanes: L, start: &[u32], fours: &[Four], shift: &[Node], force: &mut [Node]) {
    force.fill(Node::default());
    for (node, ends) in start.windows(2).enumerate() {
        let own = lanes.quad32(shift[node].0);
        let mut sum = lanes.quad32([0.0; 4]);
        for four in &fours[ends[0] as usize..ends[1] as usize] {
            let (d, scale) = four_springs(lanes, four, own, shift);
            for lane in 0..LANES {
                sum = lanes.mul_add32(scale[lane], d[lane], sum);
                let at = &mut force[four.other[lane] as usize].0;
                *at = lanes.array32(lanes.neg_mul_add32(scale[lane], d[lane], lanes.quad32(*at)));
            }
        }
        force[node].0 = lanes.array32(lanes.add32(lanes.quad32(force[node].0), sum));
    }
}
