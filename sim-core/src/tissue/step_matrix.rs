//! The matrix of an implicit step, `A = D + K(x)`, by springs: never stored as a matrix.
//!
//! `D` is the resistance of each node by mass and drag (`bdf2`), newtons per metre. `K` is the tangent of the springs at
//! `x`, kept per spring as `q = √(k (1 − g)) n` and `t = k g` with `g = max(1 − L/l, 0)`: `K` is never indefinite, a
//! compressed spring loses its transverse part only, one that pulls only is gone. A product costs one pass over the
//! springs; the preconditioner is the inverse of the 3 × 3 blocks on the diagonal. Rows and columns of nodes that may
//! not move are left out by a zero block. Deliberately absent: attachments and pairs (`couplings`), which add to blocks and products.

use crate::tissue::force::COINCIDENT_M;
use crate::tissue::network::SpringNetwork;
use crate::tissue::node::Node;
use crate::tissue::sweep::dispatch::{Kernel, KernelLevel, Lanes};
use crate::vector::Vec3;

/// A symmetric 3 × 3 block: xx, yy, zz, xy, xz, yz.
pub(crate) type Block = [f64; 6];

/// Adds `axial n nᵀ + transverse (I − n nᵀ)` to a block.
pub(crate) fn add_bar(block: &mut Block, n: &Vec3, axial: f64, transverse: f64) {
    let s = axial - transverse;
    block[0] += s * n.x * n.x + transverse;
    block[1] += s * n.y * n.y + transverse;
    block[2] += s * n.z * n.z + transverse;
    block[3] += s * n.x * n.y;
    block[4] += s * n.x * n.z;
    block[5] += s * n.y * n.z;
}

/// Tangent, resistance and preconditioner; all memory is kept.
#[derive(Clone, Debug)]
pub(crate) struct StepMatrix {
    /// First spring of each lower node, one more entry than nodes; springs lie in this order.
    start: Vec<u32>,
    upper: Vec<u32>,
    /// `q` and `t` by spring.
    along: Vec<Node>,
    transverse: Vec<f64>,
    /// `D`, newtons per metre; 0 where a node may not move.
    resistance: Vec<f64>,
    /// Most that a node resists with all its neighbours held: `D + Σ k`; 0 where it may not move.
    bound: Vec<f64>,
    blocks: Vec<Block>,
    /// Columns of the inverse blocks.
    inverse: Vec<[Node; 3]>,
}

impl StepMatrix {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        let nodes = network.node_count();
        let mut start = vec![0_u32; nodes + 1];
        for s in &network.springs {
            start[s.a as usize + 1] += 1;
        }
        for node in 0..nodes {
            start[node + 1] += start[node];
        }
        Self {
            start,
            upper: network.springs.iter().map(|s| s.b).collect(),
            along: vec![Node::default(); network.springs.len()],
            transverse: vec![0.0; network.springs.len()],
            resistance: vec![0.0; nodes],
            bound: vec![0.0; nodes],
            blocks: vec![[0.0; 6]; nodes],
            inverse: vec![[Node::default(); 3]; nodes],
        }
    }

    /// Sets `D = m · per_mass + c · per_drag` of the nodes that may move.
    pub(crate) fn resist(&mut self, network: &SpringNetwork, mobility_m_per_n: &[f64], per_mass: f64, per_drag: f64) {
        for (node, &mobility) in mobility_m_per_n.iter().enumerate() {
            let own = network.mass_kg[node] * per_mass + network.drag_n_s_per_m[node] * per_drag;
            let edges = &network.half_edges;
            let springs: f64 = edges.stiffness_n_per_m[edges.row(node)].iter().sum();
            let moves = mobility > 0.0;
            self.resistance[node] = if moves { own } else { 0.0 };
            self.bound[node] = if moves { own + springs } else { 0.0 };
        }
    }

    /// `D`, newtons per metre.
    pub(crate) fn resistance(&self) -> &[f64] {
        &self.resistance
    }

    /// `D + Σ k`, newtons per metre.
    pub(crate) fn bound(&self) -> &[f64] {
        &self.bound
    }

    /// Tangent of the springs and blocks on the diagonal at `position_m`.
    pub(crate) fn assemble(&mut self, network: &SpringNetwork, position_m: &[Vec3]) {
        for (block, &d) in self.blocks.iter_mut().zip(&self.resistance) {
            *block = [d, d, d, 0.0, 0.0, 0.0];
        }
        let mut pulls_only = network.pulls_only.iter().peekable();
        let bars = self.along.iter_mut().zip(&mut self.transverse).zip(&network.springs);
        for (index, ((along, kept), s)) in bars.enumerate() {
            let d = position_m[s.b as usize] - position_m[s.a as usize];
            let length = d.norm().max(COINCIDENT_M);
            if pulls_only.next_if(|&&spring| spring as usize == index).is_some() && length < s.rest_length_m {
                (*along, *kept) = (Node::default(), 0.0);
                continue;
            }
            let g = (1.0 - s.rest_length_m / length).max(0.0);
            let (axial, transverse) = (s.stiffness_n_per_m * (1.0 - g), s.stiffness_n_per_m * g);
            *along = Node::from(&(d * (axial.sqrt() / length)));
            *kept = transverse;
            let mut own = [0.0; 6];
            add_bar(&mut own, &(d / length), s.stiffness_n_per_m, transverse);
            for end in [s.a, s.b] {
                self.blocks[end as usize].iter_mut().zip(&own).for_each(|(sum, part)| *sum += part);
            }
        }
    }

    /// Block of a node, for what else holds it.
    pub(crate) fn block_mut(&mut self, node: u32) -> &mut Block {
        &mut self.blocks[node as usize]
    }

    /// Inverts the blocks: the preconditioner.
    pub(crate) fn invert(&mut self) {
        for ((columns, block), &bound) in self.inverse.iter_mut().zip(&self.blocks).zip(&self.bound) {
            let [xx, yy, zz, xy, xz, yz] = if bound > 0.0 { inverse(block) } else { [0.0; 6] };
            *columns = [Node([xx, xy, xz, 0.0]), Node([xy, yy, yz, 0.0]), Node([xz, yz, zz, 0.0])];
        }
    }

    /// `image = A v`.
    pub(crate) fn multiply(&self, v: &[Node], image: &mut [Node]) {
        KernelLevel::Best.for_quads().run(Product { matrix: self, v, image });
    }

    /// `z = M⁻¹ r` with the inverse blocks; returns `r · z`.
    pub(crate) fn precondition(&self, r: &[Node], z: &mut [Node]) -> f64 {
        KernelLevel::Best.for_quads().run(Precondition { inverse: &self.inverse, r, z })
    }
}

