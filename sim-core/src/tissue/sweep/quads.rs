//! Force sweeps over springs in any order, four side by side: rows (each spring once, by its lower node), gather (each
//! spring from both ends) and edges (each spring once, in an order that keeps springs of one node apart).
//!
//! A node is four numbers, x y z 0, one 256-bit register. `f = (k − k L/|d|) d`, `F_a += f`, `F_b −= f` (Zhang et al.,
//! Eq. (3), second line). Places without a spring hold `k = k L = 0` and point to a node beyond the last one, which
//! lies where no node comes near.

use super::dispatch::{Kernel, Lanes};
use crate::tissue::force::COINCIDENT_M;
use crate::tissue::network::Spring;
use crate::tissue::node::Node;
use crate::vector::Vec3;

/// Springs side by side.
const LANES: usize = 4;
/// Where the node beyond the last one lies.
pub(super) const BEYOND_M: f64 = 1.0e6;

/// Four springs: their upper nodes, stiffness (N/m) and `k L` (N).
#[derive(Clone, Copy, Debug)]
pub(super) struct Four {
    upper: [u32; LANES],
    stiffness: [f64; LANES],
    preload: [f64; LANES],
}

impl Four {
    fn new(springs: &[(u32, Spring)], beyond: u32) -> Self {
        let at = |lane: usize| springs.get(lane);
        Self {
            upper: std::array::from_fn(|lane| at(lane).map_or(beyond, |s| s.0)),
            stiffness: std::array::from_fn(|lane| at(lane).map_or(0.0, |s| s.1.stiffness_n_per_m)),
            preload: std::array::from_fn(|lane| at(lane).map_or(0.0, |s| s.1.stiffness_n_per_m * s.1.rest_length_m)),
        }
    }
}

/// How the springs are visited.
#[derive(Clone, Debug)]
enum Order {
    /// Fours of each node, each spring once.
    Rows(Vec<u32>),
    /// Fours of each node, each spring from both ends.
    Gather(Vec<u32>),
    /// Lower nodes of each four.
    Edges(Vec<[u32; LANES]>),
}

/// Springs in fours, with the nodes they touch.
#[derive(Clone, Debug)]
pub(super) struct Quads {
    order: Order,
    fours: Vec<Four>,
    /// Node of the network by own number; `None` when they are the same.
    nodes: Option<Vec<u32>>,
    position: Vec<Node>,
    force: Vec<Node>,
    springs: usize,
}

impl Quads {
    /// Each spring once, by its lower node.
    pub(super) fn rows(springs: &[Spring], nodes: usize) -> Self {
        let ends = springs.iter().map(|s| (s.a, (s.b, *s))).collect();
        let (start, fours) = by_node(ends, nodes);
        Self::new(Order::Rows(start), fours, None, nodes, springs.len())
    }

    /// Each spring from both ends.
    pub(super) fn gather(springs: &[Spring], nodes: usize) -> Self {
        let ends = springs.iter().flat_map(|s| [(s.a, (s.b, *s)), (s.b, (s.a, *s))]).collect();
        let (start, fours) = by_node(ends, nodes);
        Self::new(Order::Gather(start), fours, None, nodes, springs.len())
    }

    /// Each spring once, in rounds that take one spring of each lower node; only the nodes they touch.
    pub(super) fn edges(springs: &[Spring]) -> Self {
        let mut nodes: Vec<u32> = springs.iter().flat_map(|s| [s.a, s.b]).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let own = |node: u32| nodes.partition_point(|n| *n < node) as u32;
        let mut rounds: Vec<(u32, u32, Spring)> = Vec::with_capacity(springs.len());
        for row in springs.chunk_by(|s, t| s.a == t.a) {
            rounds.extend(row.iter().zip(0..).map(|(s, round)| (round, own(s.a), *s)));
        }
        rounds.sort_by_key(|r| (r.0, r.1));
        let beyond = nodes.len() as u32;
        let (mut lower, mut fours) = (Vec::new(), Vec::new());
        for four in rounds.chunks(LANES) {
            let uppers: Vec<_> = four.iter().map(|(_, _, s)| (own(s.b), *s)).collect();
            lower.push(std::array::from_fn(|lane| four.get(lane).map_or(0, |s| s.1)));
            fours.push(Four::new(&uppers, beyond));
        }
        let count = nodes.len();
        Self::new(Order::Edges(lower), fours, Some(nodes), count, springs.len())
    }

