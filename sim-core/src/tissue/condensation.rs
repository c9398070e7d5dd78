//! Step stiffness of a patch: the tissue's resistance to a rigid shift of the patch within one period.
//!
//! With `A = M/H² + C/H + K` on the nodes `r` around the patch (links and pairs in `K`) and `P` the three
//! shifts of the patch `p`: `S = Pᵀ K_pp P − Gᵀ A_rr⁻¹ G`, `G = −A_rp P`; the patch's own `M/H² + C/H` is left
//! out. `H` is the period, with BDF2 two thirds of it: its step resists more. Nodes beyond the rings are held, which
//! over-estimates `S`: the safe side. Three conjugate-gradient solves run side by side, block-Jacobi preconditioned,
//! started from the last solution; `Gᵀ X + Xᵀ R` is never above `Gᵀ A⁻¹ G`, so an early end over-estimates too.
//! Deliberately absent: a factorisation.

use crate::tissue::force::{acts, spring_stiffness};
use crate::tissue::patch_set::PatchId;
use crate::tissue::port::{PortParams, PortView};
use crate::vector::{Mat3, Vec3};

/// Marks a node outside the subdomain.
const ABSENT: u32 = u32::MAX;

/// A hard link counts as this many times its follower's own step stiffness: hard to 1 %, and still
/// well conditioned.
const HARD_RATIO: f64 = 100.0;

/// Subdomain around one patch with its step matrix and last solution; all memory is kept.
#[derive(Clone, Debug)]
pub(crate) struct Condensation {
    /// Local index by node.
    local: Vec<u32>,
    /// Nodes that give way.
    nodes: Vec<u32>,
    /// Off-diagonal entries in compressed rows: other end (local) and half-spring.
    start: Vec<u32>,
    other: Vec<u32>,
    half_spring: Vec<u32>,
    block: Vec<Mat3>,
    diagonal: Vec<Mat3>,
    inverse: Vec<Mat3>,
    /// `G` and the CG vectors: per node a 3 × 3 block, one column per shift.
    coupling: Vec<Mat3>,
    solution: Vec<Mat3>,
    residual: Vec<Mat3>,
    search: Vec<Mat3>,
    image: Vec<Mat3>,
}

/// What a condensation found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Condensed {
    /// Step stiffness, newtons per metre.
    pub(crate) step: Mat3,
    /// Stiffness with everything around the patch held, links and pairs included.
    pub(crate) held: Mat3,
}

impl Condensation {
    pub(crate) fn new(node_count: usize) -> Self {
        let none = Vec::new;
        Self {
            local: vec![ABSENT; node_count],
            nodes: Vec::new(),
            start: Vec::new(),
            other: Vec::new(),
            half_spring: Vec::new(),
            block: none(),
            diagonal: none(),
            inverse: none(),
            coupling: none(),
            solution: none(),
            residual: none(),
            search: none(),
            image: none(),
        }
    }

    /// Chooses the nodes that give way: free nodes within `rings` springs of the patch.
    pub(crate) fn enclose(&mut self, patch: PatchId, view: &PortView<'_>, rings: u32) {
        let edges = &view.network.half_edges;
        for node in self.nodes.drain(..) {
            self.local[node as usize] = ABSENT;
        }
        let mut first = 0;
        for ring in 0..rings {
            let last = self.nodes.len();
            let seeds = if ring == 0 { view.patches.nodes(patch).len() } else { last - first };
            for seed in 0..seeds {
                let node = if ring == 0 { view.patches.nodes(patch)[seed] } else { self.nodes[first + seed] };
                for e in edges.row(node as usize) {
                    let other = edges.neighbour[e];
                    if view.mobility_m_per_n[other as usize] > 0.0 && self.local[other as usize] == ABSENT {
                        self.local[other as usize] = self.nodes.len() as u32;
                        self.nodes.push(other);
                    }
                }
            }
            first = last;
        }
        self.start.clear();
        self.other.clear();
        self.half_spring.clear();
        self.start.push(0);
        for &node in &self.nodes {
            for e in edges.row(node as usize) {
                let other = self.local[edges.neighbour[e] as usize];
                if other != ABSENT {
                    self.other.push(other);
                    self.half_spring.push(e as u32);
                }
            }
            self.start.push(self.other.len() as u32);
        }
        let count = self.nodes.len();
        self.block.clear();
        self.block.resize(self.other.len(), Mat3::zeros());
        for vector in [
            &mut self.diagonal,
            &mut self.inverse,
            &mut self.coupling,
            &mut self.solution,
            &mut self.residual,
            &mut self.search,
            &mut self.image,
        ] {
            vector.clear();
            vector.resize(count, Mat3::zeros());
        }
    }

