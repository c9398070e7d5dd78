//! Our own programs in a sandbox: a private run directory each, captured output, and nothing left behind.
//!
//! A [`Sandbox`] owns a folder of mode 0700 which its programs see as `XDG_RUNTIME_DIR`. A [`Program`] leads a process group
//! of its own; dropped, the whole group is killed, so that no test can leave a servo or a solver running.

mod programs;

pub use programs::{binary, viewer, virtual_omni};

use rustix::process::{Pid, Signal, kill_process_group};
use std::ffi::OsStr;
use std::fs::Permissions;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// How often a waiting test looks at its child.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// A private run directory.
#[derive(Debug)]
pub struct Sandbox {
    folder: PathBuf,
}

/// A started program.
#[derive(Debug)]
pub struct Program {
    child: Child,
    stdout: PathBuf,
    stderr: PathBuf,
}

/// What a program left when it ended.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Sandbox {
    /// A new folder of its own under the system's folder for temporary files.
    ///
    /// # Panics
    /// When the folder cannot be made.
    #[must_use]
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("suture-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        std::fs::DirBuilder::new().mode(0o700).create(&folder).expect("a sandbox needs a new folder");
        Self { folder }
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A copy of server and solver in a folder of their own, with this shell script in the viewer's place, or with none.
    ///
    /// # Panics
    /// When they cannot be built or copied.
    #[must_use]
    pub fn server_beside(&self, viewer: Option<&str>) -> PathBuf {
        let folder = self.folder.join("bin");
        std::fs::create_dir_all(&folder).expect("a sandbox is writable");
        for name in ["haptic-server", "deformation-solver"] {
            std::fs::copy(binary(name), folder.join(name)).expect("the program is built");
        }
        if let Some(script) = viewer {
            let path = folder.join("viewer-client");
            std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("a sandbox is writable");
            std::fs::set_permissions(&path, Permissions::from_mode(0o700)).expect("our own file");
        }
        folder.join("haptic-server")
    }

    /// Starts one of our programs in this sandbox.
    ///
    /// # Panics
    /// When it cannot be built or started.
    #[must_use]
    pub fn start<A: AsRef<OsStr>>(&self, program: &Path, arguments: &[A]) -> Program {
        self.start_with(program, arguments, &[])
    }

    /// The same, with more in its environment.
    ///
    /// # Panics
    /// When it cannot be built or started.
    #[must_use]
    pub fn start_with<A: AsRef<OsStr>>(
        &self,
        program: &Path,
        arguments: &[A],
        environment: &[(&str, &str)],
    ) -> Program {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let (stdout, stderr) = (self.folder.join(format!("{number}.out")), self.folder.join(format!("{number}.err")));
        let file = |path: &Path| std::fs::File::create(path).expect("a sandbox is writable");
        let child = Command::new(program)
            .args(arguments)
            .envs(environment.iter().copied())
            .env("XDG_RUNTIME_DIR", &self.folder)
            .env("NO_COLOR", "1")
            .stdin(Stdio::null())
            .stdout(file(&stdout))
            .stderr(file(&stderr))
            .process_group(0)
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}", program.display()));
        Program { child, stdout, stderr }
    }
}

impl Default for Sandbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Sandbox {
    fn drop(&mut self) {
        let _already_gone = std::fs::remove_dir_all(&self.folder);
    }
}

impl Program {
    /// Process id.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal to the program alone.
    ///
    /// # Panics
    /// When the program is gone.
    pub fn signal(&self, signal: Signal) {
        rustix::process::kill_process(pid(&self.child), signal).expect("the program is there");
    }

    /// Its children of this name, by `/proc`.
    #[must_use]
    pub fn children(&self, name: &str) -> Vec<Pid> {
        let list = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", self.id())).unwrap_or_default();
        let named = |id: &&str| {
            // The kernel keeps 15 characters of a name.
            let comm = std::fs::read_to_string(format!("/proc/{id}/comm")).unwrap_or_default();
            !comm.trim().is_empty() && name.starts_with(comm.trim())
        };
        let ids = list.split_whitespace().filter(named);
        ids.filter_map(|id| Pid::from_raw(id.parse().ok()?)).collect()
    }