    fn new(order: Order, fours: Vec<Four>, nodes: Option<Vec<u32>>, count: usize, springs: usize) -> Self {
        let mut position = vec![Node::default(); count + 1];
        position[count] = Node([BEYOND_M, BEYOND_M, BEYOND_M, 0.0]);
        Self { order, fours, nodes, position, force: vec![Node::default(); count + 1], springs }
    }

    /// Springs.
    pub(super) fn springs(&self) -> usize {
        self.springs
    }

    /// The kernel of one sweep.
    pub(super) fn sweep<'a>(&'a mut self, position_m: &'a [Vec3], force_n: &'a mut [Vec3]) -> QuadSweep<'a> {
        QuadSweep { quads: self, position_m, force_n }
    }
}

/// Springs (with their other end) by node, in fours.
pub(super) fn by_node(mut ends: Vec<(u32, (u32, Spring))>, nodes: usize) -> (Vec<u32>, Vec<Four>) {
    ends.sort_by_key(|e| (e.0, e.1.0));
    let (mut start, mut fours) = (vec![0_u32; nodes + 1], Vec::new());
    let mut rest = &ends[..];
    for node in 0..nodes {
        let (own, others) = rest.split_at(rest.partition_point(|e| e.0 as usize <= node));
        for four in own.chunks(LANES) {
            let springs: Vec<_> = four.iter().map(|e| e.1).collect();
            fours.push(Four::new(&springs, nodes as u32));
        }
        start[node + 1] = fours.len() as u32;
        rest = others;
    }
    (start, fours)
}

/// One sweep. All nodes: writes their forces. Some nodes: adds to theirs. Returns the least squared distance it met.
pub(super) struct QuadSweep<'a> {
    quads: &'a mut Quads,
    position_m: &'a [Vec3],
    force_n: &'a mut [Vec3],
}

impl Kernel for QuadSweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let Self { quads: Quads { order, fours, nodes, position, force, .. }, position_m, force_n } = self;
        match nodes {
            None => position.iter_mut().zip(position_m).for_each(|(own, p)| *own = Node::from(p)),
            Some(nodes) => {
                position.iter_mut().zip(&*nodes).for_each(|(own, &n)| *own = Node::from(&position_m[n as usize]));
            }
        }
        let least = match order {
            Order::Rows(start) => rows(lanes, start, fours, position, force),
            Order::Gather(start) => gather(lanes, start, fours, position, force),
            Order::Edges(lower) => edges(lanes, lower, fours, position, force),
        };
        match nodes {
            None => {
                force_n.iter_mut().zip(&*force).for_each(|(f, own)| *f = own.vector());
            }
            Some(nodes) => {
                for (own, &n) in force.iter().zip(&*nodes) {
                    force_n[n as usize] += own.vector();
                }
            }
        }
        lanes.array(least).into_iter().fold(f64::MAX, f64::min)
    }
}

/// Four nodes.
#[inline(always)]
fn ends_of<L: Lanes>(lanes: L, nodes: &[u32; 4], position: &[Node]) -> [L::Quad; 4] {
    [
        lanes.quad(position[nodes[0] as usize].0),
        lanes.quad(position[nodes[1] as usize].0),
        lanes.quad(position[nodes[2] as usize].0),
        lanes.quad(position[nodes[3] as usize].0),
    ]
}

/// `k − k L/|d|` of four springs.
#[inline(always)]
fn scale<L: Lanes>(lanes: L, squared: L::Quad, four: &Four) -> L::Quad {
    let floored = lanes.max(squared, lanes.quad([COINCIDENT_M * COINCIDENT_M; 4]));
    lanes.neg_mul_add(lanes.quad(four.preload), lanes.inverse_root_quad(floored), lanes.quad(four.stiffness))
}