    /// Step stiffness at the current state; `ring` is the one-ring stiffness of the springs alone.
    pub(crate) fn condense(
        &mut self,
        patch: PatchId,
        ring: Mat3,
        view: &PortView<'_>,
        params: &PortParams,
    ) -> Condensed {
        self.assemble(patch, view);
        let mut found = Condensed { step: ring, held: ring };
        self.add_links(patch, view, &mut found);
        add_pairs(patch, view, &mut found);
        for (inverse, diagonal) in self.inverse.iter_mut().zip(&self.diagonal) {
            *inverse = diagonal.try_inverse().unwrap_or_else(Mat3::zeros);
        }
        self.solve(params);
        let gives = self.coupling.iter().zip(&self.solution).zip(&self.residual);
        let relief = gives.fold(Mat3::zeros(), |sum, ((g, x), r)| sum + g.transpose() * x + x.transpose() * r);
        found.step -= relief;
        found.step = (found.step + found.step.transpose()) * 0.5;
        found
    }

    /// Blocks of the springs, mass and drag.
    fn assemble(&mut self, patch: PatchId, view: &PortView<'_>) {
        let members = view.patches.nodes(patch);
        for (row, &node) in self.nodes.iter().enumerate() {
            let mut slot = self.start[row] as usize;
            let mut diagonal = Mat3::identity() * own_stiffness(node, view);
            let mut coupling = Mat3::zeros();
            for e in view.network.half_edges.row(node as usize) {
                let (other, stiffness) = half_spring_stiffness(node, e, view);
                diagonal += stiffness;
                if self.local[other as usize] != ABSENT {
                    self.block[slot] = stiffness;
                    slot += 1;
                } else if members.contains(&other) {
                    coupling += stiffness;
                }
            }
            self.diagonal[row] = diagonal;
            self.coupling[row] = coupling;
        }
    }

    /// Links that pull: those of this patch couple it to its followers, the others hold theirs.
    fn add_links(&mut self, patch: PatchId, view: &PortView<'_>, found: &mut Condensed) {
        let Some(attachments) = view.attachments else { return };
        for attachment in 0..attachments.len() {
            let own = attachments.patch(attachment) == patch;
            for link in attachments.pulling(attachment) {
                let stiffness = attachments.stiffness_n_per_m(link, view.network, view.substep_s);
                let k = stiffness.min(HARD_RATIO * own_stiffness(link.node, view));
                let n = link.direction;
                let pull = n * n.transpose() * k;
                let row = self.local[link.node as usize];
                if row != ABSENT {
                    self.diagonal[row as usize] += pull;
                }
                if !own {
                    continue;
                }
                found.held += pull;
                if row == ABSENT {
                    let gives = local_mobility(link.node, n, view);
                    found.step += n * n.transpose() / (1.0 / k + gives);
                } else {
                    found.step += pull;
                    self.coupling[row as usize] += pull;
                }
            }
        }
    }

    /// `A X = G`, all three columns at once.
    fn solve(&mut self, params: &PortParams) {
        let goal = column_dots(&self.coupling, &self.coupling) * (params.tolerance * params.tolerance);
        self.multiply(Operand::Solution);
        for (row, r) in self.residual.iter_mut().enumerate() {
            *r = self.coupling[row] - self.image[row];
        }
        let mut energy = Vec3::zeros();
        for iteration in 0..params.max_iterations {
            if column_dots(&self.residual, &self.residual).iter().zip(goal.iter()).all(|(r, g)| r <= g) {
                return;
            }
            let mut next = Vec3::zeros();
            for (inverse, r) in self.inverse.iter().zip(&self.residual) {
                next += column_dot(r, &(inverse * r));
            }
            let keep = if iteration == 0 { Vec3::zeros() } else { ratio(&next, &energy) };
            energy = next;
            for (row, search) in self.search.iter_mut().enumerate() {
                *search = self.inverse[row] * self.residual[row] + scale_columns(search, &keep);
            }
            self.multiply(Operand::Search);
            let step = ratio(&energy, &column_dots(&self.search, &self.image));
            for row in 0..self.nodes.len() {
                self.solution[row] += scale_columns(&self.search[row], &step);
                self.residual[row] -= scale_columns(&self.image[row], &step);
            }
        }
    }

