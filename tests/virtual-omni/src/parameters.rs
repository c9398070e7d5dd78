//! Get and set: every parameter with its type, its length and its unit (millimetres, newtons per millimetre).
//!
//! A parameter is asked for in its own type; reals may be asked for as float or double. The same parameter of the last
//! frame has a number 0x0200 higher, and the last force 0x0100. Set works inside a frame only.

use crate::codes;
use crate::device::{Latched, VirtualDevice, Wanted};
use crate::motors::{CONTINUOUS_FORCE_N, MAX_FORCE_N};
use sim_core::vector::Vec3;

/// Largest array of a parameter.
pub(crate) const LONGEST: usize = 16;

/// Type in which a client asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    Int,
    Long,
    Float,
    Double,
}

/// A parameter's value with its own type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value {
    Bool(bool),
    Int(i32),
    /// A whole number that may be asked for as a real one, too.
    Rate(i32),
    Long([i64; 6]),
    Real([f64; LONGEST], usize),
    /// Only as float.
    Single(f64),
}

impl Value {
    fn reals(values: &[f64]) -> Self {
        let mut out = [0.0; LONGEST];
        out[..values.len()].copy_from_slice(values);
        Self::Real(out, values.len())
    }

    /// Whether it may be asked for in this type.
    pub(crate) fn answers(&self, kind: Kind) -> bool {
        match self {
            Self::Bool(_) => kind == Kind::Bool,
            Self::Int(_) => kind == Kind::Int,
            Self::Rate(_) => matches!(kind, Kind::Int | Kind::Double),
            Self::Long(_) => kind == Kind::Long,
            Self::Real(..) => matches!(kind, Kind::Float | Kind::Double),
            Self::Single(_) => kind == Kind::Float,
        }
    }

    /// As numbers.
    pub(crate) fn numbers(&self) -> ([f64; LONGEST], usize) {
        let one = |n: f64| {
            let mut out = [0.0; LONGEST];
            out[0] = n;
            (out, 1)
        };
        match *self {
            Self::Bool(b) => one(f64::from(u8::from(b))),
            Self::Int(i) | Self::Rate(i) => one(f64::from(i)),
            Self::Single(x) => one(x),
            Self::Long(counts) => {
                let mut out = [0.0; LONGEST];
                for (out, count) in out.iter_mut().zip(counts) {
                    *out = count as f64;
                }
                (out, counts.len())
            }
            Self::Real(values, count) => (values, count),
        }
    }
}

/// Values of a frame.
fn latched(frame: &Latched, wanted: &Wanted, parameter: u32) -> Option<Value> {
    let spoilt = |v: Vec3| if frame.garbage { Vec3::repeat(f64::NAN) } else { v };
    Some(match parameter {
        codes::CURRENT_BUTTONS => Value::Int(frame.buttons.cast_signed()),
        codes::CURRENT_SAFETY_SWITCH => Value::Bool(false),
        codes::CURRENT_INKWELL_SWITCH => Value::Bool(frame.docked),
        codes::CURRENT_ENCODER_VALUES => Value::Long(frame.reading.counts),
        codes::CURRENT_POSITION => Value::reals(spoilt(frame.reading.position_mm()).as_slice()),
        codes::CURRENT_VELOCITY => Value::reals((spoilt(frame.velocity_m_per_s) * 1e3).as_slice()),
        codes::CURRENT_TRANSFORM => {
            let mut transform = frame.reading.transform();
            if frame.garbage {
                transform = [f64::NAN; 16];
            }
            Value::reals(&transform)
        }
        codes::CURRENT_JACOBIAN => Value::reals(&frame.reading.jacobian()),
        codes::CURRENT_JOINT_ANGLES => Value::reals(frame.reading.joints.as_slice()),
        codes::CURRENT_GIMBAL_ANGLES => Value::reals(frame.reading.gimbal.as_slice()),
        codes::CURRENT_FORCE => Value::reals(wanted.force_n.as_slice()),
        codes::CURRENT_JOINT_TORQUE => Value::reals((wanted.torque_nm.unwrap_or_default() * 1e3).as_slice()),
        _ => return None,
    })
}

/// A parameter of a device; `rate_hz` is the scheduler's.
pub(crate) fn get(device: &VirtualDevice, rate_hz: u32, parameter: u32) -> Option<Value> {
    let rate = i32::try_from(rate_hz).unwrap_or(i32::MAX);
    let of_frame = latched(&device.current, &device.wanted, parameter).or_else(|| match parameter {
        codes::LAST_FORCE => Some(Value::reals(device.last_wanted.force_n.as_slice())),
        _ => latched(&device.last, &device.last_wanted, parameter.wrapping_sub(codes::LAST)),
    });
    of_frame.or_else(|| {
        Some(match parameter {
            codes::DEVICE_FIRMWARE_VERSION => Value::reals(&[192.0]),
            codes::MAX_WORKSPACE_DIMENSIONS => Value::reals(&[-210.0, -110.0, -85.0, 210.0, 205.0, 130.0]),
            codes::USABLE_WORKSPACE_DIMENSIONS => Value::reals(&[-80.0, -60.0, -35.0, 80.0, 60.0, 35.0]),
            codes::TABLETOP_OFFSET => Value::Single(-110.0),
            codes::INPUT_DOF => Value::Int(6),
            codes::OUTPUT_DOF => Value::Int(3),
            codes::CALIBRATION_STYLE => Value::Int(codes::CALIBRATION_INKWELL.cast_signed()),
            codes::UPDATE_RATE | codes::INSTANTANEOUS_UPDATE_RATE => Value::Rate(rate),
            codes::NOMINAL_MAX_STIFFNESS => Value::reals(&[0.5]),
            codes::NOMINAL_MAX_DAMPING => Value::reals(&[0.003]),
            codes::NOMINAL_MAX_FORCE => Value::reals(&[MAX_FORCE_N]),
            codes::NOMINAL_MAX_CONTINUOUS_FORCE => Value::reals(&[CONTINUOUS_FORCE_N]),
            codes::MOTOR_TEMPERATURE => Value::reals(device.motors.temperature.as_slice()),
            codes::SOFTWARE_VELOCITY_LIMIT => Value::reals(&[device.settings.max_velocity_m_per_s * 1e3]),
            codes::SOFTWARE_FORCE_IMPULSE_LIMIT => Value::reals(&[device.settings.max_impulse_n_per_ms]),
            codes::FORCE_RAMPING_RATE => Value::reals(&[device.settings.ramp_n_per_s]),
            codes::USER_STATUS_LIGHT => Value::Int(device.light),
            _ => return None,
        })
    })
}

