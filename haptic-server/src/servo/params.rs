//! Every constant of the servo, named, with its unit and its reason.
//!
//! [`ServoConfig`] comes from outside (TOML tables, keys with SI suffixes, unknown keys refused).
//! [`ServoParams`] is the same after validation, and after the device's own limits have been applied: it is the
//! only form in which the servo takes a constant, and it can only be made by [`ServoParams::new`].
//! Deliberately absent: anything that belongs to a scene (mass, drag, tissue) – that comes with the tissue port.

use crate::device::DeviceLimits;
use serde::{Deserialize, Serialize};

/// Virtual coupling and suture line above the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CouplingParams {
    /// Kvc, N/m: below the 500 N/m an Omni is rated for, with room for half a tick of delay.
    pub stiffness_n_per_m: f64,
    /// Bvc, N·s/m: damps the stylus on the coupling; one encoder count per tick then moves the force by 0.055 N.
    pub damping_n_s_per_m: f64,
    /// Stiffness of the suture line above the tissue, N/m; like Kvc, so that a tight line renders as stably.
    pub line_stiffness_n_per_m: f64,
    /// Damping of the suture line above the tissue while it is tight, N·s/m.
    pub line_damping_n_s_per_m: f64,
    /// An anchor that changes with a new epoch is blended over this time, s; one slow solver step.
    pub blend_s: f64,
}

impl Default for CouplingParams {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: 400.0,
            damping_n_s_per_m: 1.0,
            line_stiffness_n_per_m: 400.0,
            line_damping_n_s_per_m: 1.0,
            blend_s: 0.010,
        }
    }
}

/// Last stage before the device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SafetyParams {
    /// Never exceeded, N; 3.3 N is what an Omni can do.
    pub peak_force_n: f64,
    /// May be held for ever, N; 0.88 N is what an Omni's motors bear.
    pub continuous_force_n: f64,
    /// How long a cold device may render the peak, s (I²t budget = (peak² − continuous²) · this).
    pub peak_hold_s: f64,
    /// Largest change of the force, N/s; 500 N/s = 0.5 N per tick, a hand takes it as firm, not as a blow.
    pub slew_n_per_s: f64,
    /// Corner of the first-order low-pass, Hz; 400 Hz delays by 0.4 ms, half the stiffness goes with each whole ms.
    pub filter_hz: f64,
    /// Consecutive forces that are not finite before the target becomes zero and the servo faults.
    pub bad_force_ticks: u32,
}

impl Default for SafetyParams {
    fn default() -> Self {
        Self {
            peak_force_n: 3.3,
            continuous_force_n: 0.88,
            peak_hold_s: 5.0,
            slew_n_per_s: 500.0,
            filter_hz: 400.0,
            bad_force_ticks: 5,
        }
    }
}

/// Late-solver ladder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LadderParams {
    /// Solver period until two ports have shown the real one, s.
    pub solver_period_s: f64,
    /// The affine port is used up to this many solver periods of age: one lost port is normal, two are not.
    pub affine_periods: f64,
    /// One-ring stiffness and raised damping up to this age, s.
    pub one_ring_until_s: f64,
    /// The handles stand still up to this age, s.
    pub frozen_until_s: f64,
    /// Then the force goes to zero in this time, s; a known death starts it at once.
    pub decay_s: f64,
}

impl Default for LadderParams {
    fn default() -> Self {
        Self {
            solver_period_s: 0.005,
            affine_periods: 2.0,
            one_ring_until_s: 0.050,
            frozen_until_s: 0.250,
            decay_s: 0.100,
        }
    }
}

/// What the servo makes of its device's samples and buttons.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SampleParams {
    /// A larger change of position per period is a glitch, m; ten times what a quick hand does.
    pub max_jump_m: f64,
    /// A larger speed is a glitch, m/s; recorded free hands stay below 0.21 m/s.
    pub max_speed_m_per_s: f64,
    /// Rejected samples in a row that are bridged with the last good one.
    pub max_rejected: u32,
    /// Stale samples in a row from which on the force decays.
    pub stale_decay_ticks: u32,
    /// Stale samples in a row that are a fault.
    pub stale_fault_ticks: u32,
    /// The force comes back over this time after stale samples, s.
    pub stale_recover_s: f64,
    /// A button's contact is left alone for this time after an edge, s; micro-switches bounce for 1 to 3 ms.
    pub button_lockout_s: f64,
}

