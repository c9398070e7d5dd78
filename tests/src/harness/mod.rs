//! The latency harness: each trace runs through the live server while a plain timer thread sleeps beside it.
//!
//! Figures of the servo come from the server's own summary (`run --json`), the baseline from this process, in the same
//! seconds, with the same period and policy: what the baseline suffers too is the machine's, not the server's. One trace
//! gives one JSON object, several give a list of such objects. Exit codes follow sysexits; a code of the server is handed on.
//! Deliberately absent: any limit that fails. The harness reports and grades, it does not judge code.

mod report;
mod run;

pub use report::TraceReport;

use clap::Parser;
use haptic_server::exit;
use run::RunFault;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Longest run per trace, seconds: a day.
const LONGEST_S: f64 = 86_400.0;

/// Replays recorded device traces through the live server and reports its latency beside a plain timer.
#[derive(Debug, Parser)]
#[command(name = "latency-harness", version)]
struct Arguments {
    /// Recorded hands (.csv or .mcap), replayed open loop.
    #[arg(required = true)]
    traces: Vec<PathBuf>,
    /// Scene: skin, liver, vessel or a scene file.
    #[arg(long, default_value = "skin")]
    scene: String,
    /// Seconds per trace.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    duration: f64,
    /// Print one JSON document on stdout and nothing else.
    #[arg(long)]
    json: bool,
    /// Folder for latency.json and latency.txt.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(s) if s > 0.0 && s <= LONGEST_S => Ok(s),
        _ => Err(format!("give seconds, more than 0 and at most {LONGEST_S}")),
    }
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
    match measure_all(&arguments).and_then(|reports| write_reports(&arguments, &reports)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("latency-harness: {fault}");
            ExitCode::from(fault.exit_code())
        }
    }
}

fn measure_all(arguments: &Arguments) -> Result<Vec<TraceReport>, RunFault> {
    let server = run::server_binary()?;
    for trace in &arguments.traces {
        run::check_trace(trace)?;
    }
    let mut reports = Vec::with_capacity(arguments.traces.len());
    for trace in &arguments.traces {
        if std::io::stderr().is_terminal() {
            eprintln!("{}: {} s …", trace.display(), arguments.duration);
        }
        reports.push(run::measure(&server, trace, &arguments.scene, arguments.duration)?);
    }
    Ok(reports)
}

fn write_reports(arguments: &Arguments, reports: &[TraceReport]) -> Result<(), RunFault> {
    let json = report::to_json(reports);
    let text = reports.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n");
    if let Some(folder) = &arguments.out {
        write_file(folder, "latency.json", &json)?;
        write_file(folder, "latency.txt", &text)?;
    }
    let shown = if arguments.json { json } else { text };
    writeln!(std::io::stdout(), "{shown}").map_err(|error| RunFault::Output { place: "standard output".into(), error })
}

fn write_file(folder: &Path, name: &str, content: &str) -> Result<(), RunFault> {
    let path = folder.join(name);
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, format!("{content}\n")));
    written.map_err(|error| RunFault::Output { place: path.display().to_string(), error })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent_and_needs_a_trace() {
        Arguments::command().debug_assert();
        let parse = |line: &str| Arguments::try_parse_from(line.split(' '));
        assert!(parse("latency-harness").is_err());
        assert!(parse("latency-harness a.csv --duration 0").is_err());
        assert!(parse("latency-harness a.csv --duration nan").is_err());
        let given = parse("latency-harness a.csv b.mcap --scene vessel --json --out d --duration 2.5").expect("parses");
        assert_eq!((given.traces.len(), given.scene.as_str(), given.duration), (2, "vessel", 2.5));
    }
}
