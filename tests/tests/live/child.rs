//! A test of this program, started once more as a process of its own and killed with its guard.

use protocol::run::RunDir;
use rustix::process::{Pid, Signal, kill_process};
use std::process::{Child, Command, Stdio};

pub(crate) struct Again(Child);

impl Again {
    /// Starts a test by its path; the variable tells it the run, and that it is meant.
    pub(crate) fn start(test: &str, variable: &str, run: &RunDir) -> Self {
        let child = Command::new(std::env::current_exe().expect("a test knows its own path"))
            .args(["--exact", test, "--nocapture"])
            .env(variable, run.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        Self(child.expect("a test can be started many times"))
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).expect("the child is there");
    }
}

impl Drop for Again {
    fn drop(&mut self) {
        let _gone = self.0.kill().and_then(|()| self.0.wait());
    }
}
