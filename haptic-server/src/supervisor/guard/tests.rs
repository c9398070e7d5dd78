//! Tests of the supervisor's decisions against a clock made of numbers.

use super::*;

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn running(duration: Option<Duration>) -> Guard {
    let mut guard = Guard::new(ms(0), duration);
    let actions = guard.handle(ms(100), Event::ServoReady);
    assert_eq!(actions, [Action::StartSolver, Action::Tell(ToServo::SolverUp)]);
    guard
}

#[test]
fn the_duration_counts_from_ready() {
    let mut guard = running(Some(ms(1000)));
    assert_eq!(guard.deadline(), Some(ms(1100)));
    assert!(guard.handle(ms(1099), Event::Heartbeat { ticks: 900 }).is_empty());
    assert_eq!(guard.handle(ms(1100), Event::Time), [Action::Tell(ToServo::Stop)]);
    assert!(guard.handle(ms(1160), Event::ServoEnded(ChildEnd::Exit(0))).is_empty());
    assert_eq!(guard.outcome(), Some(Outcome::Done));
}

#[test]
fn a_dead_solver_is_told_at_once_and_started_again_after_the_delay() {
    let mut guard = running(None);
    let now = ms(5000);
    guard.handle(now, Event::Heartbeat { ticks: 1 });
    assert_eq!(guard.handle(now, Event::SolverEnded(ChildEnd::Signal(9))), [Action::Tell(ToServo::SolverDied)]);
    assert_eq!(guard.deadline(), Some(now + RESTART_DELAY));
    assert!(guard.handle(now + RESTART_DELAY - ms(1), Event::Time).is_empty());
    let again = guard.handle(now + RESTART_DELAY, Event::Time);
    assert_eq!(again, [Action::StartSolver, Action::Tell(ToServo::SolverUp)]);
    assert_eq!(guard.solver_restarts(), 1);
}

#[test]
fn a_solver_killed_a_hundred_times_is_started_a_hundred_times() {
    let mut guard = running(None);
    let mut now = ms(100);
    for n in 0..100_u64 {
        for half in 0..2 {
            now += QUICK_DEATH / 2;
            guard.handle(now, Event::Heartbeat { ticks: 2 * n + half });
        }
        guard.handle(now, Event::SolverEnded(ChildEnd::Signal(9)));
        now += RESTART_DELAY;
        assert_eq!(guard.handle(now, Event::Time).first(), Some(&Action::StartSolver));
    }
    assert_eq!(guard.solver_restarts(), 100);
}

#[test]
fn quick_deaths_double_the_delay_up_to_a_bound_and_end_in_giving_up() {
    let mut guard = running(None);
    let mut now = ms(100);
    let mut delays = Vec::new();
    let last = loop {
        guard.handle(now, Event::Heartbeat { ticks: now.as_millis() as u64 });
        let actions = guard.handle(now, Event::SolverEnded(ChildEnd::Exit(101)));
        if actions.len() > 1 {
            break actions;
        }
        let next = guard.deadline().expect("waits");
        delays.push(next - now);
        now = next;
        assert_eq!(guard.handle(now, Event::Time).first(), Some(&Action::StartSolver));
    };
    assert_eq!(last, [Action::Tell(ToServo::SolverDied), Action::Tell(ToServo::Stop)]);
    assert_eq!(delays[..3], [ms(50), ms(100), ms(200)]);
    assert_eq!(delays.iter().max(), Some(&RESTART_DELAY_MAX));
    assert_eq!(delays.len(), QUICK_DEATHS_MAX as usize);
    guard.handle(now, Event::ServoEnded(ChildEnd::Exit(0)));
    assert_eq!(guard.outcome(), Some(Outcome::SolverHopeless));
}

#[test]
fn a_solver_that_refuses_its_scene_is_not_started_again() {
    let mut guard = running(None);
    guard.handle(ms(200), Event::SolverEnded(ChildEnd::Exit(65)));
    guard.handle(ms(260), Event::ServoEnded(ChildEnd::Exit(0)));
    assert_eq!(guard.outcome(), Some(Outcome::Refused { code: 65 }));
    assert_eq!(guard.solver_restarts(), 0);
}

#[test]
fn standing_ticks_kill_the_servo_even_while_heartbeats_arrive() {
    let mut guard = running(None);
    assert!(guard.handle(ms(200), Event::Heartbeat { ticks: 50 }).is_empty());
    assert!(guard.handle(ms(1000), Event::Heartbeat { ticks: 50 }).is_empty());
    assert_eq!(guard.handle(ms(200) + HEARTBEAT_LIMIT, Event::Heartbeat { ticks: 50 }), [Action::KillServo]);
    assert_eq!(guard.outcome(), Some(Outcome::Hung));
}

#[test]
fn a_servo_that_never_gets_ready_is_killed() {
    let mut guard = Guard::new(ms(0), Some(ms(1)));
    assert!(guard.handle(START_LIMIT - ms(1), Event::Time).is_empty());
    assert_eq!(guard.handle(START_LIMIT, Event::Time), [Action::KillServo]);
    assert_eq!(guard.outcome(), Some(Outcome::NotReady));
}

#[test]
fn one_interrupt_ends_in_order_and_two_at_once() {
    let mut guard = running(None);
    assert_eq!(guard.handle(ms(300), Event::Interrupt), [Action::Tell(ToServo::Stop)]);
    assert!(guard.handle(ms(305), Event::StopAsked).is_empty());
    assert!(guard.handle(ms(310), Event::SolverEnded(ChildEnd::Exit(0))).is_empty());
    let mut twice = guard.clone();
    guard.handle(ms(350), Event::ServoEnded(ChildEnd::Exit(0)));
    assert_eq!(guard.outcome(), Some(Outcome::Done));
    assert_eq!(twice.handle(ms(320), Event::Interrupt), [Action::KillServo]);
    assert_eq!(twice.outcome(), Some(Outcome::Interrupted));
}

#[test]
fn a_servo_that_does_not_stop_is_killed() {
    let mut guard = running(None);
    guard.handle(ms(300), Event::StopAsked);
    assert_eq!(guard.handle(ms(300) + STOP_LIMIT, Event::Time), [Action::KillServo]);
}

#[test]
fn a_killed_servo_is_a_fault_and_a_finished_trace_is_not() {
    let mut guard = running(None);
    let mut finished = guard.clone();
    guard.handle(ms(300), Event::ServoEnded(ChildEnd::Signal(9)));
    assert_eq!(guard.outcome(), Some(Outcome::ServoDied(ChildEnd::Signal(9))));
    finished.handle(ms(300), Event::ServoEnded(ChildEnd::Exit(0)));
    assert_eq!(finished.outcome(), Some(Outcome::Done));
}
