//! A polygon surface of triangles and quads: the one shape from which every tissue model is built.
//!
//! Faces are wound counter-clockwise seen from outside. Deliberately absent: positions (a layered
//! tissue has one position array per layer over the same faces) and half-edge pointers (an edge
//! table sorted by vertex pair serves all passes made at load).

use super::model::TissueError;

/// A triangle or a quad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Three corners.
    Triangle([u32; 3]),
    /// Four corners in order around the face.
    Quad([u32; 4]),
}

impl Face {
    /// Corners in order.
    #[must_use]
    pub fn corners(&self) -> &[u32] {
        match self {
            Self::Triangle(c) => c,
            Self::Quad(c) => c,
        }
    }

    /// Corners in order, to be changed in place.
    pub(super) fn corners_mut(&mut self) -> &mut [u32] {
        match self {
            Self::Triangle(c) => c,
            Self::Quad(c) => c,
        }
    }

    /// Directed edges `(from, to)` in order around the face.
    pub fn edges(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let corners = self.corners();
        (0..corners.len()).map(move |i| (corners[i], corners[(i + 1) % corners.len()]))
    }

    /// The face as triangles of the same winding.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let corners = self.corners();
        (1..corners.len() - 1).map(move |i| [corners[0], corners[i], corners[i + 1]])
    }
}

/// One use of an edge by a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeUse {
    /// Lower vertex.
    pub low: u32,
    /// Higher vertex.
    pub high: u32,
    /// The face that has it.
    pub face: u32,
    /// Which of the face's edges: from corner `slot` to the next.
    pub slot: u32,
}

/// All uses of all edges, sorted by vertex pair: the uses of one edge are neighbours.
#[must_use]
pub fn edge_uses(faces: &[Face]) -> Vec<EdgeUse> {
    let mut uses: Vec<EdgeUse> = faces
        .iter()
        .enumerate()
        .flat_map(|(face, f)| {
            f.edges().enumerate().map(move |(slot, (a, b))| EdgeUse {
                low: a.min(b),
                high: a.max(b),
                face: face as u32,
                slot: slot as u32,
            })
        })
        .collect();
    uses.sort_unstable();
    uses
}

/// Groups sorted edge uses by edge.
pub fn by_edge(uses: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    uses.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
}

/// Checks that the faces form an oriented surface: indices exist, no corner twice in a face, every
/// edge in one or two faces that run it in opposite directions, no vertex without a face.
///
/// # Errors
/// [`TissueError::Mesh`] naming the first face, edge or vertex at fault.
pub fn check_surface(faces: &[Face], vertex_count: usize) -> Result<(), TissueError> {
    let mesh = |what: String| Err(TissueError::Mesh { what });
    let mut used = vec![false; vertex_count];
    for (index, face) in faces.iter().enumerate() {
        for (i, &corner) in face.corners().iter().enumerate() {
            let Some(slot) = used.get_mut(corner as usize) else {
                return mesh(format!("face {index} names vertex {corner}, but there are only {vertex_count}"));
            };
            *slot = true;
            if face.corners()[..i].contains(&corner) {
                return mesh(format!("face {index} has vertex {corner} twice"));
            }
        }
    }
    if let Some(vertex) = used.iter().position(|u| !u) {
        return mesh(format!("vertex {vertex} belongs to no face"));
    }
    for group in by_edge(&edge_uses(faces)) {
        let EdgeUse { low, high, .. } = group[0];
        match group {
            [_] => {}
            [a, b] => {
                let from = |u: &EdgeUse| faces[u.face as usize].corners()[u.slot as usize];
                if from(a) == from(b) {
                    return mesh(format!(
                        "faces {} and {} run edge {low}–{high} in the same direction, so one of them is turned over",
                        a.face, b.face
                    ));
                }
            }
            _ => return mesh(format!("edge {low}–{high} belongs to {} faces, at most 2 can meet", group.len())),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_two_quads_share_one() {
        let faces = [Face::Quad([0, 1, 4, 3]), Face::Quad([1, 2, 5, 4])];
        let uses = edge_uses(&faces);
        let groups: Vec<usize> = by_edge(&uses).map(<[EdgeUse]>::len).collect();
        assert_eq!((groups.len(), groups.iter().filter(|n| **n == 2).count()), (7, 1));
        assert!(check_surface(&faces, 6).is_ok());
    }

    #[test]
    fn faults_are_named() {
        let cases = [
            (vec![Face::Triangle([0, 1, 9])], "vertex 9"),
            (vec![Face::Triangle([0, 1, 1])], "twice"),
            (vec![Face::Triangle([0, 1, 2])], "vertex 3 belongs to no face"),
            (vec![Face::Triangle([0, 1, 2]), Face::Triangle([0, 1, 3])], "turned over"),
            (vec![Face::Triangle([0, 1, 2]), Face::Triangle([1, 0, 3]), Face::Triangle([0, 1, 3])], "3 faces"),
        ];
        for (faces, words) in cases {
            let text = check_surface(&faces, 4).unwrap_err().to_string();
            assert!(text.contains(words), "{text}");
        }
    }
}
