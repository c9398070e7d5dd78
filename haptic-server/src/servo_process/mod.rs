//! The servo process: `haptic-server servo`, started and instructed by the supervisor.
//!
//! | thread | work |
//! |---|---|
//! | main | control line and heartbeat, telemetry, end of a recorded hand |
//! | servo | device and 1 kHz loop ([`room`]) |
//! | servo-bridge | subscribers; newest port and wish into the loop's cells ([`bridge`], [`pointer`]) |
//! | recorder | the recording, if one is made |
//!
//! A stop order, SIGTERM, SIGINT or the end of stdin lets the loop ramp the force to zero; then the summary goes to
//! the supervisor and the process ends.

mod bridge;
mod control;
mod pointer;
mod report;
mod room;

use crate::cli::choice::DeviceChoice;
use crate::device::DeviceLimits;
use crate::device::hid::side_input;
use crate::device::notice::NoticeRing;
use crate::error::ServerError;
use crate::flight_record::FlightRecord;
use crate::realtime::{self, RightsPolicy};
use crate::record::Recorder;
use crate::rig::{self, Rig, RigChoice};
use crate::servo::events::ServoEvent;
use crate::servo::flight_recorder::TickRecord;
use crate::servo::params::{ServoConfig, ServoParams};
use crate::servo_link::{FromServo, NoRtPolicy, ServoSpec, ToServo};
use crate::servo_setup::{self, OuterEnds, Recording, RoomEnds, ServoLinks};
use crate::standing::Standing;
use crate::supervisor::child::{DeathSignal, end_with_parent};
use crate::supervisor::signals::stop_flag;
use crate::telemetry;
use bridge::{Cells, Delivery};
use control::{ControlLine, Incoming};
use protocol::ports::PortError;
use protocol::run::RunDir;
use protocol::servo_state::FLAG_POINTER;
use protocol::wound_report::WoundReport;
use room::{LoopEnd, Task};
use rtrb::Consumer;
use rustix::event::Timespec;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two heartbeats: far below the supervisor's limit, far above a tick.
const HEARTBEAT: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };
/// Telemetry speaks once in so many heartbeats: five times a second.
const HEARTBEATS_PER_TELLING: u32 = 20;
/// Name of the last fault's flight record, beside the run directories.
const FLIGHT_RECORD: &str = "flight-record.csv";

/// The whole of the servo process.
///
/// # Errors
/// What refused or ended it, with the exit code.
pub fn run() -> Result<(), ServerError> {
    let stop = stop_flag()?;
    ControlLine::keep_for_itself()?;
    let mut control = ControlLine::default();
    let spec = control.specification()?;
    end_with_parent(spec.guarded_by, DeathSignal::Terminate)?;
    let run = RunDir::open(&spec.run_dir)?;
    let Rig { device, registration, ends_after_s, wishes } = rig::build(&RigChoice {
        device: &spec.device,
        hand: &spec.hand,
        side: spec.hand_side,
        length: spec.length,
        library: spec.openhaptics_library.as_deref(),
        device_file: spec.device_file.as_deref(),
    })?;
    let device = side_input::attach(device.into_device(), &spec.side_inputs)?;
    let name = device.name().to_owned();
    let notices = device.notices();
    refuse_stiffness(&spec.servo, &device.limits())?;
    let params =
        ServoParams::new(&spec.servo, &device.limits()).map_err(|e| ServerError::Configuration(e.to_string()))?;
    let ring = if spec.record.is_some() { Recording::EveryTick } else { Recording::None };
    let (links, room, outer) = servo_setup::open(ring);
    let OuterEnds { ports, events, flight, record } = outer;
    let recorder = spec.record.as_deref().zip(record);
    let recorder = recorder.map(|(path, ring)| Recorder::start(path, &spec.origin, run.clone(), ring, links.clone()));
    let recorder = recorder.transpose()?;
    let delivery = Arc::new(Delivery::new(links.clone()));
    // Until the end of the run.
    let _awake = realtime::stay_awake();
    let bridge = spawn_bridge(&run, Cells { ports, wishes }, &delivery)?;
    let marks = marks(&spec.device);
    let task = Task { params, policy: policy(&spec), processor: spec.processor, marks, links: links.clone() };
    let servo = spawn_servo(&run, device, task, room)?;
    let mut watch = Watch {
        links: &links,
        events,
        flight,
        flight_record: FlightRecord::new(params.period_ns()),
        delivery: &delivery,
        stop: &stop,
        spec: &spec,
        notices,
        ends_after_s,
        ready: None,
        wound: None,
        standing: Standing::default(),
    };
    watch.until_finished(&mut control, &servo, &bridge)?;
    let end = joined(servo, "servo")??;
    delivery.stop.store(true, Ordering::Relaxed);
    joined(bridge, "bridge")??;
    let wound = delivery.reports.pop().or(watch.wound);
    let recording = recorder.map(Recorder::finish).transpose()?;
    let facts = report::Facts { device: name, hand: spec.hand_label(), registration, recording };
    ControlLine::report(&FromServo::Summary(Box::new(report::summary(facts, &end, wound.as_ref()))));
    Ok(())
}

