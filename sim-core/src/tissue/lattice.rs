//! The one spring builder of all three models: springs come from the faces of a layered, cut surface.
//!
//! Structural: edges of each layer, k/2 per face that has the edge (rim k/2, inner k: E·t = 4/3·k).
//! Shear: quad diagonals. Bend: vertices opposite over an edge of two faces. Radial: a node and its
//! image on the next layer. Diagonal: over a face edge to the next layer, both ways, k/2 per face.
//! Since springs exist only where a face does, none crosses the wound. Rest lengths are those of
//! the built shape; in-plane ones are divided by 1 + pre-strain. Source: Zhang et al., §2.1.1.

use super::cut::Cut;
use super::model::TissueError;
use super::network::{Spring, SpringFamily};
use super::params::MaterialParams;
use super::surface::{Face, by_edge, edge_uses};
use crate::vector::Vec3;

/// Layers of one surface, outside first. Face f of every layer lies below face f of the one above,
/// corner by corner.
#[derive(Clone, Debug)]
pub struct LayeredSurface {
    /// Positions of all nodes, layer by layer, metres.
    pub position_m: Vec<Vec3>,
    /// First node of each layer, and the node count.
    pub start: Vec<u32>,
    /// Faces of each layer, in node indices.
    pub faces: Vec<Vec<Face>>,
    /// Surface vertex of each node (twins keep their own).
    pub vertex: Vec<u32>,
}

impl LayeredSurface {
    /// Stacks layers. A layer with as many positions as the split surface is cut, one with as many
    /// as the whole surface is not.
    ///
    /// # Errors
    /// [`TissueError::Mesh`] if a layer fits neither.
    pub fn stack(faces: &[Face], cut: Option<&Cut>, layers: &[Vec<Vec3>]) -> Result<Self, TissueError> {
        let mut stack = Self { position_m: Vec::new(), start: vec![0], faces: Vec::new(), vertex: Vec::new() };
        let whole = cut.map_or_else(|| layers.first().map_or(0, Vec::len), |c| c.vertex_count as usize);
        for positions in layers {
            let source = match cut {
                Some(c) if c.split_count() == positions.len() => &c.faces,
                _ if positions.len() == whole => faces,
                _ => return Err(TissueError::Mesh { what: "layers differ in vertex count".to_owned() }),
            };
            let first = stack.position_m.len() as u32;
            let shifted = |face: &Face| {
                let mut moved = *face;
                moved.corners_mut().iter_mut().for_each(|c| *c += first);
                moved
            };
            stack.faces.push(source.iter().map(shifted).collect());
            stack.position_m.extend_from_slice(positions);
            stack.vertex.extend(0..positions.len() as u32);
            stack.start.push(stack.position_m.len() as u32);
        }
        Ok(stack)
    }

    /// Layer of each node.
    #[must_use]
    pub fn layer_of_nodes(&self) -> Vec<u8> {
        let counts = self.start.windows(2).map(|w| (w[1] - w[0]) as usize);
        counts.enumerate().flat_map(|(layer, n)| std::iter::repeat_n(layer as u8, n)).collect()
    }

    /// Node of a surface vertex on a layer; `None` where a twin has no counterpart (layer not cut).
    #[must_use]
    pub fn node(&self, layer: usize, vertex: u32) -> Option<u32> {
        let node = self.start[layer] + vertex;
        (node < self.start[layer + 1]).then_some(node)
    }

    /// All layers and the walls between them (rim and wound) as triangles, seen from outside.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for (layer, faces) in self.faces.iter().enumerate() {
            let turned = |t: [u32; 3]| if layer == 0 { t } else { [t[0], t[2], t[1]] };
            triangles.extend(faces.iter().flat_map(Face::triangles).map(turned));
            let Some(below) = self.faces.get(layer + 1) else { break };
            for group in by_edge(&edge_uses(faces)).filter(|g| g.len() == 1) {
                let (face, slot) = (group[0].face as usize, group[0].slot as usize);
                let (upper, lower) = (faces[face].corners(), below[face].corners());
                let next = (slot + 1) % upper.len();
                triangles.push([upper[slot], lower[slot], upper[next]]);
                triangles.push([upper[next], lower[slot], lower[next]]);
            }
        }
        triangles
    }
}

