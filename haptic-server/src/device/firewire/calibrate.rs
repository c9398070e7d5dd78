//! `haptic-server calibrate-force`: a person with a spring scale, the Omni on FireWire, and a file at the end.
//!
//! For every joint: which way the motor drives it, by its encoder (`direction.rs`). Then for both directions and three small
//! counts: the motor goes on for at most ten seconds, the person reads the spring scale that holds the arm, the motor goes
//! off. `τ = ±F·lever`: F is never negative, the sign is the encoder's. Then the fit (`fit.rs`), and the file (`force_scale.rs`) whose limits are what was measured. `q` ends at any question,
//! motors off, nothing written. Whoever asks and answers is any reader and writer, and the motors are behind [`Bench`], so that
//! all of it runs against a script. Deliberately absent: guessing; a reading that came too late is asked for again.

use super::direction::{LEAST_MOVED, direction, enter};
use super::fit::{self, Reading};
use super::force_scale::ForceScaleFile;
use std::io::{BufRead, Write};

/// Counts of the motors, smallest first: at most an eighth of the converter's range.
pub const STEPS: [i16; 3] = [80, 160, 240];
/// Lever arms that a person can have, millimetres.
const LEVERS_MM: [f64; 2] = [20.0, 400.0];
/// Readings that a spring scale can have, newtons.
const FORCES_N: [f64; 2] = [0.0, 10.0];
/// Attempts at one question.
pub(super) const ATTEMPTS: u32 = 5;

/// Whether a motor was on until its release.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// Yes.
    Throughout,
    /// It went off by itself before.
    TooLong,
}

/// The motors.
pub trait Bench {
    /// Serial number of the device.
    fn serial(&self) -> &str;
    /// One motor on.
    ///
    /// # Errors
    /// The device is gone, in words.
    fn hold(&mut self, joint: usize, counts: i16) -> Result<(), String>;
    /// All motors off.
    ///
    /// # Errors
    /// The device is gone, in words.
    fn release(&mut self) -> Result<Held, String>;
    /// Encoders of the three joints as they are now; they wrap round.
    ///
    /// # Errors
    /// The device is gone or silent, in words.
    fn encoders(&mut self) -> Result<[u16; 3], String>;
}

/// Why there is no file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// The person ended it.
    #[error("ended without a file; the motors are off")]
    Quit,
    /// Answers that are none.
    #[error("no usable answer to {0:?} in {ATTEMPTS} attempts; the motors are off, start again")]
    NoAnswer(String),
    /// A motor's direction is not known.
    #[error(
        "{0}: the arm did not follow the motor by {LEAST_MOVED} counts of its encoder in {ATTEMPTS} attempts, so the sign of its \
         force is not known; nothing is written"
    )]
    NotMoved(String),
    /// Both directions of a motor move the arm the same way.
    #[error(
        "joint {0} moved the same way for both signs of the counts; let the motor move it, not the hand; nothing is written"
    )]
    OneWay(usize),
    /// The terminal is gone.
    #[error("cannot ask: {0}; the motors are off")]
    Talk(String),
    /// The device is gone.
    #[error("{0}; the motors are off, start again")]
    Device(String),
    /// The fit.
    #[error("{0}; nothing is written")]
    Fit(#[from] fit::FitError),
    /// The file would be refused.
    #[error("the measured scale cannot be: {0}; nothing is written")]
    Implausible(String),
}

impl From<std::io::Error> for CalibrateError {
    fn from(error: std::io::Error) -> Self {
        Self::Talk(error.to_string())
    }
}

/// Asks for everything and fits it; the motors are off when it returns, however it does.
///
/// # Errors
/// [`CalibrateError`] says why there is no scale.
pub fn calibrate(
    bench: &mut dyn Bench,
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
) -> Result<ForceScaleFile, CalibrateError> {
    let outcome = measure(bench, answers, out);
    let released = bench.release();
    let file = outcome?;
    released.map_err(CalibrateError::Device)?;
    Ok(file)
}

