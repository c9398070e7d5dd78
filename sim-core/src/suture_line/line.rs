//! The suture line of a scene: through the suture points already taken, then free to the hand.
//!
//! Free part: length `L_f = L − Σ|path|`, ends `a` (last suture point) and `b` (hand), extension `r = |b − a|/L_f`.
//! Below [`STRAIGHT_RATIO`] it hangs by Follow the Leader without tension; from there on it is a straight
//! polyline; beyond r = 1 the tension `T = EA/L_f·(|b − a| − L_f)` is reported (what pulls is named in `scene::line_course`; Zhang et al.,
//! §2.1; their line is always taut). Metres, newtons.
//!
//! A cut drops the tension and leaves both halves, each led by its own end. Deliberately absent: the hand's pull at 1 kHz
//! (`kinematics::line_pull`), tied stitches (`wound::stitch`), gravity, contact with tissue.

use crate::suture_line::follow_the_leader::{follow_both, follow_first, follow_last};
use crate::suture_line::tension::{STRAIGHT_RATIO, axial_tension_n, extension_ratio, path_length_m};
use crate::vector::Vec3;

/// Suture points a line is drawn through; of a longer path the newest are kept.
pub const MAX_PATH_POINTS: usize = 64;
/// Links of the free part: with the path, a line fits 128 drawn points.
pub const MAX_LINKS: usize = 63;
/// A chain that misses its end by less than this has met it: a tenth of what a viewer can show.
const MEETING_TOLERANCE_M: f64 = 1e-5;
/// Sweeps per step with both ends held; the chain starts from the last step's shape, so it goes on converging.
const MAX_SWEEPS: usize = 32;

/// Validated properties of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SutureLineParams {
    length_m: f64,
    axial_stiffness_n: f64,
    links: usize,
}

/// Why a line is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SutureLineError {
    /// Length not usable.
    #[error("suture line: length_m = {length_m} is not usable: give a finite length above 0")]
    Length {
        /// The value.
        length_m: f64,
    },
    /// Stiffness not usable.
    #[error("suture line: axial_stiffness_n = {axial_stiffness_n} is not usable: give a finite EA of at least 0")]
    Stiffness {
        /// The value.
        axial_stiffness_n: f64,
    },
    /// Number of links not usable.
    #[error("suture line: {links} links are not usable: give 1 to {MAX_LINKS}")]
    Links {
        /// The value.
        links: usize,
    },
}

impl SutureLineParams {
    /// Checks length, axial stiffness `EA` and number of links of the free part.
    ///
    /// # Errors
    /// [`SutureLineError`] for the first value that cannot be used.
    pub fn new(length_m: f64, axial_stiffness_n: f64, links: usize) -> Result<Self, SutureLineError> {
        if !(length_m.is_finite() && length_m > 0.0) {
            return Err(SutureLineError::Length { length_m });
        }
        if !(axial_stiffness_n.is_finite() && axial_stiffness_n >= 0.0) {
            return Err(SutureLineError::Stiffness { axial_stiffness_n });
        }
        if links == 0 || links > MAX_LINKS {
            return Err(SutureLineError::Links { links });
        }
        Ok(Self { length_m, axial_stiffness_n, links })
    }
}

/// What the free end does in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FreeEnd {
    /// Nobody holds it.
    Loose,
    /// The hand holds the very end.
    Held(Vec3),
    /// The hand has gripped the line: between the last suture point and the hand is this much of it.
    Gripped {
        /// Where the hand is, metres.
        hand_m: Vec3,
        /// Length between last suture point and hand, metres.
        free_length_m: f64,
    },
}

/// Shape of the free part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineShape {
    /// Slack: Follow the Leader.
    Slack,
    /// Straight between its ends.
    Straight,
    /// Cut: two halves.
    Cut,
}

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStep {
    /// Shape of the free part.
    pub shape: LineShape,
    /// Extension `r` of the free part, 0 where an end is loose.
    pub extension_ratio: f64,
    /// Tension, newtons.
    pub tension_n: f64,
}

/// A suture line. All memory is taken when it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct SutureLine {
    params: SutureLineParams,
    /// Path, then the free part: the last path point is also the first free one.
    points: Vec<Vec3>,
    free: Vec<Vec3>,
    /// Last free point before the cut.
    cut_after: Option<usize>,
}

impl SutureLine {
    /// A straight line from `start_m` along `direction` (any length but 0; x where it is 0).
    #[must_use]
    pub fn new(params: SutureLineParams, start_m: Vec3, direction: Vec3) -> Self {
        let along = direction.try_normalize(0.0).unwrap_or_else(Vec3::x) * (params.length_m / params.links as f64);
        let free: Vec<Vec3> = (0..=params.links).map(|i| start_m + along * i as f64).collect();
        let mut points = Vec::with_capacity(MAX_PATH_POINTS + MAX_LINKS + 1);
        points.extend_from_slice(&free);
        Self { params, points, free, cut_after: None }
    }

