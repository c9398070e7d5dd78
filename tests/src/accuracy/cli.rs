//! The command line of the report: what to measure, where to write, how to stop.
//!
//! The report is written anew after every part. The first interrupt ends the part at work and leaves a partial report that
//! says so; the second ends the program at once. Exit codes follow sysexits; 1 means that something got worse than the
//! stored report.

use super::cases::Subject;
use super::cpu_clock::process_cpu_s;
use super::document::{self, Report, Spent};
use super::head::Head;
use super::networks;
use super::parts::{Part, Request, keep_scenes, keys, parts};
use super::regression;
use super::section::{Effort, Progress};
use clap::Parser;
use haptic_server::cli::choice::SceneChoice;
use haptic_server::error::ServerError;
use haptic_server::exit;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Something got worse than in the stored report.
const WORSE: u8 = 1;

/// Where the report goes when nothing is said.
const DEFAULT_FOLDER: &str = "accuracy-report";

/// Measures error against run time, stability, extreme cases, validation, and what each scene paid for.
#[derive(Debug, Parser)]
#[command(name = "accuracy-report", version)]
struct Arguments {
    /// The whole report in under two minutes on two cores, on coarser meshes; without it under thirty.
    #[arg(long)]
    quick: bool,
    /// Only these scenes: skin, liver, vessel or a scene file (FILE.toml, on its own mesh).
    #[arg(long, value_name = "SCENE")]
    scene: Vec<SceneChoice>,
    /// Spring networks (spring-network/1 JSON) on which every integrator is measured.
    #[arg(long, value_name = "FILE.json", num_args = 1..)]
    network: Vec<PathBuf>,
    /// Only the parts with these keys (see report.json), for instance work_precision.
    #[arg(long, value_name = "KEY")]
    only: Vec<String>,
    /// Folder for report.html, report.json, CSV and SVG files; without it `accuracy-report`, or none with --json.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON document on stdout and nothing else.
    #[arg(long)]
    json: bool,
    /// Stored report.json: name what got worse, and end with 1 when something did.
    #[arg(long, value_name = "FILE.json")]
    baseline: Option<PathBuf>,
}

/// The whole program.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Nothing can be done when even the message cannot be written.
            let _unwritten = error.print();
            return ExitCode::from(if error.use_stderr() { exit::USAGE } else { exit::OK });
        }
    };
    match run(&arguments) {
        Ok(code) => ExitCode::from(code),
        Err(fault) => {
            eprintln!("accuracy-report: {fault}");
            ExitCode::from(fault.exit_code())
        }
    }
}

fn run(arguments: &Arguments) -> Result<u8, ServerError> {
    if let Some(unknown) = arguments.only.iter().find(|only| !keys().contains(&only.as_str())) {
        let known = keys().join(", ");
        return Err(ServerError::Usage(format!("there is no part {unknown}; the parts are {known}")));
    }
    let stored = arguments.baseline.as_deref().map(regression::read).transpose()?;
    let effort = if arguments.quick { Effort::Quick } else { Effort::Full };
    let chosen = arguments.scene.iter().map(|choice| Subject::chosen(choice, effort)).collect::<Result<Vec<_>, _>>()?;
    let request = Request {
        effort,
        kept: chosen.iter().map(|subject| subject.name.clone()).collect(),
        scenes: if chosen.is_empty() { Subject::presets(effort) } else { chosen },
        networks: arguments.network.iter().map(|path| networks::read(path)).collect::<Result<_, _>>()?,
        only: arguments.only.clone(),
    };
    let folder = match (&arguments.out, arguments.json) {
        (Some(folder), _) => Some(folder.clone()),
        (None, true) => None,
        (None, false) => Some(PathBuf::from(DEFAULT_FOLDER)),
    };
    folder.as_deref().map_or(Ok(()), document::prepare)?;
    let stop = interrupt_flag()?;
    let mut report = measure(&request, &stop, |report| folder.as_deref().map_or(Ok(()), |f| report.write(f)))?;
    report.worse = stored.map(|stored| regression::compare(&stored, &report.sections));
    if let Some(folder) = &folder {
        report.write(folder)?;
    }
    let shown =
        if arguments.json { format!("{:#}", report.to_json()) } else { closing_words(&report, folder.as_deref()) };
    writeln!(std::io::stdout(), "{shown}")
        .map_err(|e| ServerError::Internal(format!("standard output cannot be written: {e}")))?;
    Ok(match &report.worse {
        _ if report.stopped_in.is_some() => exit::INTERRUPTED,
        Some(worse) if !worse.is_empty() => WORSE,
        _ => exit::OK,
    })
}

