//! The supervisor's decisions, without processes and without a clock: events in, actions out.
//!
//! ```text
//! Starting ──ready──▶ Running ──stop, duration over, trace over──▶ Stopping ──servo ended──▶ Ended
//!     └──no ready in time──▶ Ended ◀──heartbeat missing, servo dead, solver hopeless──┘
//! ```
//! A dead solver is told to the servo first and started again after a delay that doubles with each quick
//! death. Sources: libfranka (bounded loss, then stop), JACK (the server outlives its clients).

use crate::exit;
use crate::servo_link::ToServo;
use std::time::Duration;

/// The servo must report ready within this: device and shared memory take a second; a machine that swaps takes ten.
pub const START_LIMIT: Duration = Duration::from_secs(30);
/// A servo whose tick counter stands still for this long is killed. A machine without real-time rights
/// under load stalls for tenths of a second, so the limit is far above that.
pub const HEARTBEAT_LIMIT: Duration = Duration::from_secs(2);
/// After the stop request the servo has this long to ramp (50 ms), end its recording, report and end.
pub const STOP_LIMIT: Duration = Duration::from_secs(3);
/// Delay before a dead solver is started again, first time: the next one loads while the force still fades.
pub const RESTART_DELAY: Duration = Duration::from_millis(50);
/// Longest such delay: a person who waits for the tissue to come back notices no more than this.
pub const RESTART_DELAY_MAX: Duration = Duration::from_secs(1);
/// A solver that lived this long died of something new (loading takes less than a second): the delay starts over.
pub const QUICK_DEATH: Duration = Duration::from_secs(2);
/// After so many quick deaths in a row, some 15 s of trying, the solver is given up.
pub const QUICK_DEATHS_MAX: u32 = 20;

/// How a child ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildEnd {
    /// By itself, with this exit code.
    Exit(i32),
    /// By this signal.
    Signal(i32),
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The servo said ready.
    ServoReady,
    /// The servo said how many ticks it has done.
    Heartbeat {
        /// Ticks executed so far.
        ticks: u64,
    },
    /// The servo process is gone.
    ServoEnded(ChildEnd),
    /// The solver process is gone.
    SolverEnded(ChildEnd),
    /// Someone asked for the end (terminate, hang-up); asking again changes nothing.
    StopAsked,
    /// A person interrupted; the second time means at once.
    Interrupt,
    /// Only time has passed.
    Time,
}

/// What the supervisor must do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Send this line to the servo.
    Tell(ToServo),
    /// Start the solver.
    StartSolver,
    /// Kill the servo at once.
    KillServo,
}

/// Why the run is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// In order.
    Done,
    /// A second interrupt.
    Interrupted,
    /// A child refused its work and said why.
    Refused {
        /// Its exit code.
        code: i32,
    },
    /// The servo did not become ready.
    NotReady,
    /// The servo's ticks stood still.
    Hung,
    /// The servo process died.
    ServoDied(ChildEnd),
    /// The solver dies again and again.
    SolverHopeless,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Starting { since: Duration },
    Running { since: Duration },
    Stopping { since: Duration, because: Outcome },
    Ended(Outcome),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Solver {
    NotStarted,
    Up { since: Duration },
    Waiting { until: Duration },
    Over,
}

/// State of the supervision.
#[derive(Clone, Debug)]
pub struct Guard {
    stage: Stage,
    solver: Solver,
    duration: Option<Duration>,
    ticks: u64,
    ticks_moved: Duration,
    quick_deaths: u32,
    restarts: u32,
    interrupts: u32,
}

impl Guard {
    /// A run that starts at `now` and ends `duration` after the servo is ready.
    #[must_use]
    pub fn new(now: Duration, duration: Option<Duration>) -> Self {
        Self {
            stage: Stage::Starting { since: now },
            solver: Solver::NotStarted,
            duration,
            ticks: 0,
            ticks_moved: now,
            quick_deaths: 0,
            restarts: 0,
            interrupts: 0,
        }
    }

    /// Why the run is over, once it is.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        match self.stage {
            Stage::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Times the solver was started again.
    #[must_use]
    pub fn solver_restarts(&self) -> u32 {
        self.restarts
    }

