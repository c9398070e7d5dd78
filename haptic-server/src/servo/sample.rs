//! What the servo makes of its device's samples: a gate for positions, and clean button edges.
//!
//! Gate: a fresh sample passes when every number is finite, |x − x_last| ≤ jump · ticks since the last accepted one, and
//! |v| ≤ limit. Up to three refused in a row are bridged with the last good one, the next is a fault. Stale ones keep the
//! position at zero velocity; from the fifth on the force decays, the twentieth is a fault. A lost device is a fault.
//! Buttons: an edge counts at once, then the contact is left alone for the lock-out time, so a short press is never lost
//! and a bounce never counted. A button that is down at the start counts as up until it has been released.
//! Metres, metres per second, nanoseconds. Deliberately absent: filtering (the device gives filtered velocity).

use crate::device::{DeviceSample, SampleQuality};
use crate::servo::params::{SampleParams, to_ns};
use crate::servo::state_machine::ServoFault;
use sim_core::vector::Vec3;

/// Buttons of a device.
pub const BUTTONS: usize = 2;

/// No stylus is farther from the scene's origin than this, metres: the first sample has nothing else to be judged by.
const FARTHEST_M: f64 = 100.0;

/// Why a sample was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleRefusal {
    /// A number was not finite.
    NotFinite,
    /// The position jumped.
    Jump,
    /// Faster than a hand.
    Speed,
}

/// A sample that may be worked with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accepted {
    /// Stylus position, metres.
    pub position_m: Vec3,
    /// Stylus velocity, metres per second.
    pub velocity_m_per_s: Vec3,
    /// `scene_from_stylus` (x, y, z, w).
    pub orientation: [f64; 4],
    /// Buttons as the device gave them.
    pub buttons: u32,
}

/// The gate's answer to one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GateAnswer {
    /// The sample to work with; `None` before the first good one.
    pub sample: Option<Accepted>,
    /// Share of the force that the samples' state allows, 0 to 1.
    pub gain: f64,
    /// Why this sample was refused (for the first in a row).
    pub refusal: Option<SampleRefusal>,
    /// The device can no longer be worked with.
    pub fault: Option<ServoFault>,
}

/// Gate for positions.
#[derive(Clone, Copy, Debug)]
pub struct SampleGate {
    params: SampleParams,
    last: Option<Accepted>,
    periods_since: f64,
    refused_in_a_row: u32,
    stale_in_a_row: u32,
    gain: f64,
}

impl SampleGate {
    /// Without a reference.
    #[must_use]
    pub fn new(params: SampleParams) -> Self {
        Self { params, last: None, periods_since: 0.0, refused_in_a_row: 0, stale_in_a_row: 0, gain: 1.0 }
    }

    /// Forgets the reference: the next finite sample is taken wherever it is (after a re-arm).
    pub fn reset(&mut self) {
        *self = Self { last: None, ..Self::new(self.params) };
    }

    /// Judges one sample. `dt_s` is the time since the last tick, `period_s` the servo period.
    pub fn tick(&mut self, sample: &DeviceSample, dt_s: f64, period_s: f64) -> GateAnswer {
        self.periods_since += (dt_s / period_s).max(1.0);
        match sample.quality {
            SampleQuality::Lost => self.answer(None, Some(ServoFault::DeviceLost)),
            SampleQuality::Tripped => self.answer(None, Some(ServoFault::DeviceTripped)),
            SampleQuality::Unready => {
                // The next good sample is taken wherever it is: calibration moves the position.
                self.reset();
                self.answer(None, None)
            }
            SampleQuality::Stale => {
                self.stale_in_a_row = self.stale_in_a_row.saturating_add(1);
                if let Some(last) = &mut self.last {
                    last.velocity_m_per_s = Vec3::zeros();
                }
                let (from, to) = (f64::from(self.params.stale_decay_ticks), f64::from(self.params.stale_fault_ticks));
                let left = 1.0 - (f64::from(self.stale_in_a_row) - from) / (to - from);
                self.gain = self.gain.min(left).clamp(0.0, 1.0);
                let is_dead = self.stale_in_a_row >= self.params.stale_fault_ticks;
                self.answer(None, is_dead.then_some(ServoFault::SamplesStale))
            }
            SampleQuality::Fresh => {
                self.stale_in_a_row = 0;
                self.gain = (self.gain + dt_s / self.params.stale_recover_s).clamp(0.0, 1.0);
                self.judge(sample)
            }
        }
    }

