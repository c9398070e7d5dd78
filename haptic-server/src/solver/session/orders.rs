//! Session commands: what each asks of the procedure, and the answer that its sender finds in the report.
//!
//! Re-arming is the servo's: its bridge hears the same command. The solver, which sees the servo's state at every step, says
//! what became of it: done when the servo has left Fault since the command was sent, refused when it was in none, and when
//! it is still in one after [`REARM_PATIENCE_NS`], because the cause is still there.
//! Deliberately absent: time of its own; `now_ns` is the clock that the caller has.

use protocol::servo_state::ServoState;
use protocol::session_command::{CommandAnswer, MAX_ANSWERS, Order, SessionCommand};
use sim_core::scene::procedure::SessionRequest;
use sim_core::wound::control::ControlMode;

/// `ServoState::mode`: latched fault.
pub(super) const SERVO_FAULT: u32 = 5;
/// The bridge looks at commands every 7 ms, the servo follows in its next tick: half a second is patience with a loaded machine.
const REARM_PATIENCE_NS: u64 = 500_000_000;

/// Why the procedure does not begin.
pub(super) const START_IN_FAULT: &str = "the servo is in a fault; re-arm it first";
const NO_SERVO: &str = "no servo is heard of";
const NO_FAULT: &str = "the servo is in no fault";
const STILL_IN_FAULT: &str = "the servo is still in its fault; remove the cause first";
const TOO_MANY: &str = "too many re-arm commands are waiting already";

/// What came of a command: why not, as a sentence.
pub(super) type Outcome = Result<(), &'static str>;

/// What a command asks of the procedure; `None`: it is the servo's.
pub(super) fn request_of(code: u32) -> Option<SessionRequest> {
    match Order::of_code(code)? {
        Order::Start => Some(SessionRequest::Start),
        Order::Restore => Some(SessionRequest::Restore),
        Order::Next => Some(SessionRequest::Next),
        Order::Previous => Some(SessionRequest::Previous),
        Order::Tie => Some(SessionRequest::Tie),
        Order::ControlOn => Some(SessionRequest::Control(ControlMode::Sound)),
        Order::ControlOff => Some(SessionRequest::Control(ControlMode::Off)),
        Order::ControlPaper => Some(SessionRequest::Control(ControlMode::Paper)),
        Order::Rearm => None,
    }
}

/// The answer to a command.
pub(super) fn answer(command: &SessionCommand, outcome: Outcome) -> CommandAnswer {
    CommandAnswer::new(command.header.sequence, command.sender, command.command, outcome.err().unwrap_or_default())
}

/// Re-arm commands that wait for the servo.
#[derive(Debug, Default)]
pub(super) struct Rearms {
    /// With the time until which each is waited for.
    waiting: [Option<(SessionCommand, u64)>; MAX_ANSWERS],
    is_in_fault: bool,
    /// When the servo was first seen without the fault that it had before, nanoseconds.
    left_ns: u64,
}

impl Rearms {
    /// Notices that the servo has left a fault.
    pub(super) fn look(&mut self, servo: Option<&ServoState>) {
        let Some(servo) = servo else { return };
        let was = std::mem::replace(&mut self.is_in_fault, servo.mode == SERVO_FAULT);
        if was && !self.is_in_fault {
            self.left_ns = servo.header.time_ns;
        }
    }

    /// The outcome of a command that has just come; `None`: it waits.
    pub(super) fn judge(
        &mut self,
        command: &SessionCommand,
        servo: Option<&ServoState>,
        now_ns: u64,
    ) -> Option<Outcome> {
        if servo.is_none() {
            return Some(Err(NO_SERVO));
        }
        if !self.is_in_fault {
            // The servo may have heard of it first.
            let was_in_fault = command.header.time_ns <= self.left_ns;
            return Some(if was_in_fault { Ok(()) } else { Err(NO_FAULT) });
        }
        let Some(place) = self.waiting.iter_mut().find(|place| place.is_none()) else { return Some(Err(TOO_MANY)) };
        *place = Some((*command, now_ns.saturating_add(REARM_PATIENCE_NS)));
        None
    }

