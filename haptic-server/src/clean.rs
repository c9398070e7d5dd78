//! `haptic-server clean`: removes what killed servers left behind, and says what.
//!
//! A run in use is never touched. Starting a server does the same by itself; the command is for people who
//! want to look. Deliberately absent: removing anything outside this user's own runs.

use crate::error::ServerError;
use protocol::run::{Environment, RunRoot};
use std::fmt::Write;

/// Removes dead runs; gives what was done, for stdout.
///
/// # Errors
/// When the place of the runs cannot be read, or a dead run cannot be removed.
pub fn clean() -> Result<String, ServerError> {
    let cleaned = RunRoot::open(&Environment::of_process())?.clean()?;
    let mut text = String::new();
    for run in &cleaned.removed {
        let files = run.shared_memory.len();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "removed {} and {files} shared-memory files", run.directory.display());
    }
    for path in &cleaned.in_use {
        let _ = writeln!(text, "in use  {}", path.display());
    }
    if text.is_empty() {
        text.push_str("nothing to remove\n");
    }
    match cleaned.failed.first() {
        Some((path, reason)) => Err(ServerError::Unavailable(format!("{}: {reason}", path.display()))),
        None => Ok(text),
    }
}
