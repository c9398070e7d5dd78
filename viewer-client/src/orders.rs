//! Commands to the running session, and what became of them.
//!
//! A command goes out as `session_command`; the solver answers it by its sequence in a `wound_report`, a refusal with its reason,
//! and re-arming is seen in `servo_state`, too. One command is under way at a time; re-arming waits for none of them. A solver that
//! was restarted answers nothing that was asked before. The port is opened with the first command: a
//! viewer that only looks takes no sender's place.

use crate::feed::View;
use crate::notice::Notice;
use protocol::ports::{PortNode, SessionCommandPublisher};
pub use protocol::session_command::Order;
use protocol::words;

/// An answer is awaited for this long: going to another scene builds it first.
const PATIENCE_NS: u64 = 10_000_000_000;
/// Servo state machine: fault.
const FAULT: u32 = 5;

/// The control mode that follows the one at work: off, on, paper, off.
#[must_use]
pub fn next_control(view: &View) -> Order {
    match view.report.as_ref().map_or(0, |r| r.control) {
        0 => Order::ControlOn,
        1 => Order::ControlPaper,
        _ => Order::ControlOff,
    }
}

/// A command that waits for its answer.
#[derive(Clone, Copy, Debug)]
struct Pending {
    order: Order,
    sequence: u64,
    sent_ns: u64,
}

/// The command port of one viewer.
#[derive(Debug, Default)]
pub struct Orders {
    publisher: Option<SessionCommandPublisher>,
    pending: Option<Pending>,
    /// The servo obeys it, whatever the solver does.
    rearm: Option<Pending>,
    /// Solver steps of the newest report.
    steps: u64,
}

impl Orders {
    /// Sends a command; the notice says what stands in the way, if anything does.
    pub fn send(&mut self, node: &PortNode, order: Order, view: &View, now_ns: u64) -> Option<Notice> {
        if let Some(obstacle) = self.obstacle(order, view) {
            return Some(obstacle);
        }
        match self.publish(node, order) {
            Ok((0, _)) => Some(Notice::bad(format!(
                "{}: no process of the server listens yet; try again in a second",
                order.name()
            ))),
            Ok((_, sequence)) => {
                self.slot(order).replace(Pending { order, sequence, sent_ns: now_ns });
                None
            }
            Err(reason) => Some(Notice::bad(format!("{}: {reason}", order.name()))),
        }
    }

    /// Looks for the answer.
    pub fn look(&mut self, view: &View, now_ns: u64) -> Option<Notice> {
        let steps = view.report.as_ref().map_or(self.steps, |report| report.solver_steps);
        let is_restarted = steps < std::mem::replace(&mut self.steps, steps);
        let answered = [&mut self.rearm, &mut self.pending].into_iter().find_map(|slot| {
            let notice = judge(slot.as_ref()?, view, now_ns)?;
            *slot = None;
            Some(notice)
        });
        if is_restarted && let Some(lost) = self.pending.take() {
            return Some(Notice::bad(format!("{}: the solver restarted, ask again", lost.order.name())));
        }
        answered
    }

    fn slot(&mut self, order: Order) -> &mut Option<Pending> {
        if order == Order::Rearm { &mut self.rearm } else { &mut self.pending }
    }

    fn obstacle(&self, order: Order, view: &View) -> Option<Notice> {
        if order != Order::Rearm
            && let Some(pending) = &self.pending
        {
            return Some(Notice::note(format!("{}: {} is still under way", order.name(), pending.order.name())));
        }
        let faulty = view.servo.as_ref().is_some_and(|s| s.mode == FAULT);
        (order == Order::Rearm && !faulty).then(|| Notice::note("re-arm: there is no fault to re-arm after"))
    }

    fn publish(&mut self, node: &PortNode, order: Order) -> Result<(usize, u64), String> {
        let publisher = match &mut self.publisher {
            Some(publisher) => publisher,
            none => none.insert(SessionCommandPublisher::open(node).map_err(|e| e.to_string())?),
        };
        let receivers = publisher.send(order).map_err(|e| e.to_string())?;
        Ok((receivers, publisher.last_sequence()))
    }
}

