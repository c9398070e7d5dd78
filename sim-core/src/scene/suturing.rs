//! Suturing by hand, in the paper's manner: which suture point the hand takes, and when a stitch is tied.
//!
//! ```text
//! Idle ──press near a free left point──▶ LeftHeld ──release──▶ LeftTaken
//!   ▲                                                              │ press near its partner
//!   │                      release, gap open ◀──┐                  ▼
//!   └──release, gap closed (tie)── LinePulled ──┴─▶ LineFree ──press near the right point──▶ LinePulled
//! ```
//! When every pair is tied the stage is `Done`. A tied point can be dragged in `Idle` and `Done`: that is
//! the disturbance against which the suture control of §2.3 works. Puncture and needle are absent: a
//! suture point is an existing mass node (Zhang et al., §2.2).

use crate::vector::Vec3;

/// Where the suturing of a scene stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// No line in a pair: the next free left point is to be taken.
    Idle,
    /// The needle holds the left point.
    LeftHeld,
    /// The line is through the left point; its partner is to be taken.
    LeftTaken,
    /// The hand pulls the line at the right point.
    LinePulled,
    /// The hand let go of the line before the gap was closed.
    LineFree,
    /// Every pair is tied.
    Done,
}

impl Stage {
    /// The code of the wire.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Self::Idle => 0,
            Self::LeftHeld => 1,
            Self::LeftTaken => 2,
            Self::LinePulled => 3,
            Self::LineFree => 4,
            Self::Done => 5,
        }
    }
}

/// What the hand did since the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandInput {
    /// Stylus position, metres.
    pub position_m: Vec3,
    /// Rising edges of button 1 since start.
    pub press_count: u32,
    /// Falling edges of button 1 since start.
    pub release_count: u32,
}

/// Where the two points of a pair are now, and when their gap counts as closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairPlace {
    /// Left suture point, metres.
    pub left_m: Vec3,
    /// Right suture point, metres.
    pub right_m: Vec3,
    /// A distance at or below this is a closed gap, metres.
    pub closed_m: f64,
}

impl PairPlace {
    /// Distance of the two points, metres.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        (self.right_m - self.left_m).norm()
    }
}

/// Which point of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left of the wound.
    Left,
    /// Right of the wound.
    Right,
}

/// What the hand's act means for the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SuturingEvent {
    /// The needle took the left point of this pair.
    LeftTaken(usize),
    /// The needle let go of the left point; the line stays in it.
    LeftReleased(usize),
    /// The hand pulls the line of this pair.
    LineTaken(usize),
    /// The hand let go of the line with the gap open.
    LineReleased(usize),
    /// The stitch of this pair is tied.
    Tied(usize),
    /// A tied point is dragged.
    DragBegun(usize, Side),
    /// The dragged point is let go.
    DragEnded(usize),
}

/// The state machine of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Suturing {
    stage: Stage,
    pair: usize,
    dragged: Option<usize>,
    drags: usize,
    tied: Vec<bool>,
    points_taken: u32,
    grips_used: u32,
    seen: Option<(u32, u32)>,
    capture_radius_m: f64,
}

impl Suturing {
    /// A scene with `pairs` free pairs; a point is taken within `capture_radius_m` of the stylus.
    #[must_use]
    pub fn new(pairs: usize, capture_radius_m: f64) -> Self {
        Self {
            stage: if pairs == 0 { Stage::Done } else { Stage::Idle },
            pair: 0,
            dragged: None,
            drags: 0,
            tied: vec![false; pairs],
            points_taken: 0,
            grips_used: 0,
            seen: None,
            capture_radius_m,
        }
    }

    /// Where the suturing stands.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The pair at work: the one in hand, else the next free one, else the last.
    #[must_use]
    pub fn pair(&self) -> usize {
        match self.stage {
            Stage::Idle => self.next_free().unwrap_or(0),
            _ => self.pair,
        }
    }

    /// Stitches tied.
    #[must_use]
    pub fn stitches(&self) -> usize {
        self.tied.iter().filter(|t| **t).count()
    }

    /// Suture points that the hand took.
    #[must_use]
    pub fn points_taken(&self) -> u32 {
        self.points_taken
    }

    /// Presses that took something: a point, the line again, or a tied point.
    #[must_use]
    pub fn grips_used(&self) -> u32 {
        self.grips_used
    }

    /// How often a tied point was dragged and let go.
    #[must_use]
    pub fn drags(&self) -> usize {
        self.drags
    }

    /// Back to the start; only the counts of points and grips go on. What the hand did meanwhile is not made up for.
    pub fn restart(&mut self) {
        let fresh = Self::new(self.tied.len(), self.capture_radius_m);
        *self = Self { points_taken: self.points_taken, grips_used: self.grips_used, ..fresh };
    }

    /// Counts a pair as tied that another solver tied; both of its points were taken then.
    pub(super) fn resume(&mut self, pair: usize) {
        self.pair = pair;
        self.points_taken += 2;
        self.finish_stitch();
    }

