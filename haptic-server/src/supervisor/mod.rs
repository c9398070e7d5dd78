//! `haptic-server run`: the parent of servo, solver and viewer, and the guard of the force.
//!
//! It maps no shared memory, so nothing that damages shared memory can stop it; it holds the lock of the run
//! directory, starts the children, and turns what happens to them into what [`guard::Guard`] decides. One
//! thread, one `poll`. Children die with it (parent-death signal, end of file on the servo's stdin).

pub mod child;
pub mod guard;
mod launch;
pub mod notify;
pub mod signals;

use crate::cli::RunArgs;
use crate::error::ServerError;
use crate::servo_link::{FromServo, LineBuffer, ToServo, to_line};
use crate::standing::Standing;
use crate::summary::RunSummary;
use child::ChildProcess;
use guard::{Action, ChildEnd, Event, Guard, Outcome};
use launch::Plan;
use notify::Notify;
use protocol::run::{Environment, RunDir, RunRoot};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use signals::{Signals, take_count};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// The solver and the viewer have this long to end after SIGTERM: some of their steps; then they are killed.
const CHILD_END_LIMIT: Duration = Duration::from_secs(1);
/// Most that is read from the servo at once, bytes: what a pipe holds.
const READ_CHUNK: usize = 1 << 16;

/// Runs a session live and gives its summary.
///
/// # Errors
/// What refused or ended the run, with its exit code.
pub fn run(args: &RunArgs) -> Result<RunSummary, ServerError> {
    let plan = launch::plan(args)?;
    let root = RunRoot::open(&Environment::of_process())?;
    let active = root.start()?;
    let result = Supervisor::start(args, &plan, active.run()).and_then(Supervisor::watch);
    if let Err(error) = active.finish(&root) {
        tracing::warn!("{error}");
    }
    result
}

struct Supervisor<'a> {
    args: &'a RunArgs,
    plan: &'a Plan,
    run: &'a RunDir,
    signals: Signals,
    guard: Guard,
    notify: Notify,
    began: Instant,
    servo: ChildProcess,
    lines: LineBuffer,
    solver: Option<ChildProcess>,
    viewer: Option<ChildProcess>,
    summary: Option<RunSummary>,
    faults: Vec<String>,
    /// Where the session stood last.
    standing: Standing,
    /// Scene generation with which the last solver began.
    begun_with: u32,
}

impl<'a> Supervisor<'a> {
    fn start(args: &'a RunArgs, plan: &'a Plan, run: &'a RunDir) -> Result<Self, ServerError> {
        let signals = Signals::take_over()?;
        let servo = launch::servo(plan, run)?;
        let duration = args.duration.map(Duration::from_secs_f64);
        Ok(Self {
            args,
            plan,
            run,
            signals,
            guard: Guard::new(Duration::ZERO, duration),
            notify: Notify::of_process(),
            began: Instant::now(),
            servo,
            lines: LineBuffer::default(),
            solver: None,
            viewer: None,
            summary: None,
            faults: Vec::new(),
            standing: Standing::default(),
            begun_with: 0,
        })
    }

    /// Watches until the run is over, then ends what still lives.
    fn watch(mut self) -> Result<RunSummary, ServerError> {
        let outcome = loop {
            if let Some(outcome) = self.guard.outcome() {
                break outcome;
            }
            self.wait_and_handle()?;
        };
        self.notify.stopping();
        self.end_children(outcome)?;
        self.result(outcome)
    }

    fn wait_and_handle(&mut self) -> Result<(), ServerError> {
        let timeout = self.guard.deadline().map(|d| d.saturating_sub(self.began.elapsed()));
        let timeout = timeout.and_then(|t| Timespec::try_from(t).ok());
        let stdout = self.servo.inner().stdout.as_ref();
        let mut fds = vec![
            PollFd::new(&self.signals.interrupt, PollFlags::IN),
            PollFd::new(&self.signals.stop, PollFlags::IN),
            PollFd::new(&self.signals.child, PollFlags::IN),
        ];
        fds.extend(stdout.map(|s| PollFd::new(s, PollFlags::IN)));
        match poll(&mut fds, timeout.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(e) => {
                return Err(ServerError::Internal(format!(
                    "cannot wait for the processes of the run: {e}; start again"
                )));
            }
        }
        let readable = fds.get(3).is_some_and(|f| !f.revents().is_empty());
        drop(fds);
        if readable {
            self.read_servo();
        }
        if take_count(&self.signals.child) > 0 {
            self.reap()?;
        }
        for _ in 0..take_count(&self.signals.interrupt) {
            self.handle(Event::Interrupt);
        }
        if take_count(&self.signals.stop) > 0 {
            self.handle(Event::StopAsked);
        }
        self.handle(Event::Time);
        Ok(())
    }