    /// `image = A · operand`.
    fn multiply(&mut self, operand: Operand) {
        let v = match operand {
            Operand::Solution => &self.solution,
            Operand::Search => &self.search,
        };
        for (row, image) in self.image.iter_mut().enumerate() {
            let mut sum = self.diagonal[row] * v[row];
            for entry in self.start[row] as usize..self.start[row + 1] as usize {
                sum -= self.block[entry] * v[self.other[entry] as usize];
            }
            *image = sum;
        }
    }
}

/// Which vector to multiply.
#[derive(Clone, Copy)]
enum Operand {
    Solution,
    Search,
}

/// Pairs that act on the patch, with the other patch giving way by itself. When the other is prescribed too, its
/// own port sees the same pair: the two ports together must bear `[[K, −K], [−K, K]] ≤ diag(2K, 2K)`, so each
/// takes `2K`.
fn add_pairs(patch: PatchId, view: &PortView<'_>, found: &mut Condensed) {
    let Some(pairs) = view.pairs else { return };
    for (other, n, stiffness) in pairs.acting_on(patch) {
        let members = view.patches.nodes(other).iter().zip(view.patches.weights(other));
        let gives = members.fold(0.0, |sum, (&node, &w)| sum + w * w * local_mobility(node, n, view));
        let limit = if gives > 0.0 { HARD_RATIO / gives } else { view.hard_limit_n_per_m(patch) };
        let shared = if gives > 0.0 { 1.0 } else { 2.0 };
        let k = shared * stiffness.min(limit);
        found.held += n * n.transpose() * k;
        found.step += n * n.transpose() / (1.0 / k + gives);
    }
}

impl PortView<'_> {
    /// Stiffest pair between two prescribed patches, from the mass and drag of this one.
    fn hard_limit_n_per_m(&self, patch: PatchId) -> f64 {
        HARD_RATIO * self.patches.nodes(patch).iter().map(|&n| own_stiffness(n, self)).sum::<f64>()
    }
}

/// `m/H² + c/H` of a node.
fn own_stiffness(node: u32, view: &PortView<'_>) -> f64 {
    let h = view.resisting_s;
    view.network.mass_kg[node as usize] / (h * h) + view.network.drag_n_s_per_m[node as usize] / h
}

/// Displacement of a node along `n` per newton in one period, with all its neighbours held.
fn local_mobility(node: u32, n: Vec3, view: &PortView<'_>) -> f64 {
    if view.mobility_m_per_n[node as usize] == 0.0 {
        return 0.0;
    }
    let own = Mat3::identity() * own_stiffness(node, view);
    let row = view.network.half_edges.row(node as usize);
    let held = row.fold(own, |sum, e| sum + half_spring_stiffness(node, e, view).1);
    held.try_inverse().map_or(0.0, |inverse| n.dot(&(inverse * n)))
}

/// Other end and tangent of a half-spring.
fn half_spring_stiffness(node: u32, half_spring: usize, view: &PortView<'_>) -> (u32, Mat3) {
    let edges = &view.network.half_edges;
    let other = edges.neighbour[half_spring];
    let (x, y) = (&view.position_m[node as usize], &view.position_m[other as usize]);
    if !acts(edges, half_spring, x, y) {
        return (other, Mat3::zeros());
    }
    (other, spring_stiffness(x, y, edges.stiffness_n_per_m[half_spring], edges.rest_length_m[half_spring]))
}

fn column_dot(a: &Mat3, b: &Mat3) -> Vec3 {
    Vec3::new(a.column(0).dot(&b.column(0)), a.column(1).dot(&b.column(1)), a.column(2).dot(&b.column(2)))
}

fn column_dots(a: &[Mat3], b: &[Mat3]) -> Vec3 {
    a.iter().zip(b).fold(Vec3::zeros(), |sum, (a, b)| sum + column_dot(a, b))
}

fn scale_columns(m: &Mat3, by: &Vec3) -> Mat3 {
    m * Mat3::from_diagonal(by)
}

/// Quotients, 0 where a column is done.
fn ratio(a: &Vec3, b: &Vec3) -> Vec3 {
    a.zip_map(b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}