fn measure(
    bench: &mut dyn Bench,
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
) -> Result<ForceScaleFile, CalibrateError> {
    writeln!(
        out,
        "Force calibration of the Omni with serial number {}.\n\
         You need a spring scale (0 to 5 N), a thread loop for the stylus' gimbal, and a ruler. For each joint, hook the scale \
         into the gimbal so that it pulls at a right angle to the lever, hold the arm still with it, and read it while the motor \
         is on. Keep your eyes off the arm's reach. A motor goes off after 10 s by itself. q ends at any question.",
        bench.serial()
    )?;
    let mut readings = Vec::new();
    let mut largest_force_n = [0.0_f64; 3];
    for (joint, largest_n) in largest_force_n.iter_mut().enumerate() {
        let sign = direction(bench, answers, out, joint)?;
        let question = format!("Joint {}: lever from its axis to the hook, millimetres", joint + 1);
        let lever_m = ask(answers, out, &question, LEVERS_MM)? * 1e-3;
        for counts in STEPS.into_iter().flat_map(|n| [n, -n]) {
            let force_n = read(bench, answers, out, joint, counts)?;
            *largest_n = largest_n.max(force_n);
            readings.push(Reading { joint, counts, torque_n_m: sign * f64::from(counts.signum()) * force_n * lever_m });
        }
    }
    let lines = fit::fit(&readings)?;
    for (joint, line) in lines.iter().enumerate() {
        writeln!(
            out,
            "Joint {}: {:.4e} N·m per count, friction {:.4} N·m, largest residual {:.1} %",
            joint + 1,
            line.scale,
            line.friction.abs(),
            line.residual_share * 100.0
        )?;
    }
    let max_force_n = largest_force_n.into_iter().fold(f64::INFINITY, f64::min);
    let file = ForceScaleFile {
        serial: bench.serial().to_owned(),
        torque_n_m_per_count: lines.map(|line| line.scale),
        max_count: STEPS[STEPS.len() - 1],
        // What every joint has shown, and no more than the device is made for.
        max_force_n: max_force_n.min(crate::device::DeviceLimits::OMNI.peak_force_n),
        residual_share: lines.map(|line| line.residual_share),
        readings: readings.len(),
    };
    file.check(bench.serial()).map_err(CalibrateError::Implausible)?;
    Ok(file)
}

/// One reading: motor on, question, motor off; again when it was on for too long.
fn read(
    bench: &mut dyn Bench,
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
    joint: usize,
    counts: i16,
) -> Result<f64, CalibrateError> {
    let name = format!("joint {}, {counts:+} counts", joint + 1);
    for _ in 0..ATTEMPTS {
        let ready = format!("{name}: hook the scale in, then press Enter for the motor");
        enter(answers, out, &ready)?;
        bench.hold(joint, counts).map_err(CalibrateError::Device)?;
        let question = format!("{name}: spring scale against the motor's pull, newtons");
        let force_n = ask(answers, out, &question, FORCES_N);
        let held = bench.release().map_err(CalibrateError::Device)?;
        match (force_n?, held) {
            (force_n, Held::Throughout) => return Ok(force_n),
            (_, Held::TooLong) => writeln!(out, "The motor had gone off by then; once more.")?,
        }
    }
    Err(CalibrateError::NoAnswer(name))
}

/// A number within a range.
fn ask(answers: &mut dyn BufRead, out: &mut dyn Write, question: &str, range: [f64; 2]) -> Result<f64, CalibrateError> {
    let [low, high] = range;
    for _ in 0..ATTEMPTS {
        let answer = line_of(answers, out, question)?;
        match answer.parse::<f64>() {
            Ok(value) if (low..=high).contains(&value) => return Ok(value),
            _ => writeln!(out, "Give a number from {low} to {high}, with a decimal point.")?,
        }
    }
    Err(CalibrateError::NoAnswer(question.to_owned()))
}

