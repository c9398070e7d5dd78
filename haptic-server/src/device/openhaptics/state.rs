//! The device's way to forces: Initialised → NeedsCalibration → Ready → ForcesOn, and Tripped or Lost from anywhere.
//!
//! ```text
//! Loaded ─open─▶ Initialised ─▶ NeedsCalibration ⇄ Ready ⇄ ForcesOn (gain rises over the ramp)
//!                     ▲                               ▲        any ─trip─▶ Tripped ─ operator re-arms ─▶ Ready
//!                     └────────── reopened ── Lost ◀──┼──lose── any
//! ```
//! Forces are on only when the device is calibrated and the servo is not in Fault. A trip is latched by the servo's own
//! Fault: the servo is told once, and the device stays tripped until the servo has been re-armed. Pure: no clock, no device.
//! Deliberately absent: Loaded is the library alone (`library.rs`); a device begins here when it is opened.

use super::severity::Reaction;
use crate::device::SampleQuality;

/// From no force to full force, seconds.
const RAMP_S: f64 = 0.5;
/// Notes in so many ticks in a row are a trip.
const NOTES_TO_TRIP: u32 = 20;

/// Where the device stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceState {
    /// Open, calibration not asked for yet.
    Initialised,
    /// Somebody has to put the stylus into the inkwell.
    NeedsCalibration,
    /// Calibrated, motors off.
    Ready,
    /// Motors on.
    ForcesOn,
    /// Force off until the operator has re-armed.
    Tripped,
    /// Gone.
    Lost,
}

impl DeviceState {
    /// Name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["initialised", "needs calibration", "ready", "forces on", "tripped", "lost"][self as usize]
    }
}

/// What the device says about its calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// Good.
    Good,
    /// The stylus is in the inkwell: it can be done now.
    Possible,
    /// Somebody has to act first.
    NeedsHand,
}

/// The servo as the device sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Latch {
    /// It works or could.
    Open,
    /// It is in Fault.
    Closed,
}

/// What has happened since the last tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// The calibration, when it was asked for.
    pub calibration: Option<Calibration>,
    /// The worst reaction to an error.
    pub worst: Option<Reaction>,
    /// The servo.
    pub latch: Latch,
    /// Time since the last tick, seconds.
    pub dt_s: f64,
}

/// State, ramp, latch.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    state: DeviceState,
    ramp_s: f64,
    notes: u32,
    /// The servo has taken notice of the trip.
    latched: bool,
    /// The last answer about the calibration.
    calibrated: bool,
}

impl Machine {
    /// A device that has just been opened.
    #[must_use]
    pub fn opened() -> Self {
        Self { state: DeviceState::Initialised, ramp_s: 0.0, notes: 0, latched: false, calibrated: false }
    }

    /// Where it stands.
    #[must_use]
    pub fn state(&self) -> DeviceState {
        self.state
    }

    /// Share of the force that may go out.
    #[must_use]
    pub fn gain(&self) -> f64 {
        match self.state {
            DeviceState::ForcesOn => (self.ramp_s / RAMP_S).clamp(0.0, 1.0),
            _ => 0.0,
        }
    }

    /// What the servo is told of the samples.
    #[must_use]
    pub fn quality(&self) -> SampleQuality {
        match self.state {
            DeviceState::Initialised | DeviceState::NeedsCalibration => SampleQuality::Unready,
            DeviceState::Tripped if !self.latched => SampleQuality::Tripped,
            DeviceState::Ready | DeviceState::ForcesOn | DeviceState::Tripped => SampleQuality::Fresh,
            DeviceState::Lost => SampleQuality::Lost,
        }
    }

    /// One tick; gives the state that was left.
    pub fn tick(&mut self, situation: &Situation) -> Option<DeviceState> {
        let next = self.next(situation);
        self.latched = next == DeviceState::Tripped && (self.latched || self.is_noticed(situation.latch));
        self.ramp_s = if next == DeviceState::ForcesOn { self.ramp_s + situation.dt_s.max(0.0) } else { 0.0 };
        let from = std::mem::replace(&mut self.state, next);
        (from != next).then_some(from)
    }

    /// The servo is in Fault, after it has been told.
    fn is_noticed(&self, latch: Latch) -> bool {
        self.state == DeviceState::Tripped && latch == Latch::Closed
    }

