//! The loop of a device on a wire, stepped by a test: scripted peer → driver → servo → driver → peer, one tick a millisecond.
//!
//! The loop is the product's own ([`turn`]); only the thread between wire and cells is left out: what it does with the
//! wire ([`drain`]) is called in the test's thread. The solver is a port made by hand: one held point on a spring.

use crate::rig::hand_made_port;
use haptic_server::device::notice::{NOTICES, NoticeRing};
use haptic_server::device::wire::pump::drain;
use haptic_server::device::wire::{Arrival, Link, Packet, WireDriver, WirePort, turn};
use haptic_server::device::{DeviceCommand, DeviceLimits, DeviceSample, HandView, ServoRoom, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::state_machine::{Mode, ServoFault};
use haptic_server::servo::tick::{Orders, Rights, Servo, StopOrder, TickInput};
use protocol::servo_state::ServoState;
use std::time::Duration;

const MS: u64 = 1_000_000;
/// What counts as no force, newtons.
pub(crate) const ZERO_N: f64 = 1e-3;

/// A device of a test: time passes in it, and it can be read back.
pub(crate) trait Peer {
    /// A millisecond passes.
    fn pass(&mut self);
    /// The force that its motors give now, newtons.
    fn arrived_n(&self) -> f64;
}

/// The wire without a thread.
struct DirectLink<P> {
    port: Option<P>,
    is_sound: fn(&[u8]) -> bool,
    state: Arrival,
}

impl<P: WirePort> Link for DirectLink<P> {
    fn take(&mut self) -> Arrival {
        self.state.newest = None;
        if let Some(port) = &mut self.port {
            match drain(port, self.is_sound, Duration::ZERO) {
                Ok(drained) => {
                    self.state.newest = drained.newest;
                    self.state.sound += drained.sound;
                    self.state.refused += drained.refused;
                }
                Err(error) => (self.port, self.state.broken) = (None, Some(error)),
            }
        }
        self.state
    }

    fn put(&mut self, packet: &Packet) {
        if let Some(port) = &mut self.port
            && let Err(error) = port.send(packet.bytes())
        {
            (self.port, self.state.broken) = (None, Some(error));
        }
    }
}

struct TestRoom {
    servo: Servo,
    now_ns: u64,
    sequence: u64,
    is_held: bool,
    rearms: u32,
}

impl ServoRoom for TestRoom {
    fn wait(&mut self) -> Option<TickTime> {
        self.begin(0)
    }

    fn begin(&mut self, _late_ns: u64) -> Option<TickTime> {
        self.now_ns += MS;
        Some(TickTime { scheduled_ns: self.now_ns, now_ns: self.now_ns, dt_s: 1e-3 })
    }

    fn view(&self) -> HandView {
        self.servo.view()
    }

    fn is_latched(&self) -> bool {
        self.servo.mode() == Mode::Fault
    }

    fn tick(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        let port = (self.now_ns / MS).is_multiple_of(5).then(|| {
            self.sequence += 1;
            hand_made_port(self.now_ns, self.sequence, [self.is_held, false])
        });
        let orders = Orders { rearms: self.rearms, stop: StopOrder::GoOn, ..Orders::default() };
        let wakefulness = Wakefulness::Awake;
        self.servo.tick(&TickInput { time, sample, new_port: port.as_ref(), orders, wakefulness }).command
    }

    fn tick_second(&mut self, _time: TickTime, _sample: &DeviceSample) -> DeviceCommand {
        unreachable!("one device on a wire")
    }
}

/// Driver, wire and servo.
pub(crate) struct WireRig<D, P> {
    driver: D,
    link: DirectLink<P>,
    room: TestRoom,
    ring: NoticeRing,
    told: Vec<String>,
}

/// What became of a fault.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// Ticks until the motors gave no force.
    pub(crate) zero_ms: Option<u32>,
    /// What the user was told.
    pub(crate) told: Vec<String>,
}

impl<D: WireDriver, P: WirePort + Peer> WireRig<D, P> {
    pub(crate) fn new(driver: D, limits: &DeviceLimits, port: P) -> Self {
        let params = ServoParams::new(&ServoConfig::default(), limits).expect("defaults suit the device");
        let state = Arrival { generation: 0, broken: None, newest: None, sound: 0, refused: 0 };
        let servo = Servo::new(&params, Rights::Full);
        Self {
            driver,
            link: DirectLink { port: Some(port), is_sound: D::is_sound, state },
            room: TestRoom { servo, now_ns: 1_000 * MS, sequence: 0, is_held: false, rearms: 0 },
            ring: NoticeRing::new(NOTICES),
            told: Vec::new(),
        }
    }

    /// One millisecond after another; `each` moves the peer.
    pub(crate) fn step_with(&mut self, ticks: u32, mut each: impl FnMut(u32, &mut P)) {
        for tick in 1..=ticks {
            if let Some(peer) = &mut self.link.port {
                each(tick, peer);
                peer.pass();
            }
            let time = self.room.begin(0).expect("never ends");
            turn(&mut self.driver, &mut self.link, &mut self.room, &self.ring, time);
            self.told.extend(std::iter::from_fn(|| self.ring.pop()).map(|notice| notice.what.to_string()));
        }
    }

    pub(crate) fn step(&mut self, ticks: u32) {
        self.step_with(ticks, |_, _| {});
    }

    /// The peer, while it is attached.
    pub(crate) fn peer(&mut self) -> &mut P {
        self.link.port.as_mut().expect("attached")
    }

    /// Plugs a peer in again, as the wire's thread does.
    pub(crate) fn plug_in(&mut self, port: P) {
        self.link.port = Some(port);
        self.link.state.generation += 1;
        self.link.state.broken = None;
    }

    pub(crate) fn hold(&mut self, is_held: bool) {
        self.room.is_held = is_held;
    }

    pub(crate) fn rearm(&mut self) {
        self.room.rearms += 1;
    }

    pub(crate) fn mode(&self) -> Mode {
        self.room.servo.mode()
    }

    pub(crate) fn fault(&self) -> Option<ServoFault> {
        ServoFault::from_code(self.state().fault)
    }

    pub(crate) fn state(&self) -> &ServoState {
        self.room.servo.state()
    }

    /// Force of the motors; none of a peer that is gone.
    pub(crate) fn arrived_n(&self) -> f64 {
        self.link.port.as_ref().map_or(0.0, P::arrived_n)
    }

    /// What has been told since the last call.
    pub(crate) fn told(&mut self) -> Vec<String> {
        std::mem::take(&mut self.told)
    }

    /// Does a fault and watches for `ticks`.
    pub(crate) fn after(&mut self, ticks: u32, fault: impl FnOnce(&mut P)) -> Outcome {
        let _before = self.told();
        fault(self.peer());
        let mut zero_ms = None;
        for tick in 0..ticks {
            self.step(1);
            if self.arrived_n() < ZERO_N && zero_ms.is_none() {
                zero_ms = Some(tick);
            }
        }
        Outcome { zero_ms, told: self.told() }
    }
}

/// A row of the table.
pub(crate) fn line(fault: &str, outcome: &Outcome, end: &str) {
    let zero = outcome.zero_ms.map_or_else(|| "–".to_owned(), |ms| ms.to_string());
    let told: Vec<&String> = outcome.told.iter().filter(|t| !t.contains('→')).collect();
    println!("| {fault} | {zero} | {end} | {told:?} |");
}
