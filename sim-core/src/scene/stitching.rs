//! Tied stitches of a scene: their constraints in the solver, their rows in the ledger, and the control above them.
//!
//! Before a step every stitch (and, once the control has engaged, its hold) is a pull-only distance constraint between
//! two suture points. After the step distances are measured, knots slip, Table 1 is brought up to date and
//! Algorithm 2 looks at every row (Zhang et al., §2.3).

use crate::absent::{Keep, SUTURE_CONTROL, Stage};
use crate::tissue::constraint::{PairConstraint, PairSense, Pairs};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::Vec3;
use crate::wound::control::{ControlEvent, ControlMode, WoundControl};
use crate::wound::ledger::{LEDGER_CAPACITY, Ledger, StitchHistory};
use crate::wound::stitch::{Stitch, StitchParams};

use super::plan::ScenePlan;

/// Suture points of a pair as patches.
#[must_use]
pub(super) fn left_patch(pair: usize) -> PatchId {
    PatchId(2 * pair as u32)
}

/// Right suture point of a pair.
#[must_use]
pub(super) fn right_patch(pair: usize) -> PatchId {
    PatchId(2 * pair as u32 + 1)
}

/// A tied stitch with its constraints.
#[derive(Clone, Copy, Debug)]
struct Tied {
    pair: usize,
    stitch: Stitch,
    /// None when the solver refused it: the stitch then is in Table 1 and holds nothing.
    constraint: Option<usize>,
    hold: Option<usize>,
}

/// A stitch as another solver left it; the points' positions when it was finished give `D_o`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiedStitch {
    /// Suture pair.
    pub pair: usize,
    /// Left suture point when the stitch was finished, metres.
    pub left_original_m: Vec3,
    /// Right suture point when the stitch was finished, metres.
    pub right_original_m: Vec3,
    /// Rest length of the loop, metres.
    pub rest_length_m: f64,
    /// Length that has slipped through the knot, metres.
    pub slipped_m: f64,
    /// What has happened to it.
    pub history: StitchHistory,
}

/// A shift of a suture point that the control in paper mode asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointShift {
    /// Suture point.
    pub patch: PatchId,
    /// Displacement, metres.
    pub shift_m: Vec3,
}

/// All stitches of a scene.
#[derive(Clone, Debug)]
pub struct Stitching {
    params: StitchParams,
    tied: Vec<Tied>,
    ledger: Ledger,
    control: Option<Stage<WoundControl, SUTURE_CONTROL>>,
    holding_force_n: [f64; LEDGER_CAPACITY],
    events: Vec<ControlEvent>,
    shifts: Vec<PointShift>,
}

impl Stitching {
    /// No stitch yet; `None` when the scene has no suture line.
    #[must_use]
    pub fn new(plan: &ScenePlan) -> Option<Self> {
        let line = plan.line?;
        let floor = plan.control.map_or(crate::wound::ledger::DISTANCE_FLOOR_M, |c| c.distance_floor_m);
        Some(Self {
            params: line.stitch,
            tied: Vec::with_capacity(LEDGER_CAPACITY),
            ledger: Ledger::new(floor),
            control: plan.control.and_then(|c| Keep::keep(WoundControl::new(c.mode, c.params))),
            holding_force_n: [0.0; LEDGER_CAPACITY],
            events: Vec::with_capacity(LEDGER_CAPACITY),
            shifts: Vec::with_capacity(2 * LEDGER_CAPACITY),
        })
    }

    /// Table 1.
    #[must_use]
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// What the control did in the last step.
    #[must_use]
    pub fn events(&self) -> &[ControlEvent] {
        &self.events
    }

    /// Control mode; `None` when the scene has no control.
    #[must_use]
    pub fn control_mode(&self) -> Option<ControlMode> {
        self.control.as_ref().map(|c| c.mode())
    }

    /// Changes the control mode. Returns false when the scene has no control.
    pub fn set_control_mode(&mut self, mode: ControlMode, pairs: &mut Pairs, patches: &PatchSet) -> bool {
        let Some(control) = &mut self.control else { return false };
        control.set_mode(mode);
        for tied in self.tied.iter().filter(|t| t.hold.is_some()) {
            let slack = hold_constraint(tied.pair, f64::MAX, 1.0, 0.0);
            set(pairs, patches, tied.hold, slack);
        }
        true
    }

