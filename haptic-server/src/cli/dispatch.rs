//! From the command line to the code that does the work, and from its result to the exit code.
//!
//! stdout carries results only (with `--json` one document and nothing else); an error is one sentence on
//! stderr. A closed stdout (`| head`) is no error.

use super::{Command, SceneCommand, ServerCli, SolverCli, files, lockstep, parse};
use crate::device::firewire;
use crate::error::ServerError;
use crate::exit;
use crate::summary::RunSummary;
use crate::{clean, convert, devices, doctor, inspect, logging, servo_process, session, solver_process, supervisor};
use clap::CommandFactory;
use std::io::Write;
use std::process::ExitCode;

/// The whole of the program `haptic-server`.
#[must_use]
pub fn haptic_server() -> ExitCode {
    match parse::<ServerCli>(std::env::args_os()) {
        Err(code) => ExitCode::from(code),
        Ok(cli) => {
            logging::install();
            ending("haptic-server", execute(cli.command))
        }
    }
}

/// The whole of the program `deformation-solver`.
#[must_use]
pub fn deformation_solver() -> ExitCode {
    match parse::<SolverCli>(std::env::args_os()) {
        Err(code) => ExitCode::from(code),
        Ok(cli) => {
            logging::install();
            ending("deformation-solver", solver_process::run(&cli))
        }
    }
}

fn ending(program: &str, result: Result<(), ServerError>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::from(exit::OK),
        Err(error) => {
            if !matches!(error, ServerError::Reported(_)) {
                // Nothing can be done when stderr is gone.
                let _ = writeln!(std::io::stderr(), "{program}: {error}");
            }
            ExitCode::from(error.exit_code())
        }
    }
}

fn execute(command: Command) -> Result<(), ServerError> {
    match command {
        Command::Run(args) => print(&report(&supervisor::run(&args)?, args.json)?),
        Command::Lockstep(args) => print(&report(&lockstep::run(&args)?, args.json)?),
        Command::Servo => servo_process::run(),
        Command::Scene(SceneCommand::Check { file, json }) => print(&files::scene_check(&file, json.into())?),
        Command::Doctor(args) => {
            let (text, code) = doctor::report(&args)?;
            print(&text)?;
            if code == exit::OK { Ok(()) } else { Err(ServerError::Reported(code)) }
        }
        Command::Devices { json } => print(&devices::run(json.into())?),
        Command::Clean => print(&clean::clean()?),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut ServerCli::command(), "haptic-server", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
        Command::CalibrateForce { out } => print(&firewire::calibrate_force(&out)?),
        Command::Session { action } => session::send(action),
        Command::Convert { input, output } => {
            let converted = convert::run(&input, &output)?;
            print(&converted.text)?;
            converted.fault.map_or(Ok(()), Err)
        }
        Command::Inspect { file, json } => {
            let inspected = inspect::run(&file, json.into())?;
            print(&inspected.text)?;
            inspected.fault.map_or(Ok(()), Err)
        }
    }
}

fn report(summary: &RunSummary, json: bool) -> Result<String, ServerError> {
    if json {
        let text = summary.to_json();
        text.map(|t| t + "\n").map_err(|e| ServerError::Internal(format!("cannot write the summary as JSON: {e}")))
    } else {
        Ok(format!("{summary}\n"))
    }
}

fn print(text: &str) -> Result<(), ServerError> {
    let mut stdout = std::io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(ServerError::Unavailable(format!("cannot write to stdout: {e}; check where it leads")))
        }
        _ => Ok(()),
    }
}