impl Default for SampleParams {
    fn default() -> Self {
        Self {
            max_jump_m: 0.005,
            max_speed_m_per_s: 1.2,
            max_rejected: 3,
            stale_decay_ticks: 5,
            stale_fault_ticks: 20,
            stale_recover_s: 0.100,
            button_lockout_s: 0.005,
        }
    }
}

/// Tick rate and the way into and out of rendering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RhythmParams {
    /// Servo period, s.
    pub period_s: f64,
    /// The thread wakes this long before the deadline and spins the rest, s; 0 = sleep only. 60 µs removes the jitter.
    pub spin_s: f64,
    /// Missed ticks in a row that are a fault (libfranka's 20).
    pub missed_fault_ticks: u32,
    /// Armed waits for a wanted force below this, N; about the friction of an Omni, so nobody feels the start.
    pub arm_force_n: f64,
    /// The link must be good, and then the force small, for this time each, s.
    pub arm_wait_s: f64,
    /// From zero to full force, s.
    pub ramp_s: f64,
    /// On a stop order the force goes to zero in this time, s.
    pub stop_s: f64,
}

impl Default for RhythmParams {
    fn default() -> Self {
        Self {
            period_s: 0.001,
            spin_s: 0.0,
            missed_fault_ticks: 20,
            arm_force_n: 0.3,
            arm_wait_s: 0.050,
            ramp_s: 2.0,
            stop_s: 0.050,
        }
    }
}

/// Servo constants as a configuration gives them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServoConfig {
    /// Virtual coupling and suture line.
    pub coupling: CouplingParams,
    /// Last stage before the device.
    pub safety: SafetyParams,
    /// Late-solver ladder.
    pub ladder: LadderParams,
    /// Device samples and buttons.
    pub sample: SampleParams,
    /// Tick rate, start and stop.
    pub rhythm: RhythmParams,
}

/// Validated servo constants, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoParams {
    pub(in crate::servo) coupling: CouplingParams,
    pub(in crate::servo) safety: SafetyParams,
    pub(in crate::servo) ladder: LadderParams,
    pub(in crate::servo) sample: SampleParams,
    pub(in crate::servo) rhythm: RhythmParams,
}

/// A constant that the servo cannot work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("servo.{key} is {value}, allowed are {low} to {high}; change it in the configuration")]
pub struct ParamError {
    /// Table and key.
    pub key: &'static str,
    /// What was given.
    pub value: f64,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
}