    /// The pair and side that the hand should reach for next. After the last stitch: the tied right
    /// points in turn, one per drag.
    #[must_use]
    pub fn next_target(&self) -> Option<(usize, Side)> {
        match self.stage {
            Stage::Idle => self.next_free().map(|p| (p, Side::Left)),
            Stage::LeftHeld | Stage::LeftTaken | Stage::LinePulled | Stage::LineFree => Some((self.pair, Side::Right)),
            Stage::Done if self.tied.is_empty() => None,
            Stage::Done => Some((self.dragged.unwrap_or(self.drags % self.tied.len()), Side::Right)),
        }
    }

    /// Takes in what the hand did. At most two events, in the order of the edges: a hand whose button was up pressed
    /// first, one whose button was down released first.
    pub fn advance(&mut self, hand: &HandInput, places: &[PairPlace]) -> [Option<SuturingEvent>; 2] {
        let was_down = self.seen.is_some_and(|(p, r)| p != r);
        let (presses, releases) = self.edges(hand);
        let press = |s: &mut Self| {
            let taken = if presses > 0 { s.press(hand.position_m, places) } else { None };
            s.grips_used += u32::from(taken.is_some());
            taken
        };
        if was_down {
            let released = if releases > 0 { self.release(places) } else { None };
            return [released, press(self)];
        }
        let pressed = press(self);
        [pressed, if releases > 0 { self.release(places) } else { None }]
    }

    /// Ties the stitch in hand now.
    ///
    /// # Errors
    /// The reason why there is nothing to tie, as a sentence.
    pub fn tie(&mut self, places: &[PairPlace]) -> Result<SuturingEvent, &'static str> {
        if !matches!(self.stage, Stage::LinePulled | Stage::LineFree) {
            return Err("no line is through both points of a pair");
        }
        if places[self.pair].distance_m() > places[self.pair].closed_m {
            return Err("the gap is still open; pull the line until it is closed");
        }
        Ok(self.finish_stitch())
    }

    /// Edges since the last call. A first call only notes the counters: a button held at start is no press.
    fn edges(&mut self, hand: &HandInput) -> (u32, u32) {
        let now = (hand.press_count, hand.release_count);
        let (p, r) = self.seen.replace(now).unwrap_or(now);
        (now.0.wrapping_sub(p), now.1.wrapping_sub(r))
    }

    fn press(&mut self, stylus: Vec3, places: &[PairPlace]) -> Option<SuturingEvent> {
        let near = |p: Vec3| (p - stylus).norm();
        match self.stage {
            Stage::Idle => {
                let free = nearest(places.iter().enumerate().filter(|(i, _)| !self.tied[*i]), |p| near(p.left_m));
                match free {
                    Some((pair, distance)) if distance <= self.capture_radius_m => {
                        self.pair = pair;
                        self.stage = Stage::LeftHeld;
                        self.points_taken += 1;
                        Some(SuturingEvent::LeftTaken(pair))
                    }
                    _ => self.drag(stylus, places),
                }
            }
            Stage::LeftTaken | Stage::LineFree if near(places[self.pair].right_m) <= self.capture_radius_m => {
                self.points_taken += u32::from(self.stage == Stage::LeftTaken);
                self.stage = Stage::LinePulled;
                Some(SuturingEvent::LineTaken(self.pair))
            }
            Stage::Done => self.drag(stylus, places),
            _ => None,
        }
    }

    fn drag(&mut self, stylus: Vec3, places: &[PairPlace]) -> Option<SuturingEvent> {
        let tied = || places.iter().enumerate().filter(|(i, _)| self.tied[*i]);
        let left = nearest(tied(), |p| (p.left_m - stylus).norm());
        let right = nearest(tied(), |p| (p.right_m - stylus).norm());
        let (pair, distance, side) = match (left, right) {
            (Some((l, a)), Some((_, b))) if a < b => (l, a, Side::Left),
            (_, Some((r, b))) => (r, b, Side::Right),
            _ => return None,
        };
        if distance > self.capture_radius_m {
            return None;
        }
        self.dragged = Some(pair);
        Some(SuturingEvent::DragBegun(pair, side))
    }

    fn release(&mut self, places: &[PairPlace]) -> Option<SuturingEvent> {
        if let Some(pair) = self.dragged.take() {
            self.drags += 1;
            return Some(SuturingEvent::DragEnded(pair));
        }
        match self.stage {
            Stage::LeftHeld => {
                self.stage = Stage::LeftTaken;
                Some(SuturingEvent::LeftReleased(self.pair))
            }
            Stage::LinePulled if places[self.pair].distance_m() <= places[self.pair].closed_m => {
                Some(self.finish_stitch())
            }
            Stage::LinePulled => {
                self.stage = Stage::LineFree;
                Some(SuturingEvent::LineReleased(self.pair))
            }
            _ => None,
        }
    }

    fn finish_stitch(&mut self) -> SuturingEvent {
        self.tied[self.pair] = true;
        self.stage = if self.next_free().is_some() { Stage::Idle } else { Stage::Done };
        SuturingEvent::Tied(self.pair)
    }

    fn next_free(&self) -> Option<usize> {
        self.tied.iter().position(|t| !t)
    }
}

/// Index and distance of the nearest place; the lower index wins a tie.
fn nearest<'a>(
    places: impl Iterator<Item = (usize, &'a PairPlace)>,
    distance: impl Fn(&PairPlace) -> f64,
) -> Option<(usize, f64)> {
    places.map(|(i, p)| (i, distance(p))).min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests;