    fn next(&mut self, situation: &Situation) -> DeviceState {
        self.notes = if situation.worst == Some(Reaction::Note) { self.notes + 1 } else { 0 };
        // Before anything returns: an answer that comes with an error is an answer all the same.
        self.calibrated = situation.calibration.map_or(self.calibrated, |c| c == Calibration::Good);
        match situation.worst {
            _ if self.state == DeviceState::Lost => return DeviceState::Lost,
            Some(Reaction::Lose) => return DeviceState::Lost,
            Some(Reaction::Trip) => return DeviceState::Tripped,
            Some(Reaction::Note) if self.notes >= NOTES_TO_TRIP => return DeviceState::Tripped,
            _ => {}
        }
        match (self.state, self.calibrated, situation.latch) {
            (DeviceState::Initialised, _, _) if situation.calibration.is_none() => DeviceState::Initialised,
            (DeviceState::Tripped, true, Latch::Open) if self.latched => DeviceState::Ready,
            (DeviceState::Tripped, false, Latch::Open) if self.latched => DeviceState::NeedsCalibration,
            (DeviceState::Tripped, _, _) => DeviceState::Tripped,
            (_, false, _) => DeviceState::NeedsCalibration,
            (DeviceState::Initialised | DeviceState::NeedsCalibration, true, _) => DeviceState::Ready,
            (DeviceState::Ready, _, Latch::Open) => DeviceState::ForcesOn,
            (DeviceState::ForcesOn, _, Latch::Closed) => DeviceState::Ready,
            (state, _, _) => state,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const QUIET: Situation =
        Situation { calibration: Some(Calibration::Good), worst: None, latch: Latch::Open, dt_s: 1e-3 };

    fn forces_on() -> Machine {
        let mut machine = Machine::opened();
        for _ in 0..600 {
            machine.tick(&QUIET);
        }
        assert_eq!((machine.state(), machine.gain()), (DeviceState::ForcesOn, 1.0));
        machine
    }

    #[test]
    fn no_force_before_calibration_and_a_ramp_after_it() {
        let mut machine = Machine::opened();
        let missing = Situation { calibration: Some(Calibration::NeedsHand), ..QUIET };
        for _ in 0..1_000 {
            machine.tick(&missing);
            assert_eq!((machine.gain(), machine.quality()), (0.0, SampleQuality::Unready));
        }
        assert_eq!(machine.state(), DeviceState::NeedsCalibration);
        machine.tick(&QUIET);
        assert_eq!((machine.state(), machine.quality()), (DeviceState::Ready, SampleQuality::Fresh));
        let mut before = 0.0;
        for _ in 0..500 {
            machine.tick(&QUIET);
            assert!((machine.gain() - before) < 2.1e-3, "half a second, evenly");
            before = machine.gain();
        }
        assert!((machine.gain() - 1.0).abs() < 1e-9);
        assert_eq!(machine.tick(&missing), Some(DeviceState::ForcesOn));
        assert_eq!((machine.state(), machine.gain()), (DeviceState::NeedsCalibration, 0.0));
    }

    #[test]
    fn a_trip_is_told_once_and_held_until_the_servo_was_in_fault_and_left_it() {
        let mut machine = forces_on();
        machine.tick(&Situation { worst: Some(Reaction::Trip), ..QUIET });
        assert_eq!((machine.gain(), machine.quality()), (0.0, SampleQuality::Tripped));
        machine.tick(&QUIET);
        assert_eq!(machine.quality(), SampleQuality::Tripped, "told until the servo has noticed");
        let latched = Situation { latch: Latch::Closed, ..QUIET };
        for _ in 0..5_000 {
            machine.tick(&latched);
            assert_eq!((machine.state(), machine.quality()), (DeviceState::Tripped, SampleQuality::Fresh));
        }
        machine.tick(&QUIET);
        assert_eq!(machine.state(), DeviceState::Ready);
        machine.tick(&QUIET);
        assert!(machine.gain() < 0.01, "the ramp begins anew");
    }

    #[test]
    fn another_fault_of_the_servo_switches_the_motors_off_and_no_more() {
        let mut machine = forces_on();
        machine.tick(&Situation { latch: Latch::Closed, ..QUIET });
        assert_eq!((machine.state(), machine.quality()), (DeviceState::Ready, SampleQuality::Fresh));
    }

    #[test]
    fn a_lost_device_stays_lost_and_twenty_notes_are_a_trip() {
        let mut machine = forces_on();
        machine.tick(&Situation { worst: Some(Reaction::Lose), ..QUIET });
        for _ in 0..1_000 {
            machine.tick(&QUIET);
        }
        assert_eq!((machine.state(), machine.quality()), (DeviceState::Lost, SampleQuality::Lost));
        let mut machine = forces_on();
        let note = Situation { worst: Some(Reaction::Note), ..QUIET };
        for _ in 0..19 {
            machine.tick(&note);
        }
        assert_eq!(machine.state(), DeviceState::ForcesOn);
        machine.tick(&note);
        assert_eq!(machine.state(), DeviceState::Tripped);
        let mut machine = forces_on();
        for _ in 0..19 {
            machine.tick(&Situation { worst: Some(Reaction::Cool), ..QUIET });
        }
        assert_eq!(machine.state(), DeviceState::ForcesOn);
    }

    #[test]
    fn an_answer_about_the_calibration_that_comes_with_a_trip_is_not_lost() {
        let mut machine = forces_on();
        machine.tick(&Situation { worst: Some(Reaction::Trip), ..QUIET });
        let lost = Some(Calibration::NeedsHand);
        machine.tick(&Situation { calibration: lost, worst: Some(Reaction::Trip), latch: Latch::Closed, ..QUIET });
        machine.tick(&Situation { calibration: None, ..QUIET });
        assert_eq!(machine.state(), DeviceState::NeedsCalibration);
    }

    proptest! {
        #[test]
        fn no_sequence_gives_force_without_calibration(steps in prop::collection::vec((0..4_u8, 0..6_u8, any::<bool>()), 1..300)) {
            let mut machine = Machine::opened();
            let mut calibrated = false;
            for (calibration, worst, closed) in steps {
                let calibration =
                    [None, Some(Calibration::Good), Some(Calibration::Possible), Some(Calibration::NeedsHand)]
                        [usize::from(calibration)];
                let worst = [Some(Reaction::Note), Some(Reaction::Cool), Some(Reaction::Trip), Some(Reaction::Lose)]
                    .get(usize::from(worst)).copied().flatten();
                let latch = if closed { Latch::Closed } else { Latch::Open };
                machine.tick(&Situation { calibration, worst, latch, dt_s: 1e-3 });
                calibrated = calibration.map_or(calibrated, |c| c == Calibration::Good);
                prop_assert!(machine.gain() == 0.0 || (calibrated && !closed));
            }
        }
    }
}