/// A spring before rest length; weight in multiples of k.
#[derive(Clone, Copy)]
struct Candidate {
    pair: (u32, u32),
    family: SpringFamily,
    weight: f64,
}

fn candidate(a: u32, b: u32, family: SpringFamily, weight: f64) -> Candidate {
    Candidate { pair: (a.min(b), a.max(b)), family, weight }
}

/// Springs of a layered surface.
///
/// # Errors
/// [`TissueError::Mesh`] where two joined nodes lie on one spot.
pub fn springs(
    layers: &LayeredSurface,
    material: &MaterialParams,
    pre_strain: f64,
) -> Result<Vec<Spring>, TissueError> {
    let f = material.factors;
    let mut candidates = Vec::new();
    for (layer, faces) in layers.faces.iter().enumerate() {
        in_plane(faces, f.shear, f.bend, &mut candidates);
        if let Some(below) = layers.faces.get(layer + 1) {
            between(faces, below, f.radial, f.diagonal, &mut candidates);
        }
    }
    candidates.retain(|c| c.weight > 0.0);
    // Where two families claim one pair (a tube of three faces around), the stronger claim is the
    // first in the order of the families.
    candidates.sort_by_key(|c| (c.pair, c.family));
    let spring = |group: &[Candidate]| {
        let first = group[0];
        let same = group.iter().filter(|c| c.family == first.family);
        let weight = match first.family {
            SpringFamily::Structural | SpringFamily::Diagonal => same.map(|c| c.weight).sum(),
            SpringFamily::Shear | SpringFamily::Bend | SpringFamily::Radial => first.weight,
        };
        let (a, b) = first.pair;
        let length = (layers.position_m[a as usize] - layers.position_m[b as usize]).norm();
        if length <= 0.0 {
            return Err(TissueError::Mesh { what: format!("joined nodes {a} and {b} lie on one spot") });
        }
        let stretch = match first.family {
            SpringFamily::Structural | SpringFamily::Shear | SpringFamily::Bend => 1.0 + pre_strain,
            SpringFamily::Radial | SpringFamily::Diagonal => 1.0,
        };
        let stiffness_n_per_m = weight * material.stiffness.get();
        Ok(Spring { a, b, stiffness_n_per_m, rest_length_m: length / stretch, family: first.family })
    };
    candidates.chunk_by(|x, y| x.pair == y.pair).map(spring).collect()
}

fn in_plane(faces: &[Face], shear: f64, bend: f64, out: &mut Vec<Candidate>) {
    for face in faces {
        out.extend(face.edges().map(|(a, b)| candidate(a, b, SpringFamily::Structural, 0.5)));
        if let Face::Quad([a, b, c, d]) = *face {
            out.push(candidate(a, c, SpringFamily::Shear, shear));
            out.push(candidate(b, d, SpringFamily::Shear, shear));
        }
    }
    if bend <= 0.0 {
        return;
    }
    for group in by_edge(&edge_uses(faces)) {
        let [one, two] = group else { continue };
        let turned = |u: &super::surface::EdgeUse, by: usize| {
            let corners = faces[u.face as usize].corners();
            corners[(u.slot as usize + by) % corners.len()]
        };
        // Face one runs p, q, q', p' (or p, q, o), face two q, p, p'', q'' (or q, p, o').
        let counts = [one, two].map(|u| faces[u.face as usize].corners().len());
        let offsets: &[(usize, usize)] = match counts {
            [3, 3] => &[(2, 2)],
            [4, 4] => &[(2, 3), (3, 2)],
            _ => &[],
        };
        for &(i, j) in offsets {
            let (a, b) = (turned(one, i), turned(two, j));
            if a != b {
                out.push(candidate(a, b, SpringFamily::Bend, bend));
            }
        }
    }
}

fn between(upper: &[Face], lower: &[Face], radial: f64, diagonal: f64, out: &mut Vec<Candidate>) {
    for (up, low) in upper.iter().zip(lower) {
        let corners = up.corners().iter().zip(low.corners());
        out.extend(corners.map(|(a, b)| candidate(*a, *b, SpringFamily::Radial, radial)));
        for ((a, b), (c, d)) in up.edges().zip(low.edges()) {
            out.push(candidate(a, d, SpringFamily::Diagonal, 0.5 * diagonal));
            out.push(candidate(b, c, SpringFamily::Diagonal, 0.5 * diagonal));
        }
    }
}
