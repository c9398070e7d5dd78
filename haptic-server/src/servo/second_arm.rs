//! The second device's share of a tick: its own gate, handles and force stage, under the mode, the port and the orders of
//! the first.
//!
//! gain = first's machine · ladder · own samples · own ramp · stop. Where it is 0 the grip slips, so that a force comes back
//! from nothing. A fault of the second device is the servo's, latched for both hands, from the first's next tick on; its own
//! force is gone at once. It is ticked after the first, and `servo_state` shows it with the first's next tick.
//! Metres, newtons, seconds, scene frame.

use crate::device::{DeviceCommand, DeviceSample, TickTime};
use crate::servo::coupling::{HANDLES_PER_DEVICE, HandleNews, Handles};
use crate::servo::energy::EnergyObserver;
use crate::servo::ladder::Rung;
use crate::servo::params::ServoParams;
use crate::servo::safety::ForceStage;
use crate::servo::sample::{Buttons, SampleGate};
use crate::servo::state_machine::ServoFault;
use protocol::servo_state::{DeviceState, HandleState};
use protocol::tissue_port::TissuePort;
use protocol::wire::Field;
use sim_core::kinematics::coupling::StylusState;
use sim_core::vector::Vec3;

/// What the first device's tick leaves for the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    pub(super) rung: Rung,
    /// Product of the machine's, the ladder's and the stop's gain.
    pub(super) gain: f64,
    pub(super) dt_s: f64,
}

/// The second device.
#[derive(Clone, Copy, Debug)]
pub(super) struct SecondArm {
    gate: SampleGate,
    buttons: Buttons,
    handles: Handles,
    stage: ForceStage,
    observer: EnergyObserver,
    period_s: f64,
    ramp_s: f64,
    ramp: f64,
    fault: Option<ServoFault>,
    stylus_m: Vec3,
    state: DeviceState,
}

impl SecondArm {
    pub(super) fn new(params: &ServoParams) -> Self {
        let mut state = DeviceState::EMPTY;
        state.orientation = [0.0, 0.0, 0.0, 1.0];
        Self {
            gate: SampleGate::new(params.sample),
            buttons: Buttons::new(&params.sample),
            handles: Handles::new(params.coupling, 1),
            stage: ForceStage::new(params.safety, params.rhythm.period_s),
            observer: EnergyObserver::default(),
            period_s: params.rhythm.period_s,
            ramp_s: params.rhythm.ramp_s,
            ramp: 0.0,
            fault: None,
            stylus_m: Vec3::zeros(),
            state,
        }
    }

    /// Takes over a new, validated port.
    pub(super) fn take(&mut self, port: &TissuePort) {
        self.handles.take(port, self.stylus_m);
    }

    /// One tick.
    pub(super) fn tick(&mut self, lead: Lead, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        let answer = self.gate.tick(sample, lead.dt_s, self.period_s);
        self.fault = answer.fault;
        let usable = answer.sample.filter(|_| answer.fault.is_none());
        self.state.present = u32::from(usable.is_some());
        if let Some(accepted) = answer.sample {
            self.buttons.tick(accepted.buttons, time.now_ns);
            self.stylus_m = accepted.position_m;
            self.state.position_m = accepted.position_m.into();
            self.state.velocity_m_per_s = accepted.velocity_m_per_s.into();
            self.state.orientation = accepted.orientation;
            self.state.buttons = self.buttons.level;
            self.state.press_count = self.buttons.press_count;
            self.state.release_count = self.buttons.release_count;
        }
        let gives_force = usable.is_some() && lead.gain > 0.0 && lead.rung != Rung::None;
        self.ramp = if gives_force { (self.ramp + lead.dt_s / self.ramp_s).min(1.0) } else { 0.0 };
        if !gives_force {
            self.handles.slip(self.stylus_m);
        }
        let wanted = usable.map_or_else(Vec3::zeros, |s| {
            let stylus = StylusState { position_m: s.position_m, velocity_m_per_s: s.velocity_m_per_s };
            self.handles.tick(stylus, lead.rung, lead.gain * answer.gain * self.ramp, lead.dt_s)
        });
        let released = self.stage.release(wanted, lead.dt_s);
        self.observer.measure(self.stylus_m, released.command.force_n);
        self.state.force_n = released.command.force_n.into();
        self.state.unclipped_force_n = wanted.map(|n| if n.is_finite() { n } else { 0.0 }).into();
        released.command
    }

    /// What is wrong with the device by its last tick.
    pub(super) fn fault(&self) -> Option<ServoFault> {
        self.fault
    }

    /// The operator has re-armed: the next finite sample is taken wherever it is.
    pub(super) fn rearm(&mut self) {
        self.gate.reset();
        self.fault = None;
    }

    /// As the wire has it.
    pub(super) fn state(&self) -> DeviceState {
        self.state
    }

    pub(super) fn handles(&self) -> [HandleState; HANDLES_PER_DEVICE] {
        self.handles.states()
    }

    pub(super) fn take_news(&mut self) -> [HandleNews; HANDLES_PER_DEVICE] {
        self.handles.take_news()
    }

    pub(super) fn last_force(&self) -> Vec3 {
        self.stage.last_force()
    }

    pub(super) fn given_j(&self) -> f64 {
        self.observer.given_j()
    }
}
