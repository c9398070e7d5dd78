//! The plain C kernels (`plain.c`) with the arrays they work on, safe to call.
//!
//! Every array is built here from a validated network, so that its length fits what the C code reads and writes.

#![expect(unsafe_code, reason = "C functions are called; nothing else in the package needs it")]

use sim_core::tissue::network::SpringNetwork;

/// Share of its places that a diagonal must fill to be part of the C stencil.
const LEAST_FILL: f64 = 0.3;

// SAFETY: the signatures are those of plain.c, which is compiled into this package.
unsafe extern "C" {
    fn plain_edges_f64(
        nodes: usize,
        springs: usize,
        a: *const u32,
        b: *const u32,
        k: *const f64,
        rest: *const f64,
        x: *const f64,
        f: *mut f64,
    );
    fn plain_gather_f64(
        nodes: usize,
        start: *const u32,
        other: *const u32,
        k: *const f64,
        rest: *const f64,
        x: *const f64,
        f: *mut f64,
    );
    fn plain_gather_f32(
        nodes: usize,
        start: *const u32,
        other: *const u32,
        k: *const f32,
        rest: *const f32,
        x: *const f32,
        f: *mut f32,
    );
    fn plain_stencil_f64(
        nodes: usize,
        diagonals: usize,
        offset: *const usize,
        k: *const f64,
        rest: *const f64,
        x: *const f64,
        f: *mut f64,
    );
    fn plain_stencil_f32(
        nodes: usize,
        diagonals: usize,
        offset: *const usize,
        k: *const f32,
        rest: *const f32,
        x: *const f32,
        f: *mut f32,
    );
}

/// One of the C kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plain {
    /// Each spring once, scattered to both ends.
    EdgesDouble,
    /// Each spring from both ends, by compressed rows.
    GatherDouble,
    /// The same in single precision.
    GatherSingle,
    /// Each spring from both ends, along diagonals.
    StencilDouble,
    /// The same in single precision.
    StencilSingle,
}

impl Plain {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::EdgesDouble, Self::GatherDouble, Self::GatherSingle, Self::StencilDouble, Self::StencilSingle];
}

/// Springs and places of one precision, as C takes them.
#[derive(Debug)]
struct Arrays<T> {
    k: Vec<T>,
    rest: Vec<T>,
    half_k: Vec<T>,
    half_rest: Vec<T>,
    diagonal_k: Vec<T>,
    diagonal_rest: Vec<T>,
    /// Node by node.
    x: Vec<T>,
    /// Coordinate by coordinate.
    columns: Vec<T>,
    force: Vec<T>,
}

/// A network as the C kernels take it.
#[derive(Debug)]
pub struct PlainKernels {
    nodes: usize,
    a: Vec<u32>,
    b: Vec<u32>,
    start: Vec<u32>,
    other: Vec<u32>,
    offset: Vec<usize>,
    on_diagonals: usize,
    double: Arrays<f64>,
    single: Arrays<f32>,
}

impl PlainKernels {
    /// Lays out a network at rest.
    #[must_use]
    pub fn new(network: &SpringNetwork) -> Self {
        let nodes = network.node_count();
        let mut all: Vec<usize> = network.springs.iter().map(|s| (s.b - s.a) as usize).collect();
        all.sort_unstable();
        let filled = |run: &&[usize]| run.len() as f64 >= LEAST_FILL * nodes as f64;
        let offset: Vec<usize> = all.chunk_by(|p, q| p == q).filter(filled).map(|run| run[0]).collect();
        let (mut diagonal_k, mut diagonal_rest) = (vec![0.0; nodes * offset.len()], vec![0.0; nodes * offset.len()]);
        let mut on_diagonals = 0;
        for s in &network.springs {
            if let Ok(j) = offset.binary_search(&((s.b - s.a) as usize)) {
                diagonal_k[j * nodes + s.a as usize] = s.stiffness_n_per_m;
                diagonal_rest[j * nodes + s.a as usize] = s.rest_length_m;
                on_diagonals += 1;
            }
        }
        let x: Vec<f64> = network.rest_m.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let double = Arrays {
            k: network.springs.iter().map(|s| s.stiffness_n_per_m).collect(),
            rest: network.springs.iter().map(|s| s.rest_length_m).collect(),
            half_k: network.half_edges.stiffness_n_per_m.clone(),
            half_rest: network.half_edges.rest_length_m.clone(),
            diagonal_k,
            diagonal_rest,
            columns: (0..3).flat_map(|axis| network.rest_m.iter().map(move |p| p[axis])).collect(),
            x,
            force: vec![0.0; 3 * nodes],
        };
        let narrow = |from: &[f64]| from.iter().map(|v| *v as f32).collect::<Vec<_>>();
        let single = Arrays {
            k: narrow(&double.k),
            rest: narrow(&double.rest),
            half_k: narrow(&double.half_k),
            half_rest: narrow(&double.half_rest),
            diagonal_k: narrow(&double.diagonal_k),
            diagonal_rest: narrow(&double.diagonal_rest),
            x: narrow(&double.x),
            columns: narrow(&double.columns),
            force: vec![0.0; 3 * nodes],
        };
        Self {
            nodes,
            a: network.springs.iter().map(|s| s.a).collect(),
            b: network.springs.iter().map(|s| s.b).collect(),
            start: network.half_edges.start.clone(),
            other: network.half_edges.neighbour.clone(),
            offset,
            on_diagonals,
            double,
            single,
        }
    }

