//! Node areas, masses and drag: A_i = a third (triangle) or a quarter (quad) of each face around
//! node i, m_i = ρ·t·A_i, c_i = c·A_i/h² or c as printed.
//!
//! Units: m², kg, N·s/m. Sums are exact up to rounding: Σ m_i = ρ·t·(area of the layer). The
//! paper gives no mass; without one Eq. (3) cannot be stepped.

use super::lattice::LayeredSurface;
use super::params::{DragReading, MaterialParams};
use super::surface::Face;
use crate::vector::Vec3;

/// Area of a face, m²; that of a bent quad is its projection along the mean normal.
#[must_use]
pub fn face_area(face: &Face, position_m: &[Vec3]) -> f64 {
    let at = |i: u32| position_m[i as usize];
    match *face {
        Face::Triangle([a, b, c]) => 0.5 * (at(b) - at(a)).cross(&(at(c) - at(a))).norm(),
        Face::Quad([a, b, c, d]) => 0.5 * (at(c) - at(a)).cross(&(at(d) - at(b))).norm(),
    }
}

/// Share of each node in the area of its layer, m².
#[must_use]
pub fn node_areas(layers: &LayeredSurface) -> Vec<f64> {
    let mut areas = vec![0.0; layers.position_m.len()];
    for face in layers.faces.iter().flatten() {
        let share = face_area(face, &layers.position_m) / face.corners().len() as f64;
        for &corner in face.corners() {
            areas[corner as usize] += share;
        }
    }
    areas
}

/// Mass of each node, kg, when a layer stands for `thickness_m` of tissue.
#[must_use]
pub fn node_masses(areas_m2: &[f64], material: &MaterialParams, thickness_m: f64) -> Vec<f64> {
    areas_m2.iter().map(|a| material.density.get() * thickness_m * a).collect()
}

/// Drag of each node, N·s/m.
#[must_use]
pub fn node_drags(areas_m2: &[f64], material: &MaterialParams) -> Vec<f64> {
    match material.drag {
        DragReading::PerNode(drag) => vec![drag.get(); areas_m2.len()],
        DragReading::PerArea { drag, spacing } => {
            let per_area = drag.get() / (spacing.get() * spacing.get());
            areas_m2.iter().map(|a| per_area * a).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::test_support::{material, mm};
    use crate::units::NewtonSecondsPerMetre;

    #[test]
    fn areas_are_those_of_the_polygons() {
        let corners = [Vec3::zeros(), Vec3::x() * 3.0, Vec3::new(3.0, 2.0, 0.0), Vec3::y() * 2.0];
        assert_eq!(face_area(&Face::Quad([0, 1, 2, 3]), &corners), 6.0);
        assert_eq!(face_area(&Face::Triangle([0, 1, 2]), &corners), 3.0);
        let faces = [Face::Triangle([0, 1, 2]), Face::Triangle([0, 2, 3])];
        let layers = LayeredSurface::stack(&faces, None, &[corners.to_vec()]).unwrap();
        assert_eq!(node_areas(&layers), vec![2.0, 1.0, 2.0, 1.0]);
    }

    #[test]
    fn table2_drag_is_read_per_area_or_per_node() {
        let per_area = material(0.16, 3.0, 2.0);
        let drag = NewtonSecondsPerMetre::new(3.0).unwrap();
        let per_node = MaterialParams { drag: DragReading::PerNode(drag), ..per_area };
        let areas = [mm(2.0).get().powi(2), mm(1.0).get().powi(2)];
        assert_eq!(node_drags(&areas, &per_area), vec![3.0, 0.75]);
        assert_eq!(node_drags(&areas, &per_node), vec![3.0, 3.0]);
        assert_eq!(node_masses(&[2.0], &per_area, 0.5), vec![1100.0]);
    }
}
