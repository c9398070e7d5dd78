//! A hand that repeats a recording and looks at nothing.
//!
//! Open loop: whatever the scene does, the wish is the recording at this time. Through a simulated
//! device the force still bends the motion, by the hand's own stiffness; as a replay device it does not.
//! Metres, seconds; all memory is allocated before the first tick.

use crate::device::HandView;
use crate::hand::resample::{AtEnd, Curve};
use crate::hand::{Hand, HandRecording, HandTarget, RecordingFault};

/// A recorded hand.
#[derive(Clone, Debug)]
pub struct RecordedHand {
    curve: Curve,
}

impl RecordedHand {
    /// A hand that moves as recorded; the recording must already be in the scene frame.
    pub fn new(recording: &HandRecording, at_end: AtEnd) -> Result<Self, RecordingFault> {
        Ok(Self { curve: Curve::new(recording, at_end)? })
    }

    /// Length of the motion, with the way back if it loops, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.curve.duration_s()
    }
}

impl Hand for RecordedHand {
    fn target(&mut self, time_s: f64, _view: &HandView) -> HandTarget {
        let point = self.curve.at(time_s);
        HandTarget { position_m: point.position_m, buttons: point.buttons }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::vector::Vec3;

    #[test]
    fn the_view_changes_nothing() {
        let recording = HandRecording {
            times_s: vec![0.0, 1.0, 2.0],
            positions_m: vec![Vec3::zeros(), Vec3::x(), Vec3::y()],
            buttons: vec![0, 1, 0],
        };
        let mut hand = RecordedHand::new(&recording, AtEnd::Hold).expect("good");
        let unseen = HandView::unseen();
        let seen = HandView { valid: true, target_m: Vec3::new(9.0, 9.0, 9.0), stage: 3, ..unseen };
        for tick in 0..2500 {
            let time_s = f64::from(tick) * 1e-3;
            assert_eq!(hand.target(time_s, &unseen), hand.target(time_s, &seen));
        }
        assert_eq!(hand.target(1.5, &seen).buttons, 1);
        assert_eq!(hand.duration_s(), 2.0);
    }
}