struct Product<'a> {
    matrix: &'a StepMatrix,
    v: &'a [Node],
    image: &'a mut [Node],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { matrix: StepMatrix { start, upper, along, transverse, resistance, .. }, v, image } = self;
        for ((out, v), &d) in image.iter_mut().zip(v).zip(resistance) {
            out.0 = lanes.array(lanes.mul(lanes.quad(v.0), lanes.quad([d; 4])));
        }
        for (a, ends) in start.windows(2).enumerate() {
            let row = ends[0] as usize..ends[1] as usize;
            let x = lanes.quad(v[a].0);
            let mut own = lanes.quad([0.0; 4]);
            for ((&b, along), &t) in upper[row.clone()].iter().zip(&along[row.clone()]).zip(&transverse[row]) {
                let (d, along) = (lanes.sub(lanes.quad(v[b as usize].0), x), lanes.quad(along.0));
                let f = lanes.mul_add(along, lanes.dots(along, d), lanes.mul(d, lanes.quad([t; 4])));
                own = lanes.add(own, f);
                let at = &mut image[b as usize].0;
                *at = lanes.array(lanes.add(lanes.quad(*at), f));
            }
            let at = &mut image[a].0;
            *at = lanes.array(lanes.sub(lanes.quad(*at), own));
        }
    }
}

struct Precondition<'a> {
    inverse: &'a [[Node; 3]],
    r: &'a [Node],
    z: &'a mut [Node],
}

impl Kernel for Precondition<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let mut sum = lanes.quad([0.0; 4]);
        for ((z, r), [x, y, w]) in self.z.iter_mut().zip(self.r).zip(self.inverse) {
            let part = lanes.mul(lanes.quad(x.0), lanes.quad([r.0[0]; 4]));
            let part = lanes.mul_add(lanes.quad(y.0), lanes.quad([r.0[1]; 4]), part);
            let part = lanes.mul_add(lanes.quad(w.0), lanes.quad([r.0[2]; 4]), part);
            z.0 = lanes.array(part);
            sum = lanes.mul_add(part, lanes.quad(r.0), sum);
        }
        let [x, y, z, _] = lanes.array(sum);
        x + y + z
    }
}

/// Below this share of the product of its diagonal a determinant is rounding.
const LEAST_DETERMINANT: f64 = 1e-13;

