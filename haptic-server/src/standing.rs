//! Where a session stands: what a solver that is started again must know.
//!
//! The servo process, which outlives its solvers, makes it of the newest wound report; the supervisor keeps it and writes it as
//! one JSON line to the standard input of the next solver, which ties the stitches again. A stitch that was tied in the last
//! hundredth of a second before a death may be missing: the hand then finds its pair open.
//! Deliberately absent: what the hand held (it takes it again).

use crate::error::ServerError;
use protocol::wound_report::WoundReport;
use serde::{Deserialize, Serialize};
use sim_core::scene::procedure::ProcedureStanding;
use sim_core::scene::stitching::TiedStitch;
use sim_core::vector::Vec3;
use sim_core::wound::control::ControlMode;
use sim_core::wound::ledger::StitchHistory;
use std::io::Read;

/// Scene generations that a solver may have gone through without anybody having heard of it: a queue full of session
/// commands.
const UNSEEN_GENERATIONS: u32 = 16;
/// Most that is read, bytes: many times what the stitches of a full ledger need.
const LONGEST: u64 = 1 << 20;
/// `LedgerRow::flags`: the control acts now; that is of the moment.
const ACTS_NOW: u32 = 1;

/// Where a session stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standing {
    /// Scene of the procedure.
    pub scene_index: u32,
    /// Scene loads and restores so far.
    pub scene_generation: u32,
    /// Control mode code of `wound_report`; none before the first report.
    pub control: Option<u32>,
    /// Tied stitches of all scenes in the order of tying.
    pub stitches: Vec<StandingStitch>,
}

/// A tied stitch, as the columns of `wound_report` have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandingStitch {
    /// Scene of the procedure.
    pub scene_index: u32,
    /// Suture pair of that scene.
    pub pair: u32,
    /// Left suture point when the stitch was finished, metres.
    pub left_original_m: [f64; 3],
    /// Right suture point when the stitch was finished, metres.
    pub right_original_m: [f64; 3],
    /// Rest length of the tied line, metres.
    pub rest_length_m: f64,
    /// Length that has slipped through its knot, metres.
    pub slipped_m: f64,
    /// What has happened to it.
    pub flags: u32,
}

impl Standing {
    /// What a report says.
    #[must_use]
    pub fn of(report: &WoundReport) -> Self {
        let rows = report.rows.iter().take(report.row_count as usize);
        let stitches = rows.map(|row| StandingStitch {
            scene_index: row.scene_index,
            pair: row.pair,
            left_original_m: row.left_original_m,
            right_original_m: row.right_original_m,
            rest_length_m: row.rest_length_m,
            slipped_m: row.slipped_m,
            flags: row.flags & !ACTS_NOW,
        });
        Self {
            scene_index: report.scene_index,
            scene_generation: report.scene_generation,
            control: Some(report.control),
            stitches: stitches.collect(),
        }
    }

    /// What the next solver begins with: a generation that none before it had, so that hands and viewers see a new scene and
    /// not an old one that jumped. `begun_with` is what the last one began with.
    #[must_use]
    pub fn for_successor(&self, begun_with: u32) -> Self {
        let last = self.scene_generation.max(begun_with);
        Self { scene_generation: last.saturating_add(UNSEEN_GENERATIONS), ..self.clone() }
    }

    /// Reads one from a supervisor.
    ///
    /// # Errors
    /// 65 when it is not one.
    pub fn read(source: impl Read) -> Result<Self, ServerError> {
        let unreadable = |error: String| {
            ServerError::BadData(format!(
                "standard input: where the session stands is not understood: {error}; use programs of one build"
            ))
        };
        let mut text = String::new();
        source.take(LONGEST).read_to_string(&mut text).map_err(|e| unreadable(e.to_string()))?;
        serde_json::from_str(&text).map_err(|e| unreadable(e.to_string()))
    }

    /// In the words of the tissue; whether it fits the procedure is seen there.
    #[must_use]
    pub fn of_procedure(&self) -> ProcedureStanding {
        let control = match self.control {
            Some(0) => Some(ControlMode::Off),
            Some(1) => Some(ControlMode::Sound),
            Some(2) => Some(ControlMode::Paper),
            _ => None,
        };
        let stitch = |s: &StandingStitch| TiedStitch {
            pair: s.pair as usize,
            left_original_m: Vec3::from(s.left_original_m),
            right_original_m: Vec3::from(s.right_original_m),
            rest_length_m: s.rest_length_m,
            slipped_m: s.slipped_m,
            history: StitchHistory {
                control_acts: false,
                control_has_acted: s.flags & 2 != 0,
                knot_slipped: s.flags & 4 != 0,
                pulled_through: s.flags & 8 != 0,
            },
        };
        ProcedureStanding {
            scene: self.scene_index as usize,
            generation: self.scene_generation,
            control,
            stitches: self.stitches.iter().map(|s| (s.scene_index as usize, stitch(s))).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use protocol::wire::Field;
    use protocol::wound_report::LedgerRow;

    fn standing() -> Standing {
        let mut report =
            WoundReport { row_count: 2, scene_index: 1, scene_generation: 5, control: 2, ..WoundReport::EMPTY };
        let row =
            LedgerRow { right_original_m: [0.003, 0.0, 0.1], rest_length_m: 0.003, flags: 0b1111, ..LedgerRow::EMPTY };
        report.rows[0] = row;
        report.rows[1] = LedgerRow { scene_index: 1, pair: 3, slipped_m: 1.0 / 3.0, flags: 0, ..row };
        Standing::of(&report)
    }

    #[test]
    fn a_report_comes_through_the_line_to_the_tissue_unchanged() {
        let line = serde_json::to_string(&standing()).expect("finite numbers");
        let read = Standing::read(line.as_bytes()).expect("own line");
        assert_eq!(read, standing());
        let tissue = read.of_procedure();
        assert_eq!((tissue.scene, tissue.generation, tissue.control), (1, 5, Some(ControlMode::Paper)));
        let [(0, first), (1, second)] = tissue.stitches[..] else { panic!("{tissue:?}") };
        assert!(first.history.pulled_through && first.history.knot_slipped && !first.history.control_acts);
        assert_eq!((second.pair, second.slipped_m, second.history), (3, 1.0 / 3.0, StitchHistory::default()));
    }

    #[test]
    fn no_two_solvers_in_a_row_have_a_generation_in_common() {
        let first = Standing::default().for_successor(0);
        // The second died before anybody heard of it; the third was restored often.
        let second = Standing::default().for_successor(first.scene_generation);
        let restored = Standing { scene_generation: second.scene_generation + 9, ..second.clone() };
        let third = restored.for_successor(second.scene_generation);
        assert!(0 < first.scene_generation && first.scene_generation < second.scene_generation);
        assert!(restored.scene_generation < third.scene_generation);
    }

    proptest! {
        #[test]
        fn nothing_that_is_not_one_passes(text in ".{0,200}", cut in 0_usize..300) {
            prop_assert!(Standing::read(text.as_bytes()).is_err());
            let line = serde_json::to_string(&standing()).expect("finite numbers");
            let cut = cut.min(line.len() - 1);
            prop_assert!(Standing::read(&line.as_bytes()[..cut]).is_err());
        }
    }
}