    /// Reads what the servo has said; its pipe is closed on end of file.
    fn read_servo(&mut self) {
        let mut chunk = [0_u8; READ_CHUNK];
        let Some(stdout) = self.servo.inner().stdout.as_mut() else { return };
        let count = stdout.read(&mut chunk).unwrap_or(0);
        if count == 0 {
            self.servo.inner().stdout = None;
            return;
        }
        let mut messages = Vec::new();
        self.lines.feed(&chunk[..count], |line| match serde_json::from_str::<FromServo>(line) {
            Ok(message) => messages.push(message),
            Err(error) => tracing::warn!("the servo process said something that is not understood: {error}"),
        });
        for message in messages {
            match message {
                FromServo::Ready => {
                    self.handle(Event::ServoReady);
                    self.notify.ready();
                    self.start_viewer();
                }
                FromServo::Heartbeat { ticks } => {
                    self.notify.alive(self.began.elapsed(), ticks);
                    self.handle(Event::Heartbeat { ticks });
                }
                FromServo::Standing(standing) => self.standing = standing,
                FromServo::Fault { what } => {
                    tracing::error!("servo fault: {what}; remove the cause, then `haptic-server session rearm`");
                    self.faults.push(what);
                }
                FromServo::Summary(summary) => self.summary = Some(*summary),
            }
        }
    }

    fn reap(&mut self) -> Result<(), ServerError> {
        if let Some(end) = self.servo.ended()? {
            while self.servo.inner().stdout.is_some() {
                self.read_servo();
            }
            self.handle(Event::ServoEnded(end));
        }
        if let Some(solver) = &mut self.solver
            && let Some(end) = solver.ended()?
        {
            self.solver = None;
            if self.guard.outcome().is_none() {
                tracing::warn!("the deformation solver ended ({})", describe(end));
            }
            self.handle(Event::SolverEnded(end));
        }
        if let Some(viewer) = &mut self.viewer
            && let Some(end) = viewer.ended()?
        {
            self.viewer = None;
            if end != ChildEnd::Exit(0) && self.guard.outcome().is_none() {
                tracing::warn!("the viewer ended ({}); the run goes on without it", describe(end));
            }
        }
        Ok(())
    }

    fn handle(&mut self, event: Event) {
        for action in self.guard.handle(self.began.elapsed(), event) {
            match action {
                Action::Tell(message) => self.tell(&message),
                Action::StartSolver => self.start_solver(),
                Action::KillServo => self.servo.kill(),
            }
        }
    }

    /// A restarted solver begins where the session stands, and in a scene generation of its own.
    fn start_solver(&mut self) {
        let standing = (self.guard.solver_restarts() > 0).then(|| self.standing.for_successor(self.begun_with));
        if let Some(standing) = &standing {
            self.begun_with = standing.scene_generation;
        }
        match launch::solver(self.plan, self.run, standing.as_ref()) {
            Ok(solver) => self.solver = Some(solver),
            Err(error) => {
                tracing::error!("{error}");
                self.handle(Event::SolverEnded(ChildEnd::Exit(i32::from(error.exit_code()))));
            }
        }
    }

    fn tell(&mut self, message: &ToServo) {
        let Some(stdin) = self.servo.inner().stdin.as_mut() else { return };
        let sent = to_line(message).map_err(std::io::Error::from).and_then(|line| stdin.write_all(line.as_bytes()));
        if sent.is_err() {
            // A servo that is dead is noticed by SIGCHLD.
            self.servo.inner().stdin = None;
        }
    }

    fn start_viewer(&mut self) {
        if self.args.viewer {
            match launch::viewer(self.run) {
                Ok(viewer) => self.viewer = Some(viewer),
                Err(error) => tracing::warn!("{error}; the run goes on without a viewer"),
            }
        }
    }

    /// Ends what still lives: at once after a second interrupt, else in order.
    fn end_children(&mut self, outcome: Outcome) -> Result<(), ServerError> {
        for child in [self.solver.take(), self.viewer.take()].into_iter().flatten() {
            match outcome {
                Outcome::Interrupted => drop(child),
                _ => child.end_within(CHILD_END_LIMIT),
            }
        }
        while self.servo.inner().stdout.is_some() && self.servo.ended()?.is_some() {
            self.read_servo();
        }
        Ok(())
    }

    fn result(self, outcome: Outcome) -> Result<RunSummary, ServerError> {
        let internal = |what: String| Err(ServerError::Internal(what));
        match outcome {
            Outcome::Done => {}
            Outcome::Interrupted => return Err(ServerError::Interrupted),
            Outcome::Refused { code } => {
                return Err(ServerError::Reported(u8::try_from(code).unwrap_or(crate::exit::INTERNAL)));
            }
            Outcome::NotReady => {
                return internal(format!(
                    "the servo process was not ready within {} s and was killed; see its messages above",
                    guard::START_LIMIT.as_secs()
                ));
            }
            Outcome::Hung => {
                return internal(format!(
                    "the servo loop stood still for {} s and was killed; the machine is overloaded or the device blocks",
                    guard::HEARTBEAT_LIMIT.as_secs()
                ));
            }
            Outcome::ServoDied(end) => {
                return internal(format!("the servo process died ({}); the run is over, start again", describe(end)));
            }
            Outcome::SolverHopeless => {
                return internal("the deformation solver dies again and again; see its messages above".to_owned());
            }
        }
        let Some(mut summary) = self.summary else {
            return internal("the servo process ended without its report; see its messages above".to_owned());
        };
        summary.scene = self.args.scene.label();
        summary.faults = self.faults;
        Ok(summary.after_solver_restarts(self.guard.solver_restarts()))
    }
}

fn describe(end: ChildEnd) -> String {
    match end {
        ChildEnd::Exit(code) => format!("exit code {code}"),
        ChildEnd::Signal(signal) => format!("signal {signal}"),
    }
}
