//! The run directory: where the processes of one run find each other, and nobody else.
//!
//! ```text
//! $XDG_RUNTIME_DIR/haptic-suture/      0700, own user, no symlink        (root)
//!   lock                               flock of the one running server, its pid inside
//!   current                            JSON: the run to attach to, written atomically
//!   run-<16 hex>/                      one run: id from the kernel's random source   (run)
//!     run.json                         the same JSON
//!     alive                            shared flock of every process of the run
//!     services/ nodes/                 iceoryx2's own files
//! /dev/shm/hs_<16 hex>_…               the run's shared memory
//! ```
//! Leftovers of a killed run cannot hinder the next one: it has another directory and prefix. They
//! are removed when nobody holds `alive` any more. The environment is read in one place,
//! [`Environment::of_process`]; tests pass their own.

mod active;
mod clean;
mod directory;
mod private;

pub use active::ActiveRun;
pub use clean::{Cleaned, RemovedRun, Survey};
pub use directory::{Environment, RunDir, RunRoot};

use std::path::{Path, PathBuf};

/// What can be wrong with the run directory.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Another server of this user is running.
    #[error("a server is already running (process {}); stop it before a second one is started", pid_text(*pid))]
    AlreadyRunning {
        /// Its process id, if it could be read.
        pid: Option<u32>,
    },
    /// There is no run to attach to.
    #[error("no server is running under {}; start one with `haptic-server run`", root.display())]
    NotRunning {
        /// Directory that was searched.
        root: PathBuf,
    },
    /// A directory is not ours alone.
    #[error("{} must not be used: it {reason}; remove it or set XDG_RUNTIME_DIR to a directory of your own", path.display())]
    Unsafe {
        /// The directory or file.
        path: PathBuf,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The run speaks another wire version.
    #[error("the run in {} has wire version {found}, this program speaks {expected}; use binaries of one build", path.display())]
    Version {
        /// Its directory.
        path: PathBuf,
        /// The version of the run.
        found: u32,
        /// Our version.
        expected: u32,
    },
    /// The description of a run cannot be understood.
    #[error("{} does not describe a run ({reason}); remove leftovers with `haptic-server clean`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The run is just being removed.
    #[error("the run in {} has ended and is being removed; attach to the next one", path.display())]
    Ended {
        /// Its directory.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error(
        "cannot {action} {}: {source}; check its owner, permissions and free space, or set XDG_RUNTIME_DIR to a directory of your own",
        path.display()
    )]
    Io {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
}

impl RunError {
    fn io(action: &'static str, path: &Path, source: impl Into<std::io::Error>) -> Self {
        Self::Io { action, path: path.to_owned(), source: source.into() }
    }

    fn damaged(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Damaged { path: path.to_owned(), reason: reason.to_string() }
    }
}

fn pid_text(pid: Option<u32>) -> String {
    pid.map_or_else(|| "unknown".to_owned(), |p| p.to_string())
}

#[cfg(test)]
mod tests;
