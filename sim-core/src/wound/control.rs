//! The suture control strategy: it supervises every stitch tied so far and keeps it from opening again.
//!
//! Zhang et al., Algorithm 2: for all previous suture points, `ER = |D_c − D_o|/D_o`; where `ER > 10 %`, "adjust and
//! update p_cl and p_cr". Two readings of that step, metres, newtons, seconds:
//! - [`ControlMode::Paper`]: the points jump along their line, each half way, to the distance `D_o`, whether the stitch has opened
//!   or tightened; repeated until nothing is left, at most as many passes as there are rows.
//! - [`ControlMode::Sound`]: only a stitch that has opened is held, by a compliant constraint whose target starts at `D_c`
//!   (no force) and sinks to `D_o` at a limited speed; hysteresis: above 10 % it closes, at 5 % the target freezes and goes on
//!   holding; the force is recorded, and where it stays for [`TEAR_TIME_S`] at what tissue bears, the stitch is let go for good
//!   and says so.
//!
//! Deliberately absent: the constraint itself (tissue solver), moving nodes, and hiding a tear.

use crate::wound::adjust::{ControlCorrection, adjust_as_printed};
use crate::wound::ledger::{LEDGER_CAPACITY, Ledger};

/// Which reading of Algorithm 2 is at work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ControlMode {
    /// None.
    Off,
    /// One-sided, rate limited, compliant.
    Sound,
    /// As printed.
    Paper,
}

/// Limits of the control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlParams {
    /// `ER` above which the control engages (Algorithm 2: 10 %).
    pub engage_error: f64,
    /// `ER` at or below which the target stops moving.
    pub settle_error: f64,
    /// Speed at which the target distance sinks, metres per second.
    pub closing_speed_m_per_s: f64,
    /// Stiffness of the constraint, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// Holding force at which the line cuts through the tissue, newtons.
    pub max_holding_force_n: f64,
}

/// The holding force must stand at the limit for this long without a break before the stitch is let go, seconds.
/// One sub-step's tension of a hold of 20 kN/m is mostly the drag of the nodes that it moves; drag is gone after a
/// few steps, a load that tears is not.
pub const TEAR_TIME_S: f64 = 0.05;

impl Default for ControlParams {
    fn default() -> Self {
        Self {
            engage_error: 0.10,
            // Half the band: noise of half the band cannot make the control chatter.
            settle_error: 0.05,
            // A 1 mm jump would be felt as K·Δ ≈ 0.3 N at once; at 5 mm/s it takes 0.2 s.
            closing_speed_m_per_s: 0.005,
            // At the largest holding force it stretches by 0.165 mm, inside the 0.2 mm that 10 % of the floor allow.
            stiffness_n_per_m: 20_000.0,
            // Lower end of measured tear-through forces of skin sutures (3.3 N to 4.1 N).
            max_holding_force_n: 3.3,
        }
    }
}

/// A distance constraint that the solver must apply until the next call: it pulls, never pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlTarget {
    /// Ledger row.
    pub row: usize,
    /// Suture pair.
    pub pair: u32,
    /// Distance to hold, metres.
    pub target_m: f64,
    /// Stiffness, newtons per metre.
    pub stiffness_n_per_m: f64,
    /// Largest force, newtons; the stitch is let go when it stays there for [`TEAR_TIME_S`].
    pub max_force_n: f64,
}

/// Something worth telling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ControlEvent {
    /// A stitch has opened beyond the limit and is being closed.
    Engaged {
        /// Ledger row.
        row: usize,
    },
    /// It is closed far enough; the hold stays where it is.
    Settled {
        /// Ledger row.
        row: usize,
    },
    /// It needed more than the tissue bears and was let go for good.
    PulledThrough {
        /// Ledger row.
        row: usize,
        /// Force when it was let go, newtons.
        force_n: f64,
    },
}

/// What one call of the control asks for; the slices live in the control and are overwritten by the next call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlOutcome<'a> {
    /// Sound mode: constraints for the solver.
    pub targets: &'a [ControlTarget],
    /// Paper mode: position updates, in the order of Algorithm 2.
    pub corrections: &'a [ControlCorrection],
    /// What happened.
    pub events: &'a [ControlEvent],
    /// Paper mode: passes over the ledger.
    pub passes: usize,
    /// Paper mode: largest `ER` that is left.
    pub residual_error: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Hold {
    #[default]
    None,
    Closing(f64),
    Settled(f64),
    PulledThrough,
}

/// The supervisor of one ledger. All memory is taken when it is made.
#[derive(Clone, Debug)]
pub struct WoundControl {
    mode: ControlMode,
    params: ControlParams,
    holds: [Hold; LEDGER_CAPACITY],
    /// How long each row's hold has been at its limit.
    at_limit_s: [f64; LEDGER_CAPACITY],
    targets: Vec<ControlTarget>,
    corrections: Vec<ControlCorrection>,
    events: Vec<ControlEvent>,
}

