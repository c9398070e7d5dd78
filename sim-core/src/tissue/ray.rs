//! The first face that a segment from a vertex into the body meets: local thickness of an organ.
//!
//! A uniform grid over the faces' boxes, walked cell by cell (Amanatides and Woo 1987), and the
//! segment–triangle test of Möller and Trumbore 1997. Lengths in metres, hits as share of the segment.

use super::triangle_mesh::TriangleMesh;
use crate::vector::Vec3;

/// Most cells along an axis.
const MAX_CELLS: usize = 64;
/// Most cell entries per face before the grid is made coarser.
const ENTRIES_PER_FACE: usize = 32;
/// Cells are this many times longer than the mean edge of the faces' boxes.
const CELL_PER_BOX: f64 = 1.5;

/// Faces by cell, in compressed rows.
pub(super) struct FaceGrid {
    low: Vec3,
    cell: f64,
    counts: [usize; 3],
    start: Vec<u32>,
    faces: Vec<u32>,
}

impl FaceGrid {
    pub(super) fn new(mesh: &TriangleMesh) -> Self {
        let boxes: Vec<(Vec3, Vec3)> = mesh.faces.iter().map(|f| face_box(mesh, f)).collect();
        let low = boxes.iter().fold(Vec3::repeat(f64::INFINITY), |l, b| l.inf(&b.0));
        let high = boxes.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |h, b| h.sup(&b.1));
        let extent = (high - low).max();
        let mean = boxes.iter().map(|b| (b.1 - b.0).max()).sum::<f64>() / boxes.len() as f64;
        let mut cell = (CELL_PER_BOX * mean).max(extent / MAX_CELLS as f64).max(f64::MIN_POSITIVE);
        loop {
            let counts = [0, 1, 2].map(|i| (((high[i] - low[i]) / cell) as usize + 1).min(MAX_CELLS + 1));
            let mut grid = Self { low, cell, counts, start: Vec::new(), faces: Vec::new() };
            let entries: usize = boxes.iter().map(|b| grid.cells_of(b).count()).sum();
            if entries <= ENTRIES_PER_FACE * boxes.len() || counts == [1; 3] {
                grid.fill(&boxes);
                return grid;
            }
            cell *= 2.0;
        }
    }

    fn fill(&mut self, boxes: &[(Vec3, Vec3)]) {
        let mut pairs: Vec<(usize, u32)> =
            (0..).zip(boxes).flat_map(|(f, b)| self.cells_of(b).map(move |c| (c, f)).collect::<Vec<_>>()).collect();
        pairs.sort_unstable();
        let cells = self.counts.iter().product::<usize>();
        self.start = (0..=cells).map(|c| pairs.partition_point(|p| p.0 < c) as u32).collect();
        self.faces = pairs.into_iter().map(|p| p.1).collect();
    }

    fn axis_cell(&self, x: f64, axis: usize) -> usize {
        (((x - self.low[axis]) / self.cell).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn cells_of(&self, bounds: &(Vec3, Vec3)) -> impl Iterator<Item = usize> + use<> {
        let range = |axis: usize| self.axis_cell(bounds.0[axis], axis)..=self.axis_cell(bounds.1[axis], axis);
        let (xs, ys, zs) = (range(0), range(1), range(2));
        let [nx, ny, _] = self.counts;
        zs.flat_map(move |z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| (z * ny + y) * nx + x))
        })
    }

    /// Share of the segment `from`–`from + along` at which it first meets a face that does not have
    /// vertex `own`; `None` if it meets none.
    pub(super) fn first_hit(&self, mesh: &TriangleMesh, own: u32, from: Vec3, along: Vec3) -> Option<f64> {
        let mut at = [0, 1, 2].map(|i| self.axis_cell(from[i], i));
        // Share of the segment at the next cell wall of each axis, and from wall to wall.
        let wall = [0, 1, 2].map(|i| self.low[i] + self.cell * (at[i] + usize::from(along[i] > 0.0)) as f64);
        let mut next = [0, 1, 2].map(|i| if along[i] == 0.0 { f64::INFINITY } else { (wall[i] - from[i]) / along[i] });
        let step = [0, 1, 2].map(|i| (self.cell / along[i]).abs());
        let mut best: Option<f64> = None;
        loop {
            let cell = (at[2] * self.counts[1] + at[1]) * self.counts[0] + at[0];
            for &f in &self.faces[self.start[cell] as usize..self.start[cell + 1] as usize] {
                let face = mesh.faces[f as usize];
                if !face.contains(&own)
                    && let Some(t) = hit(face.map(|v| mesh.vertices_m[v as usize]), from, along)
                {
                    best = Some(best.map_or(t, |b| b.min(t)));
                }
            }
            let axis = (0..3).fold(0, |a, i| if next[i] < next[a] { i } else { a });
            // A hit before the cell's wall is the first; past the segment's end or the grid's there is none.
            if next[axis] > best.unwrap_or(1.0) {
                return best;
            }
            let moved = if along[axis] > 0.0 { at[axis].checked_add(1) } else { at[axis].checked_sub(1) };
            match moved.filter(|m| *m < self.counts[axis]) {
                Some(cell) => at[axis] = cell,
                None => return best,
            }
            next[axis] += step[axis];
        }
    }
}

fn face_box(mesh: &TriangleMesh, face: &[u32; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = face.map(|v| mesh.vertices_m[v as usize]);
    (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
}

/// Share of the segment at which it crosses a triangle.
pub(super) fn hit([a, b, c]: [Vec3; 3], from: Vec3, along: Vec3) -> Option<f64> {
    let (ab, ac, offset) = (b - a, c - a, from - a);
    let normal = along.cross(&ac);
    let det = ab.dot(&normal);
    let u = offset.dot(&normal) / det;
    let across = offset.cross(&ab);
    let v = along.dot(&across) / det;
    let t = ac.dot(&across) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_finds_what_all_faces_find() {
        let mesh = TriangleMesh::lobe(Vec3::new(0.1, 0.07, 0.02), 0.4, 3).unwrap();
        let grid = FaceGrid::new(&mesh);
        let mut met = 0;
        for (own, (x, n)) in (0..).zip(mesh.vertices_m.iter().zip(mesh.vertex_normals())) {
            let along = -n * 0.03;
            let faces = mesh.faces.iter().filter(|f| !f.contains(&own));
            let brute = faces.filter_map(|f| hit(f.map(|v| mesh.vertices_m[v as usize]), *x, along));
            let brute = brute.fold(None, |b: Option<f64>, t| Some(b.map_or(t, |b| b.min(t))));
            assert_eq!(grid.first_hit(&mesh, own, *x, along), brute, "vertex {own}");
            met += usize::from(brute.is_some());
        }
        assert!(met > 100 && met < mesh.vertices_m.len(), "both outcomes must occur: {met}");
    }
}
