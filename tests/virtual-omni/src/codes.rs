//! Numbers of the haptic device interface: errors, parameters, capabilities, answers.
//!
//! Written down here on their own, beside those that the server's driver uses: a test compares the two, so that a
//! wrong digit in either is found. Deliberately absent: parameters that an Omni does not have.

/// No error.
pub const SUCCESS: u32 = 0x0000;
/// A parameter or capability that does not exist.
pub const INVALID_ENUM: u32 = 0x0100;
/// A value out of its range.
pub const INVALID_VALUE: u32 = 0x0101;
/// A call that is not possible now.
pub const INVALID_OPERATION: u32 = 0x0102;
/// A parameter that has another type.
pub const INVALID_INPUT_TYPE: u32 = 0x0103;
/// A device handle that is none.
pub const BAD_HANDLE: u32 = 0x0104;
/// The motors are too warm.
pub const WARM_MOTORS: u32 = 0x0200;
/// More force than the device has.
pub const EXCEEDED_MAX_FORCE: u32 = 0x0201;
/// The force changed too fast.
pub const EXCEEDED_MAX_FORCE_IMPULSE: u32 = 0x0202;
/// The stylus moves too fast.
pub const EXCEEDED_MAX_VELOCITY: u32 = 0x0203;
/// Forces of two kinds at once.
pub const FORCE_ERROR: u32 = 0x0204;
/// The device does not work.
pub const DEVICE_FAULT: u32 = 0x0300;
/// The device is open already.
pub const DEVICE_ALREADY_INITIATED: u32 = 0x0301;
/// The connection is broken.
pub const COMM_ERROR: u32 = 0x0302;
/// The connection is set up wrongly, or the device is locked.
pub const COMM_CONFIG_ERROR: u32 = 0x0303;
/// The scheduler's timer does not work.
pub const TIMER_ERROR: u32 = 0x0304;
/// A frame was begun twice.
pub const ILLEGAL_BEGIN: u32 = 0x0400;
/// A frame was ended that was not begun.
pub const ILLEGAL_END: u32 = 0x0401;
/// A call that needs a frame.
pub const FRAME_ERROR: u32 = 0x0402;
/// A priority that does not exist.
pub const INVALID_PRIORITY: u32 = 0x0500;
/// No room for a callback.
pub const SCHEDULER_FULL: u32 = 0x0501;
/// No licence.
pub const INVALID_LICENSE: u32 = 0x0600;

/// Every error with its name.
pub const ERRORS: [(u32, &core::ffi::CStr); 23] = [
    (SUCCESS, c"no error"),
    (INVALID_ENUM, c"invalid enumerant"),
    (INVALID_VALUE, c"invalid value"),
    (INVALID_OPERATION, c"invalid operation"),
    (INVALID_INPUT_TYPE, c"invalid input type"),
    (BAD_HANDLE, c"bad device handle"),
    (WARM_MOTORS, c"warm motors"),
    (EXCEEDED_MAX_FORCE, c"maximum force exceeded"),
    (EXCEEDED_MAX_FORCE_IMPULSE, c"maximum force impulse exceeded"),
    (EXCEEDED_MAX_VELOCITY, c"maximum velocity exceeded"),
    (FORCE_ERROR, c"conflicting forces"),
    (DEVICE_FAULT, c"device fault"),
    (DEVICE_ALREADY_INITIATED, c"device is open already"),
    (COMM_ERROR, c"communication error"),
    (COMM_CONFIG_ERROR, c"communication set-up error"),
    (TIMER_ERROR, c"timer error"),
    (ILLEGAL_BEGIN, c"frame begun twice"),
    (ILLEGAL_END, c"frame ended without begin"),
    (FRAME_ERROR, c"call outside a frame"),
    (INVALID_PRIORITY, c"invalid priority"),
    (SCHEDULER_FULL, c"scheduler is full"),
    (INVALID_LICENSE, c"invalid licence"),
    (u32::MAX, c"unknown error"),
];

/// A handle that is none.
pub const INVALID_HANDLE: u32 = u32::MAX;

