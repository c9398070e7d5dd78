//! One child process: how it is started, watched, asked to end, killed.
//!
//! A child leads its own process group, so that Ctrl-C in a terminal reaches the supervisor alone, which
//! then ends the run in order. Dropping a [`ChildProcess`] kills it: no path out of the supervisor leaves one
//! behind. When the supervisor itself is killed, the child ends by the parent-death signal it asked for
//! ([`end_with_parent`]).

use super::guard::ChildEnd;
use crate::error::ServerError;
use rustix::process::{Pid, Signal, getppid, kill_process, set_parent_process_death_signal};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// How often a child that was asked to end is looked at.
const END_LOOK: Duration = Duration::from_millis(5);

/// A child of the supervisor.
#[derive(Debug)]
pub struct ChildProcess {
    child: Child,
    name: &'static str,
}

impl ChildProcess {
    /// Starts `command` in a process group of its own.
    ///
    /// # Errors
    /// [`ServerError::Unavailable`] when the program cannot be started.
    pub fn spawn(name: &'static str, mut command: Command) -> Result<Self, ServerError> {
        let program = command.get_program().to_owned();
        let child = command.process_group(0).spawn().map_err(|e| {
            let program = program.display();
            ServerError::Unavailable(format!(
                "cannot start {name} ({program}: {e}); build or install it beside this program"
            ))
        })?;
        Ok(Self { child, name })
    }

    /// Name for messages.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The child itself, for its pipes.
    pub fn inner(&mut self) -> &mut Child {
        &mut self.child
    }

    /// How it ended, if it has.
    ///
    /// # Errors
    /// [`ServerError::Internal`] when the kernel refuses to say.
    pub fn ended(&mut self) -> Result<Option<ChildEnd>, ServerError> {
        let status = self
            .child
            .try_wait()
            .map_err(|e| ServerError::Internal(format!("cannot watch the {} process: {e}; start again", self.name)))?;
        Ok(status.map(|s| match (s.code(), s.signal()) {
            (Some(code), _) => ChildEnd::Exit(code),
            (None, signal) => ChildEnd::Signal(signal.unwrap_or(0)),
        }))
    }

    /// Kills it at once, also when it is stopped.
    pub fn kill(&mut self) {
        // An error means that it is dead already.
        let _ = self.child.kill();
    }

    /// Asks it to end, waits up to `limit`, then kills it.
    pub fn end_within(mut self, limit: Duration) {
        // An error means that it is dead already.
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let deadline = Instant::now() + limit;
        while matches!(self.ended(), Ok(None)) && Instant::now() < deadline {
            std::thread::sleep(END_LOOK);
        }
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        self.kill();
        let _ = self.child.wait();
    }
}

/// The program that lies beside the running one.
///
/// # Errors
/// [`ServerError::Internal`] when the path of the running program is unknown.
pub fn beside_this_program(name: &str) -> Result<PathBuf, ServerError> {
    std::env::current_exe().map(|exe| exe.with_file_name(name)).map_err(|e| {
        ServerError::Internal(format!("cannot find the folder of this program: {e}; start it by its path"))
    })
}

/// How a child ends when the supervisor dies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeathSignal {
    /// SIGTERM: it ends in order, and a stopped one only when it is continued.
    Terminate,
    /// SIGKILL: it ends at once, also when it is stopped, and keeps nothing in use.
    Kill,
}

/// Makes this process receive the signal when process `parent` dies; called first of all in a child.
///
/// # Errors
/// [`ServerError::Internal`] when the parent is gone already or the kernel refuses.
pub fn end_with_parent(parent: u32, by: DeathSignal) -> Result<(), ServerError> {
    let signal = match by {
        DeathSignal::Terminate => Signal::TERM,
        DeathSignal::Kill => Signal::KILL,
    };
    set_parent_process_death_signal(Some(signal))
        .map_err(|e| ServerError::Internal(format!("cannot tie this process to the server: {e}; check the kernel")))?;
    let now = getppid().and_then(|p| u32::try_from(p.as_raw_nonzero().get()).ok()).unwrap_or(0);
    if now == parent {
        Ok(())
    } else {
        Err(ServerError::Internal(format!("the server (process {parent}) is gone; start it again")))
    }
}
