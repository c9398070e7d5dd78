//! Numbers of the interface that this driver uses: parameters, capabilities, answers.
//!
//! Errors stand in `severity.rs`, with what they mean. Units in the comments are the interface's.

/// No error.
pub const SUCCESS: u32 = 0;
/// A handle that is none.
pub const INVALID_HANDLE: u32 = u32::MAX;

/// Buttons, bit 0 front, bit 1 back.
pub const CURRENT_BUTTONS: u32 = 0x2000;
/// Stylus in the inkwell.
pub const CURRENT_INKWELL_SWITCH: u32 = 0x2002;
/// Position, millimetres.
pub const CURRENT_POSITION: u32 = 0x2050;
/// Transform, column by column, millimetres.
pub const CURRENT_TRANSFORM: u32 = 0x2052;
/// Force, newtons.
pub const CURRENT_FORCE: u32 = 0x2700;
/// Model.
pub const DEVICE_MODEL_TYPE: u32 = 0x2501;
/// Version of the driver.
pub const DEVICE_DRIVER_VERSION: u32 = 0x2502;
/// Serial number.
pub const DEVICE_SERIAL_NUMBER: u32 = 0x2504;
/// Ways of calibration, a mask.
pub const CALIBRATION_STYLE: u32 = 0x2555;
/// Stiffness, newtons per millimetre.
pub const NOMINAL_MAX_STIFFNESS: u32 = 0x2602;
/// Peak force, newtons.
pub const NOMINAL_MAX_FORCE: u32 = 0x2603;
/// Continuous force, newtons.
pub const NOMINAL_MAX_CONTINUOUS_FORCE: u32 = 0x2604;
/// Motor temperatures, 0 cold to 1 hot.
pub const MOTOR_TEMPERATURE: u32 = 0x2605;

/// Motors on.
pub const FORCE_OUTPUT: u32 = 0x4000;
/// Shorten a force that is too large.
pub const MAX_FORCE_CLAMPING: u32 = 0x4001;
/// Let the force rise slowly.
pub const FORCE_RAMPING: u32 = 0x4002;

/// Calibrated.
pub const CALIBRATION_OK: u32 = 0x5000;
/// The calibration can be updated now.
pub const CALIBRATION_NEEDS_UPDATE: u32 = 0x5001;
/// Calibration by encoder reset.
pub const CALIBRATION_ENCODER_RESET: u32 = 1;
/// Calibration by itself.
pub const CALIBRATION_AUTO: u32 = 2;
/// Calibration by the inkwell.
pub const CALIBRATION_INKWELL: u32 = 4;

/// The style to use when a device has several: by itself, else by the inkwell, else by a reset of the encoders.
#[must_use]
pub fn preferred_style(mask: i32) -> u32 {
    let mask = mask.cast_unsigned();
    let preferred = [CALIBRATION_AUTO, CALIBRATION_INKWELL, CALIBRATION_ENCODER_RESET];
    preferred.into_iter().find(|style| mask & style != 0).unwrap_or(CALIBRATION_INKWELL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_style_that_needs_least_is_preferred() {
        assert_eq!(preferred_style(7), CALIBRATION_AUTO);
        assert_eq!(preferred_style(5), CALIBRATION_INKWELL);
        assert_eq!(preferred_style(1), CALIBRATION_ENCODER_RESET);
        assert_eq!(preferred_style(0), CALIBRATION_INKWELL);
    }
}
