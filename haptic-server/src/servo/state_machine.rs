//! The way into rendering and out of it: Init → Monitor → Armed → Ramp → Active, and Fault from anywhere.
//!
//! Monitor renders nothing and waits for a good link; Armed waits until the wanted force is small; Ramp raises the gain
//! from 0 to 1; Active renders. A lost link leads back to Monitor, so that coming back always passes Ramp.
//! Fault is latched: only an explicit order of the operator leads out of it, and only to Monitor.
//! Codes as in `servo_state`: 0 init, 1 monitor, 2 armed, 3 ramp, 4 active, 5 fault.
//! Deliberately absent: what counts as a good link (ladder) and how a force fades (safety).

use crate::servo::params::RhythmParams;

/// State of the servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// No sample yet.
    Init,
    /// Zero force, watching.
    Monitor,
    /// Zero force, waiting for a small wanted force.
    Armed,
    /// Force rising.
    Ramp,
    /// Full force.
    Active,
    /// Zero force until re-armed.
    Fault,
}

impl Mode {
    /// Code on the wire.
    #[must_use]
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["init", "monitor", "armed", "ramp", "active", "fault"][self as usize]
    }
}

/// Why the servo stopped rendering for good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ServoFault {
    /// The device is gone.
    DeviceLost = 1,
    /// The device delivered nothing new for too long.
    SamplesStale = 2,
    /// Too many implausible samples in a row.
    SamplesImplausible = 3,
    /// Too many ticks missed in a row.
    DeadlineMissed = 4,
    /// The wanted force was not finite for too long.
    ForceNotFinite = 5,
    /// The machine slept.
    Suspended = 6,
    /// The device switched its force off.
    DeviceTripped = 7,
}

impl std::error::Error for ServoFault {}

impl std::fmt::Display for ServoFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(protocol::words::fault(self.code()))
    }
}

impl ServoFault {
    /// Code on the wire.
    #[must_use]
    pub fn code(self) -> u32 {
        self as u32
    }

    /// From the code on the wire.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        [
            Self::DeviceLost,
            Self::SamplesStale,
            Self::SamplesImplausible,
            Self::DeadlineMissed,
            Self::ForceNotFinite,
            Self::Suspended,
            Self::DeviceTripped,
        ]
        .into_iter()
        .find(|fault| fault.code() == code)
    }
}

/// How the tissue is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// Not even a sample of the device.
    NoSample,
    /// No port, or the ladder has run out.
    None,
    /// A late port: enough to go on, not to start.
    Late,
    /// A fresh port.
    Good,
}

/// What the operator asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// Nothing.
    Silent,
    /// To leave Fault.
    Rearm,
}

/// Everything a transition depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// A fault found in this tick.
    pub fault: Option<ServoFault>,
    /// Way to the tissue.
    pub link: Link,
    /// Norm of the force wanted at full gain, newtons.
    pub wanted_n: f64,
    /// The operator's order.
    pub operator: Operator,
}

/// Mode, its clock, and the latched fault.
#[derive(Clone, Copy, Debug)]
pub struct StateMachine {
    params: RhythmParams,
    mode: Mode,
    fault: Option<ServoFault>,
    /// Seconds that the condition for the next mode has held (Ramp: seconds in Ramp).
    held_s: f64,
}

impl StateMachine {
    /// In Init.
    #[must_use]
    pub fn new(params: RhythmParams) -> Self {
        Self { params, mode: Mode::Init, fault: None, held_s: 0.0 }
    }

    /// Mode now.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The latched fault.
    #[must_use]
    pub fn fault(&self) -> Option<ServoFault> {
        self.fault
    }

    /// Share of the wanted force that may be rendered, 0 to 1.
    #[must_use]
    pub fn gain(&self) -> f64 {
        match self.mode {
            Mode::Init | Mode::Monitor | Mode::Armed | Mode::Fault => 0.0,
            Mode::Ramp => (self.held_s / self.params.ramp_s).clamp(0.0, 1.0),
            Mode::Active => 1.0,
        }
    }

    /// One tick: at most one transition; gives the mode that was left.
    pub fn tick(&mut self, situation: &Situation, dt_s: f64) -> Option<Mode> {
        let next = self.next(situation, dt_s);
        if next == self.mode {
            return None;
        }
        self.held_s = 0.0;
        Some(std::mem::replace(&mut self.mode, next))
    }