/// The same, each in all lanes.
#[inline(always)]
fn scales<L: Lanes>(lanes: L, d: [L::Quad; 4], four: &Four, least: &mut L::Quad) -> [L::Quad; 4] {
    let squared = lanes.squares(d);
    *least = lanes.min(*least, squared);
    lanes.spread(scale(lanes, squared, four))
}

#[inline(always)]
fn rows<L: Lanes>(lanes: L, start: &[u32], fours: &[Four], position: &[Node], force: &mut [Node]) -> L::Quad {
    force.fill(Node::default());
    let mut least = lanes.quad([f64::MAX; 4]);
    for (node, ends) in start.windows(2).enumerate() {
        let x = lanes.quad(position[node].0);
        let mut own = lanes.quad([0.0; 4]);
        for four in &fours[ends[0] as usize..ends[1] as usize] {
            let [p, q, r, s] = ends_of(lanes, &four.upper, position);
            let d = [lanes.sub(p, x), lanes.sub(q, x), lanes.sub(r, x), lanes.sub(s, x)];
            let scale = scales(lanes, d, four, &mut least);
            for lane in 0..LANES {
                own = lanes.mul_add(scale[lane], d[lane], own);
                let at = &mut force[four.upper[lane] as usize].0;
                *at = lanes.array(lanes.neg_mul_add(scale[lane], d[lane], lanes.quad(*at)));
            }
        }
        let sum = lanes.mul_add(own, lanes.quad([1.0; 4]), lanes.quad(force[node].0));
        force[node].0 = lanes.array(sum);
    }
    least
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, start: &[u32], fours: &[Four], position: &[Node], force: &mut [Node]) -> L::Quad {
    let mut least = lanes.quad([f64::MAX; 4]);
    for (node, ends) in start.windows(2).enumerate() {
        let row = &fours[ends[0] as usize..ends[1] as usize];
        force[node] = row_force(lanes, &position[node], row, position, &mut least);
    }
    least
}

/// Force on the node at `own` by the springs of its row.
#[inline(always)]
pub(super) fn row_force<L: Lanes>(lanes: L, own: &Node, row: &[Four], position: &[Node], least: &mut L::Quad) -> Node {
    let own = lanes.quad(own.0);
    let zero = lanes.quad([0.0; 4]);
    let (mut x, mut y, mut z) = (zero, zero, zero);
    for four in row {
        let [p, q, r, s] = ends_of(lanes, &four.upper, position);
        let [dx, dy, dz] = lanes.axes([lanes.sub(p, own), lanes.sub(q, own), lanes.sub(r, own), lanes.sub(s, own)]);
        let squared = lanes.mul_add(dx, dx, lanes.mul_add(dy, dy, lanes.mul_add(dz, dz, zero)));
        *least = lanes.min(*least, squared);
        let scale = scale(lanes, squared, four);
        x = lanes.mul_add(scale, dx, x);
        y = lanes.mul_add(scale, dy, y);
        z = lanes.mul_add(scale, dz, z);
    }
    Node(lanes.sums([x, y, z]))
}

#[inline(always)]
fn edges<L: Lanes>(lanes: L, lower: &[[u32; 4]], fours: &[Four], position: &[Node], force: &mut [Node]) -> L::Quad {
    force.fill(Node::default());
    let mut least = lanes.quad([f64::MAX; 4]);
    for (lower, four) in lower.iter().zip(fours) {
        let (from, to) = (ends_of(lanes, lower, position), ends_of(lanes, &four.upper, position));
        let d = [
            lanes.sub(to[0], from[0]),
            lanes.sub(to[1], from[1]),
            lanes.sub(to[2], from[2]),
            lanes.sub(to[3], from[3]),
        ];
        let scale = scales(lanes, d, four, &mut least);
        for lane in 0..LANES {
            let at = &mut force[lower[lane] as usize].0;
            *at = lanes.array(lanes.mul_add(scale[lane], d[lane], lanes.quad(*at)));
            let at = &mut force[four.upper[lane] as usize].0;
            *at = lanes.array(lanes.neg_mul_add(scale[lane], d[lane], lanes.quad(*at)));
        }
    }
    least
}