    fn judge(&mut self, sample: &DeviceSample) -> GateAnswer {
        let Some(refusal) = self.refusal(sample) else {
            self.refused_in_a_row = 0;
            self.periods_since = 0.0;
            self.last = Some(Accepted {
                position_m: sample.position_m,
                velocity_m_per_s: sample.velocity_m_per_s,
                orientation: sample.orientation,
                buttons: sample.buttons,
            });
            return self.answer(None, None);
        };
        self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
        let is_first = self.refused_in_a_row == 1;
        let is_dead = self.refused_in_a_row > self.params.max_rejected;
        self.answer(is_first.then_some(refusal), is_dead.then_some(ServoFault::SamplesImplausible))
    }

    fn refusal(&self, sample: &DeviceSample) -> Option<SampleRefusal> {
        let numbers = sample.position_m.iter().chain(sample.velocity_m_per_s.iter()).chain(&sample.orientation);
        if !numbers.into_iter().all(|n| n.is_finite()) {
            return Some(SampleRefusal::NotFinite);
        }
        if sample.velocity_m_per_s.norm() > self.params.max_speed_m_per_s {
            return Some(SampleRefusal::Speed);
        }
        if sample.position_m.norm() > FARTHEST_M {
            return Some(SampleRefusal::Jump);
        }
        let last = self.last?;
        let reach = self.params.max_jump_m * self.periods_since.max(1.0);
        ((sample.position_m - last.position_m).norm() > reach).then_some(SampleRefusal::Jump)
    }

    fn answer(&self, refusal: Option<SampleRefusal>, fault: Option<ServoFault>) -> GateAnswer {
        GateAnswer { sample: self.last, gain: self.gain, refusal, fault }
    }
}

/// Clean button levels and edge counters.
#[derive(Clone, Copy, Debug)]
pub struct Buttons {
    lockout_ns: u64,
    /// Clean levels, bit per button.
    pub level: u32,
    /// Rising edges since start.
    pub press_count: [u32; BUTTONS],
    /// Falling edges since start.
    pub release_count: [u32; BUTTONS],
    edge_ns: [u64; BUTTONS],
    /// Bit per button that has been seen up.
    seen_up: u32,
}

impl Buttons {
    /// Nothing pressed, nothing trusted yet.
    #[must_use]
    pub fn new(params: &SampleParams) -> Self {
        Self {
            lockout_ns: to_ns(params.button_lockout_s),
            level: 0,
            press_count: [0; BUTTONS],
            release_count: [0; BUTTONS],
            edge_ns: [0; BUTTONS],
            seen_up: 0,
        }
    }