impl WoundControl {
    /// A control that holds nothing yet.
    #[must_use]
    pub fn new(mode: ControlMode, params: ControlParams) -> Self {
        Self {
            mode,
            params,
            holds: [Hold::None; LEDGER_CAPACITY],
            at_limit_s: [0.0; LEDGER_CAPACITY],
            targets: Vec::with_capacity(LEDGER_CAPACITY),
            corrections: Vec::with_capacity(LEDGER_CAPACITY),
            events: Vec::with_capacity(LEDGER_CAPACITY),
        }
    }

    /// The mode.
    #[must_use]
    pub fn mode(&self) -> ControlMode {
        self.mode
    }

    /// Changes the mode; what the sound mode holds is let go, what was pulled through stays so.
    pub fn set_mode(&mut self, mode: ControlMode) {
        self.mode = mode;
        self.at_limit_s = [0.0; LEDGER_CAPACITY];
        for hold in &mut self.holds {
            if *hold != Hold::PulledThrough {
                *hold = Hold::None;
            }
        }
    }

    /// Forgets all stitches (scene restored); keeps the memory.
    pub fn clear(&mut self) {
        self.holds = [Hold::None; LEDGER_CAPACITY];
        self.at_limit_s = [0.0; LEDGER_CAPACITY];
    }

    /// One supervision of all stitches in the ledger, whose current columns must be up to date.
    /// `holding_force_n[row]` is what the solver's constraint of that row pulled with in the last step (0 or missing: none).
    pub fn supervise(&mut self, ledger: &mut Ledger, dt_s: f64, holding_force_n: &[f64]) -> ControlOutcome<'_> {
        self.targets.clear();
        self.corrections.clear();
        self.events.clear();
        let (passes, residual_error) = match self.mode {
            ControlMode::Off => (0, 0.0),
            ControlMode::Sound => {
                for row in 0..ledger.rows().len() {
                    self.hold_row(ledger, row, dt_s, holding_force_n.get(row).copied().unwrap_or(0.0));
                }
                (0, 0.0)
            }
            ControlMode::Paper => adjust_as_printed(self.params.engage_error, ledger, &mut self.corrections),
        };
        for row in 0..ledger.rows().len() {
            let held = matches!(self.holds[row], Hold::Closing(_) | Hold::Settled(_));
            let acts = held || self.corrections.iter().any(|c| c.row == row);
            let history = ledger.history_mut(row);
            history.control_acts = acts;
            history.control_has_acted |= acts;
            if !held {
                ledger.note_holding_force(row, 0.0);
            }
        }
        ControlOutcome {
            targets: &self.targets,
            corrections: &self.corrections,
            events: &self.events,
            passes,
            residual_error,
        }
    }

    /// Sound reading of "adjust and update" for one row.
    fn hold_row(&mut self, ledger: &mut Ledger, index: usize, dt_s: f64, force_n: f64) {
        let row = ledger.rows()[index];
        let params = self.params;
        let held = matches!(self.holds[index], Hold::Closing(_) | Hold::Settled(_));
        if held {
            ledger.note_holding_force(index, force_n);
            let at_limit_s = &mut self.at_limit_s[index];
            *at_limit_s = if force_n >= params.max_holding_force_n { *at_limit_s + dt_s } else { 0.0 };
            // Half a step against the rounding of the sum.
            if *at_limit_s > 0.0 && *at_limit_s + 0.5 * dt_s >= TEAR_TIME_S {
                self.holds[index] = Hold::PulledThrough;
                ledger.history_mut(index).pulled_through = true;
                self.events.push(ControlEvent::PulledThrough { row: index, force_n });
            }
        }
        let opened = row.relative_error > params.engage_error && row.current_distance_m > row.original_distance_m;
        let sunk = |from: f64| (from - params.closing_speed_m_per_s * dt_s).max(row.original_distance_m);
        let next = match self.holds[index] {
            Hold::None if opened && !row.history.pulled_through => {
                self.events.push(ControlEvent::Engaged { row: index });
                Hold::Closing(row.current_distance_m)
            }
            Hold::Closing(target) if row.relative_error <= params.settle_error => {
                self.events.push(ControlEvent::Settled { row: index });
                Hold::Settled(target)
            }
            Hold::Closing(target) => Hold::Closing(sunk(target)),
            Hold::Settled(target) if opened => {
                self.events.push(ControlEvent::Engaged { row: index });
                Hold::Closing(sunk(target))
            }
            same => same,
        };
        self.holds[index] = next;
        if let Hold::Closing(target_m) | Hold::Settled(target_m) = next {
            self.targets.push(ControlTarget {
                row: index,
                pair: row.pair,
                target_m,
                stiffness_n_per_m: params.stiffness_n_per_m,
                max_force_n: params.max_holding_force_n,
            });
        }
    }
}

#[cfg(test)]
mod tests;
