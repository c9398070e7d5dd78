//! Which way a motor drives its joint: the encoder says it, not the person.
//!
//! The motor goes on with counts `+n`, then `−n`, while a hand lets the arm follow by about a centimetre (some 180 counts of an
//! encoder at 0.13 m). `sign = sgn(moved)·sgn(counts)·d_i`, with `moved = after − before` (the counts wrap) and the direction
//! `d_i` that the pose is computed with: so a torque of positive sign drives the joint's angle up, as the jacobian has it, and
//! a wall pushes back. Refused: less than 50 counts, and the same way for both signs (weight or hand, not the motor).
//! Deliberately absent: how strong the motor is (`fit.rs`).

use super::arm::DIRECTION;
use super::calibrate::{ATTEMPTS, Bench, CalibrateError, Held, STEPS, line_of};
use std::io::{BufRead, Write};

/// The motor must overcome the friction of the arm: the most that the readings use.
const COUNTS: i16 = STEPS[STEPS.len() - 1];
/// Least movement that shows a direction, counts of the encoder: about 3 mm.
pub(super) const LEAST_MOVED: u16 = 50;

/// Sign of the torque of a joint for positive counts, 1 or −1.
pub(super) fn direction(
    bench: &mut dyn Bench,
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
    joint: usize,
) -> Result<f64, CalibrateError> {
    let up = follow(bench, answers, out, joint, COUNTS)?.signum();
    let down = follow(bench, answers, out, joint, -COUNTS)?.signum();
    if up == down {
        return Err(CalibrateError::OneWay(joint + 1));
    }
    Ok(f64::from(up) * DIRECTION[joint])
}

/// How far the joint moves with its motor on, counts of its encoder.
fn follow(
    bench: &mut dyn Bench,
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
    joint: usize,
    counts: i16,
) -> Result<i16, CalibrateError> {
    let name = format!("joint {}, {counts:+} counts", joint + 1);
    for _ in 0..ATTEMPTS {
        let ready = format!("{name}: no hook, hold the gimbal loosely in mid-air, then press Enter for the motor");
        enter(answers, out, &ready)?;
        let before = bench.encoders().map_err(CalibrateError::Device)?;
        bench.hold(joint, counts).map_err(CalibrateError::Device)?;
        let followed =
            line_of(answers, out, &format!("{name}: let the arm follow the motor by a centimetre, then press Enter"));
        let after = bench.encoders();
        let held = bench.release().map_err(CalibrateError::Device)?;
        followed?;
        let moved = after.map_err(CalibrateError::Device)?[joint].wrapping_sub(before[joint]).cast_signed();
        match held {
            Held::TooLong => writeln!(out, "The motor had gone off by then; once more.")?,
            Held::Throughout if moved.unsigned_abs() >= LEAST_MOVED => return Ok(moved),
            Held::Throughout => writeln!(out, "It moved by {moved} counts, {LEAST_MOVED} are needed; once more.")?,
        }
    }
    Err(CalibrateError::NotMoved(name))
}

/// Waits for Enter alone.
pub(super) fn enter(answers: &mut dyn BufRead, out: &mut dyn Write, question: &str) -> Result<(), CalibrateError> {
    for _ in 0..ATTEMPTS {
        if line_of(answers, out, question)?.is_empty() {
            return Ok(());
        }
        writeln!(out, "Only Enter switches the motor on.")?;
    }
    Err(CalibrateError::NoAnswer(question.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that moves by what `moves` says for the counts of each hold.
    struct Joint {
        moves: fn(i16) -> i16,
        encoder: u16,
        late: u32,
        is_on: bool,
    }

    impl Bench for Joint {
        fn serial(&self) -> &'static str {
            "1"
        }

        fn hold(&mut self, _joint: usize, counts: i16) -> Result<(), String> {
            self.encoder = self.encoder.wrapping_add_signed((self.moves)(counts));
            self.is_on = true;
            Ok(())
        }

        fn release(&mut self) -> Result<Held, String> {
            self.is_on = false;
            let is_late = self.late > 0;
            self.late = self.late.saturating_sub(1);
            Ok(if is_late { Held::TooLong } else { Held::Throughout })
        }

        fn encoders(&mut self) -> Result<[u16; 3], String> {
            Ok([7, self.encoder, 7])
        }
    }

    /// The sign of the second joint, and what was told; enough answers for every attempt.
    fn sign(moves: fn(i16) -> i16, late: u32) -> (Result<f64, CalibrateError>, String) {
        // Just below the wrap of the encoder.
        let mut joint = Joint { moves, encoder: 65_530, late, is_on: false };
        let mut out = Vec::new();
        let sign = direction(&mut joint, &mut "\n".repeat(20).as_bytes(), &mut out, 1);
        assert!(!joint.is_on);
        (sign, String::from_utf8(out).expect("text"))
    }

    #[test]
    fn the_sign_is_that_of_the_movement_even_across_the_wrap() {
        assert_eq!(sign(|n| n.signum() * 180, 0).0, Ok(DIRECTION[1]));
        assert_eq!(sign(|n| -n.signum() * 180, 0).0, Ok(-DIRECTION[1]));
    }

    #[test]
    fn no_movement_and_the_same_one_for_both_signs_are_refused() {
        let (stuck, out) = sign(|n| n.signum() * 49, 0);
        assert!(matches!(stuck, Err(CalibrateError::NotMoved(_))) && out.contains("moved by 49 counts"), "{stuck:?}");
        assert_eq!(sign(|_| -180, 0).0, Err(CalibrateError::OneWay(2)));
    }

    #[test]
    fn a_motor_that_went_off_by_itself_shows_nothing_and_q_ends_it() {
        let (known, out) = sign(|n| n.signum() * 180, 1);
        assert!(known.is_ok() && out.contains("gone off by then"), "{known:?}");
        let mut joint = Joint { moves: |n| n, encoder: 0, late: 0, is_on: false };
        let ended = direction(&mut joint, &mut "\nq\n".as_bytes(), &mut Vec::new(), 1);
        assert_eq!((ended, joint.is_on), (Err(CalibrateError::Quit), false));
    }
}
