//! The servo tick: a pure function of (sample, newest port, orders, state); no clock, no device, no heap.
//!
//! device sample → gate → button edges → ladder → coupling → force → state machine → safety → observer → `servo_state`.
//! `thread.rs` calls it live, lockstep calls it against a virtual clock: equal inputs give equal bits.
//! The gain is the product of what state machine, ladder, samples and a stop order allow; it weakens the coupling, so that
//! the tissue feels no more than the hand. The safety stage behind it has the last word. Metres, newtons, seconds, scene frame.
//! A second device is ticked after the first (`second_arm`). Deliberately absent: filters of the samples.

use crate::device::{DeviceCommand, DeviceSample, HandView, TickTime};
use crate::servo::clock::{MissCounter, Wakefulness};
use crate::servo::coupling::{HANDLES_PER_DEVICE, Handles};
use crate::servo::energy::EnergyObserver;
use crate::servo::events::{EventBatch, EventKind, ServoEvent};
use crate::servo::ladder::{Ladder, PortRefusal, Rung, Step};
pub use crate::servo::orders::{FLAG_DEGRADED, FLAG_STOPPING, Orders, Rights, StopOrder, TickInput, TickOutput};
use crate::servo::params::ServoParams;
use crate::servo::safety::{ForceStage, Released, Verdict};
use crate::servo::sample::{Accepted, Buttons, SampleGate};
use crate::servo::second_arm::{Lead, SecondArm};
use crate::servo::state_machine::{Link, Mode, Operator, ServoFault, Situation, StateMachine};
use protocol::servo_state::ServoState;
use protocol::tissue_port::TissuePort;
use protocol::wire::{Field, Message};
use sim_core::kinematics::coupling::StylusState;
use sim_core::vector::Vec3;

/// A press of this button (the back one) re-arms after a fault; the front one sutures.
const REARM_BUTTON: usize = 1;
/// A stop order is fulfilled when less than this is left; the device's own zero then makes no step that can be felt.
const STOPPED_N: f64 = 1e-3;
/// Longer ticks integrate as this many periods; the rest of the time is lost, not made up for.
const LONGEST_TICK_PERIODS: f64 = 20.0;

/// The servo of one device, or of two.
#[derive(Clone, Debug)]
pub struct Servo {
    params: ServoParams,
    rights: Rights,
    machine: StateMachine,
    gate: SampleGate,
    buttons: Buttons,
    second: SecondArm,
    lead: Lead,
    ladder: Ladder,
    handles: Handles,
    stage: ForceStage,
    observer: EnergyObserver,
    misses: MissCounter,
    verdict: Verdict,
    last_rung: Rung,
    rearms_seen: u32,
    presses_seen: u32,
    stopping_s: Option<f64>,
    port: TissuePort,
    state: ServoState,
}

impl Servo {
    /// In Init, at zero force.
    #[must_use]
    pub fn new(params: &ServoParams, rights: Rights) -> Self {
        let mut state = ServoState::EMPTY;
        state.handle_count = HANDLES_PER_DEVICE as u32;
        state.period_ns = params.period_ns();
        for device in &mut state.devices {
            device.orientation = [0.0, 0.0, 0.0, 1.0];
        }
        Self {
            params: *params,
            rights,
            machine: StateMachine::new(params.rhythm),
            gate: SampleGate::new(params.sample),
            buttons: Buttons::new(&params.sample),
            second: SecondArm::new(params),
            lead: Lead { rung: Rung::None, gain: 0.0, dt_s: 0.0 },
            ladder: Ladder::new(params.ladder),
            handles: Handles::new(params.coupling, 0),
            stage: ForceStage::new(params.safety, params.rhythm.period_s),
            observer: EnergyObserver::default(),
            misses: MissCounter::default(),
            verdict: Verdict::Usable,
            last_rung: Rung::None,
            rearms_seen: 0,
            presses_seen: 0,
            stopping_s: None,
            port: TissuePort::EMPTY,
            state,
        }
    }

