//! Runs `count-steps` under callgrind and reads what each case collected.
//!
//! `--toggle-collect` counts inside `counted_steps` only, `--dump-before` writes one profile per call of `case_ends`, so that
//! one process counts many cases. Every profile ends in a line `totals: N`.

use super::PROGRAM;
use crate::processes::Sandbox;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Instruction set that the kernels take under valgrind on a processor that has it.
const EXPECTED_LEVEL: &str = "AVX2";

/// Why there are no counts.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotCounted {
    /// No valgrind here.
    #[error("valgrind is not installed (apt-get install valgrind)")]
    NoValgrind,
    /// The program is not there.
    #[error("{0} is not there; build it with cargo build --bins")]
    NoProgram(PathBuf),
    /// The processor lacks what the counts are for.
    #[error("the kernels take {0} under valgrind here, and counts are compared for {EXPECTED_LEVEL}")]
    Level(String),
    /// It ran and failed.
    #[error("callgrind did not count: {0}")]
    Failed(String),
}

impl NotCounted {
    /// Whether this machine cannot count, rather than the program.
    #[must_use]
    pub fn is_of_the_machine(&self) -> bool {
        matches!(self, Self::NoValgrind | Self::Level(_))
    }
}

/// Instructions per step of each case, in their order.
///
/// # Errors
/// [`NotCounted`] says what is missing or what went wrong.
pub fn count(program: &Path, steps: u32, cases: &[String]) -> Result<Vec<f64>, NotCounted> {
    let there = Command::new("valgrind").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !there.is_ok_and(|status| status.success()) {
        return Err(NotCounted::NoValgrind);
    }
    if !program.is_file() {
        return Err(NotCounted::NoProgram(program.to_owned()));
    }
    let sandbox = Sandbox::new();
    let profile = sandbox.folder().join("profile");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=*counted_steps*", "--dump-before=*case_ends*"])
        .arg(format!("--callgrind-out-file={}", profile.display()))
        .arg(program)
        .args(["--steps", &steps.to_string()])
        .args(cases)
        .output()
        .map_err(|e| NotCounted::Failed(e.to_string()))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let mut lines = said.lines();
    let level = lines.next().unwrap_or_default();
    if !output.status.success() || !lines.eq(cases.iter().map(String::as_str)) {
        let errors = String::from_utf8_lossy(&output.stderr);
        let own = errors.lines().filter(|l| l.starts_with(PROGRAM)).collect::<Vec<_>>().join("; ");
        return Err(NotCounted::Failed(format!("{} {own}", output.status)));
    }
    if level != EXPECTED_LEVEL {
        return Err(NotCounted::Level(level.to_owned()));
    }
    let total = |index: usize| {
        let path = profile.with_extension((index + 1).to_string());
        let text = std::fs::read_to_string(&path).map_err(|e| NotCounted::Failed(format!("no profile: {e}")))?;
        totals(&text).ok_or_else(|| NotCounted::Failed("a profile without totals".to_owned()))
    };
    (0..cases.len()).map(|index| Ok(total(index)? as f64 / f64::from(steps))).collect()
}

/// The instructions of a profile.
fn totals(profile: &str) -> Option<u64> {
    profile.lines().rev().find_map(|l| l.strip_prefix("totals:"))?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_totals_of_a_profile_are_read() {
        assert_eq!(totals("events: Ir\nfn=(1) a\n1 20\n\ntotals: 4711\n"), Some(4711));
        assert_eq!(totals("events: Ir\n"), None);
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let missing = Path::new("no/such/program");
        match count(missing, 1, &[]) {
            Err(NotCounted::NoProgram(path)) => assert_eq!(path, missing),
            Err(NotCounted::NoValgrind) => {}
            other => panic!("{other:?}"),
        }
    }
}