/// Inverse of a symmetric positive block, scaled first so that no product leaves the range of numbers; of its diagonal where
/// rounding has left no determinant (a node on one spring that is very much stiffer than what else holds it).
fn inverse(block: &Block) -> Block {
    let scale = 1.0 / (block[0] + block[1] + block[2]);
    let [xx, yy, zz, xy, xz, yz] = block.map(|v| v * scale);
    let (cxx, cxy, cxz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let determinant = xx * cxx + xy * cxy + xz * cxz;
    if determinant <= LEAST_DETERMINANT * xx * yy * zz {
        return [scale / xx, scale / yy, scale / zz, 0.0, 0.0, 0.0];
    }
    let by = scale / determinant;
    let minors = [cxx, xx * zz - xz * xz, xx * yy - xy * xy, cxy, cxz, xy * xz - xx * yz];
    minors.map(|m| m * by)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::force::spring_stiffness;
    use crate::tissue::network::{Spring, SpringFamily};
    use crate::vector::Mat3;

    /// Four nodes, five springs, one node held.
    fn network() -> SpringNetwork {
        let x = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.1, 0.3], [0.9, 0.8, 1.0]].map(Vec3::from).to_vec();
        let spring = |a: u32, b: u32| Spring {
            a,
            b,
            stiffness_n_per_m: 100.0 + 10.0 * f64::from(a + b),
            rest_length_m: if b == 3 { 2.0 } else { 0.8 },
            family: SpringFamily::Structural,
        };
        let springs = vec![spring(0, 1), spring(0, 2), spring(1, 2), spring(1, 3), spring(2, 3)];
        SpringNetwork::new(x, vec![1e-3, 2e-3, 3e-3, 4e-3], vec![0.5; 4], vec![0, 0, 0, 1], springs).unwrap()
    }

    fn dense(network: &SpringNetwork, v: &[Vec3]) -> Vec<Vec3> {
        let x = &network.rest_m;
        let mut image: Vec<Vec3> = (0..4).map(|i| v[i] * (network.mass_kg[i] * 1e6 + 0.5 * 1e3)).collect();
        for s in &network.springs {
            let (a, b) = (s.a as usize, s.b as usize);
            let k: Mat3 = spring_stiffness(&x[a], &x[b], s.stiffness_n_per_m, s.rest_length_m);
            image[a] += k * (v[a] - v[b]);
            image[b] += k * (v[b] - v[a]);
        }
        image
    }

    #[test]
    fn the_product_is_that_of_the_assembled_tangent() {
        let network = network();
        let mut matrix = StepMatrix::new(&network);
        matrix.resist(&network, &[1.0, 1.0, 1.0, 0.0], 1e6, 1e3);
        matrix.assemble(&network, &network.rest_m);
        let v = [[0.3, -0.2, 0.5], [0.1, 0.7, -0.4], [-0.6, 0.2, 0.1], [0.0; 3]].map(Vec3::from);
        let mut image = vec![Node::default(); 4];
        matrix.multiply(&v.map(|v| Node::from(&v)), &mut image);
        for (node, expected) in dense(&network, &v).iter().enumerate().take(3) {
            // A few products of about 1e3.
            assert!((image[node].vector() - expected).norm() < 1e-10, "{node}: {:?} / {expected}", image[node]);
        }
    }

    #[test]
    fn a_node_on_one_very_stiff_spring_keeps_a_positive_preconditioner() {
        let n = Vec3::new(0.36, 0.48, 0.8);
        for tiny in [1e-6, 1e-8, 1e-10, 1e-14] {
            let mut block = [tiny, tiny, tiny, 0.0, 0.0, 0.0];
            add_bar(&mut block, &n, 1.0, 0.0);
            let [xx, yy, zz, xy, xz, yz] = inverse(&block);
            let full = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            for r in [Vec3::x(), Vec3::new(0.8, -0.6, 0.0), n] {
                assert!(r.dot(&(full * r)) > 0.0, "{tiny}: {full}");
            }
        }
    }

    #[test]
    fn the_preconditioner_is_exact_where_only_one_node_moves() {
        let network = network();
        let mut matrix = StepMatrix::new(&network);
        matrix.resist(&network, &[0.0, 0.0, 1.0, 0.0], 1e6, 1e3);
        matrix.assemble(&network, &network.rest_m);
        matrix.invert();
        let v = [[0.0; 3], [0.0; 3], [-0.6, 0.2, 0.1], [0.0; 3]].map(Vec3::from);
        let image: Vec<Node> = dense(&network, &v).iter().map(Node::from).collect();
        let mut z = vec![Node([9.0; 4]); 4];
        let energy = matrix.precondition(&image, &mut z);
        // One inverse of a block of about 1e3.
        assert!((z[2].vector() - v[2]).norm() < 1e-12 && z[0] == Node::default() && z[3] == Node::default(), "{z:?}");
        assert!((energy - image[2].vector().dot(&v[2])).abs() < 1e-9);
    }
}
