//! The whole way of a device without a clock: virtual library → driver → servo, stepped by the test.
//!
//! The driver's callback runs in the test's own thread, one millisecond per step; `run` waits in a thread of its own, as in
//! the servo process. The solver is a port made by hand: one held point on a spring.

use crate::alone;
use haptic_server::device::frame::SceneFromDevice;
use haptic_server::device::notice::NoticeRing;
use haptic_server::device::openhaptics::ffi::Hd;
use haptic_server::device::openhaptics::{KeeperParams, OpenHaptics};
use haptic_server::device::{Device, DeviceCommand, DeviceSample, HandView, ServoRoom, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::tick::{Orders, Rights, Servo, StopOrder, TickInput};
use protocol::servo_state::ServoState;
use protocol::tissue_port::{HANDLE_FREE, HANDLE_HELD, HandlePort, TissuePort};
use protocol::wire::{Field, Message};
use sim_core::vector::Vec3;
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use suture_tests::processes::wait_for;
use virtual_omni::{Setup, control, functions};

/// Patience with a loaded machine.
pub(crate) const LIMIT: Duration = Duration::from_secs(60);
/// What counts as no force, newtons: a tenth of an encoder count on the coupling.
pub(crate) const ZERO_N: f64 = 1e-3;
const MS: u64 = 1_000_000;
/// Where the stylus is held, millimetres, device frame.
pub(crate) const PLACE_MM: [f64; 3] = [4.0, 0.0, 0.0];

/// What the test and the servo share.
#[derive(Default)]
pub(crate) struct Shared {
    stop: AtomicBool,
    held: AtomicBool,
    second_held: AtomicBool,
    rearms: AtomicU32,
    state: Mutex<Option<ServoState>>,
}

struct StepRoom {
    servo: Servo,
    shared: Arc<Shared>,
    now_ns: u64,
    sequence: u64,
}

impl StepRoom {
    fn port(&mut self) -> Option<TissuePort> {
        if !(self.now_ns / MS).is_multiple_of(5) {
            return None;
        }
        self.sequence += 1;
        let held = |hand: &AtomicBool| hand.load(Ordering::Relaxed);
        let hands = [held(&self.shared.held), held(&self.shared.second_held)];
        Some(hand_made_port(self.now_ns, self.sequence, hands))
    }
}

/// A solver's answer: one point for each hand, held on a spring or free.
pub(crate) fn hand_made_port(now_ns: u64, sequence: u64, held: [bool; 2]) -> TissuePort {
    let [first_holds, second_holds] = held;
    let mut port = TissuePort::EMPTY;
    port.epoch = 1 + u32::from(first_holds) + 2 * u32::from(second_holds);
    (port.publish_ns, port.valid_ns) = (now_ns, now_ns);
    port.line_rest_length_m = 0.028;
    (port.pair_count, port.gap_m, port.handle_count) = (4, 0.008, 2);
    let k = 300.0;
    let taken = |holds| if holds { HANDLE_HELD } else { HANDLE_FREE };
    let modes = [(taken(first_holds), 0.004), (HANDLE_FREE, -0.004), (taken(second_holds), -0.03)];
    for (handle, (mode, x)) in port.handles.iter_mut().zip(modes) {
        *handle = HandlePort {
            position_m: [x, 0.0, 0.0],
            stiffness_n_per_m: [k, 0.0, 0.0, k, 0.0, k],
            one_ring_n_per_m: [3.0 * k, 0.0, 0.0, 3.0 * k, 0.0, 3.0 * k],
            trust_radius_m: 0.02,
            mass_kg: 0.002,
            drag_n_s_per_m: 0.5,
            mode,
            ..HandlePort::EMPTY
        };
    }
    port.stamp(sequence, now_ns);
    port
}

impl ServoRoom for StepRoom {
    /// Only when the device is lost: then nobody steps, and the servo goes by its own clock.
    fn wait(&mut self) -> Option<TickTime> {
        std::thread::sleep(Duration::from_micros(200));
        self.begin(0)
    }

    fn begin(&mut self, _late_ns: u64) -> Option<TickTime> {
        if self.servo.is_stopped() {
            return None;
        }
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
        let port = self.port();
        let stop = if self.shared.stop.load(Ordering::Relaxed) { StopOrder::Stop } else { StopOrder::GoOn };
        let orders = Orders { rearms: self.shared.rearms.load(Ordering::Relaxed), stop, ..Orders::default() };
        let wakefulness = Wakefulness::Awake;
        let output = self.servo.tick(&TickInput { time, sample, new_port: port.as_ref(), orders, wakefulness });
        *self.shared.state.lock().unwrap_or_else(PoisonError::into_inner) = Some(*self.servo.state());
        output.command
    }

    fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        self.servo.tick_second(time, sample)
    }
}

/// A running device.
pub(crate) struct Rig {
    pub(crate) shared: Arc<Shared>,
    pub(crate) notices: Arc<NoticeRing>,
    thread: Option<JoinHandle<()>>,
    place_mm: Cell<Vec3>,
    _alone: MutexGuard<'static, ()>,
}

/// Nobody is silent for as long as this in a stepped test.
pub(crate) const NO_STALL: KeeperParams =
    KeeperParams { stall_limit: Duration::from_secs(3600), reopen_pause: Duration::from_millis(20) };

