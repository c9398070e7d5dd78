//! From the command line's scenes to a session.

use crate::cli::SceneArgs;
use crate::error::ServerError;
use crate::scene_file;
use crate::solver::session::SolverSession;

/// Loads the chosen scenes and prepares the session.
pub(super) fn session(args: &SceneArgs) -> Result<SolverSession, ServerError> {
    SolverSession::new(scene_file::chosen(args)?).map_err(|e| ServerError::BadData(e.to_string()))
}
