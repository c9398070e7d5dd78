//! Taking a scene up where another solver left it: its stitches are tied again at load.
//!
//! What is known of a stitch is where its points were when it was finished (`D_o`), the rest length of its loop and what has
//! slipped through its knot. The tissue begins at rest with an open wound; each pair is drawn together over [`DRAW_S`], by
//! whatever force that needs and without slip, then the tissue comes to rest for [`REST_S`], then the knots hold what they
//! hold. Statics have no memory, so that the wound ends where it was. Metres, seconds.
//! Deliberately absent: what the hand held (it takes it again), and a hold of the suture control (it engages again when the
//! stitch is open beyond its limit).

use super::Scene;
use crate::finite::is_finite;
use crate::scene::stitching::{TiedStitch, left_patch, right_patch};

/// Time over which the pairs are drawn together, seconds: 10 mm at 2 cm/s, as a hand does it.
const DRAW_S: f64 = 0.5;
/// Time to come to rest, seconds; the drag of Table 2 relaxes a clamped sheet in a quarter of it.
const REST_S: f64 = 1.0;
/// No loop of a stitch is longer, metres.
const LONGEST_M: f64 = 1.0;

/// Why a scene cannot be taken up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// The procedure has no such scene.
    #[error("there is no scene {scene} in a procedure of {count}; resume the procedure that was left")]
    Scene {
        /// Index asked for.
        scene: usize,
        /// Scenes that there are.
        count: usize,
    },
    /// The scene has no suture line.
    #[error("the scene has no suture line to tie stitches with; resume the scene that was left")]
    NoLine,
    /// The scene has no such pair.
    #[error("there is no suture pair {pair} in a scene of {count}; resume the scene that was left")]
    Pair {
        /// Pair asked for.
        pair: usize,
        /// Pairs that there are.
        count: usize,
    },
    /// Two stitches in one pair.
    #[error("suture pair {pair} is said to be tied twice; give each stitch once")]
    Twice {
        /// Pair.
        pair: usize,
    },
    /// A number that no stitch has.
    #[error(
        "the stitch of pair {pair} has a length or position that no stitch has; give finite lengths up to {LONGEST_M} m"
    )]
    Number {
        /// Pair.
        pair: usize,
    },
}

impl Scene {
    /// Whether these stitches can be those of this scene.
    ///
    /// # Errors
    /// [`ResumeError`] names the first one that cannot.
    pub fn check_stitches(&self, stitches: &[TiedStitch]) -> Result<(), ResumeError> {
        let count = self.facts.len();
        for (index, stitch) in stitches.iter().enumerate() {
            let pair = stitch.pair;
            if self.stitching.is_none() {
                return Err(ResumeError::NoLine);
            }
            if pair >= count {
                return Err(ResumeError::Pair { pair, count });
            }
            if stitches[..index].iter().any(|s| s.pair == pair) {
                return Err(ResumeError::Twice { pair });
            }
            let length = |l: f64| (0.0..=LONGEST_M).contains(&l);
            let original_m = stitch.right_original_m - stitch.left_original_m;
            let finite = is_finite(&stitch.left_original_m) && is_finite(&stitch.right_original_m);
            if !(finite && length(original_m.norm()) && length(stitch.rest_length_m) && length(stitch.slipped_m)) {
                return Err(ResumeError::Number { pair });
            }
        }
        Ok(())
    }

    /// Ties these stitches again in a scene at its start and lets the tissue come to rest with them.
    ///
    /// # Errors
    /// As [`Self::check_stitches`]; the scene is then as it was.
    pub fn resume(&mut self, stitches: &[TiedStitch]) -> Result<(), ResumeError> {
        self.check_stitches(stitches)?;
        for stitch in stitches {
            let pair = stitch.pair;
            self.engage(left_patch(pair));
            self.engage(right_patch(pair));
            self.suturing.resume(pair);
            if let (Some(stitching), Some(pairs)) = (&mut self.stitching, &mut self.stages.pairs) {
                // Checked above: a scene has fewer pairs than the ledger has rows.
                stitching.resume(stitch, self.facts[pair].open_distance_m, pairs, self.solver.patches());
            }
        }
        if !stitches.is_empty() {
            self.draw_together();
        }
        Ok(())
    }

    fn draw_together(&mut self) {
        let period_s = self.solver.params().period_s;
        for step in 1..=((DRAW_S + REST_S) / period_s).ceil() as u32 {
            let share = (f64::from(step) * period_s / DRAW_S).min(1.0);
            if let (Some(stitching), Some(pairs)) = (&self.stitching, &mut self.stages.pairs) {
                stitching.draw(share, pairs, self.solver.patches());
            }
            self.last = self.solver.step(&mut self.stages);
        }
        if let (Some(stitching), Some(pairs)) = (&mut self.stitching, &mut self.stages.pairs) {
            stitching.hold_again(&self.solver.state().position_m, self.solver.patches(), pairs);
        }
        self.measure_places();
        self.follow_line(None);
    }
}
