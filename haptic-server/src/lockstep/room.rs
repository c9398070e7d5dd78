//! The servo room on a virtual clock: every tick takes exactly one period, the solver steps at its own rate between
//! ticks, and its port arrives a stated number of ticks later. Nothing waits, so equal inputs give equal bits.

use crate::device::{DeviceCommand, DeviceSample, HandView, ServoRoom, TickTime};
use crate::servo::clock::Wakefulness;
use crate::servo::params::ServoParams;
use crate::servo::state_machine::Mode;
use crate::servo::tick::{Orders, Rights, Servo, StopOrder, TickInput};
use crate::solver::session::SolverSession;
use protocol::servo_state::ServoState;
use protocol::tissue_port::TissuePort;
use protocol::wire::Message;
use std::collections::VecDeque;

/// A port computed at tick `n` reaches the servo at tick `n + PORT_DELAY_TICKS`: the live solver needs less than a
/// period for a step, and the bridge less than half of one.
const PORT_DELAY_TICKS: u64 = 1;
/// The virtual clock starts here: zero would look like a message that was never stamped.
const START_NS: u64 = 1_000_000_000;

/// Who looks at every tick.
pub(super) trait TickWatch {
    /// Called after each tick with the time since the start.
    fn watch(&mut self, time_s: f64, state: &ServoState, session: &SolverSession);
}

/// When a lockstep run ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// After this many ticks at the latest.
    pub(super) ticks: u64,
    /// Also as soon as the procedure is finished.
    pub(super) when_finished: bool,
}

/// Servo and solver in one process.
pub(super) struct LockstepRoom<'a> {
    servo: Servo,
    session: &'a mut SolverSession,
    watch: &'a mut dyn TickWatch,
    end: End,
    period_ns: u64,
    period_s: f64,
    tick: u64,
    next_step_ns: u64,
    port_sequence: u64,
    pending: VecDeque<(u64, TissuePort)>,
    stop: StopOrder,
}

impl<'a> LockstepRoom<'a> {
    pub(super) fn new(
        params: &ServoParams,
        session: &'a mut SolverSession,
        watch: &'a mut dyn TickWatch,
        end: End,
    ) -> Self {
        Self {
            servo: Servo::new(params, Rights::Full),
            session,
            watch,
            end,
            period_ns: params.period_ns(),
            period_s: params.period_ns() as f64 * 1e-9,
            tick: 0,
            next_step_ns: START_NS,
            port_sequence: 0,
            pending: VecDeque::new(),
            stop: StopOrder::GoOn,
        }
    }

    /// The servo after the run.
    pub(super) fn into_servo(self) -> Servo {
        self.servo
    }

    fn now_ns(&self) -> u64 {
        START_NS + self.tick * self.period_ns
    }

    /// Steps the solver while its next step is due; slower servo rates may owe several.
    fn step_solver(&mut self) {
        let now = self.now_ns();
        while self.next_step_ns <= now {
            let state = (self.tick > 0).then(|| *self.servo.state());
            self.session.step(state.as_ref(), None, now);
            self.port_sequence += 1;
            let mut port = *self.session.port();
            port.publish_ns = now;
            port.stamp(self.port_sequence, now);
            self.pending.push_back((self.tick + PORT_DELAY_TICKS, port));
            self.next_step_ns += (self.session.period_s() * 1e9).round() as u64;
        }
    }

    /// The newest port that has arrived.
    fn due_port(&mut self) -> Option<TissuePort> {
        let mut newest = None;
        while self.pending.front().is_some_and(|(tick, _)| *tick <= self.tick) {
            newest = self.pending.pop_front().map(|(_, port)| port);
        }
        newest
    }
}

impl ServoRoom for LockstepRoom<'_> {
    fn wait(&mut self) -> Option<TickTime> {
        let finished = self.end.when_finished && self.session.finished();
        if self.tick >= self.end.ticks || finished {
            self.stop = StopOrder::Stop;
        }
        if self.servo.is_stopped() {
            return None;
        }
        self.step_solver();
        let now_ns = self.now_ns();
        Some(TickTime { scheduled_ns: now_ns, now_ns, dt_s: self.period_s })
    }

    /// The virtual clock is the room's, whoever calls.
    fn begin(&mut self, _late_ns: u64) -> Option<TickTime> {
        self.wait()
    }

    fn view(&self) -> HandView {
        self.servo.view()
    }

    fn is_latched(&self) -> bool {
        self.servo.mode() == Mode::Fault
    }

    fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        self.servo.tick_second(time, sample)
    }

    fn tick(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        let port = self.due_port();
        let orders = Orders { stop: self.stop, ..Orders::default() };
        let output = self.servo.tick(&TickInput {
            time,
            sample,
            new_port: port.as_ref(),
            orders,
            wakefulness: Wakefulness::Awake,
        });
        let since_start_s = self.tick as f64 * self.period_s;
        self.watch.watch(since_start_s, self.servo.state(), self.session);
        self.tick += 1;
        output.command
    }
}
