//! What an error of the library means: one table, from the code to the reaction and to what the user is told.
//!
//! | reaction | what happens |
//! |---|---|
//! | note | told; 20 ticks in a row of them are a trip: the driver and the library do not understand each other |
//! | cool | the force fades and stays away until the motors have cooled down |
//! | trip | force off at once, latched until the operator re-arms |
//! | lose | the device is gone: force off, reopened with growing pauses, latched until the operator re-arms |
//!
//! A code that is not in the table trips. Source of classes: the interface's description; the vendor's own sorting forgets
//! the impulse error.

/// What is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reaction {
    /// Told.
    Note,
    /// Force fades until cool.
    Cool,
    /// Force off, latched.
    Trip,
    /// Device gone, latched.
    Lose,
}

/// One error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Severity {
    /// Code.
    pub code: u32,
    /// What is done.
    pub reaction: Reaction,
    /// What the user is told, with the remedy.
    pub meaning: &'static str,
}

/// The device has been opened already.
pub const DEVICE_ALREADY_INITIATED: u32 = 0x0301;

const fn row(code: u32, reaction: Reaction, meaning: &'static str) -> Severity {
    Severity { code, reaction, meaning }
}

const CALL: &str = "the driver made a call that this library refuses; use OpenHaptics 3.0 or 3.4";
const FRAME: &str = "a frame of the driver was out of order; no other program may use the device at the same time";

/// Every code.
pub const TABLE: [Severity; 22] = [
    row(0x0100, Reaction::Note, CALL),
    row(0x0101, Reaction::Note, CALL),
    row(0x0102, Reaction::Note, CALL),
    row(0x0103, Reaction::Note, CALL),
    row(0x0104, Reaction::Lose, "the library no longer knows the device; check its cable"),
    row(0x0200, Reaction::Cool, "the motors are too warm; the force stays away until they have cooled down"),
    row(
        0x0201,
        Reaction::Trip,
        "more force was asked for than the device has; lower [safety] peak_force_n, then re-arm",
    ),
    row(
        0x0202,
        Reaction::Trip,
        "the force changed faster than the device allows; lower [safety] slew_n_per_s, then re-arm",
    ),
    row(0x0203, Reaction::Trip, "the stylus moved faster than the device allows; move it gently, then re-arm"),
    row(
        0x0204,
        Reaction::Trip,
        "forces of two kinds were asked for at once; no other program may use the device, then re-arm",
    ),
    row(0x0300, Reaction::Lose, "the device does not work; check power, cable and the vendor's diagnostic program"),
    row(DEVICE_ALREADY_INITIATED, Reaction::Note, "the device is open already; close the other program that uses it"),
    row(0x0302, Reaction::Lose, "the connection to the device is broken; check its cable and power"),
    row(
        0x0303,
        Reaction::Lose,
        "the device is set up wrongly, or a killed program has left it locked; unplug it, plug it in, run the vendor's set-up",
    ),
    row(
        0x0304,
        Reaction::Lose,
        "the scheduler's timer does not work; give real-time rights, see `haptic-server doctor`",
    ),
    row(0x0400, Reaction::Note, FRAME),
    row(0x0401, Reaction::Note, FRAME),
    row(0x0402, Reaction::Note, FRAME),
    row(0x0500, Reaction::Lose, "the scheduler refuses the driver's priority; use OpenHaptics 3.0 or 3.4"),
    row(0x0501, Reaction::Lose, "the scheduler has no room; close other programs that use the device"),
    row(0x0600, Reaction::Lose, "the library has no licence; set OH_SDK_LICENSE_PATH or install the licence file"),
    row(0xFFFF_FFFF, Reaction::Trip, "an error that this driver does not know; look it up in the vendor's reference"),
];

/// The row of a code; the last row for one that is unknown.
#[must_use]
pub fn of(code: u32) -> &'static Severity {
    TABLE.iter().find(|row| row.code == code).unwrap_or(&TABLE[TABLE.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_stands_once_and_says_what_to_do() {
        for (i, row) in TABLE.iter().enumerate() {
            assert_eq!(of(row.code), row, "{:#06x} stands twice", row.code);
            assert!(row.meaning.contains(';'), "{:#06x} has no remedy: {}", row.code, row.meaning);
            assert!(i == 0 || TABLE[i - 1].code < row.code);
        }
    }

    #[test]
    fn an_unknown_code_trips_and_the_worse_reaction_is_the_larger() {
        assert_eq!(of(0x0777).reaction, Reaction::Trip);
        assert!(Reaction::Lose > Reaction::Trip && Reaction::Trip > Reaction::Cool && Reaction::Cool > Reaction::Note);
    }

    #[test]
    fn forces_that_went_wrong_never_come_back_by_themselves() {
        for code in 0x0201..=0x0204 {
            assert_eq!(of(code).reaction, Reaction::Trip);
        }
    }
}