/// Measures the parts in order; `keep` is called after each.
fn measure(
    request: &Request,
    stop: &AtomicBool,
    keep: impl Fn(&Report) -> Result<(), ServerError>,
) -> Result<Report, ServerError> {
    let parts = parts(request);
    let mut report = Report {
        head: Head::measure(),
        effort: request.effort,
        sections: Vec::new(),
        spent: Vec::new(),
        not_measured: parts.iter().flat_map(|p| p.keys).copied().collect(),
        stopped_in: None,
        worse: None,
    };
    let terminal = std::io::stderr().is_terminal();
    for (index, Part { keys, measure }) in parts.iter().enumerate() {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let say = |words: &str| {
            if terminal {
                eprint!("\r\x1b[2K[{}/{}] {}: {words}", index + 1, parts.len(), keys[0]);
            }
        };
        say("begun");
        // Wall clock: how long the report takes is one of its figures.
        let (cpu_s, begun) = (process_cpu_s(), Instant::now());
        let sections = measure(request, &Progress { stop, say: &say });
        let wall_s = begun.elapsed().as_secs_f64();
        report.spent.push(Spent { part: keys[0], cpu_s: process_cpu_s() - cpu_s, wall_s });
        report.not_measured.retain(|key| !keys.contains(key));
        for mut section in sections {
            keep_scenes(&mut section, &request.kept);
            report.sections.push(section);
        }
        if stop.load(Ordering::Relaxed) {
            report.stopped_in = Some(keys[0]);
        }
        keep(&report)?;
    }
    if terminal {
        eprint!("\r\x1b[2K");
    }
    Ok(report)
}

/// Raised by the first interrupt; the second ends the program.
fn interrupt_flag() -> Result<Arc<AtomicBool>, ServerError> {
    let stop = Arc::new(AtomicBool::new(false));
    let fail = |e| ServerError::Internal(format!("cannot watch signals: {e}; check the process limits"));
    // Only a person interrupts twice: `timeout` sends SIGTERM to the process and again to its group.
    signal_hook::flag::register_conditional_shutdown(SIGINT, i32::from(exit::INTERRUPTED), stop.clone())
        .map_err(fail)?;
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, stop.clone()).map_err(fail)?;
    }
    Ok(stop)
}

fn closing_words(report: &Report, folder: Option<&std::path::Path>) -> String {
    let mut words = String::new();
    for section in &report.sections {
        words.push_str(&format!("{:<22} {:>5} rows  {}\n", section.key, section.rows.len(), section.title));
    }
    if !report.complete() {
        words.push_str("partial report: stopped before all parts were measured\n");
    }
    for worse in report.worse.iter().flatten() {
        words.push_str(&format!("worse: {worse}\n"));
    }
    if let Some(folder) = folder {
        words.push_str(&folder.join("report.html").display().to_string());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
        let parse = |line: &str| Arguments::try_parse_from(line.split(' '));
        assert!(parse("accuracy-report --scene kidney").is_err());
        let given =
            parse("accuracy-report --quick --scene skin --network a.json b.json --out d --json").expect("parses");
        assert_eq!((given.network.len(), given.quick, given.json), (2, true, true));
    }

    #[test]
    fn a_folder_that_takes_no_files_is_told_before_anything_is_measured() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let error = document::prepare(&file.path().join("report")).expect_err("a file is no folder");
        assert_eq!(error.exit_code(), exit::UNAVAILABLE, "{error}");
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(document::prepare(&folder.path().join("new/report")), Ok(()));
    }

    #[test]
    fn a_report_that_is_stopped_at_once_names_every_part() {
        let request =
            Request { effort: Effort::Quick, scenes: vec![], kept: vec![], networks: Vec::new(), only: vec![] };
        let report = measure(&request, &AtomicBool::new(true), |_| Ok(())).expect("no part was begun");
        assert!(report.sections.is_empty() && report.not_measured.len() == keys().len());
        assert!(keys().iter().all(|key| report.to_json()[*key] == serde_json::json!([])));
    }
}
