//! From the command line's scenes to a session, at their start or where a dead solver left them.
//!
//! A solver that follows a dead one reads where the session stood from its standard input: the scene at work, its stitches,
//! the control mode, and a scene generation that no solver had before it.

use crate::cli::SolverCli;
use crate::crew;
use crate::error::ServerError;
use crate::scene_file;
use crate::solver::session::SolverSession;
use crate::standing::Standing;
use sim_core::scene::procedure::ProcedureStanding;

/// Loads the chosen scenes and prepares the session.
pub(super) fn session(cli: &SolverCli) -> Result<SolverSession, ServerError> {
    let standing = if cli.resume { Some(Standing::read(std::io::stdin().lock())?) } else { None };
    let scenes = scene_file::chosen(&cli.scene)?;
    let mut session = SolverSession::new(&scenes).map_err(|e| scene_file::refused(&cli.scene, &e))?;
    crew::hire(&mut session);
    if let Some(standing) = standing {
        resume(&mut session, &standing.of_procedure());
    }
    Ok(session)
}

/// Goes on where the session stood; where that is not possible the work is worth more than the stitches.
fn resume(session: &mut SolverSession, standing: &ProcedureStanding) {
    match session.resume(standing) {
        Ok(()) if standing.stitches.is_empty() => {}
        Ok(()) => tracing::info!("{} stitches were tied again", standing.stitches.len()),
        Err(error) => {
            tracing::error!("the stitches are lost: {error}");
            let anew = ProcedureStanding { generation: standing.generation, ..ProcedureStanding::default() };
            // A first scene without stitches is in every procedure.
            let _ = session.resume(&anew);
        }
    }
}
