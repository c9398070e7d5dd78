//! The program: finds the run or opens the recording, then shows it in a window, makes pictures without a screen, or prints a
//! line per interval until the server is gone.

use crate::feed::Feed;
use crate::headless::{self, Failure, HeadlessArgs};
use crate::source::Source;
use crate::status;
use crate::tell::Tell;
use crate::window::{self, Opening};
use clap::{Arg, Parser};
use protocol::run::{Environment, RunDir, RunRoot};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// sysexits: a service is not there.
const UNAVAILABLE: u8 = 69;
/// sysexits: wrong usage.
const USAGE: u8 = 64;
/// The server counts as gone when its tick number stands still for this many lines.
const STILL_LINES: u32 = 3;

/// Added to the viewer's nice value: where processors are scarce, servo and solver come first.
const NICER: i32 = 10;

/// Looks at a running suture-surgery server, or at a recording of one.
#[derive(Debug, Parser)]
#[command(name = "viewer-client", version, mut_args(headless_only))]
struct Cli {
    /// Run directory of the server; without it the one of the running server.
    #[arg(long, value_name = "DIR")]
    run_dir: Option<PathBuf>,
    /// Looks at a recording instead of a server.
    #[arg(long, value_name = "FILE.mcap")]
    replay: Option<PathBuf>,
    /// Prints a line per interval.
    #[arg(long, conflicts_with_all = ["headless", "replay"])]
    text: bool,
    /// Makes pictures without a screen: --png, --frames or --bench.
    #[arg(long, requires = "picture")]
    headless: bool,
    /// Folder for screenshots and sample curves of the window.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Tells what happens in the window on standard output, a JSON line per event.
    #[arg(long, conflicts_with_all = ["headless", "text"])]
    tell: bool,
    #[command(flatten, next_help_heading = "Pictures, in the window and without a screen")]
    pictures: HeadlessArgs,
    /// Seconds between two lines.
    #[arg(long, value_name = "SECONDS", default_value = "1", requires = "text", value_parser = interval)]
    interval: Duration,
}

/// Options that a window would pass over in silence are refused without `--headless`.
fn headless_only(arg: Arg) -> Arg {
    let is_one = ["png", "frames", "bench", "at", "fps", "zoom", "overlays"].contains(&arg.get_id().as_str());
    if is_one { arg.requires("headless") } else { arg }
}

fn interval(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text:?} is not a number of seconds"))?;
    if (0.02..=3600.0).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(format!("{seconds} s is outside 0.02 to 3600"))
    }
}

/// Entry point of the binary.
#[must_use]
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let code = if error.use_stderr() { USAGE } else { 0 };
            // Nothing can be done when the terminal is gone.
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    // Before the first thread of a driver, so that all inherit it. Being nicer is never refused.
    let _ = rustix::process::nice(NICER);
    let done = if cli.headless {
        headless::run(&cli.pictures, cli.replay.as_deref(), || find(&cli))
    } else if cli.text {
        watch(&cli).map_err(unavailable)
    } else {
        open_window(&cli)
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure { sentence, code }) => {
            eprintln!("viewer-client: {sentence}");
            ExitCode::from(code)
        }
    }
}

fn unavailable(sentence: String) -> Failure {
    Failure { sentence, code: UNAVAILABLE }
}

fn open_window(cli: &Cli) -> Result<(), Failure> {
    let source = match &cli.replay {
        Some(path) => Source::played(headless::opened(path)?),
        None => Source::live(find(cli).map_err(unavailable)?).map_err(|e| unavailable(e.to_string()))?,
    };
    let opening = Opening {
        source,
        look: cli.pictures.look(),
        view: cli.pictures.view(),
        size: cli.pictures.size(),
        folder: cli.out.clone(),
        tell: if cli.tell { Tell::Lines } else { Tell::Silent },
    };
    window::show(opening).map_err(unavailable)
}

fn find(cli: &Cli) -> Result<RunDir, String> {
    let run = match &cli.run_dir {
        Some(path) => RunDir::open(path),
        None => RunRoot::open(&Environment::of_process()).and_then(|root| root.attach()),
    };
    run.map_err(|e| e.to_string())
}

fn watch(cli: &Cli) -> Result<(), String> {
    let mut feed = Feed::join(&find(cli)?).map_err(|e| e.to_string())?;
    let (mut last_tick, mut still) = (None, 0);
    while still < STILL_LINES {
        std::thread::sleep(cli.interval);
        let view = feed.look().map_err(|e| e.to_string())?;
        println!("{}", status::line(view));
        let tick = view.servo.as_ref().map(|s| s.ticks);
        still = if tick == last_tick { still + 1 } else { 0 };
        last_tick = tick;
        feed.clean_up();
    }
    println!("the server is gone");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_that_would_do_nothing_is_refused() {
        let is_taken = |line: &str| Cli::try_parse_from(line.split(' ')).is_ok();
        for line in ["v --size 640x480 --stereo", "v --headless --png a.png --at 2 --overlays", "v --text --interval 2"]
        {
            assert!(is_taken(line), "{line}");
        }
        for line in
            ["v --png a.png", "v --overlays", "v --fps 5", "v --headless", "v --interval 2", "v --headless --text"]
        {
            assert!(!is_taken(line), "{line}");
        }
        assert!(!is_taken("v --headless --png a.png --bench 3"));
    }
}