    /// Takes the raw bits of one sample.
    pub fn tick(&mut self, raw: u32, now_ns: u64) {
        self.seen_up |= !raw;
        for button in 0..BUTTONS {
            let bit = 1 << button;
            let (was, is) = (self.level & bit, raw & self.seen_up & bit);
            // A clock that has stepped back ends the lock-out: an edge in the future says nothing.
            let since_edge = now_ns.checked_sub(self.edge_ns[button]).filter(|_| self.edge_ns[button] != 0);
            let is_locked = since_edge.is_some_and(|age| age < self.lockout_ns);
            if was == is || is_locked {
                continue;
            }
            self.level ^= bit;
            self.edge_ns[button] = now_ns;
            let counter = if is == 0 { &mut self.release_count[button] } else { &mut self.press_count[button] };
            *counter = counter.wrapping_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const P: f64 = 0.001;

    fn at(x: f64) -> DeviceSample {
        DeviceSample {
            time_ns: 0,
            position_m: Vec3::new(x, 0.0, 0.0),
            velocity_m_per_s: Vec3::new(0.1, 0.0, 0.0),
            orientation: [0.0, 0.0, 0.0, 1.0],
            buttons: 0,
            quality: SampleQuality::Fresh,
        }
    }

    #[test]
    fn three_glitches_are_bridged_and_the_fourth_is_a_fault() {
        let glitches = [
            (DeviceSample { position_m: Vec3::new(f64::NAN, 0.0, 0.0), ..at(0.0) }, SampleRefusal::NotFinite),
            (at(0.5), SampleRefusal::Jump),
            (DeviceSample { velocity_m_per_s: Vec3::new(1.3, 0.0, 0.0), ..at(0.0) }, SampleRefusal::Speed),
        ];
        for (glitch, why) in glitches {
            let mut gate = SampleGate::new(SampleParams::default());
            gate.tick(&at(0.001), P, P);
            for k in 0..3 {
                let answer = gate.tick(&glitch, P, P);
                assert_eq!(answer.sample.map(|s| s.position_m.x), Some(0.001));
                assert_eq!((answer.refusal, answer.fault), ((k == 0).then_some(why), None));
            }
            assert_eq!(gate.tick(&glitch, P, P).fault, Some(ServoFault::SamplesImplausible));
            gate.reset();
            assert_eq!(gate.tick(&at(0.5), P, P).fault, None);
        }
    }

    #[test]
    fn a_first_sample_beyond_any_room_is_refused() {
        for x in [1e308, -101.0] {
            let mut gate = SampleGate::new(SampleParams::default());
            let answer = gate.tick(&at(x), P, P);
            assert_eq!((answer.sample, answer.refusal), (None, Some(SampleRefusal::Jump)), "{x}");
            assert_eq!(gate.tick(&at(0.1), P, P).sample.map(|s| s.position_m.x), Some(0.1));
        }
    }

    #[test]
    fn an_edge_counts_after_the_clock_stepped_back() {
        let mut buttons = Buttons::new(&SampleParams::default());
        buttons.tick(0, 5_000_000_000);
        buttons.tick(1, 5_001_000_000);
        buttons.tick(0, 1_000_000_000);
        assert_eq!((buttons.press_count, buttons.release_count), ([1, 0], [1, 0]));
    }

    #[test]
    fn a_gap_in_time_allows_the_way_of_that_time() {
        let mut gate = SampleGate::new(SampleParams::default());
        gate.tick(&at(0.0), P, P);
        assert_eq!(gate.tick(&at(0.020), 5.0 * P, P).refusal, None);
        assert_eq!(gate.tick(&at(0.026), P, P).refusal, Some(SampleRefusal::Jump));
    }

    #[test]
    fn stale_samples_fade_the_force_then_fault() {
        let mut gate = SampleGate::new(SampleParams::default());
        gate.tick(&at(0.0), P, P);
        let stale = DeviceSample { quality: SampleQuality::Stale, ..at(0.0) };
        let answers: [GateAnswer; 20] = std::array::from_fn(|_| gate.tick(&stale, P, P));
        assert_eq!(answers[3].gain, 1.0);
        assert!(answers[5].gain < 1.0 && answers[12].gain < answers[5].gain);
        assert!(answers[18].gain > 0.0 && answers[18].fault.is_none());
        assert_eq!((answers[19].gain, answers[19].fault), (0.0, Some(ServoFault::SamplesStale)));
        assert_eq!(answers[0].sample.map(|s| s.velocity_m_per_s), Some(Vec3::zeros()));
        assert!(gate.tick(&at(0.0), P, P).gain < 0.02);
    }

    #[test]
    fn a_button_stuck_at_the_start_is_no_edge_until_released() {
        let mut buttons = Buttons::new(&SampleParams::default());
        for ms in 1..100 {
            buttons.tick(1, ms * 1_000_000);
        }
        assert_eq!((buttons.level, buttons.press_count, buttons.release_count), (0, [0, 0], [0, 0]));
        buttons.tick(0, 100_000_000);
        buttons.tick(1, 101_000_000);
        assert_eq!((buttons.level, buttons.press_count), (1, [1, 0]));
    }

    #[test]
    fn a_short_press_counts_and_a_bounce_does_not() {
        let mut buttons = Buttons::new(&SampleParams::default());
        // One tick long, then bouncing for 4 ms, then up.
        for (ms, raw) in (1..).zip([0, 2, 0, 2, 0, 2, 0, 0, 0, 0, 0, 0, 0]) {
            buttons.tick(raw, ms * 1_000_000);
        }
        assert_eq!((buttons.level, buttons.press_count, buttons.release_count), (0, [0, 1], [0, 1]));
    }
}
