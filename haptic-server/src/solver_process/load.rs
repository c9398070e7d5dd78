//! From the command line's scenes to a session.
//!
//! A solver that follows a dead one begins with the scene at work, in a scene generation that the dead one did not
//! have, so that hands and viewers see a new scene and not an old one that jumped.

use crate::cli::SolverCli;
use crate::error::ServerError;
use crate::scene_file;
use crate::solver::session::SolverSession;
use protocol::session_command::{NEXT, RESTORE, SessionCommand};
use protocol::wire::Field;

/// Restarts that still give a generation of their own.
const MOST_GENERATIONS: u32 = 1000;

/// Loads the chosen scenes and prepares the session.
pub(super) fn session(cli: &SolverCli) -> Result<SolverSession, ServerError> {
    let scenes = scene_file::chosen(&cli.scene)?;
    let count = u32::try_from(scenes.len()).unwrap_or(u32::MAX);
    let mut session = SolverSession::new(&scenes).map_err(|e| scene_file::refused(&cli.scene, &e))?;
    let mut command = |command, times| {
        for _ in 0..times {
            session.step(None, Some(&SessionCommand { command, ..SessionCommand::EMPTY }), 0);
        }
    };
    command(NEXT, cli.resume_scene.min(count.saturating_sub(1)));
    command(RESTORE, cli.restarts.min(MOST_GENERATIONS));
    Ok(session)
}