    fn next(&mut self, situation: &Situation, dt_s: f64) -> Mode {
        if let Some(fault) = situation.fault {
            self.fault = self.fault.or(Some(fault));
            return Mode::Fault;
        }
        match (self.mode, situation.link) {
            (Mode::Fault, _) => match situation.operator {
                Operator::Silent => Mode::Fault,
                Operator::Rearm => {
                    self.fault = None;
                    Mode::Monitor
                }
            },
            (Mode::Init, Link::NoSample) => Mode::Init,
            (Mode::Init, _) | (Mode::Armed | Mode::Ramp | Mode::Active, Link::None | Link::NoSample) => Mode::Monitor,
            (Mode::Monitor, Link::Good) => self.after(self.params.arm_wait_s, dt_s, Mode::Armed),
            (Mode::Armed, Link::Good) if situation.wanted_n <= self.params.arm_force_n => {
                self.after(self.params.arm_wait_s, dt_s, Mode::Ramp)
            }
            (Mode::Monitor | Mode::Armed, _) => {
                self.held_s = 0.0;
                self.mode
            }
            (Mode::Ramp, _) => self.after(self.params.ramp_s, dt_s, Mode::Active),
            (Mode::Active, _) => Mode::Active,
        }
    }

    /// `next` once the present condition has held for `wait_s`.
    fn after(&mut self, wait_s: f64, dt_s: f64, next: Mode) -> Mode {
        self.held_s += dt_s;
        if self.held_s >= wait_s { next } else { self.mode }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: Situation = Situation { fault: None, link: Link::Good, wanted_n: 0.0, operator: Operator::Silent };
    const DT: f64 = 0.001;

    /// A machine that was led into `mode` by its own rules.
    fn machine_in(mode: Mode) -> StateMachine {
        let mut machine = StateMachine::new(RhythmParams::default());
        let fault = Situation { fault: Some(ServoFault::DeviceLost), ..QUIET };
        for _ in 0..5_000 {
            if machine.mode() == mode {
                return machine;
            }
            machine.tick(if mode == Mode::Fault { &fault } else { &QUIET }, DT);
        }
        unreachable!("{} was never reached", mode.name())
    }

    #[test]
    fn every_mode_and_situation_leads_where_the_table_says() {
        let fault = Situation { fault: Some(ServoFault::DeadlineMissed), ..QUIET };
        let none = Situation { link: Link::None, ..QUIET };
        let mute = Situation { link: Link::NoSample, ..QUIET };
        let late = Situation { link: Link::Late, ..QUIET };
        let loud = Situation { wanted_n: 2.0, ..QUIET };
        let rearm = Situation { operator: Operator::Rearm, ..QUIET };
        use Mode::{Active, Armed, Fault, Init, Monitor, Ramp};
        // Mode it starts in, and where it has gone after one second of: quiet, fault, no link, late link, a large
        // wanted force, a re-arm order in every tick, no sample.
        let table = [
            (Init, [Ramp, Fault, Monitor, Monitor, Armed, Ramp, Init]),
            (Monitor, [Ramp, Fault, Monitor, Monitor, Armed, Ramp, Monitor]),
            (Armed, [Ramp, Fault, Monitor, Armed, Armed, Ramp, Monitor]),
            (Ramp, [Ramp, Fault, Monitor, Ramp, Ramp, Ramp, Monitor]),
            (Active, [Active, Fault, Monitor, Active, Active, Active, Monitor]),
            (Fault, [Fault, Fault, Fault, Fault, Fault, Ramp, Fault]),
        ];
        for (start, ends) in table {
            for (situation, end) in [QUIET, fault, none, late, loud, rearm, mute].iter().zip(ends) {
                let mut machine = machine_in(start);
                for _ in 0..1_000 {
                    machine.tick(situation, DT);
                }
                assert_eq!(machine.mode(), end, "from {} under {situation:?}", start.name());
            }
        }
    }

    #[test]
    fn the_gain_rises_over_the_ramp_and_only_there() {
        let mut machine = machine_in(Mode::Ramp);
        assert_eq!(machine.gain(), 0.0);
        let mut before = 0.0;
        while machine.mode() == Mode::Ramp {
            machine.tick(&QUIET, DT);
            let rise = machine.gain() - before;
            assert!((0.0..=DT / 2.0 + 1e-12).contains(&rise), "{rise}");
            before = machine.gain();
        }
        assert_eq!((machine.mode(), machine.gain()), (Mode::Active, 1.0));
    }

    #[test]
    fn the_first_fault_is_the_one_that_is_kept() {
        let mut machine = machine_in(Mode::Fault);
        machine.tick(&Situation { fault: Some(ServoFault::Suspended), operator: Operator::Rearm, ..QUIET }, DT);
        assert_eq!(machine.fault(), Some(ServoFault::DeviceLost));
        assert_eq!(ServoFault::from_code(ServoFault::Suspended.code()), Some(ServoFault::Suspended));
        assert_eq!(ServoFault::from_code(0), None);
    }
}