    /// Ties the stitch of a pair at its present distance (`D_o`). Returns false when the ledger is full.
    pub fn tie(&mut self, pair: usize, open_distance_m: f64, at: [Vec3; 2], pairs: &mut Pairs, set: &PatchSet) -> bool {
        let [left, right] = at;
        let stitch = Stitch::tie((right - left).norm());
        if self.ledger.record(pair as u32, left, right, open_distance_m).is_err() {
            return false;
        }
        let constraint = pairs.push(set, self.stitch_constraint(pair, &stitch)).ok();
        self.tied.push(Tied { pair, stitch, constraint, hold: None });
        true
    }

    /// Ties a stitch again that another solver tied. Returns false when the ledger is full.
    pub(super) fn resume(
        &mut self,
        tied: &TiedStitch,
        open_distance_m: f64,
        pairs: &mut Pairs,
        set: &PatchSet,
    ) -> bool {
        let [left, right] = [tied.left_original_m, tied.right_original_m];
        let Ok(row) = self.ledger.record(tied.pair as u32, left, right, open_distance_m) else { return false };
        self.ledger.resume(row, tied.history);
        let stitch = Stitch::resume(tied.rest_length_m, tied.slipped_m);
        let constraint = pairs.push(set, self.stitch_constraint(tied.pair, &stitch)).ok();
        self.tied.push(Tied { pair: tied.pair, stitch, constraint, hold: None });
        true
    }

    /// While stitches are tied again: each pulls as hard as it must towards its rest length, of which `share` of the way
    /// from the open wound is asked for.
    pub(super) fn draw(&self, share: f64, pairs: &mut Pairs, patches: &PatchSet) {
        for (tied, row) in self.tied.iter().zip(self.ledger.rows()) {
            let length_m = tied.stitch.rest_length_m();
            let target_m = length_m + (row.open_distance_m - length_m).max(0.0) * (1.0 - share);
            let drawn =
                PairConstraint { target_m, max_force_n: f64::MAX, ..self.stitch_constraint(tied.pair, &tied.stitch) };
            set(pairs, patches, tied.constraint, drawn);
        }
    }

    /// After that: knots hold what they hold, and Table 1 says where the points are.
    pub(super) fn hold_again(&mut self, position_m: &[Vec3], patches: &PatchSet, pairs: &mut Pairs) {
        for row in 0..self.tied.len() {
            let Tied { pair, stitch, constraint, .. } = self.tied[row];
            set(pairs, patches, constraint, self.stitch_constraint(pair, &stitch));
            let left = patches.mean(left_patch(pair), position_m);
            let right = patches.mean(right_patch(pair), position_m);
            self.ledger.measure(row, left, right);
            let tension_n = stitch.tension_n(&self.params, (right - left).norm()).min(self.params.holding_force_n());
            self.ledger.note_stitch(row, tension_n, &stitch);
        }
    }

    /// After a solver step: slip, Table 1 and Algorithm 2; sets the constraints of the next step.
    pub fn measure(&mut self, position_m: &[Vec3], patches: &PatchSet, pairs: &mut Pairs, dt_s: f64) {
        for row in 0..self.tied.len() {
            let Tied { pair, hold, .. } = self.tied[row];
            let left = patches.mean(left_patch(pair), position_m);
            let right = patches.mean(right_patch(pair), position_m);
            self.ledger.measure(row, left, right);
            let slip = self.tied[row].stitch.step(&self.params, (right - left).norm());
            self.ledger.note_stitch(row, slip.tension_n, &self.tied[row].stitch);
            if slip.slipped_m > 0.0 {
                let Tied { stitch, constraint, .. } = self.tied[row];
                set(pairs, patches, constraint, self.stitch_constraint(pair, &stitch));
            }
            self.holding_force_n[row] = hold.map_or(0.0, |h| pairs.tension_n(h));
        }
        self.supervise(patches, pairs, dt_s);
    }