/// A stiffness that the device is not made for is refused, not lowered in silence.
fn refuse_stiffness(config: &ServoConfig, limits: &DeviceLimits) -> Result<(), ServerError> {
    let stiffnesses = [
        ("stiffness_n_per_m", config.coupling.stiffness_n_per_m),
        ("line_stiffness_n_per_m", config.coupling.line_stiffness_n_per_m),
    ];
    let most = limits.stiffness_n_per_m;
    match stiffnesses.into_iter().find(|(_, value)| *value > most) {
        None => Ok(()),
        Some((key, value)) => Err(ServerError::Configuration(format!(
            "servo.coupling.{key} is {value} N/m, but the device is made for {most} N/m at most; lower it in the \
             configuration"
        ))),
    }
}

fn policy(spec: &ServoSpec) -> RightsPolicy {
    match spec.no_rt {
        NoRtPolicy::Degrade => RightsPolicy::DegradedAllowed,
        NoRtPolicy::Refuse => RightsPolicy::Required,
    }
}

/// Flags of `servo_state` that hold for the whole run.
fn marks(device: &DeviceChoice) -> u32 {
    if *device == DeviceChoice::Pointer { FLAG_POINTER } else { 0 }
}

type Bridge = JoinHandle<Result<(), PortError>>;
type Loop = JoinHandle<Result<LoopEnd, ServerError>>;

fn spawn_bridge(run: &RunDir, mut cells: Cells, delivery: &Arc<Delivery>) -> Result<Bridge, ServerError> {
    let (run, delivery) = (run.clone(), delivery.clone());
    let thread = std::thread::Builder::new().name("servo-bridge".to_owned());
    thread.spawn(move || bridge::run(&run, &mut cells, &delivery)).map_err(|e| no_thread(&e))
}

fn spawn_servo(
    run: &RunDir,
    mut device: Box<dyn crate::device::Device>,
    task: Task,
    ends: RoomEnds,
) -> Result<Loop, ServerError> {
    let run = run.clone();
    let thread = std::thread::Builder::new().name("servo".to_owned()).stack_size(room::STACK);
    thread.spawn(move || room::run(&run, device.as_mut(), &task, ends)).map_err(|e| no_thread(&e))
}

fn no_thread(error: &std::io::Error) -> ServerError {
    ServerError::Unavailable(format!("cannot start a thread: {error}; raise the limits of processes and locked memory"))
}

fn joined<T>(thread: JoinHandle<T>, name: &str) -> Result<T, ServerError> {
    thread.join().map_err(|_| ServerError::Internal(format!("the {name} thread panicked; its message stands above")))
}

