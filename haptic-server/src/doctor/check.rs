//! One line of the doctor's report, and what all of them together mean.
//!
//! A check that failed carries the exit code (`sysexits`) of its kind: 77 a right is missing, 69 something is not there, 78 a
//! configuration is wrong, 65 and 66 a scene file. The program ends with the code of the first check that failed, 0 when none did.
//! The grade is the timer's (see [`crate::latency`]) when one was measured; a failed check makes it `unfit`. Field names are keys that scripts rely on.

use crate::latency::Grade;
use serde::Serialize;
use std::fmt;

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// As it should be.
    Ok,
    /// It works, but less well than it could.
    Warn,
    /// Something that was asked for cannot work.
    Fail,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Ok => "ok",
            Self::Warn => "warn",
            Self::Fail => "fail",
        })
    }
}

/// One row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What was looked at.
    pub name: &'static str,
    /// How it ended.
    pub status: Status,
    /// What was found.
    pub found: String,
    /// What mends it; null when nothing needs to be.
    pub remedy: Option<String>,
    #[serde(skip)]
    code: u8,
}

impl Check {
    /// All is well.
    pub fn ok(name: &'static str, found: impl Into<String>) -> Self {
        Self { name, status: Status::Ok, found: found.into(), remedy: None, code: crate::exit::OK }
    }

    /// It could be better.
    pub fn warn(name: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        let remedy = Some(remedy.into());
        Self { name, status: Status::Warn, found: found.into(), remedy, code: crate::exit::OK }
    }

    /// It does not work; the program ends with `code`.
    pub fn fail(name: &'static str, found: impl Into<String>, remedy: impl Into<String>, code: u8) -> Self {
        let remedy = Some(remedy.into());
        Self { name, status: Status::Fail, found: found.into(), remedy, code }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<4}  {:<19}  {}", self.status, self.name, one_line(&self.found))?;
        match &self.remedy {
            Some(remedy) => write!(f, "; mend: {}", one_line(remedy)),
            None => Ok(()),
        }
    }
}

/// A check is a line, whatever it found.
fn one_line(text: &str) -> String {
    text.split('\n').map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The whole report.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Its rows.
    pub checks: Vec<Check>,
    /// excellent, good, fair, unfit; `unmeasured` without a failed check and without `--latency`.
    pub grade: &'static str,
    /// Why, in one sentence.
    pub grade_reason: String,
    /// The timer, if it was measured.
    pub latency: Option<super::latency::Latency>,
    /// Version of this program.
    pub version: &'static str,
}

impl Report {
    /// Grades the rows.
    #[must_use]
    pub fn new(checks: Vec<Check>, latency: Option<super::latency::Latency>) -> Self {
        let failed: Vec<&str> = checks.iter().filter(|c| c.status == Status::Fail).map(|c| c.name).collect();
        let (grade, grade_reason) = match &latency {
            _ if !failed.is_empty() => ("unfit", format!("failed: {}", failed.join(", "))),
            Some(latency) => (word(latency.grade), latency.grade_reason.clone()),
            None => ("unmeasured", "no check failed; measure the timer with --latency SECONDS".to_owned()),
        };
        Self { checks, grade, grade_reason, latency, version: env!("CARGO_PKG_VERSION") }
    }

    /// Exit code: that of the first check that failed.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        self.checks.iter().find(|c| c.status == Status::Fail).map_or(crate::exit::OK, |c| c.code)
    }
}

fn word(grade: Grade) -> &'static str {
    match grade {
        Grade::Unfit => "unfit",
        Grade::Fair => "fair",
        Grade::Good => "good",
        Grade::Excellent => "excellent",
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for check in &self.checks {
            writeln!(f, "{check}")?;
        }
        let count = |status| self.checks.iter().filter(|c| c.status == status).count();
        let (ok, warn, fail) = (count(Status::Ok), count(Status::Warn), count(Status::Fail));
        write!(f, "grade: {} ({}); {ok} ok, {warn} warn, {fail} fail", self.grade, self.grade_reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;

    #[test]
    fn the_first_failure_gives_the_exit_code_and_the_grade() {
        let ok = Check::ok("a", "fine");
        let warn = Check::warn("b", "so so", "do this");
        let rights = Check::fail("c", "no", "ask", exit::PERMISSION);
        let missing = Check::fail("d", "none", "get", exit::UNAVAILABLE);
        let report = |rows: &[&Check]| Report::new(rows.iter().map(|c| (*c).clone()).collect(), None);
        assert_eq!((report(&[&ok, &warn]).exit_code(), report(&[&ok, &warn]).grade), (exit::OK, "unmeasured"));
        assert_eq!(report(&[&ok, &rights, &missing]).exit_code(), exit::PERMISSION);
        let last = report(&[&missing, &warn, &rights]);
        assert_eq!((last.exit_code(), last.grade), (exit::UNAVAILABLE, "unfit"));
        assert_eq!(last.grade_reason, "failed: d, c");
    }

    #[test]
    fn a_check_is_one_line_and_one_row() {
        let check = Check::fail("memlock_limit", "64 KiB\n of\n\n256 MiB", "first\nthen", exit::PERMISSION);
        assert_eq!(check.to_string(), "fail  memlock_limit        64 KiB of 256 MiB; mend: first then");
        let row = serde_json::to_value(&check).expect("strings");
        assert_eq!(row["status"], "fail");
        assert_eq!(row.as_object().map(serde_json::Map::len), Some(4), "{row}");
        assert!(serde_json::to_value(Check::ok("a", "b")).expect("strings")["remedy"].is_null());
    }
}
