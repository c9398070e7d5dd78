//! Where runs live ([`RunRoot`]) and one run seen by a process that takes part ([`RunDir`]).
//!
//! The root is the first usable of: `$XDG_RUNTIME_DIR`, `/run/user/<uid>`, the temporary directory
//! (there the name carries the user id). A candidate that is missing is passed over; one that is
//! there but unsafe is an error, because silently choosing another place would split a user's
//! processes into groups that do not see each other.

use super::private::{Lock, PrivateDir, check_parent, try_lock};
use super::{ActiveRun, Cleaned, RunError, Survey, clean};
use crate::names::{ROOT_DIRECTORY, run_id_of, run_prefix};
use crate::wire::WIRE_VERSION;
use rustix::fs::FlockOperation;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(super) const ALIVE: &str = "alive";
pub(super) const CURRENT: &str = "current";
pub(super) const DESCRIPTION: &str = "run.json";

/// What of the process environment decides where runs live.
#[derive(Clone, Debug)]
pub struct Environment {
    /// `$XDG_RUNTIME_DIR`.
    pub xdg_runtime_dir: Option<PathBuf>,
    /// `/run/user`.
    pub run_user_dir: PathBuf,
    /// The temporary directory.
    pub temp_dir: PathBuf,
    /// Where the kernel keeps shared memory: `/dev/shm`.
    pub shared_memory_dir: PathBuf,
}

impl Environment {
    /// The environment of this process; the only place that reads it.
    #[must_use]
    pub fn of_process() -> Self {
        Self {
            xdg_runtime_dir: std::env::var_os("XDG_RUNTIME_DIR").filter(|v| !v.is_empty()).map(PathBuf::from),
            run_user_dir: PathBuf::from("/run/user"),
            temp_dir: std::env::temp_dir(),
            shared_memory_dir: PathBuf::from("/dev/shm"),
        }
    }

    fn root_path(&self) -> Result<PathBuf, RunError> {
        let uid = rustix::process::geteuid().as_raw();
        let candidates = [self.xdg_runtime_dir.clone(), Some(self.run_user_dir.join(uid.to_string()))];
        for candidate in candidates.into_iter().flatten() {
            if candidate.is_dir() {
                return Ok(check_parent(&candidate)?.join(ROOT_DIRECTORY));
            }
        }
        Ok(check_parent(&self.temp_dir)?.join(format!("{ROOT_DIRECTORY}-{uid}")))
    }
}

/// The directory with all runs of this user.
#[derive(Debug)]
pub struct RunRoot {
    pub(super) dir: PrivateDir,
    pub(super) shared_memory_dir: PathBuf,
}

impl RunRoot {
    /// Finds, creates if needed, and checks the root.
    ///
    /// # Errors
    /// When the place belongs to somebody else, is open to others, or cannot be made.
    pub fn open(environment: &Environment) -> Result<Self, RunError> {
        let dir = PrivateDir::create(&environment.root_path()?)?;
        Ok(Self { dir, shared_memory_dir: environment.shared_memory_dir.clone() })
    }

    /// Finds and checks the root; `None` when there is none yet. Nothing is created.
    ///
    /// # Errors
    /// When the place belongs to somebody else or is open to others.
    pub fn existing(environment: &Environment) -> Result<Option<Self>, RunError> {
        match PrivateDir::open(&environment.root_path()?) {
            Ok(dir) => Ok(Some(Self { dir, shared_memory_dir: environment.shared_memory_dir.clone() })),
            Err(RunError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Starts a new run; the caller is its supervisor. Leftovers of dead runs are removed.
    ///
    /// # Errors
    /// [`RunError::AlreadyRunning`] with the process id of the server that holds the lock.
    pub fn start(&self) -> Result<ActiveRun, RunError> {
        ActiveRun::start(self)
    }

    /// The run that a running server has announced.
    ///
    /// # Errors
    /// [`RunError::NotRunning`], or what is wrong with that run.
    pub fn attach(&self) -> Result<RunDir, RunError> {
        let Some(text) = self.dir.read_text(CURRENT)? else {
            return Err(RunError::NotRunning { root: self.path().to_owned() });
        };
        let description = Description::parse(&text, &self.path().join(CURRENT))?;
        match RunDir::open(&self.path().join(&description.directory)) {
            Err(RunError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                Err(RunError::NotRunning { root: self.path().to_owned() })
            }
            other => other,
        }
    }

    /// Removes the directories and shared memory of runs that no process uses any more.
    ///
    /// # Errors
    /// When the root cannot be read; a run that cannot be removed is in the answer.
    pub fn clean(&self) -> Result<Cleaned, RunError> {
        clean::clean(self)
    }

    /// Which runs are in use and which are dead; nothing is removed.
    ///
    /// # Errors
    /// When the root cannot be read.
    pub fn survey(&self) -> Result<Survey, RunError> {
        clean::survey(self)
    }
}

/// What `current` and `run.json` say.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Description {
    pub(super) wire_version: u32,
    /// Name of the run's directory in the root.
    pub(super) directory: String,
    /// Prefix of its shared-memory files, for people who look at them.
    pub(super) prefix: String,
    /// Process id of the supervisor.
    pub(super) supervisor_pid: u32,
}

impl Description {
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, RunError> {
        let description: Self = serde_json::from_str(text).map_err(|e| RunError::damaged(path, e))?;
        if run_id_of(&description.directory).is_none() {
            return Err(RunError::damaged(path, "the directory name is not one of ours"));
        }
        Ok(description)
    }
}

/// One run, as a process that takes part in it sees it. While a clone lives, the run is not removed.
#[derive(Clone, Debug)]
pub struct RunDir {
    path: PathBuf,
    run_id: u64,
    supervisor_pid: u32,
    _alive: Arc<File>,
}

impl RunDir {
    /// Opens the run in this directory (the supervisor hands the path to its children).
    ///
    /// # Errors
    /// When the directory is not ours alone, is no run, speaks another wire version, or has ended.
    pub fn open(path: &Path) -> Result<Self, RunError> {
        let dir = PrivateDir::open(path)?;
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let run_id = run_id_of(name).ok_or_else(|| RunError::damaged(path, "the name is not run-<16 hex digits>"))?;
        let ended = || RunError::Ended { path: path.to_owned() };
        let file = dir.existing_lock_file(ALIVE)?.ok_or_else(ended)?;
        if try_lock(&file, path, FlockOperation::NonBlockingLockShared)? == Lock::Taken
            || !dir.still_names(ALIVE, &file)?
        {
            return Err(ended());
        }
        let text = dir.read_text(DESCRIPTION)?.ok_or_else(ended)?;
        let description = Description::parse(&text, &path.join(DESCRIPTION))?;
        if description.wire_version != WIRE_VERSION {
            return Err(RunError::Version {
                path: path.to_owned(),
                found: description.wire_version,
                expected: WIRE_VERSION,
            });
        }
        let supervisor_pid = description.supervisor_pid;
        Ok(Self { path: path.to_owned(), run_id, supervisor_pid, _alive: Arc::new(file) })
    }

    /// Its directory.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its random number.
    #[must_use]
    pub fn run_id(&self) -> u64 {
        self.run_id
    }

    /// Prefix of its shared-memory files.
    #[must_use]
    pub fn prefix(&self) -> String {
        run_prefix(self.run_id)
    }

    /// Process id of its supervisor.
    #[must_use]
    pub fn supervisor_pid(&self) -> u32 {
        self.supervisor_pid
    }
}
