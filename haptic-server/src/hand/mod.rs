//! Hands: who moves a simulated or replayed device.
//!
//! A [`Hand`] says at each servo tick where it wants to be and which buttons it presses: from a
//! recording ([`recorded`]), by suturing on its own with what it sees ([`synthetic`]), or as the pointer of a
//! viewer wishes ([`pointer`], [`place`]). Recordings come
//! from CSV files ([`csv`]) or from any reader that fills a [`HandRecording`]; the gripper becomes
//! button 1 ([`gripper`]), the motion is laid onto the wound by a stated similarity transform
//! ([`registration`]) and made continuous ([`resample`]). Everything is read and allocated before the
//! first tick; [`Hand::target`] uses no heap. Metres, seconds, scene frame once registered.

pub mod csv;
#[cfg(test)]
mod csv_tests;
mod file_fault;
pub mod gripper;
pub mod motion;
pub mod place;
pub mod pointer;
pub mod recorded;
pub mod registration;
pub mod resample;
pub mod synthetic;
#[cfg(test)]
mod synthetic_tests;
pub mod trace;

pub use file_fault::HandFileFault;

use crate::device::HandView;
use sim_core::vector::Vec3;

/// Bit of the front button in every `buttons` word.
pub const BUTTON_1: u32 = 1;

/// What a hand wants at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandTarget {
    /// Where the hand pulls the stylus to, metres, scene frame.
    pub position_m: Vec3,
    /// Bit 0 front button, bit 1 back button.
    pub buttons: u32,
}

/// Someone who holds the stylus.
pub trait Hand: Send {
    /// The hand's wish at `time_s` after its start; called once per tick with growing time, no heap.
    fn target(&mut self, time_s: f64, view: &HandView) -> HandTarget;
}

/// A hand's motion over time, from whatever reader.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandRecording {
    /// Sample times, seconds, strictly increasing.
    pub times_s: Vec<f64>,
    /// Positions, metres, in the recording's own frame until registered.
    pub positions_m: Vec<Vec3>,
    /// Buttons, bit 0 front, bit 1 back.
    pub buttons: Vec<u32>,
}

/// Why a recording cannot move a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordingFault {
    /// No samples.
    #[error("the hand recording has no samples; record at least one")]
    Empty,
    /// The three columns differ in length.
    #[error("the hand recording has columns of different lengths; every time needs one position and one button word")]
    Ragged,
    /// Times that do not increase.
    #[error("sample {0} of the hand recording is not later than the one before; sort the samples by time")]
    NotIncreasing(usize),
    /// A value that is not a finite number.
    #[error("sample {0} of the hand recording is not a finite number; remove it")]
    NotFinite(usize),
    /// A rate that is not positive or gives too many samples.
    #[error(
        "the hand recording cannot be resampled at this rate; choose a positive rate that gives at most a million samples"
    )]
    Rate,
}

impl HandRecording {
    /// Checks what every user of a recording relies on.
    pub fn check(&self) -> Result<(), RecordingFault> {
        if self.times_s.is_empty() {
            return Err(RecordingFault::Empty);
        }
        if self.positions_m.len() != self.times_s.len() || self.buttons.len() != self.times_s.len() {
            return Err(RecordingFault::Ragged);
        }
        let finite = |i: usize| self.times_s[i].is_finite() && self.positions_m[i].iter().all(|c| c.is_finite());
        if let Some(i) = (0..self.times_s.len()).find(|&i| !finite(i)) {
            return Err(RecordingFault::NotFinite(i));
        }
        match self.times_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(i) => Err(RecordingFault::NotIncreasing(i + 1)),
            None => Ok(()),
        }
    }

    /// From the first to the last sample, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.times_s.first(), self.times_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Samples at which button 1 goes down: where the hand grips.
    pub fn grips(&self) -> impl Iterator<Item = usize> {
        (0..self.buttons.len())
            .filter(|&i| self.buttons[i] & BUTTON_1 != 0 && (i == 0 || self.buttons[i - 1] & BUTTON_1 == 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(times: &[f64], buttons: &[u32]) -> HandRecording {
        HandRecording {
            times_s: times.to_vec(),
            positions_m: vec![Vec3::zeros(); times.len()],
            buttons: buttons.to_vec(),
        }
    }

    #[test]
    fn a_recording_is_checked_before_it_moves_a_hand() {
        assert_eq!(HandRecording::default().check(), Err(RecordingFault::Empty));
        assert_eq!(recording(&[0.0, 1.0], &[0]).check(), Err(RecordingFault::Ragged));
        assert_eq!(recording(&[0.0, 1.0, 1.0], &[0; 3]).check(), Err(RecordingFault::NotIncreasing(2)));
        assert_eq!(recording(&[0.0, f64::NAN], &[0; 2]).check(), Err(RecordingFault::NotFinite(1)));
        let mut infinite = recording(&[0.0, 1.0], &[0; 2]);
        infinite.positions_m[0].y = f64::INFINITY;
        assert_eq!(infinite.check(), Err(RecordingFault::NotFinite(0)));
        assert_eq!(recording(&[0.0, 0.5], &[0; 2]).check(), Ok(()));
    }

    #[test]
    fn grips_are_the_rising_edges_of_button_1() {
        let rec = recording(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], &[1, 0, 2, 3, 1, 0]);
        assert_eq!(rec.grips().collect::<Vec<_>>(), [0, 3]);
        assert_eq!(rec.duration_s(), 5.0);
    }
}
