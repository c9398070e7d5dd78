//! A recording as a curve of continuous velocity, to be asked at any time.
//!
//! Cubic Hermite between the samples: `p(s) = h₀₀ p₀ + h₁₀ h m₀ + h₀₁ p₁ + h₁₁ h m₁`, s = (t − t₀)/h. The slope m at a
//! sample is that of the parabola through it and its neighbours (Catmull–Rom for any spacing),
//! `mᵢ = (hᵢ dᵢ₋₁ + hᵢ₋₁ dᵢ)/(hᵢ₋₁ + hᵢ)`, and zero at both ends: the hand starts and stops at rest. At the end it holds, or goes
//! back to the start on one smooth stroke and begins again. Buttons keep the last sample's word. Metres, seconds, from
//! the first sample on; all memory is allocated in `new`. Deliberately absent: smoothing; the samples are met exactly.

use crate::hand::{HandRecording, RecordingFault, csv::MAX_ROWS};
use sim_core::vector::Vec3;

/// Mean speed of the stroke back to the start of a loop, metres per second (its peak is 1.5 times that).
const RETURN_SPEED_M_PER_S: f64 = 0.05;
/// Shortest stroke back, seconds.
const SHORTEST_RETURN_S: f64 = 0.5;

/// What happens after the last sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtEnd {
    /// The hand stays at the last sample.
    Hold,
    /// The hand lets go, returns to the first sample and begins again.
    Loop,
}

/// A hand at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Position, metres.
    pub position_m: Vec3,
    /// Velocity, metres per second; continuous.
    pub velocity_m_per_s: Vec3,
    /// Buttons of the sample at or before this time.
    pub buttons: u32,
}

/// A recording that can be asked at any time.
#[derive(Clone, Debug)]
pub struct Curve {
    at_end: AtEnd,
    knots: Vec<Knot>,
}

#[derive(Clone, Copy, Debug)]
struct Knot {
    time_s: f64,
    position_m: Vec3,
    slope_m_per_s: Vec3,
    buttons: u32,
}

impl Curve {
    /// Prepares a recording; its first sample becomes time zero.
    pub fn new(recording: &HandRecording, at_end: AtEnd) -> Result<Self, RecordingFault> {
        recording.check()?;
        let start_s = recording.times_s[0];
        let mut knots: Vec<Knot> = (0..recording.times_s.len())
            .map(|i| Knot {
                time_s: recording.times_s[i] - start_s,
                position_m: recording.positions_m[i],
                slope_m_per_s: inner_slope(recording, i),
                buttons: recording.buttons[i],
            })
            .collect();
        let first = knots[0];
        if let (AtEnd::Loop, Some(last)) = (at_end, knots.last_mut()) {
            last.buttons = 0;
            let way_m = (first.position_m - last.position_m).norm();
            let time_s = last.time_s + (way_m / RETURN_SPEED_M_PER_S).max(SHORTEST_RETURN_S);
            knots.push(Knot { time_s, ..first });
        }
        Ok(Self { at_end, knots })
    }

    /// Length of the curve, with the way back if it loops, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.time_s)
    }

    /// The hand at `time_s` after the first sample.
    #[must_use]
    pub fn at(&self, time_s: f64) -> CurvePoint {
        let duration_s = self.duration_s();
        let time_s = match self.at_end {
            AtEnd::Loop => time_s.max(0.0) % duration_s,
            AtEnd::Hold => time_s.clamp(0.0, duration_s),
        };
        let after = self.knots.partition_point(|knot| knot.time_s <= time_s).max(1);
        let from = &self.knots[after - 1];
        let Some(to) = self.knots.get(after) else {
            return CurvePoint {
                position_m: from.position_m,
                velocity_m_per_s: from.slope_m_per_s,
                buttons: from.buttons,
            };
        };
        let h = to.time_s - from.time_s;
        let s = (time_s - from.time_s) / h;
        let way = to.position_m - from.position_m;
        let (m0, m1) = (from.slope_m_per_s * h, to.slope_m_per_s * h);
        let position_m =
            from.position_m + m0 * s + (way * 3.0 - m0 * 2.0 - m1) * (s * s) + (m0 + m1 - way * 2.0) * (s * s * s);
        let velocity_m_per_s =
            (m0 + (way * 3.0 - m0 * 2.0 - m1) * (2.0 * s) + (m0 + m1 - way * 2.0) * (3.0 * s * s)) / h;
        CurvePoint { position_m, velocity_m_per_s, buttons: from.buttons }
    }
}

/// Slope of the parabola through a sample and its neighbours; zero at the ends.
fn inner_slope(recording: &HandRecording, i: usize) -> Vec3 {
    if i == 0 || i + 1 == recording.times_s.len() {
        return Vec3::zeros();
    }
    let before_s = recording.times_s[i] - recording.times_s[i - 1];
    let after_s = recording.times_s[i + 1] - recording.times_s[i];
    let slope_before = (recording.positions_m[i] - recording.positions_m[i - 1]) / before_s;
    let slope_after = (recording.positions_m[i + 1] - recording.positions_m[i]) / after_s;
    (slope_before * after_s + slope_after * before_s) / (before_s + after_s)
}