    /// One step: the line runs through `path` (oldest suture point first, fixed) and on to its free end.
    pub fn step(&mut self, path: &[Vec3], end: FreeEnd) -> LineStep {
        let last = self.free.len() - 1;
        let rest_m = (self.params.length_m - path_length_m(path)).max(0.0);
        let (hand, free_m) = match end {
            FreeEnd::Loose => (None, rest_m),
            FreeEnd::Held(hand) => (Some(hand), rest_m),
            FreeEnd::Gripped { hand_m, free_length_m } => (Some(hand_m), free_length_m.clamp(0.0, rest_m)),
        };
        let link_m = free_m / last as f64;
        let anchor = path.last().copied();
        let slack = LineStep { shape: LineShape::Slack, extension_ratio: 0.0, tension_n: 0.0 };
        let step = if let Some(after) = self.cut_after {
            let (near, far) = self.free.split_at_mut(after + 1);
            if let Some(anchor) = anchor {
                near[0] = anchor;
            }
            if let (Some(hand), Some(end)) = (hand, far.last_mut()) {
                *end = hand;
            }
            follow_first(near, link_m);
            follow_last(far, link_m);
            LineStep { shape: LineShape::Cut, ..slack }
        } else {
            match (anchor, hand) {
                (None, None) => slack,
                (Some(anchor), None) => {
                    self.free[0] = anchor;
                    follow_first(&mut self.free, link_m);
                    slack
                }
                (None, Some(hand)) => {
                    self.free[last] = hand;
                    follow_last(&mut self.free, link_m);
                    slack
                }
                (Some(anchor), Some(hand)) => self.span(anchor, hand, free_m),
            }
        };
        self.points.clear();
        let drawn = path.len().saturating_sub(1).min(MAX_PATH_POINTS);
        let skipped = path.len().saturating_sub(1) - drawn;
        self.points.extend_from_slice(&path[skipped..skipped + drawn]);
        self.points.extend_from_slice(&self.free);
        step
    }

    /// The free part between two held ends.
    fn span(&mut self, anchor: Vec3, hand: Vec3, free_m: f64) -> LineStep {
        let last = self.free.len() - 1;
        let distance_m = (hand - anchor).norm();
        let extension_ratio = extension_ratio(distance_m, free_m);
        if extension_ratio < STRAIGHT_RATIO {
            let link_m = free_m / last as f64;
            follow_both(&mut self.free, anchor, hand, link_m, MEETING_TOLERANCE_M, MAX_SWEEPS);
            return LineStep { shape: LineShape::Slack, extension_ratio, tension_n: 0.0 };
        }
        for (i, point) in self.free.iter_mut().enumerate() {
            *point = anchor.lerp(&hand, i as f64 / last as f64);
        }
        let tension_n = axial_tension_n(self.params.axial_stiffness_n, free_m, distance_m);
        LineStep { shape: LineShape::Straight, extension_ratio, tension_n }
    }

    /// Cuts the free part at the fraction `at` of its length (0: at the last suture point, 1: at the hand). The
    /// first cut counts; the tension is gone from the next step on.
    pub fn cut(&mut self, at: f64) {
        let last = self.free.len() - 1;
        if self.cut_after.is_none() {
            self.cut_after = Some(((at.clamp(0.0, 1.0) * last as f64) as usize).min(last - 1));
        }
    }

    /// A new piece of the same line from `start_m` (scene restored); keeps the memory.
    pub fn restart(&mut self, start_m: Vec3, direction: Vec3) {
        let along = direction.try_normalize(0.0).unwrap_or_else(Vec3::x);
        let link_m = self.params.length_m / self.params.links as f64;
        for (i, point) in self.free.iter_mut().enumerate() {
            *point = start_m + along * (link_m * i as f64);
        }
        self.points.clear();
        self.points.extend_from_slice(&self.free);
        self.cut_after = None;
    }

    /// All points from the first suture point to the free end, at most [`MAX_PATH_POINTS`] + [`MAX_LINKS`] + 1.
    #[must_use]
    pub fn polyline(&self) -> &[Vec3] {
        &self.points
    }

    /// The polyline as it hangs together: one piece and an empty one, or the two halves of a cut line.
    #[must_use]
    pub fn pieces(&self) -> (&[Vec3], &[Vec3]) {
        let joint = self.cut_after.map_or(self.points.len(), |after| self.points.len() - self.free.len() + after + 1);
        self.points.split_at(joint)
    }
}

#[cfg(test)]
mod tests;