    /// Springs that a kernel works on: the C stencil leaves out those off the well-filled diagonals.
    #[must_use]
    pub fn springs(&self, kernel: Plain) -> usize {
        match kernel {
            Plain::StencilDouble | Plain::StencilSingle => self.on_diagonals,
            Plain::EdgesDouble | Plain::GatherDouble | Plain::GatherSingle => self.a.len(),
        }
    }

    /// One sweep.
    pub fn sweep(&mut self, kernel: Plain) {
        let Self { nodes, a, b, start, other, offset, double: d, single: s, .. } = self;
        let (start, other) = (start.as_ptr(), other.as_ptr());
        match kernel {
            // SAFETY: ends below `nodes`, checked by the network; `k` and `rest` by spring, `x` and `force` of 3 `nodes`.
            Plain::EdgesDouble => unsafe {
                let (k, rest, x, force) = (d.k.as_ptr(), d.rest.as_ptr(), d.x.as_ptr(), d.force.as_mut_ptr());
                plain_edges_f64(*nodes, a.len(), a.as_ptr(), b.as_ptr(), k, rest, x, force);
            },
            // SAFETY: compressed rows of the network; `k` and `rest` by half-spring, `x` and `force` of 3 `nodes`.
            Plain::GatherDouble => unsafe {
                let (k, rest, x, force) = (d.half_k.as_ptr(), d.half_rest.as_ptr(), d.x.as_ptr(), d.force.as_mut_ptr());
                plain_gather_f64(*nodes, start, other, k, rest, x, force);
            },
            // SAFETY: as in double precision, the arrays have the same lengths.
            Plain::GatherSingle => unsafe {
                let (k, rest, x, force) = (s.half_k.as_ptr(), s.half_rest.as_ptr(), s.x.as_ptr(), s.force.as_mut_ptr());
                plain_gather_f32(*nodes, start, other, k, rest, x, force);
            },
            // SAFETY: `k` and `rest` of `nodes` per diagonal, `columns` and `force` of 3 `nodes`.
            Plain::StencilDouble => unsafe {
                let (k, rest) = (d.diagonal_k.as_ptr(), d.diagonal_rest.as_ptr());
                let (x, force) = (d.columns.as_ptr(), d.force.as_mut_ptr());
                plain_stencil_f64(*nodes, offset.len(), offset.as_ptr(), k, rest, x, force);
            },
            // SAFETY: as in double precision, the arrays have the same lengths.
            Plain::StencilSingle => unsafe {
                let (k, rest) = (s.diagonal_k.as_ptr(), s.diagonal_rest.as_ptr());
                let (x, force) = (s.columns.as_ptr(), s.force.as_mut_ptr());
                plain_stencil_f32(*nodes, offset.len(), offset.as_ptr(), k, rest, x, force);
            },
        }
    }

    /// Force of the last sweep on a node, as the kernel laid it out.
    #[must_use]
    pub fn force_n(&self, kernel: Plain, node: usize) -> [f64; 3] {
        let by_node = |axis: usize| 3 * node + axis;
        let by_column = |axis: usize| axis * self.nodes + node;
        match kernel {
            Plain::EdgesDouble | Plain::GatherDouble => [0, 1, 2].map(|axis| self.double.force[by_node(axis)]),
            Plain::GatherSingle => [0, 1, 2].map(|axis| f64::from(self.single.force[by_node(axis)])),
            Plain::StencilDouble => [0, 1, 2].map(|axis| self.double.force[by_column(axis)]),
            Plain::StencilSingle => [0, 1, 2].map(|axis| f64::from(self.single.force[by_column(axis)])),
        }
    }
}