/// The recording at an even rate, from time zero to its last sample.
pub fn resample(recording: &HandRecording, rate_hz: f64) -> Result<HandRecording, RecordingFault> {
    let curve = Curve::new(recording, AtEnd::Hold)?;
    let steps = (curve.duration_s() * rate_hz).floor();
    if !(rate_hz > 0.0 && steps < MAX_ROWS as f64) {
        return Err(RecordingFault::Rate);
    }
    let count = steps as usize + 1;
    let mut even = HandRecording {
        times_s: Vec::with_capacity(count),
        positions_m: Vec::with_capacity(count),
        buttons: Vec::with_capacity(count),
    };
    for i in 0..count {
        let time_s = i as f64 / rate_hz;
        let point = curve.at(time_s);
        even.times_s.push(time_s);
        even.positions_m.push(point.position_m);
        even.buttons.push(point.buttons);
    }
    Ok(even)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn uneven() -> HandRecording {
        let times_s = vec![2.0, 2.03, 2.07, 2.1, 2.2, 2.21, 2.5];
        let positions_m =
            times_s.iter().map(|t: &f64| Vec3::new((3.0 * t).sin(), t * t, -t) * 0.01).collect::<Vec<_>>();
        HandRecording { times_s, positions_m, buttons: vec![0, 0, 1, 1, 1, 0, 1] }
    }

    #[test]
    fn samples_are_met_and_buttons_hold() {
        let recording = uneven();
        let curve = Curve::new(&recording, AtEnd::Hold).expect("good");
        for i in 0..recording.times_s.len() {
            let point = curve.at(recording.times_s[i] - 2.0 + 1e-12);
            assert!((point.position_m - recording.positions_m[i]).amax() < 1e-11);
            assert_eq!(point.buttons, recording.buttons[i]);
        }
        assert_eq!(curve.at(-1.0).velocity_m_per_s, Vec3::zeros());
        assert_eq!(curve.at(9.0).position_m, recording.positions_m[6]);
        assert_eq!(curve.at(9.0).velocity_m_per_s, Vec3::zeros());
    }

    #[test]
    fn velocity_is_the_derivative_and_has_no_jumps() {
        for at_end in [AtEnd::Hold, AtEnd::Loop] {
            let curve = Curve::new(&uneven(), at_end).expect("good");
            let step = 1e-6;
            let steepest = 20.0; // m/s², above the largest second derivative of this curve
            let mut last = curve.at(0.0).velocity_m_per_s;
            for i in 0..(3.0 * curve.duration_s() / 1e-4) as u32 {
                let t = f64::from(i) * 1e-4;
                let here = curve.at(t).velocity_m_per_s;
                let difference = (curve.at(t + step).position_m - curve.at(t - step).position_m) / (2.0 * step);
                if t > step {
                    assert!((here - difference).amax() < steepest * step, "at {t} s: {here} against {difference}");
                }
                assert!((here - last).amax() < steepest * 1.1e-4, "velocity jumps at {t} s");
                last = here;
            }
        }
    }

    #[test]
    fn a_parabola_is_reproduced_between_inner_samples() {
        let mut recording = uneven();
        for (p, t) in recording.positions_m.iter_mut().zip(&recording.times_s) {
            *p = Vec3::new(0.1 * t * t - t, 2.0 * t, 1.0);
        }
        let curve = Curve::new(&recording, AtEnd::Hold).expect("good");
        for i in 31..=209 {
            let t = 2.0 + f64::from(i) * 1e-3;
            let expected = Vec3::new(0.1 * t * t - t, 2.0 * t, 1.0);
            assert!((curve.at(t - 2.0).position_m - expected).amax() < 1e-12);
        }
    }

    #[test]
    fn a_loop_lets_go_on_its_way_back() {
        let curve = Curve::new(&uneven(), AtEnd::Loop).expect("good");
        assert_eq!(curve.at(0.6).buttons, 0);
        let again = curve.at(curve.duration_s() + 0.08);
        assert!((again.position_m - curve.at(0.08).position_m).amax() < 1e-12);
    }

    #[test]
    fn an_even_rate_samples_the_curve_and_is_bounded() {
        let even = resample(&uneven(), 1000.0).expect("good");
        assert_eq!(even.times_s.len(), 501);
        let curve = Curve::new(&uneven(), AtEnd::Hold).expect("good");
        assert_eq!(even.positions_m[77], curve.at(0.077).position_m);
        for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e12] {
            assert_eq!(resample(&uneven(), rate_hz), Err(RecordingFault::Rate));
        }
        let one = HandRecording { times_s: vec![3.0], positions_m: vec![Vec3::x()], buttons: vec![2] };
        let still = Curve::new(&one, AtEnd::Loop).expect("one sample is a hand that rests").at(7.3);
        assert!((still.position_m - Vec3::x()).amax() < 1e-15);
    }

    proptest! {
        #[test]
        fn the_curve_stays_near_its_samples(points in prop::collection::vec((0.01..0.1, -0.1..0.1), 2..40), t in 0.0..9.0) {
            let mut recording = HandRecording::default();
            let mut time_s = 0.0;
            for (dt, x) in points {
                time_s += dt;
                recording.times_s.push(time_s);
                recording.positions_m.push(Vec3::new(x, 0.0, 0.0));
                recording.buttons.push(0);
            }
            // Slopes are at most 0.2 m / 10 ms; a cubic leaves its end points by at most h·|m|·8/27 in sum.
            let bound = 0.1 + 0.1 * 20.0 * 8.0 / 27.0;
            let point = Curve::new(&recording, AtEnd::Loop).expect("good").at(t);
            prop_assert!(point.position_m.x.abs() <= bound);
        }
    }
}