    /// What it has written to standard error so far.
    #[must_use]
    pub fn stderr(&self) -> String {
        std::fs::read_to_string(&self.stderr).unwrap_or_default()
    }

    /// Waits for the end; after `limit` the whole group is killed and the answer is an error with what it wrote.
    ///
    /// # Errors
    /// The program did not end in time.
    pub fn wait(mut self, limit: Duration) -> Result<Ended, String> {
        match wait_for(limit, || self.child.try_wait().ok().flatten()) {
            Some(status) => {
                let stdout = std::fs::read_to_string(&self.stdout).unwrap_or_default();
                Ok(Ended { code: status.code(), stdout, stderr: self.stderr() })
            }
            None => Err(format!("did not end within {limit:?}; standard error:\n{}", self.stderr())),
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _already_gone = kill_process_group(pid(&self.child), Signal::KILL);
        let _already_reaped = self.child.wait();
    }
}

impl Ended {
    /// Standard output as one JSON document.
    ///
    /// # Errors
    /// What is wrong, with both outputs.
    pub fn json(&self) -> Result<serde_json::Value, String> {
        serde_json::from_str(&self.stdout)
            .map_err(|error| format!("{error}\nstandard output:\n{}\nstandard error:\n{}", self.stdout, self.stderr))
    }
}

fn pid(child: &Child) -> Pid {
    Pid::from_child(child)
}

/// Asks until there is an answer; `None` when there is none within `limit`.
pub fn wait_for<T>(limit: Duration, mut ask: impl FnMut() -> Option<T>) -> Option<T> {
    // Wall clock: patience with other processes; nothing is measured.
    let deadline = Instant::now() + limit;
    loop {
        if let Some(answer) = ask() {
            return Some(answer);
        }
        // Wall clock: the same patience.
        if Instant::now() >= deadline {
            return None;
        }
        std::thread::sleep(LOOK_EVERY);
    }
}

/// Waits until a process has ended. One that nobody has reaped yet counts as ended, one that is still going down does not.
#[must_use]
pub fn is_gone_within(limit: Duration, process: Pid) -> bool {
    let state = || std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The state follows the name, which stands in parentheses and may hold some itself.
    wait_for(limit, || {
        state().rsplit_once(')').is_none_or(|(_, rest)| rest.trim_start().starts_with(['Z', 'X'])).then_some(())
    })
    .is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patience with a loaded machine.
    const LIMIT: Duration = Duration::from_secs(60);

    #[test]
    fn a_program_that_hangs_is_killed_with_its_children() {
        let sandbox = Sandbox::new();
        let program = sandbox.start(Path::new("sh"), &["-c", "sleep 60 & echo $!; wait"]);
        let written = || std::fs::read_to_string(&program.stdout).ok().filter(|text| text.ends_with('\n'));
        let grandchild = wait_for(LIMIT, || Pid::from_raw(written()?.trim().parse().ok()?));
        let failed = program.wait(Duration::from_millis(300));
        assert!(failed.is_err_and(|message| message.contains("did not end")));
        let grandchild = grandchild.expect("the shell wrote its child's id");
        assert!(is_gone_within(LIMIT, grandchild), "grandchild {grandchild} lives");
    }

    #[test]
    fn output_and_exit_code_come_back_and_the_folder_goes() {
        let sandbox = Sandbox::new();
        let folder = sandbox.folder().to_path_buf();
        let ended = sandbox
            .start(Path::new("sh"), &["-c", "echo \"{\\\"dir\\\": \\\"$XDG_RUNTIME_DIR\\\"}\"; exit 65"])
            .wait(LIMIT)
            .expect("the shell ends");
        assert_eq!(ended.code, Some(65));
        assert_eq!(ended.json().expect("JSON")["dir"], folder.to_string_lossy().as_ref());
        drop(sandbox);
        assert!(!folder.exists());
    }
}