/// Numbers that a parameter takes; `None` when it cannot be set.
pub(crate) fn settable(parameter: u32) -> Option<(usize, bool)> {
    match parameter {
        codes::CURRENT_FORCE | codes::CURRENT_JOINT_TORQUE => Some((3, true)),
        codes::SOFTWARE_VELOCITY_LIMIT | codes::SOFTWARE_FORCE_IMPULSE_LIMIT | codes::FORCE_RAMPING_RATE => {
            Some((1, true))
        }
        codes::USER_STATUS_LIGHT => Some((1, false)),
        _ => None,
    }
}

/// Sets a parameter inside a frame.
pub(crate) fn set(device: &mut VirtualDevice, parameter: u32, kind: Kind, values: &[f64]) -> Result<(), u32> {
    let (_, is_real) = settable(parameter).ok_or(codes::INVALID_ENUM)?;
    if is_real != matches!(kind, Kind::Float | Kind::Double) {
        return Err(codes::INVALID_INPUT_TYPE);
    }
    if !device.frames.open {
        return Err(codes::FRAME_ERROR);
    }
    if values.iter().any(|v| !v.is_finite()) || (values.len() == 1 && is_real && values[0] <= 0.0) {
        return Err(codes::INVALID_VALUE);
    }
    match parameter {
        codes::CURRENT_FORCE => device.wanted.force_n = Vec3::from_column_slice(values),
        codes::CURRENT_JOINT_TORQUE => device.wanted.torque_nm = Some(Vec3::from_column_slice(values) * 1e-3),
        codes::SOFTWARE_VELOCITY_LIMIT => device.settings.max_velocity_m_per_s = values[0] * 1e-3,
        codes::SOFTWARE_FORCE_IMPULSE_LIMIT => device.settings.max_impulse_n_per_ms = values[0],
        codes::FORCE_RAMPING_RATE => device.settings.ramp_n_per_s = values[0],
        _ => device.light = values[0] as i32,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Calibration;
    use crate::grip::Grip;

    fn device() -> VirtualDevice {
        VirtualDevice::new(c"test".to_owned(), Calibration::Kept, Grip::Led)
    }

    #[test]
    fn each_parameter_answers_in_its_own_type_only() {
        let device = device();
        for (parameter, right, wrong) in [
            (codes::CURRENT_POSITION, Kind::Double, Kind::Int),
            (codes::CURRENT_POSITION, Kind::Float, Kind::Long),
            (codes::CURRENT_BUTTONS, Kind::Int, Kind::Double),
            (codes::CURRENT_INKWELL_SWITCH, Kind::Bool, Kind::Int),
            (codes::CURRENT_ENCODER_VALUES, Kind::Long, Kind::Int),
            (codes::TABLETOP_OFFSET, Kind::Float, Kind::Double),
            (codes::UPDATE_RATE, Kind::Double, Kind::Float),
        ] {
            let value = get(&device, 1000, parameter).expect("known");
            assert!(value.answers(right) && !value.answers(wrong), "{parameter:#x}");
        }
        assert_eq!(get(&device, 1000, 0x2FFF), None);
        assert_eq!(get(&device, 1000, codes::NOMINAL_MAX_STIFFNESS).map(|v| v.numbers().0[0]), Some(0.5));
    }

    #[test]
    fn set_needs_a_frame_the_right_type_and_a_number() {
        let mut device = device();
        let force = [0.1, 0.2, 0.3];
        assert_eq!(set(&mut device, codes::CURRENT_FORCE, Kind::Double, &force), Err(codes::FRAME_ERROR));
        device.open();
        device.begin(1).expect("a frame");
        assert_eq!(set(&mut device, codes::CURRENT_FORCE, Kind::Int, &force), Err(codes::INVALID_INPUT_TYPE));
        assert_eq!(set(&mut device, codes::CURRENT_POSITION, Kind::Double, &force), Err(codes::INVALID_ENUM));
        let broken = [f64::NAN; 3];
        assert_eq!(set(&mut device, codes::CURRENT_FORCE, Kind::Double, &broken), Err(codes::INVALID_VALUE));
        assert_eq!(set(&mut device, codes::CURRENT_FORCE, Kind::Double, &force), Ok(()));
        assert_eq!(get(&device, 1000, codes::CURRENT_FORCE).map(|v| v.numbers().0[1]), Some(0.2));
    }
}
