//! `haptic-server session …`: one command to the running server, and its answer.
//!
//! The command goes to solver and servo process as a `session_command`; the solver answers in its
//! `wound_report`, which is awaited for [`ANSWER_LIMIT`]. Re-arming concerns the servo alone and is seen in
//! `servo_state`.

use crate::cli::SessionAction;
use crate::error::ServerError;
use protocol::ports::{PortError, PortNode, ServoStateReader, SessionCommandPublisher, WoundReportSubscriber};
use protocol::run::{Environment, RunError, RunRoot};
use protocol::session_command as command;
use std::time::{Duration, Instant};

/// An answer is awaited for this long: going to another scene builds it first.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);
/// How often it is looked for.
const ANSWER_LOOK: Duration = Duration::from_millis(5);
/// Servo state machine: fault.
const SERVO_FAULT: u32 = 5;
/// `wound_report`: the newest command was carried out.
const RESULT_DONE: u32 = 1;
/// `wound_report`: the newest command was refused.
const RESULT_REFUSED: u32 = 2;

impl From<RunError> for ServerError {
    fn from(error: RunError) -> Self {
        let sentence = error.to_string();
        match error {
            RunError::AlreadyRunning { .. } => Self::TryAgain(sentence),
            RunError::Unsafe { .. } => Self::Permission(sentence),
            _ => Self::Unavailable(sentence),
        }
    }
}

impl From<PortError> for ServerError {
    fn from(error: PortError) -> Self {
        Self::Unavailable(error.to_string())
    }
}

impl SessionAction {
    fn code(self) -> u32 {
        match self {
            Self::Restore => command::RESTORE,
            Self::Next => command::NEXT,
            Self::Previous => command::PREVIOUS,
            Self::Tie => command::TIE,
            Self::ControlOn => command::CONTROL_ON,
            Self::ControlOff => command::CONTROL_OFF,
            Self::ControlPaper => command::CONTROL_PAPER,
            Self::Rearm => command::REARM,
        }
    }
}

/// Sends one command and waits for what became of it.
///
/// # Errors
/// 69 without a running server or answer, 75 when the command is refused now.
pub fn send(action: SessionAction) -> Result<(), ServerError> {
    let run = RunRoot::open(&Environment::of_process())?.attach()?;
    let node = PortNode::join(&run, "session-command")?;
    let mut reports = WoundReportSubscriber::open(&node)?;
    let mut servo = ServoStateReader::new(&node);
    let mut publisher = SessionCommandPublisher::open(&node)?;
    let receivers = publisher.send(action.code())?;
    if receivers == 0 {
        return Err(ServerError::Unavailable(
            "no process of the running server listens to session commands yet; try again in a second".to_owned(),
        ));
    }
    let sent = protocol::ports::monotonic_ns();
    let deadline = Instant::now() + ANSWER_LIMIT;
    while Instant::now() < deadline {
        std::thread::sleep(ANSWER_LOOK);
        if action == SessionAction::Rearm {
            if servo.newest()?.is_some_and(|s| s.header.time_ns > sent && s.mode != SERVO_FAULT) {
                return Ok(());
            }
            continue;
        }
        let answer = reports.newest()?.filter(|r| r.command_sequence == publisher.answer_sequence());
        let answer = answer.map(|r| r.command_result);
        match answer {
            Some(RESULT_DONE) => return Ok(()),
            Some(RESULT_REFUSED) => {
                return Err(ServerError::TryAgain(
                    "the session refused the command: it does not fit the scene's stage now (an open gap cannot be \
                     tied, there is no scene beyond the first or last); try again when it does"
                        .to_owned(),
                ));
            }
            _ => {}
        }
    }
    Err(ServerError::Unavailable("the running server did not answer; see whether its solver lives".to_owned()))
}