    /// Displacements that the control in paper mode asks for; applied by the scene before the next step.
    #[must_use]
    pub fn shifts(&self) -> &[PointShift] {
        &self.shifts
    }

    /// After those displacements: Table 1 from where the points really are, since a point that a handle holds stayed.
    pub fn measure_again(&mut self, position_m: &[Vec3], patches: &PatchSet) {
        if self.shifts.is_empty() {
            return;
        }
        for (row, tied) in self.tied.iter().enumerate() {
            let left = patches.mean(left_patch(tied.pair), position_m);
            self.ledger.measure(row, left, patches.mean(right_patch(tied.pair), position_m));
        }
    }

    fn supervise(&mut self, patches: &PatchSet, pairs: &mut Pairs, dt_s: f64) {
        let Self { control, ledger, tied, holding_force_n, events, shifts, .. } = self;
        events.clear();
        shifts.clear();
        let Some(control) = control else { return };
        let outcome = control.supervise(ledger, dt_s, &holding_force_n[..tied.len()]);
        events.extend_from_slice(outcome.events);
        for event in outcome.events {
            if let ControlEvent::PulledThrough { row, .. } = *event {
                set(pairs, patches, tied[row].hold, hold_constraint(tied[row].pair, f64::MAX, 1.0, 0.0));
            }
        }
        for target in outcome.targets {
            let tied = &mut tied[target.row];
            let wanted = hold_constraint(tied.pair, target.target_m, target.stiffness_n_per_m, target.max_force_n);
            match tied.hold {
                None => tied.hold = pairs.push(patches, wanted).ok(),
                held => set(pairs, patches, held, wanted),
            }
        }
        for correction in outcome.corrections {
            let pair = correction.pair as usize;
            shifts.push(PointShift { patch: left_patch(pair), shift_m: correction.left_m });
            shifts.push(PointShift { patch: right_patch(pair), shift_m: correction.right_m });
        }
    }

    fn stitch_constraint(&self, pair: usize, stitch: &Stitch) -> PairConstraint {
        PairConstraint {
            a: left_patch(pair),
            b: right_patch(pair),
            target_m: stitch.rest_length_m(),
            stiffness_n_per_m: self.params.stiffness_n_per_m,
            max_force_n: self.params.holding_force_n(),
            sense: PairSense::PullOnly,
        }
    }
}

/// A hold with `max_force_n` 0 is let go: it pulls no more.
fn hold_constraint(pair: usize, target_m: f64, stiffness_n_per_m: f64, max_force_n: f64) -> PairConstraint {
    PairConstraint {
        a: left_patch(pair),
        b: right_patch(pair),
        target_m,
        stiffness_n_per_m,
        max_force_n,
        sense: PairSense::PullOnly,
    }
}

/// Replaces a constraint that was accepted before: its patches are known and its numbers validated.
fn set(pairs: &mut Pairs, patches: &PatchSet, index: Option<usize>, constraint: PairConstraint) {
    if let Some(index) = index {
        // A constraint that cannot be set stays as it was: the stitch then keeps its last length.
        let _ = pairs.set(patches, index, constraint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    #[test]
    fn a_full_ledger_takes_no_stitch_and_leaves_no_constraint_behind() {
        let plan = ScenePlan::new(&presets::skin()).unwrap();
        let patches = PatchSet::new(2, [(&[0_u32][..], &[1.0][..]), (&[1][..], &[1.0][..])]).unwrap();
        let (mut stitching, mut pairs) = (Stitching::new(&plan).unwrap(), Pairs::default());
        let at = [Vec3::zeros(), Vec3::new(0.004, 0.0, 0.0)];
        for stitch in 0..=LEDGER_CAPACITY {
            let room = stitch < LEDGER_CAPACITY;
            assert_eq!(stitching.tie(0, 0.008, at, &mut pairs, &patches), room);
        }
        assert_eq!((pairs.len(), stitching.ledger().rows().len()), (LEDGER_CAPACITY, LEDGER_CAPACITY));
    }
}
