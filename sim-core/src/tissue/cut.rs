//! The wound: splits a surface along a path of edges, so that no face, and hence no spring, joins
//! the two sides.
//!
//! Every inner vertex v of the path gets a twin; the faces to the right of the path (seen from
//! outside, walking along it) take the twin, those to the left keep v. Opening moves the sides
//! apart by ±gap/2·(1 − (2s/L)²)·(1 − d/reach): s along the wound from its middle, d the distance
//! from it. Triangles and quads alike. Deliberately absent: branching and tearing wounds.

use super::model::TissueError;
use super::surface::Face;

/// A surface split along a path.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Faces after the split; vertices from `vertex_count` on are twins.
    pub faces: Vec<Face>,
    /// The path, tip to tip.
    pub path: Vec<u32>,
    /// Vertices before the split: the twin of `path[i]` is `vertex_count + i − 1`.
    pub vertex_count: u32,
}

impl Cut {
    /// Splits `faces` along `path`.
    ///
    /// # Errors
    /// [`TissueError::Wound`]: fewer than three vertices, one twice, two that no edge joins, or an
    /// inner vertex on the rim of the surface.
    pub fn along(faces: &[Face], vertex_count: usize, path: Vec<u32>) -> Result<Self, TissueError> {
        let wound = |what: String, remedy: &'static str| Err(TissueError::Wound { what, remedy });
        if path.len() < 3 {
            return wound(
                format!("the wound spans {} edges, it needs 2", path.len().saturating_sub(1)),
                "make the wound longer or the spacing finer",
            );
        }
        let mut sorted = path.clone();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|w| w[0] == w[1]) {
            return wound(format!("the wound passes vertex {} twice", pair[0]), "make the wound shorter");
        }
        let mut directed: Vec<(u32, u32, u32)> =
            faces.iter().zip(0..).flat_map(|(f, i)| f.edges().map(move |(a, b)| (a, b, i))).collect();
        directed.sort_unstable();
        let face_of = |from: u32, to: u32| {
            let at = directed.partition_point(|e| (e.0, e.1) < (from, to));
            directed.get(at).filter(|e| (e.0, e.1) == (from, to)).map(|e| e.2 as usize)
        };
        let mut on_rim = vec![false; vertex_count];
        for &(a, b, _) in directed.iter().filter(|e| face_of(e.1, e.0).is_none()) {
            on_rim[a as usize] = true;
            on_rim[b as usize] = true;
        }
        let mut split = faces.to_vec();
        for (i, w) in path.windows(3).enumerate() {
            let [before, here, after] = [w[0], w[1], w[2]];
            let twin = vertex_count as u32 + i as u32;
            let mut spoke = after;
            // Round `here` from the edge to `after` to that from `before`, on the right side.
            for step in 0..=faces.len() {
                let Some(face) =
                    face_of(spoke, here).filter(|_| step < faces.len() && (step > 0 || !on_rim[here as usize]))
                else {
                    return wound(
                        format!("the wound touches the rim, or has no edge, at vertex {here}"),
                        "make the wound shorter or move it away from the rim",
                    );
                };
                let corners = faces[face].corners();
                let Some(at) = corners.iter().position(|c| *c == here) else { break };
                split[face].corners_mut()[at] = twin;
                spoke = corners[(at + 1) % corners.len()];
                if spoke == before {
                    break;
                }
            }
        }
        Ok(Self { faces: split, path, vertex_count: vertex_count as u32 })
    }

    /// Number of vertices after the split.
    #[must_use]
    pub fn split_count(&self) -> usize {
        self.vertex_count as usize + self.path.len() - 2
    }

    /// The vertex of which this one is a twin, or itself.
    #[must_use]
    pub fn original(&self, vertex: u32) -> u32 {
        vertex.checked_sub(self.vertex_count).map_or(vertex, |i| self.path[i as usize + 1])
    }

    /// Inner vertices of the left edge, tip to tip.
    #[must_use]
    pub fn left(&self) -> &[u32] {
        &self.path[1..self.path.len() - 1]
    }

    /// Inner vertices of the right edge, in the order of [`Self::left`].
    #[must_use]
    pub fn right(&self) -> Vec<u32> {
        (self.vertex_count..self.split_count() as u32).collect()
    }

    /// Side of every vertex after the split: −1 left, +1 right, 0 the tips. Off the path, the sign
    /// of `lateral` decides.
    #[must_use]
    pub fn sides(&self, lateral: &[f64]) -> Vec<i8> {
        let mut sides: Vec<i8> = lateral[..self.vertex_count as usize].iter().map(|x| sign(*x)).collect();
        sides.resize(self.split_count(), 1);
        for &v in &self.path {
            sides[v as usize] = -1;
        }
        for tip in [self.path[0], self.path[self.path.len() - 1]] {
            sides[tip as usize] = 0;
        }
        sides
    }
}

