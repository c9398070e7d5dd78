//! The program `deformation-solver`: steps a session at its rate against the servo's newest state.
//!
//! It attaches to the run directory it is given, or to the one that a running server has announced. Late steps
//! are skipped in whole periods, never caught up in a burst; the tissue then runs slower than the clock. It ends
//! on SIGTERM, with its server, or when the servo has been silent for [`SERVO_SILENCE_LIMIT_NS`]. What a restart
//! may mend ends with code 70, what it cannot mend with the code of its class.

mod load;
mod pace;
mod topics;

use crate::cli::SolverCli;
use crate::error::ServerError;
use crate::supervisor::child::{DeathSignal, end_with_parent};
use crate::supervisor::signals::stop_flag;
use pace::Pace;
use protocol::ports::{PortError, PortNode, monotonic_ns};
use protocol::run::{Environment, RunDir, RunRoot};
use std::sync::atomic::Ordering;
use topics::Topics;

/// A servo that has not written for this long is gone, nanoseconds.
const SERVO_SILENCE_LIMIT_NS: u64 = 5_000_000_000;

/// Runs until it is told to end.
///
/// # Errors
/// What ended it, with the exit code.
pub fn run(cli: &SolverCli) -> Result<(), ServerError> {
    let stop = stop_flag()?;
    if let Some(parent) = cli.guarded_by {
        end_with_parent(parent, DeathSignal::Kill)?;
    }
    let run = match &cli.run_dir {
        Some(directory) => RunDir::open(directory)?,
        None => RunRoot::open(&Environment::of_process())?.attach()?,
    };
    let mut session = load::session(cli)?;
    let node = PortNode::join(&run, "deformation-solver").map_err(|e| mended_by_restart(&e))?;
    let mut topics = Topics::open(&node, &session).map_err(|e| mended_by_restart(&e))?;
    let mut pace = Pace::new(cli.period.unwrap_or_else(|| session.period_s()), cli.slow_down, monotonic_ns());
    let began_ns = monotonic_ns();
    while !stop.load(Ordering::Relaxed) {
        topics.receive().map_err(|e| mended_by_restart(&e))?;
        let now_ns = monotonic_ns();
        if now_ns.saturating_sub(topics.servo_time_ns().max(began_ns)) > SERVO_SILENCE_LIMIT_NS {
            return Err(ServerError::Unavailable(format!(
                "the servo has been silent for {} s; start a server with `haptic-server run`",
                SERVO_SILENCE_LIMIT_NS / 1_000_000_000
            )));
        }
        session.step(topics.servo(), topics.command(), now_ns);
        pace.note_step(now_ns, monotonic_ns());
        topics.publish(&session, &pace).map_err(|e| mended_by_restart(&e))?;
        pace.wait(monotonic_ns());
    }
    Ok(())
}

/// A port that fails now may well work for the next process: its predecessor's slot is then cleaned up.
fn mended_by_restart(error: &PortError) -> ServerError {
    ServerError::Internal(error.to_string())
}
