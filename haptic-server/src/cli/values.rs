//! Values of the command line with their ranges; each says what it wants when it gets something else.

/// Longest run that is accepted, seconds: a year.
const LONGEST_RUN_S: f64 = 366.0 * 86_400.0;

pub(super) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(s) if s > 0.0 && s <= LONGEST_RUN_S => Ok(s),
        _ => Err(format!("give seconds, more than 0 and at most {LONGEST_RUN_S}")),
    }
}

pub(super) fn millimetres(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if mm > 0.0 && mm <= 100.0 => Ok(mm),
        _ => Err("give millimetres, more than 0 and at most 100".to_owned()),
    }
}

/// What the viewer takes, so that it is refused before the run and not after it.
pub(super) fn picture_size(text: &str) -> Result<String, String> {
    let side = |text: &str| text.parse::<u32>().is_ok_and(|side| (16..=8192).contains(&side));
    match text.split_once('x') {
        Some((width, height)) if side(width) && side(height) => Ok(text.to_owned()),
        _ => Err("give width and height, 16 to 8192 pixels each, as 1280x720".to_owned()),
    }
}

pub(super) fn slow_down(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(f) if (1.0..=1e4).contains(&f) => Ok(f),
        _ => Err("give a factor from 1 to 10000".to_owned()),
    }
}
