//! A mass-spring network on flat arrays: what every tissue model builds and every integrator steps.
//!
//! Springs are stored once (`springs`, for building, energy and reports) and once more per node
//! (`half_edges`, compressed rows, for the force gather). Force on node `i`:
//! `F_i = Σ_j k_ij (|x_j − x_i| − L_ij) (x_j − x_i)/|x_j − x_i|` (Zhang et al., Eq. (3), second line). A spring that is
//! marked as pulling only gives nothing while it is shorter than at rest: the other reading of that line.

use crate::vector::Vec3;

/// What a spring is for; reports and scenes switch families, the force law is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SpringFamily {
    /// Edge of a face.
    Structural,
    /// Diagonal of a quad face.
    Shear,
    /// Second neighbour over a shared edge.
    Bend,
    /// Between a node and its image on the next layer.
    Radial,
    /// Between a node and its neighbour's image on the next layer.
    Diagonal,
}

/// One spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Lower node index.
    pub a: u32,
    /// Higher node index.
    pub b: u32,
    /// Stiffness, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// Rest length, metres.
    pub rest_length_m: f64,
    /// What it is for.
    pub family: SpringFamily,
}

/// Neighbour lists in compressed rows: the entries of node `i` are `start[i]..start[i + 1]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HalfEdges {
    /// Row starts, `node_count + 1` entries.
    pub start: Vec<u32>,
    /// Other end.
    pub neighbour: Vec<u32>,
    /// Stiffness, newtons per metre.
    pub stiffness_n_per_m: Vec<f64>,
    /// Rest length, metres.
    pub rest_length_m: Vec<f64>,
    /// Whether it gives nothing while it is shorter than at rest.
    pub pulls_only: Vec<bool>,
}

/// A validated network.
#[derive(Clone, Debug, PartialEq)]
pub struct SpringNetwork {
    /// Built positions, metres.
    pub rest_m: Vec<Vec3>,
    /// Node masses, kilograms, above 0.
    pub mass_kg: Vec<f64>,
    /// Node drag to ground, newton seconds per metre, at least 0.
    pub drag_n_s_per_m: Vec<f64>,
    /// 1 where the node never moves, else 0.
    pub fixed: Vec<u8>,
    /// Springs with `a < b`, sorted, no pair twice.
    pub springs: Vec<Spring>,
    /// The same springs by node.
    pub half_edges: HalfEdges,
    /// Springs that pull only, by index, ascending; none in the plain mass-spring model.
    pub pulls_only: Vec<u32>,
}

/// Positions and velocities of all nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct TissueState {
    /// Positions, metres.
    pub position_m: Vec<Vec3>,
    /// Velocities, metres per second.
    pub velocity_m_per_s: Vec<Vec3>,
}

/// Why a network is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// Arrays of different length.
    #[error("node arrays differ in length: {positions} positions, {other} {what}")]
    Length {
        /// Number of positions.
        positions: usize,
        /// Length of the other array.
        other: usize,
        /// Which array.
        what: &'static str,
    },
    /// A node value that cannot be used.
    #[error("node {node}: {what} is not usable (must be finite, mass above 0, drag at least 0)")]
    Node {
        /// Node index.
        node: usize,
        /// Which value.
        what: &'static str,
    },
    /// A spring that cannot be used.
    #[error("spring {spring}: {what}")]
    Spring {
        /// Spring index in the input order.
        spring: usize,
        /// What is wrong.
        what: &'static str,
    },
}

impl SpringNetwork {
    /// Builds and validates a network. Springs may come in any order and orientation.
    ///
    /// # Errors
    /// [`NetworkError`]: arrays of different length, values that are not finite, masses not above
    /// zero, negative drag, stiffness or rest length, springs that name no node, one node twice, or
    /// the same pair twice.
    pub fn new(
        rest_m: Vec<Vec3>,
        mass_kg: Vec<f64>,
        drag_n_s_per_m: Vec<f64>,
        fixed: Vec<u8>,
        mut springs: Vec<Spring>,
    ) -> Result<Self, NetworkError> {
        check_nodes(&rest_m, &mass_kg, &drag_n_s_per_m, &fixed)?;
        for (index, spring) in springs.iter_mut().enumerate() {
            check_spring(index, spring, rest_m.len())?;
            if spring.a > spring.b {
                std::mem::swap(&mut spring.a, &mut spring.b);
            }
        }
        springs.sort_by_key(|s| (s.a, s.b));
        if let Some(i) = springs.windows(2).position(|w| (w[0].a, w[0].b) == (w[1].a, w[1].b)) {
            return Err(NetworkError::Spring { spring: i, what: "the same two nodes are joined twice" });
        }
        let half_edges = HalfEdges::from_springs(rest_m.len(), &springs);
        Ok(Self { rest_m, mass_kg, drag_n_s_per_m, fixed, springs, half_edges, pulls_only: Vec::new() })
    }