/// What became of a command by now; `None` while it is open.
fn judge(pending: &Pending, view: &View, now_ns: u64) -> Option<Notice> {
    let name = pending.order.name();
    if pending.order == Order::Rearm {
        let after = view.servo.as_ref().filter(|s| s.header.time_ns > pending.sent_ns && s.mode != FAULT);
        if let Some(servo) = after {
            return Some(Notice::good(format!("{name}: done, the servo is in state {}", words::mode(servo.mode))));
        }
    }
    if let Some(answer) = view.report.as_ref().and_then(|r| r.answer_to(pending.sequence)) {
        return Some(match answer.is_refused() {
            true => Notice::bad(format!("{name}: refused, {}", answer.reason())),
            false => Notice::good(format!("{name}: done")),
        });
    }
    (now_ns.saturating_sub(pending.sent_ns) > PATIENCE_NS).then(|| {
        Notice::bad(format!("{name}: no answer within {} s; is the server busy?", PATIENCE_NS / 1_000_000_000))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::notice::Tone;
    use protocol::servo_state::ServoState;
    use protocol::session_command::CommandAnswer;
    use protocol::wire::Field;
    use protocol::wound_report::WoundReport;

    const SENT: Pending = Pending { order: Order::Tie, sequence: 77, sent_ns: 1_000 };

    fn answered(sequence: u64, reason: &str) -> View {
        let mut report = WoundReport::EMPTY;
        report.add_answer(CommandAnswer::new(sequence, 7, Order::Tie.code(), reason));
        report.add_answer(CommandAnswer::new(sequence + 1, 8, Order::Restore.code(), ""));
        View { report: Some(Box::new(report)), ..View::default() }
    }

    #[test]
    fn an_answer_is_matched_by_its_sequence() {
        assert_eq!(judge(&SENT, &answered(75, "no"), 2_000), None);
        assert_eq!(judge(&SENT, &answered(77, ""), 2_000).map(|n| n.tone), Some(Tone::Good));
        let refused = judge(&SENT, &answered(77, "the gap is still open"), 2_000).expect("an answer");
        assert!(refused.tone == Tone::Bad && refused.text.contains("gap"), "{refused:?}");
    }

    #[test]
    fn silence_ends_in_a_sentence() {
        assert_eq!(judge(&SENT, &View::default(), PATIENCE_NS), None);
        let late = judge(&SENT, &View::default(), PATIENCE_NS + 1_001).expect("a sentence");
        assert!(late.text.contains("no answer"), "{late:?}");
    }

    #[test]
    fn re_arming_is_seen_in_the_servo_and_asked_only_after_a_fault() {
        let pending = Pending { order: Order::Rearm, ..SENT };
        let mut servo = ServoState { mode: FAULT, ..ServoState::EMPTY };
        servo.header.time_ns = 2_000;
        let faulty = View { servo: Some(servo), ..View::default() };
        assert_eq!(judge(&pending, &faulty, 3_000), None);
        assert!(Orders::default().obstacle(Order::Rearm, &faulty).is_none());
        servo.mode = 1;
        let well = View { servo: Some(servo), ..View::default() };
        assert!(judge(&pending, &well, 3_000).is_some_and(|n| n.text.contains("monitor")));
        assert!(Orders::default().obstacle(Order::Rearm, &well).is_some());
    }

    #[test]
    fn control_goes_round() {
        let mut view = answered(0, "");
        for (now, expected) in [(0, Order::ControlOn), (1, Order::ControlPaper), (2, Order::ControlOff)] {
            if let Some(report) = &mut view.report {
                report.control = now;
            }
            assert_eq!(next_control(&view), expected);
        }
    }

    #[test]
    fn re_arming_waits_for_nothing() {
        let orders = Orders { pending: Some(SENT), ..Orders::default() };
        let servo = ServoState { mode: FAULT, ..ServoState::EMPTY };
        let view = View { servo: Some(servo), ..View::default() };
        assert!(orders.obstacle(Order::Rearm, &view).is_none());
        assert!(orders.obstacle(Order::Restore, &view).is_some_and(|n| n.text.contains("tie is still under way")));
    }

    #[test]
    fn a_solver_that_was_restarted_lets_everybody_ask_again() {
        let mut orders = Orders { pending: Some(SENT), ..Orders::default() };
        let mut view = answered(0, "");
        for (steps, expected) in [(500, false), (510, false), (3, true), (4, false)] {
            if let Some(report) = &mut view.report {
                report.solver_steps = steps;
            }
            let told = orders.look(&view, 2_000).is_some_and(|n| n.text.contains("the solver restarted, ask again"));
            assert_eq!(told, expected, "{steps}");
        }
        assert!(orders.obstacle(Order::Restore, &view).is_none());
    }
}
