//! Removal of dead runs: their directories and the shared memory with their prefix, nothing else.
//!
//! Every process of a run holds a shared lock on the run's `alive` file; the kernel frees it when
//! the process dies, however it dies. Whoever gets the exclusive lock knows that nobody uses the
//! run any more (removing shared memory under a living process corrupts it). A run directory
//! without `alive` is one that was never finished or half removed.

use super::directory::ALIVE;
use super::private::{Lock, PrivateDir, try_lock};
use super::{RunError, RunRoot};
use crate::names::{run_id_of, run_prefix};
use rustix::fs::FlockOperation;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What [`RunRoot::clean`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Cleaned {
    /// Dead runs whose files are gone.
    pub removed: Vec<RemovedRun>,
    /// Directories of runs that are in use.
    pub in_use: Vec<PathBuf>,
    /// Dead runs that could not be removed, with the reason.
    pub failed: Vec<(PathBuf, String)>,
}

/// One dead run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RemovedRun {
    /// Its directory.
    pub directory: PathBuf,
    /// Its shared-memory files.
    pub shared_memory: Vec<PathBuf>,
}

/// What [`RunRoot::survey`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Survey {
    /// Runs whose processes are all gone.
    pub dead: Vec<PathBuf>,
    /// Runs that a process uses.
    pub in_use: Vec<PathBuf>,
    /// Folders that could not be looked into, with the reason.
    pub unclear: Vec<(PathBuf, String)>,
}

/// What [`clean`] would do, without doing it.
pub(super) fn survey(root: &RunRoot) -> Result<Survey, RunError> {
    let mut survey = Survey::default();
    for (name, path) in entries(root.path())? {
        if run_id_of(&name).is_none() {
            continue;
        }
        match is_in_use(&path) {
            Ok(true) => survey.in_use.push(path),
            Ok(false) => survey.dead.push(path),
            Err(error) => survey.unclear.push((path, error.to_string())),
        }
    }
    Ok(survey)
}

fn is_in_use(path: &Path) -> Result<bool, RunError> {
    let Some(file) = PrivateDir::open(path)?.existing_lock_file(ALIVE)? else { return Ok(false) };
    Ok(try_lock(&file, path, FlockOperation::NonBlockingLockExclusive)? == Lock::Taken)
}

pub(super) fn clean(root: &RunRoot) -> Result<Cleaned, RunError> {
    let mut cleaned = Cleaned::default();
    for (name, path) in entries(root.path())? {
        let Some(run_id) = run_id_of(&name) else { continue };
        match remove_run(root, run_id, &path) {
            Ok(Some(run)) => cleaned.removed.push(run),
            Ok(None) => cleaned.in_use.push(path),
            Err(error) => cleaned.failed.push((path, error.to_string())),
        }
    }
    Ok(cleaned)
}

/// Removes one run; `None` when a process uses it.
fn remove_run(root: &RunRoot, run_id: u64, path: &Path) -> Result<Option<RemovedRun>, RunError> {
    let dir = PrivateDir::open(path)?;
    let alive = dir.existing_lock_file(ALIVE)?;
    if let Some(file) = &alive
        && try_lock(file, path, FlockOperation::NonBlockingLockExclusive)? == Lock::Taken
    {
        return Ok(None);
    }
    let prefix = run_prefix(run_id);
    let mut shared_memory = Vec::new();
    for (name, file) in entries(&root.shared_memory_dir)? {
        if name.starts_with(&prefix) {
            std::fs::remove_file(&file).map_err(|e| RunError::io("remove", &file, e))?;
            shared_memory.push(file);
        }
    }
    std::fs::remove_dir_all(path).map_err(|e| RunError::io("remove", path, e))?;
    Ok(Some(RemovedRun { directory: path.to_owned(), shared_memory }))
}

/// Names (those that are UTF-8; ours are) and paths in a directory, sorted.
fn entries(directory: &Path) -> Result<Vec<(String, PathBuf)>, RunError> {
    let fail = |e| RunError::io("list", directory, e);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        if let Ok(name) = entry.file_name().into_string() {
            found.push((name, entry.path()));
        }
    }
    found.sort();
    Ok(found)
}