impl Rig {
    /// Opens the devices of `names` and runs them.
    pub(crate) fn start(setup: &Setup, names: Option<&str>, params: KeeperParams) -> Self {
        let alone = alone();
        control::reset(setup);
        let frame = SceneFromDevice::workspace_at(Vec3::new(0.0, 0.0, 0.02));
        let mut device =
            OpenHaptics::with(Hd::new(functions()), names, params, frame).expect("the virtual device opens");
        let limits = device.limits();
        let notices = device.notices().expect("a driver that has something to say");
        let shared = Arc::new(Shared::default());
        let servo = ServoParams::new(&ServoConfig::default(), &limits).expect("defaults suit the device");
        let mut room = StepRoom {
            servo: Servo::new(&servo, Rights::Full),
            shared: shared.clone(),
            now_ns: 1_000 * MS,
            sequence: 0,
        };
        let thread = std::thread::spawn(move || device.run(&mut room));
        wait_for(LIMIT, || control::is_running().then_some(())).expect("the scheduler starts");
        let place_mm = Cell::new(Vec3::from(PLACE_MM));
        Self { shared, notices, thread: Some(thread), place_mm, _alone: alone }
    }

    /// Calibrated, armed, holding the point 10 mm to the side: about 1.7 N.
    pub(crate) fn holding() -> Self {
        Self::start(&Setup::default(), None, NO_STALL).hold()
    }

    /// Arms and pulls.
    pub(crate) fn hold(self) -> Self {
        control::lead(0, Vec3::from(PLACE_MM));
        self.step(2_400);
        assert_eq!(self.mode(), Mode::Active, "{:?}", self.told());
        self.pull();
        self
    }

    /// Takes the point and pulls it 10 mm to the side.
    pub(crate) fn pull(&self) {
        self.shared.held.store(true, Ordering::Relaxed);
        self.step(20);
        self.move_to(Vec3::from(PLACE_MM) + Vec3::new(0.0, 0.0, -10.0));
        self.step(300);
        assert!(self.arrived_n() > 1.0, "{} N, {:?}", self.arrived_n(), self.told());
    }

    /// Moves the stylus at 100 mm/s, as a hand could.
    pub(crate) fn move_to(&self, to_mm: Vec3) {
        let from_mm = self.place_mm.replace(to_mm);
        let ticks = ((to_mm - from_mm).norm() / 0.1).ceil().max(1.0);
        for i in 1..=ticks as u32 {
            control::lead(0, from_mm + (to_mm - from_mm) * (f64::from(i) / ticks));
            self.step(1);
        }
    }

    /// Puts the stylus into the inkwell.
    pub(crate) fn dock(&self) {
        self.move_to(Vec3::new(0.0, -65.510_711, -88.114_197));
    }

    /// Lets go.
    pub(crate) fn let_go(&self) {
        self.shared.held.store(false, Ordering::Relaxed);
    }

    /// The second device takes a point of its own where it is.
    pub(crate) fn hold_second(&self) {
        self.shared.second_held.store(true, Ordering::Relaxed);
    }

    pub(crate) fn step(&self, ticks: u32) {
        control::step(ticks);
    }

    /// Waits until the servo has been told that its devices are gone.
    pub(crate) fn wait_until_lost(&self) {
        let lost = wait_for(LIMIT, || (self.mode() == Mode::Fault).then_some(()));
        assert!(lost.is_some(), "nobody told the servo: {:?}", self.told());
    }

    /// Waits until the device has been opened again and is stepped by the test once more.
    pub(crate) fn wait_for_the_return(&self) {
        let told = wait_for(LIMIT, || self.told().iter().any(|t| t.contains("is open again")).then_some(()));
        assert!(told.is_some(), "the device is not opened again");
        let _before = control::take_rows();
        let ticking = wait_for(LIMIT, || {
            self.step(1);
            (!control::take_rows().is_empty()).then_some(())
        });
        assert!(ticking.is_some(), "the library does not call again");
    }

    pub(crate) fn rearm(&self) {
        self.shared.rearms.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn state(&self) -> ServoState {
        self.shared.state.lock().unwrap_or_else(PoisonError::into_inner).expect("a tick has been made")
    }

    pub(crate) fn mode(&self) -> Mode {
        let code = self.state().mode;
        [Mode::Init, Mode::Monitor, Mode::Armed, Mode::Ramp, Mode::Active, Mode::Fault][code as usize]
    }

    pub(crate) fn arrived_n(&self) -> f64 {
        control::arrived_n(0).norm()
    }

    /// Everything that the driver has said since the last call.
    pub(crate) fn told(&self) -> Vec<String> {
        std::iter::from_fn(|| self.notices.pop()).map(|notice| notice.what.to_string()).collect()
    }

    /// Ends the run in order.
    pub(crate) fn stop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else { return };
        let ended = wait_for(LIMIT, || {
            self.step(20);
            thread.is_finished().then_some(())
        });
        if ended.is_some() {
            thread.join().expect("the run ends in order");
        }
        assert!(ended.is_some() || std::thread::panicking(), "the run does not end");
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.stop();
    }
}