pub(super) fn line_of(
    answers: &mut dyn BufRead,
    out: &mut dyn Write,
    question: &str,
) -> Result<String, CalibrateError> {
    write!(out, "{question}: ")?;
    out.flush()?;
    let mut line = String::new();
    // A line without end must not fill the memory.
    let read = std::io::Read::take(&mut *answers, 1024).read_line(&mut line)?;
    match line.trim() {
        _ if read == 0 => Err(CalibrateError::Quit),
        "q" | "Q" => Err(CalibrateError::Quit),
        text => Ok(text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    const SERIAL: &str = "51231700321";
    const SCALES: [f64; 3] = [2e-4, -1e-4, 1.5e-4];
    const LEVER_MM: f64 = 150.0;
    /// Answers until a joint's direction is known.
    const DIRECTION_LINES: usize = 4;

    #[derive(Default)]
    struct Motors {
        on: Option<(usize, i16)>,
        holds: Vec<(usize, i16)>,
        too_long_at: Option<usize>,
        fails_at: Option<usize>,
        encoders: [u16; 3],
    }

    struct Script(Rc<RefCell<Motors>>);

    impl Bench for Script {
        fn serial(&self) -> &str {
            SERIAL
        }

        fn hold(&mut self, joint: usize, counts: i16) -> Result<(), String> {
            let mut motors = self.0.borrow_mut();
            if motors.fails_at == Some(motors.holds.len()) {
                return Err("the device is gone".to_owned());
            }
            motors.holds.push((joint, counts));
            motors.on = Some((joint, counts));
            let way = (SCALES[joint] * f64::from(counts)).signum() as i16;
            motors.encoders[joint] = motors.encoders[joint].wrapping_add_signed(200 * way);
            Ok(())
        }

        fn encoders(&mut self) -> Result<[u16; 3], String> {
            Ok(self.0.borrow().encoders)
        }

        fn release(&mut self) -> Result<Held, String> {
            let mut motors = self.0.borrow_mut();
            motors.on = None;
            let is_late = motors.too_long_at.is_some() && motors.too_long_at == Some(motors.holds.len());
            Ok(if is_late { Held::TooLong } else { Held::Throughout })
        }
    }

    /// What a person with this device would type.
    fn answers(reading: impl Fn(usize, f64) -> f64) -> Vec<String> {
        let mut lines = Vec::new();
        for joint in 0..3 {
            lines.extend(vec![String::new(); DIRECTION_LINES]);
            lines.push(format!("{LEVER_MM}"));
            for counts in STEPS.into_iter().flat_map(|n| [n, -n]) {
                lines.push(String::new());
                lines.push(format!("{:.4}", reading(joint, f64::from(counts))));
            }
        }
        lines
    }

    fn force(joint: usize, counts: f64) -> f64 {
        (SCALES[joint] * counts / (LEVER_MM * 1e-3)).abs()
    }

    fn run(motors: &Rc<RefCell<Motors>>, lines: &[String]) -> (Result<ForceScaleFile, CalibrateError>, String) {
        let text = lines.iter().fold(String::new(), |text, line| text + line + "\n");
        let mut out = Vec::new();
        let file = calibrate(&mut Script(motors.clone()), &mut text.as_bytes(), &mut out);
        assert_eq!(motors.borrow().on, None, "motors are off at the end, however it ends");
        (file, String::from_utf8(out).expect("text"))
    }

    #[test]
    fn a_patient_person_gets_a_file_with_the_true_scale_and_its_limits() {
        let motors = Rc::default();
        let (file, out) = run(&motors, &answers(force));
        let file = file.expect("a clean rig");
        for (found, wanted) in file.torque_n_m_per_count.into_iter().zip(SCALES) {
            // Readings with four decimals of a newton at 0.15 m over 80 counts or more.
            assert!((found - wanted).abs() < 2e-7, "{found} for {wanted}");
        }
        assert_eq!((file.serial.as_str(), file.max_count, file.readings), (SERIAL, 240, 18));
        // The weakest joint: 240 · 1e-4 / 0.15 m.
        assert!((file.max_force_n - 0.16).abs() < 1e-9, "{}", file.max_force_n);
        assert!(out.contains("Joint 2: -1.000"), "{out}");
        assert_eq!(motors.borrow().holds.len(), 24);
        assert!(motors.borrow().holds.iter().all(|(_, n)| n.abs() <= 240));
    }

    #[test]
    fn a_late_reading_is_asked_for_again() {
        let motors = Rc::new(RefCell::new(Motors { too_long_at: Some(3), ..Motors::default() }));
        let mut lines = answers(force);
        lines.splice(DIRECTION_LINES + 1..DIRECTION_LINES + 1, [String::new(), "9.9".to_owned()]);
        let (file, out) = run(&motors, &lines);
        assert!(file.is_ok() && out.contains("gone off by then"), "{file:?}");
        assert_eq!(motors.borrow().holds.len(), 25);
    }

    #[test]
    fn wrong_answers_are_asked_again_and_five_end_it() {
        let motors = Rc::default();
        let mut lines = answers(force);
        // Two lines after the lever the first reading: no spring scale pulls less than nothing.
        lines.insert(DIRECTION_LINES + 2, "-0.1".to_owned());
        lines.splice(DIRECTION_LINES..DIRECTION_LINES, ["far".to_owned(), "1e9".to_owned(), "nan".to_owned()]);
        let (file, out) = run(&motors, &lines);
        assert!(file.is_ok() && out.contains("Give a number from 0 to 10"), "{file:?}");
        let (file, _) = run(&motors, &vec!["-".to_owned(); 9]);
        assert!(matches!(file, Err(CalibrateError::NoAnswer(_))), "{file:?}");
    }

    #[test]
    fn quitting_a_closed_terminal_a_lost_device_and_a_bad_fit_leave_no_file() {
        let motors = Rc::default();
        let mut lines = answers(force);
        lines[7] = "q".to_owned();
        assert_eq!(run(&motors, &lines).0, Err(CalibrateError::Quit));
        assert_eq!(run(&motors, &answers(force)[..9]).0, Err(CalibrateError::Quit));
        let gone = Rc::new(RefCell::new(Motors { fails_at: Some(4), ..Motors::default() }));
        assert!(matches!(run(&gone, &answers(force)).0, Err(CalibrateError::Device(_))));
        let bent = answers(|j, n| if n > 200.0 { 2.0 } else { force(j, n) });
        assert!(matches!(run(&motors, &bent).0, Err(CalibrateError::Fit(_))));
        let tiny = answers(|j, n| 0.005 * force(j, n) * if j == 1 { 0.4 } else { 300.0 });
        let refused = run(&motors, &tiny).0.expect_err("no motor is so weak or so strong").to_string();
        assert!(refused.contains("nothing is written") || refused.contains("no torque"), "{refused}");
    }
}