    /// Latest time at which [`Event::Time`] must be given.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        let stage = match self.stage {
            Stage::Starting { since } => Some(since + START_LIMIT),
            Stage::Running { since } => {
                let hung = self.ticks_moved + HEARTBEAT_LIMIT;
                Some(self.duration.map_or(hung, |d| hung.min(since + d)))
            }
            Stage::Stopping { since, .. } => Some(since + STOP_LIMIT),
            Stage::Ended(_) => None,
        };
        match (self.solver, stage) {
            (Solver::Waiting { until }, Some(stage)) => Some(stage.min(until)),
            _ => stage,
        }
    }

    /// Takes an event in and says what to do.
    pub fn handle(&mut self, now: Duration, event: Event) -> Vec<Action> {
        match (self.stage, event) {
            (Stage::Ended(_), _) => Vec::new(),
            (Stage::Starting { .. }, Event::ServoReady) => {
                self.stage = Stage::Running { since: now };
                self.ticks_moved = now;
                self.solver = Solver::Up { since: now };
                vec![Action::StartSolver, Action::Tell(ToServo::SolverUp)]
            }
            (_, Event::ServoReady) => Vec::new(),
            (_, Event::Heartbeat { ticks }) => {
                if ticks != self.ticks {
                    (self.ticks, self.ticks_moved) = (ticks, now);
                }
                self.on_time(now)
            }
            (stage, Event::ServoEnded(end)) => {
                self.stage = Stage::Ended(servo_end(stage, end));
                Vec::new()
            }
            (_, Event::SolverEnded(end)) => self.on_solver_end(now, end),
            (_, Event::Interrupt) if self.interrupts > 0 => self.kill(Outcome::Interrupted),
            (stage, Event::Interrupt) => {
                self.interrupts = 1;
                if matches!(stage, Stage::Stopping { .. }) { Vec::new() } else { self.stop(now, Outcome::Done) }
            }
            (Stage::Stopping { .. }, Event::StopAsked) => Vec::new(),
            (_, Event::StopAsked) => self.stop(now, Outcome::Done),
            (_, Event::Time) => self.on_time(now),
        }
    }

    fn on_time(&mut self, now: Duration) -> Vec<Action> {
        match self.stage {
            Stage::Starting { since } if now >= since + START_LIMIT => self.kill(Outcome::NotReady),
            Stage::Running { .. } if now >= self.ticks_moved + HEARTBEAT_LIMIT => self.kill(Outcome::Hung),
            Stage::Running { since } if self.duration.is_some_and(|d| now >= since + d) => {
                self.stop(now, Outcome::Done)
            }
            Stage::Stopping { since, .. } if now >= since + STOP_LIMIT => self.kill(Outcome::Hung),
            Stage::Running { .. } => self.restart_if_due(now),
            _ => Vec::new(),
        }
    }

    fn restart_if_due(&mut self, now: Duration) -> Vec<Action> {
        match self.solver {
            Solver::Waiting { until } if now >= until => {
                self.restarts += 1;
                self.solver = Solver::Up { since: now };
                vec![Action::StartSolver, Action::Tell(ToServo::SolverUp)]
            }
            _ => Vec::new(),
        }
    }

    fn on_solver_end(&mut self, now: Duration, end: ChildEnd) -> Vec<Action> {
        let Solver::Up { since } = self.solver else { return Vec::new() };
        self.solver = Solver::Over;
        if !matches!(self.stage, Stage::Running { .. }) {
            return Vec::new();
        }
        let mut actions = vec![Action::Tell(ToServo::SolverDied)];
        if let ChildEnd::Exit(code) = end
            && is_refusal(code)
        {
            actions.extend(self.stop(now, Outcome::Refused { code }));
            return actions;
        }
        self.quick_deaths = if now.saturating_sub(since) < QUICK_DEATH { self.quick_deaths + 1 } else { 0 };
        if self.quick_deaths > QUICK_DEATHS_MAX {
            actions.extend(self.stop(now, Outcome::SolverHopeless));
        } else {
            let delay = RESTART_DELAY * 2_u32.saturating_pow(self.quick_deaths.saturating_sub(1));
            self.solver = Solver::Waiting { until: now + delay.min(RESTART_DELAY_MAX) };
        }
        actions
    }

    fn stop(&mut self, now: Duration, because: Outcome) -> Vec<Action> {
        self.stage = Stage::Stopping { since: now, because };
        vec![Action::Tell(ToServo::Stop)]
    }

    fn kill(&mut self, because: Outcome) -> Vec<Action> {
        self.stage = Stage::Ended(because);
        vec![Action::KillServo]
    }
}

/// What the end of the servo process means at this stage.
fn servo_end(stage: Stage, end: ChildEnd) -> Outcome {
    match (stage, end) {
        (Stage::Stopping { because, .. }, ChildEnd::Exit(0)) => because,
        (_, ChildEnd::Exit(0)) => Outcome::Done,
        (_, ChildEnd::Exit(code)) if is_refusal(code) => Outcome::Refused { code },
        (_, end) => Outcome::ServoDied(end),
    }
}

/// Exit codes by which a child says that another try gives the same result.
fn is_refusal(code: i32) -> bool {
    u8::try_from(code).is_ok_and(|c| {
        matches!(
            c,
            exit::USAGE | exit::BAD_DATA | exit::NO_INPUT | exit::UNAVAILABLE | exit::PERMISSION | exit::CONFIGURATION
        )
    })
}

#[cfg(test)]
mod tests;