/// What the main thread watches while the loop runs.
struct Watch<'a> {
    links: &'a ServoLinks,
    events: Consumer<ServoEvent>,
    flight: Consumer<TickRecord>,
    flight_record: FlightRecord,
    delivery: &'a Delivery,
    stop: &'a AtomicBool,
    spec: &'a ServoSpec,
    notices: Option<Arc<NoticeRing>>,
    ends_after_s: Option<f64>,
    ready: Option<Instant>,
    /// The solver's newest report, and what the supervisor was told of it.
    wound: Option<WoundReport>,
    standing: Standing,
}

impl Watch<'_> {
    fn until_finished(&mut self, control: &mut ControlLine, servo: &Loop, bridge: &Bridge) -> Result<(), ServerError> {
        let mut supervised = true;
        let mut heartbeats = 0_u32;
        while !servo.is_finished() {
            if supervised {
                match control.next(Some(HEARTBEAT))? {
                    Some(Incoming::Order(order)) => self.follow(&order),
                    Some(Incoming::SupervisorGone) => {
                        supervised = false;
                        self.links.order_stop();
                    }
                    None => {}
                }
            } else {
                std::thread::sleep(Duration::from_millis(1));
            }
            self.beat();
            if bridge.is_finished() {
                // Without ports there is no force: end in order; why it ended is told when it is joined.
                self.links.order_stop();
            }
            heartbeats = heartbeats.wrapping_add(1);
            if heartbeats.is_multiple_of(HEARTBEATS_PER_TELLING) {
                self.tell();
            }
        }
        self.tell();
        Ok(())
    }

    fn follow(&self, order: &ToServo) {
        match order {
            ToServo::Start(_) => tracing::warn!("a second specification was ignored"),
            ToServo::SolverDied => self.links.report_solver_death(),
            ToServo::SolverUp => tracing::info!("a solver was started"),
            ToServo::Rearm => self.links.order_rearm(),
            ToServo::Stop => self.links.order_stop(),
        }
    }

    /// Ready once, then heartbeats; ends the run with its recorded hand.
    fn beat(&mut self) {
        let ticks = self.links.ticks.load(Ordering::Relaxed);
        match self.ready {
            None if ticks > 0 => {
                self.ready = Some(Instant::now());
                ControlLine::report(&FromServo::Ready);
            }
            None => {}
            Some(since) => {
                ControlLine::report(&FromServo::Heartbeat { ticks });
                self.tell_standing();
                if self.ends_after_s.is_some_and(|s| since.elapsed().as_secs_f64() >= s) {
                    self.links.order_stop();
                }
            }
        }
        if self.stop.load(Ordering::Relaxed) {
            self.links.order_stop();
        }
    }

    /// Where the session stands, whenever that has changed.
    fn tell_standing(&mut self) {
        let Some(report) = self.delivery.reports.pop() else { return };
        let standing = Standing::of(&report);
        self.wound = Some(report);
        if standing != self.standing {
            ControlLine::report(&FromServo::Standing(standing.clone()));
            self.standing = standing;
        }
    }

    /// Events into the log; a fault to the supervisor, with its flight record in a file.
    fn tell(&mut self) {
        for what in self.notices.iter().flat_map(|ring| telemetry::tell_notices(ring)) {
            ControlLine::report(&FromServo::Fault { what });
        }
        let told = telemetry::tell(&mut self.events, self.links);
        // After the events: the tick of a fault that was just told is in here.
        self.flight_record.take(&mut self.flight);
        let Some(fault) = told.fault else { return };
        let path = self.spec.run_dir.parent().unwrap_or(Path::new(".")).join(FLIGHT_RECORD);
        let written = std::fs::File::create(&path).and_then(|mut file| self.flight_record.write(&mut file));
        match written {
            Ok(ticks) => tracing::error!("the last {ticks} ticks before the fault are in {}", path.display()),
            Err(error) => tracing::error!("the flight record {} cannot be written: {error}", path.display()),
        }
        ControlLine::report(&FromServo::Fault { what: fault.to_string() });
    }
}