impl ServoParams {
    /// Checks every constant and applies the device's own limits on force and stiffness.
    ///
    /// # Errors
    /// [`ParamError`] names the first key that is out of its range.
    pub fn new(config: &ServoConfig, limits: &DeviceLimits) -> Result<Self, ParamError> {
        let ServoConfig { coupling: c, safety: s, ladder: l, sample: m, rhythm: r } = *config;
        let peak = s.peak_force_n.min(limits.peak_force_n);
        let checks = [
            ("coupling.stiffness_n_per_m", c.stiffness_n_per_m, 0.0, 5_000.0),
            ("coupling.damping_n_s_per_m", c.damping_n_s_per_m, 0.0, 20.0),
            ("coupling.line_stiffness_n_per_m", c.line_stiffness_n_per_m, 0.0, 5_000.0),
            ("coupling.line_damping_n_s_per_m", c.line_damping_n_s_per_m, 0.0, 20.0),
            ("coupling.blend_s", c.blend_s, 0.0, 1.0),
            ("safety.peak_force_n", peak, 0.0, 50.0),
            ("safety.continuous_force_n", s.continuous_force_n, 0.0, s.peak_force_n),
            ("safety.peak_hold_s", s.peak_hold_s, 0.01, 600.0),
            // Slower ones could not bring the peak to zero within a stop or a decay.
            ("safety.slew_n_per_s", s.slew_n_per_s, peak / r.stop_s.min(l.decay_s).max(1e-3), 5_000.0),
            ("safety.filter_hz", s.filter_hz, 50.0, 100_000.0),
            ("safety.bad_force_ticks", f64::from(s.bad_force_ticks), 1.0, 20.0),
            ("ladder.solver_period_s", l.solver_period_s, 0.0005, 0.025),
            ("ladder.affine_periods", l.affine_periods, 1.0, 10.0),
            ("ladder.one_ring_until_s", l.one_ring_until_s, 0.001, 1.0),
            ("ladder.frozen_until_s", l.frozen_until_s, l.one_ring_until_s, 2.0),
            ("ladder.decay_s", l.decay_s, 0.001, 0.100),
            ("sample.max_jump_m", m.max_jump_m, 1e-5, 0.1),
            ("sample.max_speed_m_per_s", m.max_speed_m_per_s, 0.01, 10.0),
            ("sample.max_rejected", f64::from(m.max_rejected), 0.0, 20.0),
            ("sample.stale_fault_ticks", f64::from(m.stale_fault_ticks), 2.0, 200.0),
            ("sample.stale_decay_ticks", f64::from(m.stale_decay_ticks), 1.0, f64::from(m.stale_fault_ticks) - 1.0),
            ("sample.stale_recover_s", m.stale_recover_s, 0.001, 10.0),
            ("sample.button_lockout_s", m.button_lockout_s, 0.0, 0.2),
            ("rhythm.period_s", r.period_s, 0.0001, 0.01),
            ("rhythm.spin_s", r.spin_s, 0.0, 0.2 * r.period_s),
            ("rhythm.missed_fault_ticks", f64::from(r.missed_fault_ticks), 1.0, 1_000.0),
            ("rhythm.arm_force_n", r.arm_force_n, 0.001, 10.0),
            ("rhythm.arm_wait_s", r.arm_wait_s, 0.0, 10.0),
            ("rhythm.ramp_s", r.ramp_s, 0.01, 60.0),
            ("rhythm.stop_s", r.stop_s, 0.001, 0.050),
        ];
        for (key, value, low, high) in checks {
            if !(value >= low && value <= high) {
                return Err(ParamError { key, value, low, high });
            }
        }
        let device_stiffness = limits.stiffness_n_per_m.max(0.0);
        Ok(Self {
            coupling: CouplingParams {
                stiffness_n_per_m: c.stiffness_n_per_m.min(device_stiffness),
                line_stiffness_n_per_m: c.line_stiffness_n_per_m.min(device_stiffness),
                ..c
            },
            safety: SafetyParams {
                peak_force_n: peak,
                continuous_force_n: s.continuous_force_n.min(limits.continuous_force_n).clamp(0.0, peak),
                ..s
            },
            ladder: l,
            sample: m,
            rhythm: r,
        })
    }

    /// The constants in force, for metadata and reports.
    #[must_use]
    pub fn config(&self) -> ServoConfig {
        let Self { coupling, safety, ladder, sample, rhythm } = *self;
        ServoConfig { coupling, safety, ladder, sample, rhythm }
    }

    /// Servo period, nanoseconds.
    #[must_use]
    pub fn period_ns(&self) -> u64 {
        to_ns(self.rhythm.period_s)
    }
}

/// Seconds of a validated constant as nanoseconds.
#[must_use]
pub(in crate::servo) fn to_ns(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "a test runs outside the room")]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_the_weaker_of_device_and_configuration_counts() {
        let params = ServoParams::new(&ServoConfig::default(), &DeviceLimits::OMNI).expect("defaults");
        assert_eq!(params.config(), ServoConfig::default());
        let weak = DeviceLimits { peak_force_n: 1.0, continuous_force_n: 2.0, stiffness_n_per_m: 100.0 };
        let params = ServoParams::new(&ServoConfig::default(), &weak).expect("weak device");
        assert_eq!(params.safety.peak_force_n, 1.0);
        assert_eq!(params.safety.continuous_force_n, 0.88);
        assert_eq!(params.coupling.stiffness_n_per_m, 100.0);
    }

    #[test]
    fn a_bad_constant_is_named() {
        let mut config = ServoConfig::default();
        config.safety.slew_n_per_s = f64::NAN;
        assert_eq!(ServoParams::new(&config, &DeviceLimits::OMNI).map_err(|e| e.key), Err("safety.slew_n_per_s"));
        config = ServoConfig::default();
        config.ladder.decay_s = 0.2;
        let error = ServoParams::new(&config, &DeviceLimits::OMNI).expect_err("too slow for a known death");
        assert!(error.to_string().contains("servo.ladder.decay_s is 0.2"), "{error}");
    }

    #[test]
    fn tables_read_from_toml_and_unknown_keys_are_refused() {
        let config: ServoConfig = toml::from_str("[rhythm]\nramp_s = 0.5\n").expect("partial table");
        assert_eq!(config.rhythm.ramp_s, 0.5);
        assert_eq!(config.coupling, CouplingParams::default());
        assert!(toml::from_str::<ServoConfig>("[rhythm]\nramp = 0.5\n").is_err());
    }
}