/// Buttons of this frame; the last frame's are [`LAST`] higher.
pub const CURRENT_BUTTONS: u32 = 0x2000;
/// Safety switch.
pub const CURRENT_SAFETY_SWITCH: u32 = 0x2001;
/// Inkwell switch.
pub const CURRENT_INKWELL_SWITCH: u32 = 0x2002;
/// Six encoder counts.
pub const CURRENT_ENCODER_VALUES: u32 = 0x2010;
/// Position, millimetres.
pub const CURRENT_POSITION: u32 = 0x2050;
/// Velocity, millimetres per second.
pub const CURRENT_VELOCITY: u32 = 0x2051;
/// Transform, column by column.
pub const CURRENT_TRANSFORM: u32 = 0x2052;
/// Jacobian, row by row.
pub const CURRENT_JACOBIAN: u32 = 0x2054;
/// Joint angles, radians.
pub const CURRENT_JOINT_ANGLES: u32 = 0x2100;
/// Gimbal angles, radians.
pub const CURRENT_GIMBAL_ANGLES: u32 = 0x2150;
/// From a parameter of this frame to the same of the last frame.
pub const LAST: u32 = 0x0200;
/// Version of the interface.
pub const VERSION: u32 = 0x2500;
/// Model.
pub const DEVICE_MODEL_TYPE: u32 = 0x2501;
/// Version of the driver.
pub const DEVICE_DRIVER_VERSION: u32 = 0x2502;
/// Vendor.
pub const DEVICE_VENDOR: u32 = 0x2503;
/// Serial number.
pub const DEVICE_SERIAL_NUMBER: u32 = 0x2504;
/// Version of the firmware.
pub const DEVICE_FIRMWARE_VERSION: u32 = 0x2505;
/// Largest workspace, millimetres.
pub const MAX_WORKSPACE_DIMENSIONS: u32 = 0x2550;
/// Usable workspace, millimetres.
pub const USABLE_WORKSPACE_DIMENSIONS: u32 = 0x2551;
/// Height over the table, millimetres.
pub const TABLETOP_OFFSET: u32 = 0x2552;
/// Degrees of freedom of the pose.
pub const INPUT_DOF: u32 = 0x2553;
/// Degrees of freedom of the force.
pub const OUTPUT_DOF: u32 = 0x2554;
/// Ways of calibration, as a mask.
pub const CALIBRATION_STYLE: u32 = 0x2555;
/// Rate, hertz.
pub const UPDATE_RATE: u32 = 0x2600;
/// Rate of the last tick, hertz.
pub const INSTANTANEOUS_UPDATE_RATE: u32 = 0x2601;
/// Stiffness, newtons per millimetre.
pub const NOMINAL_MAX_STIFFNESS: u32 = 0x2602;
/// Peak force, newtons.
pub const NOMINAL_MAX_FORCE: u32 = 0x2603;
/// Continuous force, newtons.
pub const NOMINAL_MAX_CONTINUOUS_FORCE: u32 = 0x2604;
/// Motor temperatures, 0 cold to 1 hot.
pub const MOTOR_TEMPERATURE: u32 = 0x2605;
/// Velocity limit, millimetres per second; also a capability.
pub const SOFTWARE_VELOCITY_LIMIT: u32 = 0x2606;
/// Impulse limit, newtons per millisecond; also a capability.
pub const SOFTWARE_FORCE_IMPULSE_LIMIT: u32 = 0x2607;
/// Ramping rate, newtons per second.
pub const FORCE_RAMPING_RATE: u32 = 0x2608;
/// Damping, newton seconds per millimetre.
pub const NOMINAL_MAX_DAMPING: u32 = 0x2609;
/// Cartesian force, newtons.
pub const CURRENT_FORCE: u32 = 0x2700;
/// Cartesian force of the last frame.
pub const LAST_FORCE: u32 = 0x2800;
/// Joint torque, millinewton metres.
pub const CURRENT_JOINT_TORQUE: u32 = 0x2703;
/// Status light; also a capability.
pub const USER_STATUS_LIGHT: u32 = 0x2900;

/// Motors on.
pub const FORCE_OUTPUT: u32 = 0x4000;
/// Shorten a force that is too large.
pub const MAX_FORCE_CLAMPING: u32 = 0x4001;
/// Let the force rise slowly.
pub const FORCE_RAMPING: u32 = 0x4002;
/// Complain of a force that is too large.
pub const SOFTWARE_FORCE_LIMIT: u32 = 0x4003;
/// One frame per device and tick.
pub const ONE_FRAME_LIMIT: u32 = 0x4004;

/// Calibrated.
pub const CALIBRATION_OK: u32 = 0x5000;
/// The calibration can be updated now.
pub const CALIBRATION_NEEDS_UPDATE: u32 = 0x5001;
/// A person has to do something first: put the stylus into the inkwell.
pub const CALIBRATION_NEEDS_MANUAL_INPUT: u32 = 0x5002;
/// Calibration by the inkwell.
pub const CALIBRATION_INKWELL: u32 = 4;

/// A callback that has ended.
pub const CALLBACK_DONE: u32 = 0;
/// Wait: only ask.
pub const WAIT_CHECK_STATUS: u32 = 0;
