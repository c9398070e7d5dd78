//! What a picture shows besides the tissue, laid out from a view: suture points, suture line and stitches, tool, force.
//!
//! Sizes go with the tissue, so that a small vessel is not hidden behind its own suture points. The number of things
//! is bounded by the wire, not by the number of nodes. Memory is reused from picture to picture.

mod line;
mod points;
mod tool;

use super::shared::Place;
use super::solids::{Body, Shape};
use super::tubes::Piece;
use crate::feed::View;
use nalgebra::{Matrix3, Vector3};

/// A suture point's radius, as a share of the tissue's diagonal.
const POINT_SHARE: f32 = 0.0078;
/// The suture line's radius.
const LINE_SHARE: f32 = 0.0024;
/// Diagonal of a tissue for which the tool has its true size.
const TOOL_SIZE_M: f32 = 0.075;

/// Everything besides the tissue.
#[derive(Default)]
pub(super) struct Props {
    pub(super) bodies: Vec<(Shape, Body)>,
    pub(super) pieces: Vec<Piece>,
    pairs: Vec<points::Pair>,
    states: Vec<[points::PointState; 2]>,
    /// Points of a curve at work.
    curve: Vec<Vector3<f32>>,
    /// Points of the free part of the line.
    bends: Vec<Vector3<f32>>,
}

/// How a body reflects.
#[derive(Clone, Copy)]
struct Finish {
    /// Colour, sRGB.
    colour: [f32; 3],
    gloss: f32,
    sharpness: f32,
    /// Share of light of its own.
    glow: f32,
}

impl Props {
    /// Lays everything out anew.
    pub(super) fn lay(&mut self, view: &View, place: &Place) {
        self.bodies.clear();
        self.pieces.clear();
        let size_m = place.size_m();
        points::on_surface(view, &mut self.pairs);
        let work = points::survey(view, &self.pairs, &mut self.states);
        points::lay(self, POINT_SHARE * size_m);
        let needles = tool::lay(self, view, (size_m / TOOL_SIZE_M).clamp(0.55, 1.5), POINT_SHARE * size_m);
        line::lay(self, view, work, needles, LINE_SHARE * size_m);
    }

    fn add(&mut self, shape: Shape, axes: &Matrix3<f32>, at_m: Vector3<f32>, finish: Finish) {
        let row = |i: usize| [axes[(i, 0)], axes[(i, 1)], axes[(i, 2)], at_m[i]];
        let [r, g, b] = linear(finish.colour);
        let rows = [row(0), row(1), row(2), [r, g, b, finish.gloss], [finish.sharpness, finish.glow, 0.0, 0.0]];
        let mut body = Body::default();
        body.iter_mut().zip(rows.iter().flatten()).for_each(|(to, from)| *to = *from);
        if body.iter().all(|number| number.is_finite()) {
            self.bodies.push((shape, body));
        }
    }
}

fn linear(colour: [f32; 3]) -> [f32; 3] {
    colour.map(|c| c.powf(2.2))
}

fn single(v: [f64; 3]) -> Vector3<f32> {
    Vector3::from(v.map(|c| c as f32))
}

#[cfg(test)]
mod tests;