    /// One tick.
    pub fn tick(&mut self, input: &TickInput<'_>) -> TickOutput {
        let period_s = self.params.rhythm.period_s;
        let dt_s = Some(input.time.dt_s).filter(|dt| dt.is_finite()).unwrap_or(period_s);
        let dt_s = dt_s.clamp(0.0, LONGEST_TICK_PERIODS * period_s);
        let tick = self.state.ticks + 1;
        let mut news = News { tick, time_ns: input.time.now_ns, batch: EventBatch::new() };

        let missed = self.misses.measure(input.time.scheduled_ns, self.params.period_ns());
        if missed > 0 {
            news.tell(EventKind::TicksMissed(missed));
        }
        let operator = self.operator(input.orders);
        let answer = self.gate.tick(input.sample, dt_s, period_s);
        if let Some(refusal) = answer.refusal {
            news.tell(EventKind::SampleRefused(refusal));
        }
        if let Some(sample) = answer.sample {
            self.buttons.tick(sample.buttons, input.time.now_ns);
        }
        let step = self.take_port(input, answer.sample, &mut news);

        let stylus = answer.sample.map_or_else(StylusState::default, |s| StylusState {
            position_m: s.position_m,
            velocity_m_per_s: s.velocity_m_per_s,
        });
        if let Some(sample) = answer.sample.filter(|_| self.gives_no_force(step.rung)) {
            self.handles.slip(sample.position_m);
        }
        let situation = Situation {
            fault: self.fault(input.wakefulness, answer.fault),
            link: link(answer.sample, step.rung),
            wanted_n: answer.sample.map_or(0.0, |_| self.handles.full_force_n(stylus)),
            operator,
        };
        self.move_machine(&situation, dt_s, &mut news);
        let gain = self.machine.gain() * step.gain * self.stop_gain(input.orders.stop, dt_s, &mut news);
        let led = if self.gives_no_force(step.rung) { 0.0 } else { gain };
        self.lead = Lead { rung: step.rung, gain: led, dt_s };
        let wanted = match answer.sample {
            Some(_) => self.handles.tick(stylus, step.rung, gain * answer.gain, dt_s),
            None => Vec3::zeros(),
        };
        self.tell_handles(&mut news);
        let released = self.stage.release(wanted, dt_s);
        self.verdict = released.verdict;
        if let Some(sample) = answer.sample {
            self.observer.measure(sample.position_m, released.command.force_n);
        }
        self.fill(input, answer.sample, step, wanted, &released);
        TickOutput { command: released.command, events: news.batch, clips: released.clips }
    }

    /// Whether the hand is given no force: then it pulls at nothing either, the grip slips. Otherwise a hand that
    /// feels nothing would drag the tissue by whatever it moves.
    fn gives_no_force(&self, rung: Rung) -> bool {
        matches!(self.machine.mode(), Mode::Init | Mode::Monitor | Mode::Armed | Mode::Fault) || rung == Rung::None
    }

    /// The servo after the last tick.
    #[must_use]
    pub fn state(&self) -> &ServoState {
        &self.state
    }

