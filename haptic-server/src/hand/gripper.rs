//! A surgeon's gripper as button 1: closing presses it, opening releases it.
//!
//! Angles differ between hands and surgeons (some close to −1.9 rad, some to −1.4), so the threshold comes from the
//! recording: the middle between its 10th and 90th percentile, with a hysteresis of ±10 % of their distance.
//! Radians in, button words out. A gripper that hardly moves presses nothing.
//! Deliberately absent: debouncing in time; a short grip is a grip.

use crate::hand::BUTTON_1;

/// Distance of the percentiles below which nothing is a grip, radians (noise of a resting gripper: 0.01).
const SMALLEST_RANGE_RAD: f64 = 0.1;
/// Half width of the hysteresis as a share of the distance of the percentiles.
const HYSTERESIS: f64 = 0.1;

/// Angles at which the gripper counts as closed and as open again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripThreshold {
    /// At or below this angle an open gripper closes, radians.
    pub close_rad: f64,
    /// At or above this angle a closed gripper opens, radians.
    pub open_rad: f64,
}

/// One change of button 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ButtonEdge {
    /// Sample at which the button has its new state.
    pub sample: usize,
    /// The new state.
    pub change: ButtonChange,
}

/// Direction of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ButtonChange {
    /// Down.
    Press,
    /// Up.
    Release,
}

/// The thresholds of a recording; `None` when the gripper hardly moves.
#[must_use]
pub fn threshold(angles_rad: &[f64]) -> Option<GripThreshold> {
    let mut sorted = angles_rad.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * sorted.len().saturating_sub(1) as f64).round() as usize).copied();
    let (low, high) = (at(0.1)?, at(0.9)?);
    let range = high - low;
    let middle = 0.5 * (low + high);
    (range >= SMALLEST_RANGE_RAD)
        .then_some(GripThreshold { close_rad: middle - HYSTERESIS * range, open_rad: middle + HYSTERESIS * range })
}

/// Button words, one per angle.
#[must_use]
pub fn buttons(angles_rad: &[f64]) -> Vec<u32> {
    let Some(threshold) = threshold(angles_rad) else {
        return vec![0; angles_rad.len()];
    };
    let mut closed = false;
    angles_rad
        .iter()
        .map(|&angle| {
            closed = if closed { angle < threshold.open_rad } else { angle <= threshold.close_rad };
            if closed { BUTTON_1 } else { 0 }
        })
        .collect()
}

/// Changes of button 1 along a recording that starts with it up.
#[must_use]
pub fn edges(buttons: &[u32]) -> Vec<ButtonEdge> {
    let mut down = false;
    let mut found = Vec::new();
    for (sample, word) in buttons.iter().enumerate() {
        let now = word & BUTTON_1 != 0;
        if now != down {
            let change = if now { ButtonChange::Press } else { ButtonChange::Release };
            found.push(ButtonEdge { sample, change });
        }
        down = now;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_threshold_lies_between_the_percentiles_and_has_hysteresis() {
        // Open at 0.5, closed at −1.5, a wobble across the middle in between.
        let mut angles = vec![0.5; 20];
        angles.extend([-0.45, -0.55, -0.45, -0.75]);
        angles.extend([-1.5; 20]);
        angles.extend([-0.55, -0.45, -0.55, -0.25]);
        angles.extend([0.5; 20]);
        let t = threshold(&angles).expect("it moves");
        assert!((t.close_rad + 0.7).abs() < 1e-12 && (t.open_rad + 0.3).abs() < 1e-12, "{t:?}");
        let expected = [
            ButtonEdge { sample: 23, change: ButtonChange::Press },
            ButtonEdge { sample: 47, change: ButtonChange::Release },
        ];
        assert_eq!(edges(&buttons(&angles)), expected, "the wobble gives no edges");
    }

    #[test]
    fn a_resting_gripper_presses_nothing() {
        assert_eq!(buttons(&[-1.4, -1.405, -1.4, -1.39]), [0; 4]);
        assert!(buttons(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn edges_alternate_and_rebuild_the_buttons(angles in prop::collection::vec(-2.0..0.6, 0..200)) {
            let words = buttons(&angles);
            prop_assert_eq!(words.len(), angles.len());
            let mut rebuilt = vec![0; angles.len()];
            let mut last = ButtonChange::Release;
            for edge in edges(&words) {
                prop_assert_ne!(edge.change, last);
                last = edge.change;
                rebuilt[edge.sample..].fill(u32::from(last == ButtonChange::Press));
            }
            prop_assert_eq!(rebuilt, words);
        }
    }
}