/// The sign of a number, 0 for 0.
fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// How far the sides of a wound are moved apart.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    /// Half of the largest gap, metres.
    pub half_gap_m: f64,
    /// Half of the distance between the tips, metres.
    pub half_length_m: f64,
    /// Distance from the wound at which nothing moves any more, metres.
    pub reach_m: f64,
}

impl Opening {
    /// Lateral displacement of a point of one side, metres.
    #[must_use]
    pub fn shift(&self, side: i8, along_m: f64, distance_m: f64) -> f64 {
        let s = along_m / self.half_length_m;
        let taper = (1.0 - s * s).max(0.0);
        let decay = (1.0 - distance_m / self.reach_m).max(0.0);
        f64::from(side) * self.half_gap_m * taper * decay
    }

    /// Refuses a gap that would press the tissue beside it to less than half of its width.
    pub(super) fn check(&self) -> Result<(), TissueError> {
        if self.half_gap_m <= 0.5 * self.reach_m {
            return Ok(());
        }
        Err(TissueError::Wound {
            what: format!(
                "a gap of {} m leaves no room beside the wound: at most {} m fits",
                2.0 * self.half_gap_m,
                self.reach_m
            ),
            remedy: "make the gap smaller or the tissue wider",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::surface::check_surface;

    fn grid(n: u32) -> Vec<Face> {
        let at = |i: u32, j: u32| j * (n + 1) + i;
        (0..n * n)
            .map(|c| (c % n, c / n))
            .map(|(i, j)| Face::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]))
            .collect()
    }

    #[test]
    fn right_faces_take_the_twins() {
        // 4 × 4 quads, path up the middle column from row 1 to row 3: one inner vertex, number 12.
        let cut = Cut::along(&grid(4), 25, vec![7, 12, 17]).unwrap();
        assert_eq!(cut.split_count(), 26);
        assert!(check_surface(&cut.faces, 26).is_ok());
        for (index, face) in cut.faces.iter().enumerate() {
            let column = index % 4;
            assert!(!face.corners().contains(&25) || column >= 2, "a twin is left of the wound");
            assert!(!face.corners().contains(&12) || column < 2, "an original is right of the wound");
        }
        assert_eq!((cut.original(25), cut.original(3)), (12, 3));
        assert_eq!((cut.left(), cut.right()), (&[12_u32][..], vec![25]));
    }

    #[test]
    fn unusable_paths_are_refused() {
        for path in [vec![], vec![7, 12], vec![7, 12, 7], vec![7, 13, 17], vec![2, 1, 0], vec![10, 15, 20]] {
            assert!(Cut::along(&grid(4), 25, path.clone()).is_err(), "{path:?}");
        }
    }

    #[test]
    fn opening_is_full_in_the_middle_and_nothing_at_tip_and_reach() {
        let opening = Opening { half_gap_m: 2.0, half_length_m: 20.0, reach_m: 30.0 };
        assert_eq!(opening.shift(1, 0.0, 0.0), 2.0);
        assert_eq!(opening.shift(-1, 10.0, 0.0), -1.5);
        assert_eq!(opening.shift(1, 20.0, 0.0), 0.0);
        assert_eq!(opening.shift(1, 0.0, 30.0), 0.0);
    }
}
