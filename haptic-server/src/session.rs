//! `haptic-server session …`: one command to the running server, and its answer.
//!
//! The command goes to solver and servo process as a `session_command`; the solver answers in its
//! `wound_report`, which is awaited for [`ANSWER_LIMIT`]. Re-arming concerns the servo alone: it is seen in
//! `servo_state`, too, also without a solver.

use crate::cli::SessionAction;
use crate::error::ServerError;
use protocol::ports::{PortError, PortNode, ServoStateReader, SessionCommandPublisher, WoundReportSubscriber};
use protocol::run::{Environment, RunError, RunRoot};
use protocol::session_command::Order;
use std::io::ErrorKind::PermissionDenied;
use std::time::{Duration, Instant};

/// An answer is awaited for this long: going to another scene builds it first.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);
/// How often it is looked for.
const ANSWER_LOOK: Duration = Duration::from_millis(5);
/// Servo state machine: fault.
const SERVO_FAULT: u32 = 5;

impl From<RunError> for ServerError {
    fn from(error: RunError) -> Self {
        let sentence = error.to_string();
        match &error {
            RunError::AlreadyRunning { .. } => Self::TryAgain(sentence),
            RunError::Unsafe { .. } => Self::Permission(sentence),
            RunError::Io { source, .. } if source.kind() == PermissionDenied => Self::Permission(sentence),
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
    fn order(self) -> Order {
        match self {
            Self::Start => Order::Start,
            Self::Restore => Order::Restore,
            Self::Next => Order::Next,
            Self::Previous => Order::Previous,
            Self::Tie => Order::Tie,
            Self::ControlOn => Order::ControlOn,
            Self::ControlOff => Order::ControlOff,
            Self::ControlPaper => Order::ControlPaper,
            Self::Rearm => Order::Rearm,
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
    let mut was_in_fault = servo.newest()?.is_some_and(|state| state.mode == SERVO_FAULT);
    let receivers = publisher.send(action.order())?;
    if receivers == 0 {
        return Err(ServerError::Unavailable(
            "no process of the running server listens to session commands yet; try again in a second".to_owned(),
        ));
    }
    let deadline = Instant::now() + ANSWER_LIMIT;
    while Instant::now() < deadline {
        std::thread::sleep(ANSWER_LOOK);
        if let Some(report) = reports.newest()?
            && let Some(answer) = report.answer_to(publisher.last_sequence())
        {
            return if answer.is_refused() {
                Err(ServerError::TryAgain(format!(
                    "the session refused the command: {}; try again when that has changed",
                    answer.reason()
                )))
            } else {
                Ok(())
            };
        }
        if action == SessionAction::Rearm
            && let Some(state) = servo.newest()?
        {
            let is_in_fault = state.mode == SERVO_FAULT;
            if was_in_fault && !is_in_fault {
                return Ok(());
            }
            was_in_fault |= is_in_fault;
        }
    }
    Err(ServerError::Unavailable("the running server did not answer; see whether its solver lives".to_owned()))
}
