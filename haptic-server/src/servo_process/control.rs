//! The control line of the servo process: orders in on stdin, reports out on stdout.
//!
//! The main thread sits here and touches nothing of the loop: it waits on stdin for at most one heartbeat
//! period, then reports the tick counter. End of file on stdin means that the supervisor is gone.

use crate::error::ServerError;
use crate::servo_link::{FromServo, LineBuffer, ServoSpec, ToServo, to_line};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::fs::File;
use std::io::Write;
use std::sync::OnceLock;

/// What came in.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Incoming {
    /// An order of the supervisor.
    Order(ToServo),
    /// The supervisor is gone.
    SupervisorGone,
}

/// The pipe to the supervisor, once it is out of the way of others.
static REPORTS: OnceLock<File> = OnceLock::new();

/// stdin and stdout of the servo process.
#[derive(Default)]
pub(super) struct ControlLine {
    lines: LineBuffer,
    waiting: std::collections::VecDeque<Incoming>,
}

impl ControlLine {
    /// Takes stdout away from everybody else: a vendor's library prints banners there, which go to stderr from now on.
    pub(super) fn keep_for_itself() -> Result<(), ServerError> {
        let moved = rustix::io::fcntl_dupfd_cloexec(std::io::stdout(), 3)
            .and_then(|pipe| rustix::stdio::dup2_stdout(std::io::stderr()).map(|()| pipe));
        let pipe = moved.map_err(|e| ServerError::Internal(format!("cannot keep the control line apart: {e}")))?;
        REPORTS.get_or_init(|| File::from(pipe));
        Ok(())
    }

    /// Waits for the specification, which is the first order.
    pub(super) fn specification(&mut self) -> Result<ServoSpec, ServerError> {
        loop {
            match self.next(None)? {
                Some(Incoming::Order(ToServo::Start(spec))) => return Ok(*spec),
                Some(Incoming::Order(_)) | None => {}
                Some(Incoming::SupervisorGone) => {
                    return Err(ServerError::Usage(
                        "`servo` is started by `haptic-server run`, which tells it on stdin what to do; use `run`"
                            .to_owned(),
                    ));
                }
            }
        }
    }

    /// The next order, waited for up to `patience` (`None`: for ever).
    pub(super) fn next(&mut self, patience: Option<Timespec>) -> Result<Option<Incoming>, ServerError> {
        if self.waiting.is_empty() {
            self.fill(patience)?;
        }
        Ok(self.waiting.pop_front())
    }

    fn fill(&mut self, patience: Option<Timespec>) -> Result<(), ServerError> {
        let stdin = std::io::stdin();
        let mut fds = [PollFd::new(&stdin, PollFlags::IN)];
        match poll(&mut fds, patience.as_ref()) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(()),
            Ok(_) => {}
            Err(e) => return Err(ServerError::Internal(format!("cannot wait for the supervisor's orders: {e}"))),
        }
        let mut chunk = [0_u8; 4096];
        // Not through `Stdin`, whose buffer `poll` does not see.
        let count = rustix::io::read(&stdin, &mut chunk).unwrap_or(0);
        if count == 0 {
            self.waiting.push_back(Incoming::SupervisorGone);
            return Ok(());
        }
        let waiting = &mut self.waiting;
        self.lines.feed(&chunk[..count], |line| match serde_json::from_str(line) {
            Ok(order) => waiting.push_back(Incoming::Order(order)),
            Err(error) => tracing::warn!("the supervisor said something that is not understood: {error}"),
        });
        Ok(())
    }

    /// Reports to the supervisor; a report that cannot be delivered is dropped, since stdin tells the same.
    pub(super) fn report(message: &FromServo) {
        if let Ok(line) = to_line(message) {
            // One write per line: reports of two threads do not mix.
            let _ = REPORTS.get().map(|mut pipe| pipe.write_all(line.as_bytes()));
        }
    }
}
