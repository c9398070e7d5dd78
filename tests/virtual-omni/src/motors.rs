//! Motors: limits, ramp, temperature, watchdog. Newtons, device frame.
//!
//! A force that a client asks for passes: motors on? → clamp or complain beyond 3.3 N → impulse → velocity → ramp.
//! Every complaint switches the amplifiers off and lets the force rise again from zero. Temperature is a model, as in
//! the vendor's driver: Ṫ = (0.6 (τ/τ_c)² − T)/55 s per motor, τ_c = 0.88 N at 0.13335 m: the continuous force settles at
//! 0.6, the peak is too warm after 8 s. A device that hears nothing for 100 ms switches its motors off (watchdog).
//! Limits of force are device facts; those of velocity, impulse, ramp and watchdog are model parameters.

use crate::codes;
use sim_core::vector::Vec3;

/// Largest force, newtons.
pub(crate) const MAX_FORCE_N: f64 = 3.3;
/// Force that may be held, newtons.
pub(crate) const CONTINUOUS_FORCE_N: f64 = 0.88;
/// Torque that a motor may hold, newton metres.
const CONTINUOUS_TORQUE_NM: f64 = CONTINUOUS_FORCE_N * 0.133_35;
/// Temperature at which the continuous torque settles.
const CONTINUOUS_TEMPERATURE: f64 = 0.6;
/// Time constant of the temperature, seconds.
const WARMING_S: f64 = 55.0;
/// Motors switch on again below this temperature.
const COOL: f64 = 0.9;
/// Silence after which the motors are switched off, seconds.
pub const WATCHDOG_S: f64 = 0.1;

/// Capabilities that are on, and the limits that belong to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(crate) force_output: bool,
    pub(crate) clamping: bool,
    pub(crate) ramping: bool,
    pub(crate) force_limit: bool,
    pub(crate) one_frame: bool,
    pub(crate) velocity_limit: bool,
    pub(crate) impulse_limit: bool,
    pub(crate) status_light: bool,
    /// Newtons per second.
    pub(crate) ramp_n_per_s: f64,
    /// Metres per second.
    pub(crate) max_velocity_m_per_s: f64,
    /// Newtons per millisecond.
    pub(crate) max_impulse_n_per_ms: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            force_output: false,
            clamping: true,
            ramping: true,
            force_limit: true,
            one_frame: true,
            velocity_limit: true,
            impulse_limit: true,
            status_light: false,
            ramp_n_per_s: 3.3,
            max_velocity_m_per_s: 1.5,
            max_impulse_n_per_ms: 1.5,
        }
    }
}

impl Settings {
    /// The switch of a capability.
    pub(crate) fn switch(&mut self, capability: u32) -> Option<&mut bool> {
        Some(match capability {
            codes::FORCE_OUTPUT => &mut self.force_output,
            codes::MAX_FORCE_CLAMPING => &mut self.clamping,
            codes::FORCE_RAMPING => &mut self.ramping,
            codes::SOFTWARE_FORCE_LIMIT => &mut self.force_limit,
            codes::ONE_FRAME_LIMIT => &mut self.one_frame,
            codes::SOFTWARE_VELOCITY_LIMIT => &mut self.velocity_limit,
            codes::SOFTWARE_FORCE_IMPULSE_LIMIT => &mut self.impulse_limit,
            codes::USER_STATUS_LIGHT => &mut self.status_light,
            _ => return None,
        })
    }
}

/// State of the motors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motors {
    /// Force that acts now, newtons.
    pub(crate) force_n: Vec3,
    /// Torque that acts now, newton metres.
    pub(crate) torque_nm: Vec3,
    /// Temperature of each motor.
    pub(crate) temperature: Vec3,
    /// What the client asked for in the frame before: an impulse is its change, whatever the motors made of it.
    asked_n: Vec3,
    /// What the ramp allows, newtons.
    ceiling_n: f64,
    /// Too warm and not yet cool again.
    too_warm: bool,
    silent_s: f64,
}

/// What the client asks for, and how the stylus moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    pub(crate) force_n: Vec3,
    pub(crate) speed_m_per_s: f64,
}

impl Motors {
    /// The force after every limit, or the complaint; then the motors are off and the ramp begins anew.
    pub(crate) fn judge(&mut self, asked: &Asked, settings: &Settings) -> Result<Vec3, u32> {
        self.silent_s = 0.0;
        let before_n = std::mem::replace(&mut self.asked_n, asked.force_n);
        if !settings.force_output {
            self.ceiling_n = 0.0;
            return Ok(Vec3::zeros());
        }
        if self.too_warm {
            return Ok(Vec3::zeros());
        }
        let mut force = asked.force_n;
        let size = force.norm();
        if size > MAX_FORCE_N * (1.0 + 1e-9) {
            if settings.clamping {
                force *= MAX_FORCE_N / size;
            } else if settings.force_limit {
                return Err(self.complain(codes::EXCEEDED_MAX_FORCE));
            }
        }
        if settings.impulse_limit && (asked.force_n - before_n).norm() > settings.max_impulse_n_per_ms {
            return Err(self.complain(codes::EXCEEDED_MAX_FORCE_IMPULSE));
        }
        if settings.velocity_limit && asked.speed_m_per_s > settings.max_velocity_m_per_s {
            return Err(self.complain(codes::EXCEEDED_MAX_VELOCITY));
        }
        if settings.ramping && force.norm() > self.ceiling_n {
            force *= self.ceiling_n / force.norm();
        }
        Ok(force)
    }

