//! What goes into a tick and what comes out of it, beside `servo_state`.
//!
//! Orders are counters where they could be lost between two ticks; times come in with the tick, nanoseconds and seconds.
//! Deliberately absent: what the tick does with them (`tick.rs`), and how they reach the servo thread (`servo_setup.rs`).

use crate::device::{DeviceCommand, DeviceSample, TickTime};
use crate::servo::clock::Wakefulness;
use crate::servo::events::EventBatch;
pub use protocol::servo_state::{FLAG_DEGRADED, FLAG_STOPPING};
use protocol::tissue_port::TissuePort;

/// With which rights the servo runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rights {
    /// Real-time scheduling and locked memory, or a virtual clock.
    Full,
    /// Neither can be promised.
    Degraded,
}

/// Whether the servo should go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StopOrder {
    /// Go on.
    #[default]
    GoOn,
    /// Fade to zero force and end.
    Stop,
}

/// Orders from outside the loop; counters, so that none is lost or taken twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// Deaths of the solver that the supervisor has reported since start.
    pub solver_deaths: u32,
    /// Re-arm commands since start.
    pub rearms: u32,
    /// Stop order.
    pub stop: StopOrder,
}

/// What one tick needs.
#[derive(Clone, Copy, Debug)]
pub struct TickInput<'a> {
    /// When.
    pub time: TickTime,
    /// From the device.
    pub sample: &'a DeviceSample,
    /// The newest port, when one has arrived since the last tick.
    pub new_port: Option<&'a TissuePort>,
    /// Orders.
    pub orders: Orders,
    /// Whether the machine slept since the last tick.
    pub wakefulness: Wakefulness,
}

/// What one tick gives, beside [`Servo::state`](crate::servo::tick::Servo::state).
#[derive(Clone, Copy, Debug)]
pub struct TickOutput {
    /// For the device.
    pub command: DeviceCommand,
    /// What happened.
    pub events: EventBatch,
    /// `CLIP_…` bits of the safety stage.
    pub clips: u32,
}
