//! The data form of the suture control strategy: one row per tied stitch.
//!
//! Columns of Zhang et al., Table 1: original and current position of the left and the right suture point,
//! original distance `D_o` and current distance `D_c`; beside them the distance of the open wound, the
//! relative error, forces and history. Metres and newtons (Table 1 prints millimetres).
//!
//! `ER = |D_c − D_o| / max(D_o, D_floor)`. `D_o` is the distance when that stitch was finished: read as the open
//! wound's distance, the strategy would pull a closed wound open again. Deliberately absent: acting on the error
//! (`control`), the elastic behaviour of a stitch (`stitch`), files.

use crate::vector::Vec3;
use crate::wound::stitch::Stitch;

/// Rows of one ledger: three scenes of up to 16 stitches. Memory for all of them is taken at once.
pub const LEDGER_CAPACITY: usize = 48;

/// Floor of `D_o` in the relative error, metres. At 2 mm the 10 % band is 0.2 mm; below it, the band would sink
/// into the 55 µm steps of an Omni's encoders and the control would chatter, and a closed wound would divide by 0.
pub const DISTANCE_FLOOR_M: f64 = 0.002;

/// What has happened to a stitch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StitchHistory {
    /// The control holds or moves it now.
    pub control_acts: bool,
    /// The control has acted on it.
    pub control_has_acted: bool,
    /// Its knot has slipped.
    pub knot_slipped: bool,
    /// It needed more force than the tissue bears and was let go for good.
    pub pulled_through: bool,
}

/// One row of Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LedgerRow {
    /// Suture pair of the scene.
    pub pair: u32,
    /// `p_ol`: left suture point when the stitch was finished, metres.
    pub left_original_m: Vec3,
    /// `p_cl`: left suture point now, metres.
    pub left_current_m: Vec3,
    /// `p_or`: right suture point when the stitch was finished, metres.
    pub right_original_m: Vec3,
    /// `p_cr`: right suture point now, metres.
    pub right_current_m: Vec3,
    /// Distance of the pair in the open wound, before suturing, metres.
    pub open_distance_m: f64,
    /// `D_o = |p_ol − p_or|`, metres.
    pub original_distance_m: f64,
    /// `D_c = |p_cl − p_cr|`, metres.
    pub current_distance_m: f64,
    /// `ER`, a fraction.
    pub relative_error: f64,
    /// Force with which the control holds the stitch, newtons.
    pub holding_force_n: f64,
    /// Largest holding force so far, newtons.
    pub holding_force_max_n: f64,
    /// Tension of the tied line, newtons.
    pub stitch_tension_n: f64,
    /// Rest length of the tied line, metres.
    pub rest_length_m: f64,
    /// Length that has slipped through its knot, metres.
    pub slipped_m: f64,
    /// History.
    pub history: StitchHistory,
}

/// Table 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    rows: Vec<LedgerRow>,
    distance_floor_m: f64,
}

/// The ledger has no row left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the ledger holds {LEDGER_CAPACITY} stitches and is full: restore the scene or start the next one")]
pub struct LedgerFull;

/// `ER = |D_c − D_o| / max(D_o, D_floor)` (Algorithm 2, with a floor).
#[must_use]
pub fn relative_error(current_m: f64, original_m: f64, floor_m: f64) -> f64 {
    (current_m - original_m).abs() / original_m.max(floor_m)
}

impl Default for Ledger {
    fn default() -> Self {
        Self::new(DISTANCE_FLOOR_M)
    }
}

impl Ledger {
    /// An empty ledger; `distance_floor_m` must be above 0.
    #[must_use]
    pub fn new(distance_floor_m: f64) -> Self {
        Self { rows: Vec::with_capacity(LEDGER_CAPACITY), distance_floor_m }
    }

    /// Writes the row of a stitch that has just been tied and returns its index.
    ///
    /// # Errors
    /// [`LedgerFull`] after [`LEDGER_CAPACITY`] stitches.
    pub fn record(
        &mut self,
        pair: u32,
        left_m: Vec3,
        right_m: Vec3,
        open_distance_m: f64,
    ) -> Result<usize, LedgerFull> {
        if self.rows.len() == LEDGER_CAPACITY {
            return Err(LedgerFull);
        }
        let original_distance_m = (left_m - right_m).norm();
        self.rows.push(LedgerRow {
            pair,
            left_original_m: left_m,
            left_current_m: left_m,
            right_original_m: right_m,
            right_current_m: right_m,
            open_distance_m,
            original_distance_m,
            current_distance_m: original_distance_m,
            relative_error: 0.0,
            holding_force_n: 0.0,
            holding_force_max_n: 0.0,
            stitch_tension_n: 0.0,
            rest_length_m: original_distance_m,
            slipped_m: 0.0,
            history: StitchHistory::default(),
        });
        Ok(self.rows.len() - 1)
    }

