//! The course of the suture line through a scene: through the tied stitches in the order of tying, through the pair at
//! work, and on to the needle in the hand (Zhang et al., §2.1: cylinders led by Follow the Leader).
//!
//! The line is drawn and reported from here; what pulls at the tissue are the tied stitches (`stitching`) and, while the
//! hand pulls, the servo's tension (`kinematics::line_pull`).

use crate::suture_line::line::{FreeEnd, LineStep, SutureLine, SutureLineParams};
use crate::vector::Vec3;

use super::suturing::{PairPlace, Stage, Suturing};

/// Points of a path that are collected at most: both points of 48 tied stitches and of the pair at work.
const PATH_CAPACITY: usize = 98;

/// The line of one scene.
#[derive(Clone, Debug)]
pub struct LineCourse {
    line: SutureLine,
    path: Vec<Vec3>,
    last: Option<LineStep>,
}

/// What the course depends on in a step.
pub(super) struct CourseInput<'a> {
    /// Where the suturing stands.
    pub(super) suturing: &'a Suturing,
    /// Where the pairs are.
    pub(super) places: &'a [PairPlace],
    /// Tied stitches in the order of tying: left and right point.
    pub(super) tied: &'a mut dyn Iterator<Item = [Vec3; 2]>,
    /// The needle, if a hand is there.
    pub(super) stylus_m: Option<Vec3>,
    /// Rest length of the line between stylus and left point while the hand pulls, metres.
    pub(super) pulled_length_m: f64,
}

impl LineCourse {
    /// A line that hangs straight up over the wound.
    #[must_use]
    pub fn new(params: SutureLineParams) -> Self {
        let line = SutureLine::new(params, Vec3::zeros(), Vec3::z());
        Self { line, path: Vec::with_capacity(PATH_CAPACITY), last: None }
    }

    /// Follows points and hand by one step.
    pub(super) fn step(&mut self, input: CourseInput<'_>) {
        self.path.clear();
        for [left, right] in input.tied {
            if self.path.len() + 4 <= PATH_CAPACITY {
                self.path.extend([left, right]);
            }
        }
        let stage = input.suturing.stage();
        let at_work = input.places.get(input.suturing.pair());
        match (stage, at_work) {
            (Stage::LeftHeld | Stage::LeftTaken, Some(place)) => self.path.push(place.left_m),
            (Stage::LinePulled | Stage::LineFree, Some(place)) => self.path.extend([place.left_m, place.right_m]),
            _ => {}
        }
        let end = match (input.stylus_m, stage, at_work) {
            (None, ..) => FreeEnd::Loose,
            (Some(hand_m), Stage::LinePulled, Some(place)) => {
                FreeEnd::Gripped { hand_m, free_length_m: input.pulled_length_m - place.distance_m() }
            }
            (Some(hand_m), ..) => FreeEnd::Held(hand_m),
        };
        self.last = Some(self.line.step(&self.path, end));
    }

    /// All points from the first suture point to the needle, metres.
    #[must_use]
    pub fn polyline(&self) -> &[Vec3] {
        self.line.polyline()
    }

    /// Shape and extension of the free part in the last step; `None` before the first.
    #[must_use]
    pub fn last_step(&self) -> Option<&LineStep> {
        self.last.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::suturing::HandInput;
    use crate::suture_line::line::LineShape;

    const LENGTH_M: f64 = 0.3;

    fn course() -> LineCourse {
        LineCourse::new(SutureLineParams::new(LENGTH_M, 273.0, 30).unwrap())
    }

    fn pulled() -> (Suturing, Vec<PairPlace>) {
        let places = vec![PairPlace {
            left_m: Vec3::new(-0.004, 0.0, 0.0),
            right_m: Vec3::new(0.004, 0.0, 0.0),
            closed_m: 0.004,
        }];
        let mut suturing = Suturing::new(1, 0.003);
        let at = |position_m, press_count, release_count| HandInput { position_m, press_count, release_count };
        suturing.advance(&at(places[0].left_m, 0, 0), &places);
        suturing.advance(&at(places[0].left_m, 1, 1), &places);
        suturing.advance(&at(places[0].right_m, 2, 1), &places);
        (suturing, places)
    }

    #[test]
    fn a_pulled_line_is_straight_from_the_right_point_to_the_needle() {
        let (suturing, places) = pulled();
        let hand = Vec3::new(0.01, 0.0, 0.02);
        let mut course = course();
        course.step(CourseInput {
            suturing: &suturing,
            places: &places,
            tied: &mut std::iter::empty(),
            stylus_m: Some(hand),
            pulled_length_m: 0.02,
        });
        let points = course.polyline();
        assert_eq!((points[0], points[1], *points.last().unwrap()), (places[0].left_m, places[0].right_m, hand));
        assert_eq!(course.last_step().unwrap().shape, LineShape::Straight);
        let drawn: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let taut = places[0].distance_m() + (hand - places[0].right_m).norm();
        assert!((drawn - taut).abs() < 1e-12);
    }

    #[test]
    fn a_slack_line_keeps_its_length() {
        let mut course = course();
        let suturing = Suturing::new(0, 0.003);
        let tied = [Vec3::new(-0.002, 0.0, 0.0), Vec3::new(0.002, 0.0, 0.0)];
        for _ in 0..200 {
            course.step(CourseInput {
                suturing: &suturing,
                places: &[],
                tied: &mut std::iter::once(tied),
                stylus_m: Some(Vec3::new(0.03, 0.0, 0.05)),
                pulled_length_m: 0.0,
            });
        }
        let drawn: f64 = course.polyline().windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        // Both ends are held: the chain meets them within a tenth of a millimetre of its length.
        assert!((drawn - LENGTH_M).abs() < 1e-4, "{drawn}");
        assert_eq!(course.last_step().unwrap().shape, LineShape::Slack);
    }
}
