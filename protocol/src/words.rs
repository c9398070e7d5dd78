//! The codes of the messages in words, for whoever shows them to a person: servo state, faults, stages, scenes,
//! control, integrators, the ladder of the late solver. An unknown code has a word, too, so that a newer writer
//! does no harm.

/// Servo states by code.
const MODES: [&str; 6] = ["init", "monitor", "armed", "ramp", "active", "fault"];
/// Why the servo stopped rendering, by fault code; code 0 is no fault.
const FAULTS: [&str; 8] = [
    "no fault",
    "the haptic device is gone; check its cable and re-arm",
    "the haptic device stopped delivering new samples; check its connection and re-arm",
    "the haptic device delivered implausible positions; calibrate it and re-arm",
    "the servo missed too many ticks in a row; lower the machine's load and re-arm",
    "the computed force was not a number; look at the flight record, then re-arm",
    "the machine was suspended while the servo ran; re-arm",
    "the haptic device switched its force off; see what it said, remove the cause and re-arm",
];
/// Suturing stages by code, as a person would say them.
const STAGES: [&str; 6] = [
    "take the left point",
    "left point in the needle",
    "take the right point",
    "pull the line, release when closed",
    "line free: take the right point again",
    "all stitches tied",
];
/// Scene kinds by code.
const SCENES: [&str; 3] = ["skin", "liver", "vessel"];
/// Control modes by code.
const CONTROLS: [&str; 3] = ["off", "on", "paper"];
/// Integrators by code.
const INTEGRATORS: [&str; 5] = ["semi-implicit Euler", "paper's explicit", "Verlet", "BDF2", "XPBD"];
/// Rungs of the late solver's ladder by code.
const RUNGS: [&str; 5] = ["affine port", "one-ring", "frozen anchor", "force decays", "no port"];

/// State of the servo.
#[must_use]
pub fn mode(code: u32) -> &'static str {
    of(&MODES, code)
}

/// What happened and what to do, one sentence without a full stop.
#[must_use]
pub fn fault(code: u32) -> &'static str {
    of(&FAULTS, code)
}

/// What is to be done next at the pair at work.
#[must_use]
pub fn stage(code: u32) -> &'static str {
    of(&STAGES, code)
}

/// Kind of a scene.
#[must_use]
pub fn scene(code: u32) -> &'static str {
    of(&SCENES, code)
}

/// Suture control.
#[must_use]
pub fn control(code: u32) -> &'static str {
    of(&CONTROLS, code)
}

/// Integrator of the tissue.
#[must_use]
pub fn integrator(code: u32) -> &'static str {
    of(&INTEGRATORS, code)
}

/// Rung of the ladder.
#[must_use]
pub fn rung(code: u32) -> &'static str {
    of(&RUNGS, code)
}

fn of(words: &[&'static str], code: u32) -> &'static str {
    words.get(code as usize).copied().unwrap_or("unknown to this build")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_codes_have_a_word() {
        for word in [mode, fault, stage, scene, control, integrator, rung] {
            assert!(!word(0).is_empty());
            assert_eq!(word(u32::MAX), "unknown to this build");
        }
    }
}
