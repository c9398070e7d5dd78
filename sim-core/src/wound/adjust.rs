//! "Adjust and update" of Algorithm 2, as printed: suture points move, at once, to their original distance.
//!
//! For all previous stitches, newest first (`i ← i − 1`): where `ER > 10 %`, `p_cl` and `p_cr` move by half of
//! `D_o − D_c` each, apart or together along their line, so that `D_c = D_o`; then the row is measured again
//! (Zhang et al., Algorithm 2). The paper makes one pass; here passes repeat until nothing is left to do, at most
//! as many as there are rows, and what is left is reported. Metres.
//!
//! Deliberately absent: velocities and the tissue around the points, which do not know of the jump.

use crate::vector::Vec3;
use crate::wound::ledger::Ledger;

/// A literal position update of Algorithm 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlCorrection {
    /// Ledger row.
    pub row: usize,
    /// Suture pair.
    pub pair: u32,
    /// Displacement of the left suture point, metres.
    pub left_m: Vec3,
    /// Displacement of the right suture point, metres.
    pub right_m: Vec3,
}

/// Algorithm 2 as printed, repeated until a pass changes nothing. Rows that share a pair share its suture points, so
/// adjusting one may break another: what is left is returned as the largest remaining `ER`.
pub(super) fn adjust_as_printed(
    engage_error: f64,
    ledger: &mut Ledger,
    corrections: &mut Vec<ControlCorrection>,
) -> (usize, f64) {
    let count = ledger.rows().len();
    let mut passes = 0;
    while passes < count {
        passes += 1;
        let mut changed = false;
        for index in (0..count).rev() {
            let row = ledger.rows()[index];
            if row.relative_error <= engage_error || row.history.pulled_through {
                continue;
            }
            let across = row.right_current_m - row.left_current_m;
            let original = row.right_original_m - row.left_original_m;
            // Points that have met have no line of their own: they part along the one they had.
            let line = if across.norm() > 0.0 { across } else { original };
            let Some(direction) = line.try_normalize(0.0) else { continue };
            let half = direction * (0.5 * (row.original_distance_m - row.current_distance_m));
            let (left, right) = (row.left_current_m - half, row.right_current_m + half);
            for other in 0..count {
                if ledger.rows()[other].pair == row.pair {
                    ledger.measure(other, left, right);
                }
            }
            note_correction(corrections, index, row.pair, half);
            changed = true;
        }
        if !changed {
            break;
        }
    }
    (passes, ledger.worst_error())
}

/// Adds to the row's correction, so that applying all of them once gives the ledger's positions.
fn note_correction(corrections: &mut Vec<ControlCorrection>, row: usize, pair: u32, half: Vec3) {
    if let Some(known) = corrections.iter_mut().find(|c| c.row == row) {
        known.left_m -= half;
        known.right_m += half;
    } else {
        corrections.push(ControlCorrection { row, pair, left_m: -half, right_m: half });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding on distances of a few millimetres.
    const ROUND_M: f64 = 1e-16;
    const ENGAGE: f64 = 0.10;

    fn opened(original_m: f64, left: Vec3, right: Vec3) -> Ledger {
        let mut ledger = Ledger::default();
        let row = ledger.record(0, Vec3::zeros(), Vec3::new(original_m, 0.0, 0.0), 0.008).expect("room");
        ledger.measure(row, left, right);
        ledger
    }

    #[test]
    fn algorithm2_moves_both_points_half_way_to_the_original_distance() {
        // 4 mm tied, 5 mm now along (3, 4, 0)/5: each point moves 0.5 mm inwards.
        let line = Vec3::new(0.6, 0.8, 0.0);
        let (left, right) = (Vec3::new(0.001, 0.002, 0.0), Vec3::new(0.001, 0.002, 0.0) + line * 0.005);
        let mut ledger = opened(0.004, left, right);
        let mut corrections = Vec::new();
        let (passes, residual) = adjust_as_printed(ENGAGE, &mut ledger, &mut corrections);
        assert_eq!((passes, corrections.len()), (1, 1));
        assert!((corrections[0].left_m - line * 0.0005).norm() < ROUND_M);
        assert!((corrections[0].right_m + line * 0.0005).norm() < ROUND_M);
        let row = ledger.rows()[0];
        assert!((row.left_current_m - left - corrections[0].left_m).norm() < ROUND_M);
        assert!((row.current_distance_m - 0.004).abs() < 10.0 * ROUND_M && residual < 1e-12);
    }

    #[test]
    fn algorithm2_is_symmetric_it_also_parts_a_stitch_that_tightened() {
        let mut ledger = opened(0.004, Vec3::zeros(), Vec3::new(0.003, 0.0, 0.0));
        let mut corrections = Vec::new();
        adjust_as_printed(ENGAGE, &mut ledger, &mut corrections);
        assert!((corrections[0].left_m.x + 0.0005).abs() < ROUND_M);
        assert!((ledger.rows()[0].current_distance_m - 0.004).abs() < 10.0 * ROUND_M);
    }

    #[test]
    fn algorithm2_leaves_errors_up_to_ten_percent_alone() {
        for (distance, acts) in [(0.004_39, false), (0.004_41, true), (0.003_61, false), (0.003_59, true)] {
            let mut ledger = opened(0.004, Vec3::zeros(), Vec3::new(distance, 0.0, 0.0));
            let mut corrections = Vec::new();
            adjust_as_printed(ENGAGE, &mut ledger, &mut corrections);
            assert_eq!(!corrections.is_empty(), acts, "distance {distance}");
        }
    }

    #[test]
    fn algorithm2_visits_the_newest_stitch_first_and_points_that_met_part_along_their_old_line() {
        let mut ledger = Ledger::default();
        for pair in 0..3 {
            let row = ledger.record(pair, Vec3::zeros(), Vec3::new(0.0, 0.004, 0.0), 0.008).expect("room");
            ledger.measure(row, Vec3::zeros(), Vec3::zeros());
        }
        let mut corrections = Vec::new();
        adjust_as_printed(ENGAGE, &mut ledger, &mut corrections);
        assert!(corrections.iter().map(|c| c.row).eq([2, 1, 0]));
        assert!((corrections[0].right_m - Vec3::new(0.0, 0.002, 0.0)).norm() < ROUND_M);
    }

    #[test]
    fn algorithm2_ends_and_reports_what_is_left_when_two_stitches_of_one_pair_disagree() {
        let mut ledger = Ledger::default();
        for original_m in [0.004, 0.006] {
            ledger.record(0, Vec3::zeros(), Vec3::new(original_m, 0.0, 0.0), 0.008).expect("room");
        }
        for row in 0..2 {
            ledger.measure(row, Vec3::zeros(), Vec3::new(0.006, 0.0, 0.0));
        }
        let mut corrections = Vec::new();
        let (passes, residual) = adjust_as_printed(ENGAGE, &mut ledger, &mut corrections);
        assert_eq!(passes, 2);
        // The older row is adjusted last and wins: 4 mm, where the newer one wants 6 mm.
        assert!((residual - 1.0 / 3.0).abs() < 1e-9);
    }
}