    /// Motors off, ramp from zero.
    pub(crate) fn restart(&mut self) {
        (self.ceiling_n, self.force_n, self.torque_nm) = (0.0, Vec3::zeros(), Vec3::zeros());
    }

    /// Time passes: ramp, temperature, watchdog. Gives a complaint when the motors have become too warm.
    pub(crate) fn pass(&mut self, dt_s: f64, settings: &Settings) -> Option<u32> {
        self.silent_s += dt_s;
        if self.silent_s > WATCHDOG_S {
            self.restart();
        } else {
            self.ceiling_n = (self.ceiling_n + settings.ramp_n_per_s * dt_s).min(MAX_FORCE_N);
        }
        let share = self.torque_nm / CONTINUOUS_TORQUE_NM;
        let heat = share.map(|s| CONTINUOUS_TEMPERATURE * s * s);
        self.temperature += (heat - self.temperature) * (dt_s / WARMING_S).min(1.0);
        let hottest = self.temperature.max();
        self.too_warm = if self.too_warm { hottest > COOL } else { hottest >= 1.0 };
        (self.too_warm && hottest >= 1.0).then(|| self.complain(codes::WARM_MOTORS))
    }

    fn complain(&mut self, code: u32) -> u32 {
        self.asked_n = Vec3::zeros();
        self.restart();
        code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;

    fn asked(force_n: f64) -> Asked {
        Asked { force_n: Vec3::new(force_n, 0.0, 0.0), speed_m_per_s: 0.1 }
    }

    fn on() -> Settings {
        Settings { force_output: true, ..Settings::default() }
    }

    fn ramped(settings: &Settings) -> Motors {
        let mut motors = Motors::default();
        for _ in 0..1_100 {
            motors.pass(DT, settings);
            motors.judge(&asked(0.0), settings).expect("nothing to complain of");
        }
        motors
    }

    #[test]
    fn the_force_rises_along_the_ramp_and_is_clamped_at_the_peak() {
        let settings = on();
        let mut motors = Motors::default();
        motors.judge(&asked(0.0), &settings).expect("no force");
        motors.pass(0.1, &settings);
        let early = motors.judge(&asked(1.0), &settings).expect("along the ramp");
        assert!((early.x - 0.33).abs() < 1e-12, "a tenth of a second of 3.3 N/s: {early}");
        let mut motors = ramped(&settings);
        motors.asked_n = Vec3::new(3.0, 0.0, 0.0);
        assert!((motors.judge(&asked(4.0), &settings).expect("clamped").x - 3.3).abs() < 1e-12);
    }

    #[test]
    fn each_limit_complains_with_its_code_and_the_force_starts_anew() {
        let unclamped = Settings { clamping: false, ..on() };
        let fast = Asked { speed_m_per_s: 2.0, ..asked(0.5) };
        for (settings, beyond, code) in [
            (unclamped, asked(3.5), codes::EXCEEDED_MAX_FORCE),
            (on(), asked(1.6), codes::EXCEEDED_MAX_FORCE_IMPULSE),
            (on(), fast, codes::EXCEEDED_MAX_VELOCITY),
        ] {
            let mut motors = ramped(&settings);
            assert_eq!(motors.judge(&beyond, &settings), Err(code));
            assert_eq!(motors.judge(&asked(1.0), &settings), Ok(Vec3::zeros()), "the ramp begins anew");
        }
    }

    #[test]
    fn temperature_follows_the_closed_form_and_the_peak_is_soon_too_warm() {
        let settings = on();
        let at = |newtons: f64, seconds: f64| {
            let mut motors = Motors { torque_nm: Vec3::new(newtons * 0.133_35, 0.0, 0.0), ..Motors::default() };
            let mut told = None;
            for tick in 0..(seconds / DT) as u32 {
                motors.silent_s = 0.0;
                told = told.or(motors.pass(DT, &settings).map(|code| (code, f64::from(tick) * DT)));
            }
            (motors.temperature.x, told)
        };
        let (warm, told) = at(0.88, 30.0);
        let expected = 0.6 * (1.0 - (-30.0_f64 / 55.0).exp());
        assert!((warm - expected).abs() < 1e-5, "{warm} against {expected}");
        assert_eq!(told, None);
        let (_, told) = at(3.3, 10.0);
        let level = 0.6 * (3.3_f64 / 0.88).powi(2);
        let expected_s = -55.0 * (1.0 - 1.0 / level).ln();
        assert!(told.is_some_and(|(code, s)| code == codes::WARM_MOTORS && (s - expected_s).abs() < 0.01), "{told:?}");
    }

    #[test]
    fn silence_switches_the_motors_off() {
        let settings = on();
        let mut motors = ramped(&settings);
        motors.force_n = Vec3::new(1.0, 0.0, 0.0);
        for _ in 0..99 {
            motors.pass(DT, &settings);
        }
        assert_eq!(motors.force_n.x, 1.0);
        motors.pass(2.0 * DT, &settings);
        assert_eq!((motors.force_n, motors.ceiling_n), (Vec3::zeros(), 0.0));
    }
}