    /// Writes the current columns of a row: `p_cl`, `p_cr`, `D_c`, `ER`.
    pub fn measure(&mut self, row: usize, left_m: Vec3, right_m: Vec3) {
        let floor_m = self.distance_floor_m;
        let row = &mut self.rows[row];
        row.left_current_m = left_m;
        row.right_current_m = right_m;
        row.current_distance_m = (left_m - right_m).norm();
        row.relative_error = relative_error(row.current_distance_m, row.original_distance_m, floor_m);
    }

    /// Writes what the tied line does in a row; a slip stays in the history.
    pub fn note_stitch(&mut self, row: usize, tension_n: f64, stitch: &Stitch) {
        let row = &mut self.rows[row];
        row.stitch_tension_n = tension_n;
        row.rest_length_m = stitch.rest_length_m();
        row.slipped_m = stitch.slipped_m();
        row.history.knot_slipped |= row.slipped_m > 0.0;
    }

    /// Gives the row of a stitch that another solver tied the history that it had there.
    pub fn resume(&mut self, row: usize, history: StitchHistory) {
        self.rows[row].history = history;
    }

    /// Writes the force with which the control holds a row.
    pub(super) fn note_holding_force(&mut self, row: usize, force_n: f64) {
        let row = &mut self.rows[row];
        row.holding_force_n = force_n;
        row.holding_force_max_n = row.holding_force_max_n.max(force_n);
    }

    /// History of a row, for the control.
    pub(super) fn history_mut(&mut self, row: usize) -> &mut StitchHistory {
        &mut self.rows[row].history
    }

    /// All rows in the order of tying.
    #[must_use]
    pub fn rows(&self) -> &[LedgerRow] {
        &self.rows
    }

    /// `D_floor`, metres.
    #[must_use]
    pub fn distance_floor_m(&self) -> f64 {
        self.distance_floor_m
    }

    /// Largest `ER` of all rows, 0 when empty.
    #[must_use]
    pub fn worst_error(&self) -> f64 {
        self.rows.iter().map(|r| r.relative_error).fold(0.0, f64::max)
    }

    /// Forgets all rows (scene restored); keeps the memory.
    pub fn clear(&mut self) {
        self.rows.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table1_row_holds_both_positions_and_both_distances_of_a_stitch() {
        let mut ledger = Ledger::default();
        let (l, r) = (Vec3::new(-0.002, 0.01, 0.0), Vec3::new(0.002, 0.01, 0.0));
        let row = ledger.record(3, l, r, 0.008).expect("room");
        let (l_now, r_now) = (Vec3::new(-0.003, 0.011, 0.0), Vec3::new(0.002, 0.011, 0.0));
        ledger.measure(row, l_now, r_now);
        let row = ledger.rows()[row];
        assert_eq!((row.left_original_m, row.right_original_m), (l, r));
        assert_eq!((row.left_current_m, row.right_current_m), (l_now, r_now));
        assert_eq!((row.pair, row.open_distance_m), (3, 0.008));
        assert!((row.original_distance_m - 0.004).abs() < 1e-18);
        assert!((row.current_distance_m - 0.005).abs() < 1e-18);
        assert!((row.relative_error - 0.25).abs() < 1e-12);
    }

    #[test]
    fn table1_original_distance_is_that_of_the_finished_stitch_not_of_the_open_wound() {
        let mut ledger = Ledger::default();
        // 8 mm open, closed to 2.5 mm: no error right after tying, although the distance fell by 69 %.
        let row = ledger.record(0, Vec3::zeros(), Vec3::new(0.0025, 0.0, 0.0), 0.008).expect("room");
        ledger.measure(row, Vec3::zeros(), Vec3::new(0.0025, 0.0, 0.0));
        assert_eq!(ledger.rows()[row].relative_error, 0.0);
    }

    #[test]
    fn algorithm2_relative_error_has_a_floor_and_is_symmetric() {
        assert!((relative_error(0.0044, 0.004, 0.002) - 0.1).abs() < 1e-12);
        assert!((relative_error(0.0036, 0.004, 0.002) - 0.1).abs() < 1e-12);
        assert!((relative_error(0.0003, 0.0001, 0.002) - 0.1).abs() < 1e-12);
        assert_eq!(relative_error(0.0, 0.0, 0.002), 0.0);
    }

    #[test]
    fn table1_is_bounded_and_keeps_its_memory() {
        let mut ledger = Ledger::default();
        let memory = ledger.rows.capacity();
        for i in 0..LEDGER_CAPACITY {
            assert_eq!(ledger.record(i as u32, Vec3::zeros(), Vec3::zeros(), 0.0), Ok(i));
        }
        assert_eq!(ledger.record(0, Vec3::zeros(), Vec3::zeros(), 0.0), Err(LedgerFull));
        ledger.clear();
        assert_eq!(ledger.rows.capacity(), memory);
        assert_eq!(ledger.worst_error(), 0.0);
    }
}