    /// The next command whose outcome has become known.
    pub(super) fn settled(&mut self, now_ns: u64) -> Option<(SessionCommand, Outcome)> {
        let in_fault = self.is_in_fault;
        let is_known = |place: &&mut Option<(SessionCommand, u64)>| {
            place.is_some_and(|(_, until_ns)| !in_fault || now_ns >= until_ns)
        };
        let (command, _) = self.waiting.iter_mut().find(is_known)?.take()?;
        Some((command, if in_fault { Err(STILL_IN_FAULT) } else { Ok(()) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::wire::{Field, Message};

    const ACTIVE: u32 = 4;

    fn servo(mode: u32, time_ns: u64) -> ServoState {
        let mut state = ServoState { mode, ..ServoState::EMPTY };
        state.stamp(1, time_ns);
        state
    }

    fn rearm(sequence: u64, time_ns: u64) -> SessionCommand {
        let mut command = SessionCommand { command: Order::Rearm.code(), ..SessionCommand::EMPTY };
        command.stamp(sequence, time_ns);
        command
    }

    #[test]
    fn it_is_done_when_the_servo_leaves_its_fault_and_refused_when_it_does_not() {
        let mut rearms = Rearms::default();
        let fault = servo(SERVO_FAULT, 10);
        rearms.look(Some(&fault));
        assert_eq!(rearms.judge(&rearm(1, 11), Some(&fault), 12), None);
        assert_eq!(rearms.judge(&rearm(2, 11), Some(&fault), 12), None);
        assert_eq!(rearms.settled(13), None);
        rearms.look(Some(&servo(1, 20)));
        let settled: Vec<_> = std::iter::from_fn(|| rearms.settled(21)).collect();
        assert_eq!(
            settled.iter().map(|(c, o)| (c.header.sequence, *o)).collect::<Vec<_>>(),
            [(1, Ok(())), (2, Ok(()))]
        );
        rearms.look(Some(&fault));
        assert_eq!(rearms.judge(&rearm(3, 30), Some(&fault), 30), None);
        assert_eq!(rearms.settled(30 + REARM_PATIENCE_NS - 1), None);
        assert_eq!(rearms.settled(30 + REARM_PATIENCE_NS).map(|(_, o)| o), Some(Err(STILL_IN_FAULT)));
        assert_eq!(rearms.settled(u64::MAX), None);
    }

    #[test]
    fn a_servo_that_was_faster_than_the_solver_has_followed_it_all_the_same() {
        let mut rearms = Rearms::default();
        rearms.look(Some(&servo(SERVO_FAULT, 10)));
        let clear = servo(1, 20);
        rearms.look(Some(&clear));
        assert_eq!(rearms.judge(&rearm(1, 15), Some(&clear), 21), Some(Ok(())));
        assert_eq!(rearms.judge(&rearm(2, 25), Some(&clear), 26), Some(Err(NO_FAULT)));
    }

    #[test]
    fn without_fault_or_servo_there_is_nothing_to_re_arm_and_the_room_has_an_end() {
        let mut rearms = Rearms::default();
        assert_eq!(rearms.judge(&rearm(1, 5), None, 6), Some(Err(NO_SERVO)));
        let active = servo(ACTIVE, 7);
        rearms.look(Some(&active));
        assert_eq!(rearms.judge(&rearm(2, 8), Some(&active), 8), Some(Err(NO_FAULT)));
        let fault = servo(SERVO_FAULT, 9);
        rearms.look(Some(&fault));
        let outcomes: Vec<_> = (0..=MAX_ANSWERS as u64).map(|n| rearms.judge(&rearm(n, 9), Some(&fault), 9)).collect();
        assert!(outcomes[..MAX_ANSWERS].iter().all(Option::is_none));
        assert_eq!(outcomes[MAX_ANSWERS], Some(Err(TOO_MANY)));
    }

    #[test]
    fn every_code_of_the_wire_but_re_arm_asks_the_procedure_for_something() {
        for order in Order::ALL {
            assert_eq!(request_of(order.code()).is_none(), order == Order::Rearm, "{order:?}");
        }
    }
}