    /// Reads the chosen springs as Eq. (3) does with the `d_i` of Eq. (1): stiffness `k β`, and they only pull.
    pub fn read_as_relaxed(&mut self, beta: f64, chosen: impl Fn(&Spring) -> bool) {
        self.pulls_only.clear();
        for (index, spring) in self.springs.iter_mut().enumerate() {
            if chosen(spring) {
                spring.stiffness_n_per_m *= beta;
                self.pulls_only.push(index as u32);
            }
        }
        self.half_edges = HalfEdges::from_springs(self.rest_m.len(), &self.springs);
        for &index in &self.pulls_only {
            let spring = &self.springs[index as usize];
            for (from, to) in [(spring.a, spring.b), (spring.b, spring.a)] {
                let row = self.half_edges.row(from as usize);
                if let Some(e) = row.into_iter().find(|&e| self.half_edges.neighbour[e] == to) {
                    self.half_edges.pulls_only[e] = true;
                }
            }
        }
    }

    /// Number of nodes.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.rest_m.len()
    }

    /// Some consecutive nodes with the springs between them; none of those only pulls.
    pub(in crate::tissue) fn part(&self, nodes: std::ops::Range<usize>) -> Self {
        let (first, end) = (nodes.start as u32, nodes.end as u32);
        let inside = self.springs.iter().filter(|s| s.a >= first && s.b < end);
        let springs: Vec<Spring> = inside.map(|s| Spring { a: s.a - first, b: s.b - first, ..*s }).collect();
        Self {
            rest_m: self.rest_m[nodes.clone()].to_vec(),
            mass_kg: self.mass_kg[nodes.clone()].to_vec(),
            drag_n_s_per_m: self.drag_n_s_per_m[nodes.clone()].to_vec(),
            fixed: self.fixed[nodes.clone()].to_vec(),
            half_edges: HalfEdges::from_springs(nodes.len(), &springs),
            springs,
            pulls_only: Vec::new(),
        }
    }

    /// The state at rest in the built shape.
    #[must_use]
    pub fn rest_state(&self) -> TissueState {
        TissueState { position_m: self.rest_m.clone(), velocity_m_per_s: vec![Vec3::zeros(); self.rest_m.len()] }
    }
}

impl HalfEdges {
    fn from_springs(nodes: usize, springs: &[Spring]) -> Self {
        let mut start = vec![0_u32; nodes + 1];
        for s in springs {
            start[s.a as usize + 1] += 1;
            start[s.b as usize + 1] += 1;
        }
        for i in 0..nodes {
            start[i + 1] += start[i];
        }
        let count = 2 * springs.len();
        let mut cursor: Vec<u32> = start[..nodes].to_vec();
        let mut neighbour = vec![0_u32; count];
        let mut stiffness = vec![0.0; count];
        let mut rest = vec![0.0; count];
        for s in springs {
            for (from, to) in [(s.a, s.b), (s.b, s.a)] {
                let slot = cursor[from as usize] as usize;
                cursor[from as usize] += 1;
                neighbour[slot] = to;
                stiffness[slot] = s.stiffness_n_per_m;
                rest[slot] = s.rest_length_m;
            }
        }
        Self { start, neighbour, stiffness_n_per_m: stiffness, rest_length_m: rest, pulls_only: vec![false; count] }
    }

    /// Range of the entries of one node.
    #[must_use]
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.start[node] as usize..self.start[node + 1] as usize
    }
}

fn check_nodes(rest: &[Vec3], mass: &[f64], drag: &[f64], fixed: &[u8]) -> Result<(), NetworkError> {
    for (what, other) in [("masses", mass.len()), ("drag values", drag.len()), ("fixed flags", fixed.len())] {
        if other != rest.len() {
            return Err(NetworkError::Length { positions: rest.len(), other, what });
        }
    }
    let bad = |what: &'static str| move |node: usize| NetworkError::Node { node, what };
    if let Some(i) = rest.iter().position(|x| !x.iter().all(|v| v.is_finite())) {
        return Err(bad("position")(i));
    }
    if let Some(i) = mass.iter().position(|m| !(m.is_finite() && *m > 0.0)) {
        return Err(bad("mass")(i));
    }
    if let Some(i) = drag.iter().position(|c| !(c.is_finite() && *c >= 0.0)) {
        return Err(bad("drag")(i));
    }
    Ok(())
}

fn check_spring(index: usize, spring: &Spring, nodes: usize) -> Result<(), NetworkError> {
    let error = |what| Err(NetworkError::Spring { spring: index, what });
    if spring.a as usize >= nodes || spring.b as usize >= nodes {
        return error("names a node that does not exist");
    }
    if spring.a == spring.b {
        return error("joins a node to itself");
    }
    if !(spring.stiffness_n_per_m.is_finite() && spring.stiffness_n_per_m >= 0.0) {
        return error("stiffness must be finite and at least 0");
    }
    if !(spring.rest_length_m.is_finite() && spring.rest_length_m >= 0.0) {
        return error("rest length must be finite and at least 0");
    }
    Ok(())
}
