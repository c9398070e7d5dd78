//! One trace through the live server: starts `haptic-server run --device replay:TRACE --json`, lets the baseline sleep
//! beside it, and reads the server's summary.

use super::report::TraceReport;
use haptic_server::exit;
use haptic_server::latency::{Baseline, grade, success_rate};
use haptic_server::summary::RunSummary;
use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Name of the server's program.
const SERVER: &str = "haptic-server";
/// A report cannot be written (`EX_IOERR`).
const CANNOT_WRITE: u8 = 74;

/// Why there is no report.
#[derive(Debug)]
pub(super) enum RunFault {
    /// The server is not built.
    NoServer { folder: PathBuf },
    /// A trace cannot be opened.
    NoTrace { trace: PathBuf, error: std::io::Error },
    /// The operating system refused something.
    System { what: &'static str, error: std::io::Error },
    /// The server ended with this code.
    Server { code: Option<i32>, message: String },
    /// The server's summary cannot be read.
    Summary { error: serde_json::Error },
    /// The report cannot be written.
    Output { place: String, error: std::io::Error },
}

impl RunFault {
    /// Exit code (sysexits).
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::NoServer { .. } => exit::UNAVAILABLE,
            Self::NoTrace { .. } => exit::NO_INPUT,
            Self::System { .. } | Self::Summary { .. } => exit::INTERNAL,
            Self::Server { code, .. } => code.and_then(|c| u8::try_from(c).ok()).unwrap_or(exit::INTERNAL),
            Self::Output { .. } => CANNOT_WRITE,
        }
    }
}

impl fmt::Display for RunFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoServer { folder } => {
                write!(f, "no {SERVER} in {}; build the workspace with `cargo build --release`", folder.display())
            }
            Self::NoTrace { trace, error } => write!(f, "{}: {error}; give a recorded hand", trace.display()),
            Self::System { what, error } => write!(f, "{what}: {error}"),
            Self::Server { code: Some(code), message } => write!(f, "the server ended with {code}: {}", message.trim()),
            Self::Server { code: None, message } => write!(f, "the server was killed: {}", message.trim()),
            Self::Summary { error } => {
                write!(f, "the server's summary cannot be read ({error}); use programs of one build")
            }
            Self::Output { place, error } => write!(f, "{place}: {error}; give a folder that can be written"),
        }
    }
}

/// The server's program beside this one.
pub(super) fn server_binary() -> Result<PathBuf, RunFault> {
    let this = std::env::current_exe().map_err(|error| RunFault::System { what: "own path", error })?;
    let folder = this.parent().unwrap_or(Path::new(".")).to_path_buf();
    let server = folder.join(SERVER);
    if server.is_file() { Ok(server) } else { Err(RunFault::NoServer { folder }) }
}

/// Refuses a trace that cannot be opened before anything is started.
pub(super) fn check_trace(trace: &Path) -> Result<(), RunFault> {
    let readable = std::fs::File::open(trace).and_then(|file| file.metadata());
    match readable {
        Ok(facts) if facts.is_file() => Ok(()),
        Ok(_) => Err(RunFault::NoTrace { trace: trace.into(), error: std::io::ErrorKind::InvalidInput.into() }),
        Err(error) => Err(RunFault::NoTrace { trace: trace.into(), error }),
    }
}

/// Runs one trace.
pub(super) fn measure(server: &Path, trace: &Path, scene: &str, duration_s: f64) -> Result<TraceReport, RunFault> {
    let mut device = OsString::from("replay:");
    device.push(trace);
    let mut command = Command::new(server);
    command.args(["run", "--json", "--scene", scene, "--duration", &duration_s.to_string(), "--device"]).arg(device);
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let child = child.map_err(|error| RunFault::System { what: "the server cannot be started", error })?;
    let baseline = Baseline::start().map_err(|error| RunFault::System { what: "no thread for the baseline", error })?;
    let ended = child.wait_with_output();
    let baseline = baseline.finish();
    let output = ended.map_err(|error| RunFault::System { what: "the server cannot be waited for", error })?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(RunFault::Server { code: output.status.code(), message });
    }
    let summary: RunSummary = serde_json::from_slice(&output.stdout).map_err(|error| RunFault::Summary { error })?;
    let (grade, grade_reason) =
        grade(summary.wake_ns.as_ref(), baseline.wake_ns.as_ref(), summary.ticks, summary.missed);
    let mut degraded_reasons = summary.degraded_reasons;
    let degraded = summary.degraded || !baseline.missing_rights.is_empty();
    degraded_reasons.extend(baseline.missing_rights.into_iter().map(|reason| format!("plain timer: {reason}")));
    Ok(TraceReport {
        trace: trace.display().to_string(),
        scene: summary.scene,
        duration_s: summary.duration_s,
        ticks: summary.ticks,
        missed: summary.missed,
        wake_ns: summary.wake_ns,
        tick_ns: summary.compute_ns,
        sample_to_force_ns: summary.sample_to_force_ns,
        port_age_ns: summary.port_age_ns,
        baseline_wake_ns: baseline.wake_ns,
        baseline_ticks: baseline.ticks,
        baseline_missed: baseline.missed,
        success_rate: success_rate(summary.ticks, summary.missed),
        grade,
        grade_reason,
        degraded,
        degraded_reasons,
        version: summary.version,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// A stand-in for the server: prints its last arguments as the scene and a fixed summary, or fails as told.
    fn stand_in(folder: &Path, body: &str) -> PathBuf {
        let path = folder.join("server.sh");
        std::fs::write(&path, format!("#!/bin/sh\n{body}\n")).expect("writable");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o700)).expect("own file");
        path
    }

    #[test]
    fn a_summary_becomes_a_report_with_a_baseline_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let summary =
            RunSummary { scene: "'\"$*\"'".into(), duration_s: 1.5, ticks: 1490, missed: 10, ..Default::default() };
        let json = summary.to_json().expect("strings and numbers").replace("\\\"", "\"");
        let server = stand_in(folder.path(), &format!("sleep 0.05; printf '%s' '{json}'"));
        let report = measure(&server, Path::new("hand.csv"), "vessel", 1.5).expect("a report");
        assert_eq!(report.scene, "run --json --scene vessel --duration 1.5 --device replay:hand.csv");
        assert_eq!((report.ticks, report.missed, report.duration_s), (1490, 10, 1.5));
        assert!(report.wake_ns.is_none() && report.grade_reason.contains("no wake-up"), "{report:?}");
        assert!(report.baseline_ticks + report.baseline_missed >= 1, "{report:?}");
    }

    #[test]
    fn faults_have_their_codes_and_say_what_to_do() {
        let folder = tempfile::tempdir().expect("a folder");
        let fails = stand_in(folder.path(), "echo 'row 3 is not a number' >&2; exit 65");
        let fault = measure(&fails, Path::new("hand.csv"), "skin", 1.0).expect_err("exit 65");
        assert_eq!(fault.exit_code(), 65);
        assert!(fault.to_string().contains("row 3"), "{fault}");
        let silent = stand_in(folder.path(), "exit 0");
        assert_eq!(measure(&silent, Path::new("a"), "skin", 1.0).expect_err("no summary").exit_code(), 70);
        let missing = check_trace(&folder.path().join("none.csv")).expect_err("no file");
        assert_eq!(missing.exit_code(), 66);
        assert_eq!(check_trace(folder.path()).expect_err("a folder is no trace").exit_code(), 66);
    }
}
