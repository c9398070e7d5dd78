//! Exit codes of every program of this package (BSD `sysexits`).
//!
//! Scripts rely on the numbers, so they are named once and used by name. Success is 0; a second
//! interrupt ends a run with 128 + SIGINT. Deliberately absent: codes without a user.

/// All went well.
pub const OK: u8 = 0;
/// The command line is wrong (`EX_USAGE`).
pub const USAGE: u8 = 64;
/// An input file is malformed (`EX_DATAERR`).
pub const BAD_DATA: u8 = 65;
/// An input file does not exist or cannot be read (`EX_NOINPUT`).
pub const NO_INPUT: u8 = 66;
/// Something needed is not there: a device, a running server, a shared memory file system (`EX_UNAVAILABLE`).
pub const UNAVAILABLE: u8 = 69;
/// A fault of the program itself (`EX_SOFTWARE`).
pub const INTERNAL: u8 = 70;
/// Another server holds the device; try again later (`EX_TEMPFAIL`).
pub const TRY_AGAIN: u8 = 75;
/// A right is missing (`EX_NOPERM`).
pub const PERMISSION: u8 = 77;
/// A configuration value is out of range (`EX_CONFIG`).
pub const CONFIGURATION: u8 = 78;
/// Ended by a second interrupt (128 + SIGINT).
pub const INTERRUPTED: u8 = 130;
