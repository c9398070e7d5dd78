//! A run seen by its supervisor: it holds the lock that refuses a second server.

use super::directory::{ALIVE, CURRENT, DESCRIPTION, Description};
use super::private::{Lock, PrivateDir, try_lock};
use super::{Cleaned, RunDir, RunError, RunRoot};
use crate::names::{run_directory, run_prefix};
use crate::wire::WIRE_VERSION;
use rustix::fs::FlockOperation;
use rustix::rand::{GetRandomFlags, getrandom};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::time::Duration;

const LOCK: &str = "lock";
const STAGING: &str = "new";
/// A server that has just taken the lock writes its process id within this many looks.
const PID_LOOKS: usize = 5;
const PID_LOOK_PAUSE: Duration = Duration::from_millis(10);
/// A process id has at most ten digits.
const MAX_PID_BYTES: u64 = 16;

/// The run of this process. Dropping it frees the lock; [`ActiveRun::finish`] also tidies up.
#[derive(Debug)]
pub struct ActiveRun {
    run: RunDir,
    _lock: File,
}

impl ActiveRun {
    pub(super) fn start(root: &RunRoot) -> Result<Self, RunError> {
        let lock = take_lock(root)?;
        root.clean()?;

        // Under its final name the directory is fair game for a cleaner as soon as nobody holds `alive`,
        // so it gets that name only when we do.
        let staging_path = root.path().join(STAGING);
        match std::fs::remove_dir_all(&staging_path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(RunError::io("remove", &staging_path, e)),
            _ => {}
        }
        let staging = PrivateDir::create(&staging_path)?;
        let alive = staging.lock_file(ALIVE)?;
        if try_lock(&alive, &staging_path, FlockOperation::NonBlockingLockShared)? == Lock::Taken {
            return Err(RunError::AlreadyRunning { pid: None });
        }
        let run_id = random_id(root.path())?;
        let directory = run_directory(run_id);
        let path = root.path().join(&directory);
        let description = Description {
            wire_version: WIRE_VERSION,
            directory,
            prefix: run_prefix(run_id),
            supervisor_pid: std::process::id(),
        };
        let text = serde_json::to_string(&description).map_err(|e| RunError::damaged(&path, e))?;
        staging.replace_text(DESCRIPTION, &text)?;
        std::fs::rename(&staging_path, &path).map_err(|e| RunError::io("create", &path, e))?;
        let run = RunDir::open(&path)?;
        root.dir.replace_text(CURRENT, &text)?;
        Ok(Self { run, _lock: lock })
    }

    /// The run as its other processes see it.
    #[must_use]
    pub fn run(&self) -> &RunDir {
        &self.run
    }

    /// Ends the run: it is no longer announced, and its files are removed unless a process that
    /// outlives the supervisor (a viewer, say) still uses them; then the next start removes them.
    ///
    /// # Errors
    /// When the root cannot be read or written.
    pub fn finish(self, root: &RunRoot) -> Result<Cleaned, RunError> {
        root.dir.remove_file(CURRENT)?;
        let Self { run, _lock } = self;
        drop(run);
        root.clean()
    }
}

fn take_lock(root: &RunRoot) -> Result<File, RunError> {
    let mut file = root.dir.lock_file(LOCK)?;
    let path = root.path().join(LOCK);
    let fail = |e| RunError::io("write", &path, e);
    if try_lock(&file, &path, FlockOperation::NonBlockingLockExclusive)? == Lock::Taken {
        return Err(RunError::AlreadyRunning { pid: holder(&mut file) });
    }
    file.set_len(0).map_err(fail)?;
    file.write_all(std::process::id().to_string().as_bytes()).map_err(fail)?;
    Ok(file)
}

fn holder(file: &mut File) -> Option<u32> {
    for _ in 0..PID_LOOKS {
        let mut text = String::new();
        file.seek(SeekFrom::Start(0)).ok()?;
        Read::by_ref(file).take(MAX_PID_BYTES).read_to_string(&mut text).ok()?;
        if let Ok(pid) = text.trim().parse() {
            return Some(pid);
        }
        std::thread::sleep(PID_LOOK_PAUSE);
    }
    None
}

fn random_id(path: &Path) -> Result<u64, RunError> {
    let mut bytes = [0_u8; 8];
    let count = getrandom(&mut bytes, GetRandomFlags::empty())
        .map_err(|e| RunError::io("draw a random number for", path, e))?;
    if count != bytes.len() {
        let short = std::io::Error::other("the kernel gave too few random bytes");
        return Err(RunError::io("draw a random number for", path, short));
    }
    Ok(u64::from_le_bytes(bytes))
}