    /// Mode of the state machine.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.machine.mode()
    }

    /// Whether a stop order has been followed to its end: the force is zero.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        // Late ticks count more time than the slew limit allows force: the force itself decides.
        let faded = self.stopping_s.is_some_and(|s| s >= self.params.rhythm.stop_s);
        faded && self.stage.last_force().norm().max(self.second.last_force().norm()) < STOPPED_N
    }

    /// What the hand sees: the newest port.
    #[must_use]
    pub fn view(&self) -> HandView {
        HandView::from(&self.port)
    }

    /// One tick of the second device, after [`Servo::tick`] of the first; gives its force.
    pub fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        self.state.handle_count = 2 * HANDLES_PER_DEVICE as u32;
        self.second.tick(self.lead, time, sample)
    }

    /// Whether the operator re-arms in this tick: by command, or by a press of the back button since the last tick.
    fn operator(&mut self, orders: Orders) -> Operator {
        let presses = self.buttons.press_count[REARM_BUTTON];
        let is_asked = orders.rearms != self.rearms_seen || presses != self.presses_seen;
        (self.rearms_seen, self.presses_seen) = (orders.rearms, presses);
        if is_asked && self.machine.mode() == Mode::Fault {
            self.gate.reset();
            self.second.rearm();
            return Operator::Rearm;
        }
        Operator::Silent
    }

    fn take_port(&mut self, input: &TickInput<'_>, sample: Option<Accepted>, news: &mut News) -> Step {
        if let Some(port) = input.new_port {
            match self.ladder.accept(port, input.time.now_ns) {
                Ok(()) => {
                    self.port = *port;
                    self.handles
                        .take(port, sample.map_or(Vec3::from(self.state.devices[0].position_m), |s| s.position_m));
                    self.second.take(port);
                }
                Err(PortRefusal::Older) => {}
                Err(refusal) => news.tell(EventKind::PortRefused(refusal)),
            }
        }
        let step = self.ladder.tick(input.time.now_ns, input.orders.solver_deaths);
        let from = std::mem::replace(&mut self.last_rung, step.rung);
        if from != step.rung {
            news.tell(EventKind::RungChanged { from, to: step.rung, age_ns: step.age_ns });
        }
        step
    }

    fn fault(&self, wakefulness: Wakefulness, of_samples: Option<ServoFault>) -> Option<ServoFault> {
        if wakefulness == Wakefulness::Suspended {
            Some(ServoFault::Suspended)
        } else if let Some(fault) = of_samples.or(self.second.fault()) {
            Some(fault)
        } else if self.misses.in_a_row >= u64::from(self.params.rhythm.missed_fault_ticks) {
            Some(ServoFault::DeadlineMissed)
        } else {
            (self.verdict == Verdict::NotFinite).then_some(ServoFault::ForceNotFinite)
        }
    }

    fn move_machine(&mut self, situation: &Situation, dt_s: f64, news: &mut News) {
        let Some(from) = self.machine.tick(situation, dt_s) else { return };
        let to = self.machine.mode();
        news.tell(EventKind::ModeChanged { from, to });
        match self.machine.fault() {
            Some(fault) => news.tell(EventKind::Faulted(fault)),
            None if from == Mode::Fault => news.tell(EventKind::Rearmed),
            None => {}
        }
    }

    fn stop_gain(&mut self, order: StopOrder, dt_s: f64, news: &mut News) -> f64 {
        if order == StopOrder::Stop && self.stopping_s.is_none() {
            self.stopping_s = Some(0.0);
            news.tell(EventKind::Stopping);
        }
        let Some(elapsed_s) = &mut self.stopping_s else { return 1.0 };
        *elapsed_s += dt_s;
        (1.0 - *elapsed_s / self.params.rhythm.stop_s).max(0.0)
    }

    fn tell_handles(&mut self, news: &mut News) {
        let states = self.handles.states().into_iter().chain(self.second.handles());
        let told = self.handles.take_news().into_iter().chain(self.second.take_news());
        for (handle, (told, state)) in (0..).zip(told.zip(states)) {
            if told.changed {
                news.tell(EventKind::HandleChanged { handle, mode: state.mode, pair: state.pair });
            }
            if told.left_trust {
                news.tell(EventKind::OutsideTrust { handle });
            }
            if told.was_reset {
                news.tell(EventKind::HandleReset { handle });
            }
        }
    }

    /// Writes `servo_state`.
    fn fill(&mut self, input: &TickInput<'_>, sample: Option<Accepted>, step: Step, wanted: Vec3, released: &Released) {
        let state = &mut self.state;
        state.ticks += 1;
        state.missed = self.misses.total;
        state.port_epoch = self.port.epoch;
        state.port_sequence = self.port.header.sequence;
        state.port_age_ns = step.age_ns;
        state.port_rung = step.rung.code();
        state.mode = self.machine.mode().code();
        state.fault = self.machine.fault().map_or(0, ServoFault::code);
        state.flags = u32::from(self.rights == Rights::Degraded) * FLAG_DEGRADED
            + u32::from(self.stopping_s.is_some()) * FLAG_STOPPING;
        state.energy_to_hand_j = self.observer.given_j() + self.second.given_j();
        let device = &mut state.devices[0];
        if let Some(sample) = sample {
            device.position_m = sample.position_m.into();
            device.velocity_m_per_s = sample.velocity_m_per_s.into();
            device.orientation = sample.orientation;
        }
        device.present = u32::from(sample.is_some());
        device.force_n = released.command.force_n.into();
        device.unclipped_force_n = wanted.map(|n| if n.is_finite() { n } else { 0.0 }).into();
        device.buttons = self.buttons.level;
        device.press_count = self.buttons.press_count;
        device.release_count = self.buttons.release_count;
        state.devices[1] = self.second.state();
        let (first, second) = state.handles.split_at_mut(HANDLES_PER_DEVICE);
        first.copy_from_slice(&self.handles.states());
        second.copy_from_slice(&self.second.handles());
        let sequence = state.ticks;
        state.stamp(sequence, input.time.now_ns);
    }
}

/// Collects the events of one tick.
struct News {
    tick: u64,
    time_ns: u64,
    batch: EventBatch,
}

impl News {
    fn tell(&mut self, kind: EventKind) {
        self.batch.push(ServoEvent { tick: self.tick, time_ns: self.time_ns, kind });
    }
}

fn link(sample: Option<Accepted>, rung: Rung) -> Link {
    match (sample, rung) {
        (None, _) => Link::NoSample,
        (_, Rung::None) => Link::None,
        (_, Rung::Affine) => Link::Good,
        (_, Rung::OneRing | Rung::Frozen | Rung::Decay) => Link::Late,
    }
}
