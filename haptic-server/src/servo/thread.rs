//! The room on the servo thread: the only file that knows the clock, the device's samples and the ports.
//!
//! [`LiveRoom`] sleeps to an absolute time (`clock_nanosleep`, `TIMER_ABSTIME`; EINTR sleeps on), optionally spins the last
//! microseconds, takes the newest tissue port out of its cell, ticks, publishes `servo_state`, and pushes the tick record
//! and its events into rings. A device that owns its clock calls [`ServoRoom::tick`] without [`ServoRoom::wait`].
//! Cell (triple buffer) and rings (one writer, one reader) are wait-free: no thread that loses its processor in the middle of
//! a transfer delays a tick.
//! Deliberately absent: everything that can wait; subscribing, recording, logging and stopping the process live elsewhere.

use crate::device::{DeviceCommand, DeviceSample, HandView, ServoRoom, TickTime};
use crate::servo::clock::{Schedule, SuspendWatch};
use crate::servo::flight_recorder::TickRecord;
use crate::servo::params::{ServoParams, to_ns};
use crate::servo::state_machine::Mode;
use crate::servo::stats::{ServoStats, TickTimes};
use crate::servo::tick::{Orders, Servo, StopOrder, TickInput};
use crate::servo_setup::RoomEnds;
use protocol::servo_state::ServoState;
use rustix::thread::ClockId as SleepClock;
use rustix::time::{ClockId, Timespec};
use std::sync::atomic::Ordering;

/// The servo against the wall clock. `sink` publishes `servo_state`: no heap, no lock, no system call.
pub struct LiveRoom<S> {
    servo: Servo,
    ends: RoomEnds,
    sink: S,
    stats: ServoStats,
    schedule: Option<Schedule>,
    suspend: SuspendWatch,
    period_ns: u64,
    spin_ns: u64,
    last_now_ns: Option<u64>,
}

impl<S: FnMut(&mut ServoState)> LiveRoom<S> {
    /// A room that has not waited yet.
    #[must_use]
    pub fn new(servo: Servo, params: &ServoParams, ends: RoomEnds, sink: S, stats: ServoStats) -> Self {
        Self {
            servo,
            ends,
            sink,
            stats,
            schedule: None,
            suspend: SuspendWatch::default(),
            period_ns: params.period_ns(),
            spin_ns: to_ns(params.rhythm.spin_s),
            last_now_ns: None,
        }
    }

    /// The servo after the loop has ended, and what it measured.
    #[must_use]
    pub fn finish(self) -> (Servo, ServoStats) {
        (self.servo, self.stats)
    }

    /// Time of a tick that was due at `scheduled_ns` and runs now; for devices that own the clock, too.
    pub fn tick_time(&mut self, scheduled_ns: u64) -> TickTime {
        let now_ns = monotonic_ns();
        let last_ns = self.last_now_ns.replace(now_ns).unwrap_or(now_ns.saturating_sub(self.period_ns));
        TickTime { scheduled_ns, now_ns, dt_s: now_ns.saturating_sub(last_ns) as f64 * 1e-9 }
    }

    fn orders(&self) -> Orders {
        let links = self.ends.links();
        let is_stop = links.stop.load(Ordering::Relaxed);
        Orders {
            solver_deaths: links.solver_deaths.load(Ordering::Relaxed),
            rearms: links.rearms.load(Ordering::Relaxed),
            stop: if is_stop { StopOrder::Stop } else { StopOrder::GoOn },
        }
    }
}

impl<S: FnMut(&mut ServoState)> ServoRoom for LiveRoom<S> {
    fn wait(&mut self) -> Option<TickTime> {
        if self.servo.is_stopped() {
            return None;
        }
        let now_ns = monotonic_ns();
        let schedule =
            self.schedule.get_or_insert(Schedule::starting(now_ns.saturating_sub(self.period_ns), self.period_ns));
        schedule.advance(now_ns);
        let due_ns = schedule.next_ns();
        sleep_until(due_ns.saturating_sub(self.spin_ns));
        while self.spin_ns > 0 && monotonic_ns() < due_ns {
            std::hint::spin_loop();
        }
        Some(self.tick_time(due_ns))
    }

    fn begin(&mut self, late_ns: u64) -> Option<TickTime> {
        if self.servo.is_stopped() {
            return None;
        }
        Some(self.tick_time(monotonic_ns().saturating_sub(late_ns)))
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
        let orders = self.orders();
        let wakefulness = self.suspend.measure(clock_ns(ClockId::Boottime), monotonic_ns());
        let new_port = if self.ends.ports.update() { Some(self.ends.ports.output_buffer()) } else { None };
        let input = TickInput { time, sample, new_port, orders, wakefulness };
        let output = self.servo.tick(&input);

        let mut record = TickRecord {
            state: *self.servo.state(),
            scheduled_ns: time.scheduled_ns,
            now_ns: time.now_ns,
            dt_s: time.dt_s,
            compute_ns: 0,
            clips: output.clips,
        };
        (self.sink)(&mut record.state);
        let done_ns = monotonic_ns();
        record.compute_ns = done_ns.saturating_sub(time.now_ns);
        let has_port = record.state.port_sequence > 0;
        let times = TickTimes {
            wake_ns: time.now_ns.saturating_sub(time.scheduled_ns),
            compute_ns: record.compute_ns,
            port_age_ns: has_port.then_some(record.state.port_age_ns),
            sample_to_force_ns: done_ns.saturating_sub(sample.time_ns),
        };
        self.stats.measure(&times, output.command.force_n);
        self.ends.hand_out(&record, &output.events);
        output.command
    }
}

/// `CLOCK_MONOTONIC`, nanoseconds.
fn monotonic_ns() -> u64 {
    clock_ns(ClockId::Monotonic)
}

#[expect(clippy::disallowed_methods, reason = "the servo thread's clock: a vDSO read, no system call")]
fn clock_ns(clock: ClockId) -> u64 {
    let now = rustix::time::clock_gettime(clock);
    u64::try_from(now.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(now.tv_nsec).unwrap_or(0)
}

/// Sleeps to an absolute time; a signal does not shorten the sleep, any other error ends it.
#[expect(clippy::disallowed_methods, reason = "the servo thread's only sleep")]
fn sleep_until(due_ns: u64) {
    let due = Timespec {
        tv_sec: i64::try_from(due_ns / 1_000_000_000).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(due_ns % 1_000_000_000).unwrap_or(0),
    };
    while rustix::thread::clock_nanosleep_absolute(SleepClock::Monotonic, &due) == Err(rustix::io::Errno::INTR) {}
}
