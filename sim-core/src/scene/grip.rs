//! Which suture points the servo integrates at 1 kHz, and as what.
//!
//! `Held`: the needle holds the point (two-sided coupling). `Pulled` and `Linked`: the line runs stylus → right
//! point → left point (Zhang et al., Fig. 3). The epoch changes with every change here, so that a servo and a
//! solver that speak of different grips notice.

use crate::tissue::handle::{GraspError, HandleSlot, MAX_HANDLES};
use crate::tissue::patch_set::PatchId;
use crate::tissue::solver::TissueSolver;
use crate::vector::Vec3;

use super::stitching::{left_patch, right_patch};
use super::suturing::Side;

/// What a handle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandleMode {
    /// The needle holds the point.
    Held,
    /// The hand pulls the line here.
    Pulled,
    /// The line pulls here from below.
    Linked,
}

/// A handle in use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Slot of the solver and index on the wire.
    pub slot: HandleSlot,
    /// Suture point.
    pub patch: PatchId,
    /// Suture pair.
    pub pair: usize,
    /// What it does.
    pub mode: HandleMode,
}

/// Slots of the first device: the point at the hand, and its partner.
const FIRST: [HandleSlot; 2] = [HandleSlot(0), HandleSlot(1)];
/// Slot of the second device.
const SECOND: HandleSlot = HandleSlot(2);

/// The handles of the first device, and of the second.
#[derive(Clone, Debug, Default)]
pub struct Grips {
    grips: [Option<Grip>; 2],
    second: Option<Grip>,
    epoch: u32,
    line_rest_length_m: f64,
}

impl Grips {
    /// Grips in use.
    pub fn iter(&self) -> impl Iterator<Item = &Grip> {
        self.grips.iter().chain([&self.second]).flatten()
    }

    /// Changes with every change of the grips.
    #[must_use]
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Rest length of the line between stylus and partner while pulling, metres.
    #[must_use]
    pub fn line_rest_length_m(&self) -> f64 {
        self.line_rest_length_m
    }

    /// The needle takes a suture point.
    pub fn hold(&mut self, solver: &mut TissueSolver, pair: usize, side: Side) {
        self.replace(solver, [Some((patch_of(pair, side), HandleMode::Held)), None], pair);
    }

    /// The hand takes the line of a pair; it is without tension at this moment.
    pub fn pull(&mut self, solver: &mut TissueSolver, pair: usize, stylus_m: Vec3, right_m: Vec3, left_m: Vec3) {
        self.line_rest_length_m = (stylus_m - right_m).norm() + (right_m - left_m).norm();
        let wanted = [Some((right_patch(pair), HandleMode::Pulled)), Some((left_patch(pair), HandleMode::Linked))];
        self.replace(solver, wanted, pair);
    }

    /// The second hand takes a suture point; from the first one, if that has it.
    pub fn hold_second(&mut self, solver: &mut TissueSolver, pair: usize, side: Side) {
        self.let_go_second(solver);
        let (patch, mode) = (patch_of(pair, side), HandleMode::Held);
        let mut grasped = solver.grasp(SECOND, patch);
        if matches!(grasped, Err(GraspError::Overlap(_))) {
            self.let_go(solver);
            grasped = solver.grasp(SECOND, patch);
        }
        self.second = grasped.ok().map(|()| Grip { slot: SECOND, patch, pair, mode });
        self.epoch = self.epoch.wrapping_add(1);
    }

    /// The second hand lets go.
    pub fn let_go_second(&mut self, solver: &mut TissueSolver) {
        if self.second.take().is_some() {
            solver.release(SECOND);
            self.epoch = self.epoch.wrapping_add(1);
        }
    }

    /// The hand lets go.
    pub fn let_go(&mut self, solver: &mut TissueSolver) {
        self.replace(solver, [None, None], 0);
    }

    /// Moves the grips to where the servo has integrated them; indexed by slot.
    pub fn follow(&self, solver: &mut TissueSolver, handles_m: &[Option<Vec3>; MAX_HANDLES]) {
        for grip in self.iter() {
            if let Some(target) = handles_m[grip.slot.0] {
                // A target that is not finite is refused: the handle stays.
                solver.lead(grip.slot, target);
            }
        }
    }

    fn replace(&mut self, solver: &mut TissueSolver, wanted: [Option<(PatchId, HandleMode)>; 2], pair: usize) {
        for old in self.grips.iter().flatten() {
            solver.release(old.slot);
        }
        for ((grip, slot), wanted) in self.grips.iter_mut().zip(FIRST).zip(wanted) {
            *grip = wanted.and_then(|(patch, mode)| {
                let mut grasped = solver.grasp(slot, patch);
                if matches!(grasped, Err(GraspError::Overlap(_))) && self.second.take().is_some() {
                    solver.release(SECOND);
                    grasped = solver.grasp(slot, patch);
                }
                grasped.ok().map(|()| Grip { slot, patch, pair, mode })
            });
        }
        self.epoch = self.epoch.wrapping_add(1);
    }
}

fn patch_of(pair: usize, side: Side) -> PatchId {
    match side {
        Side::Left => left_patch(pair),
        Side::Right => right_patch(pair),
    }
}
