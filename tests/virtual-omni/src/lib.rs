//! A virtual PHANTOM Omni behind the C interface of the vendor's device library.
//!
//! Built as a shared library that the server loads by path, as it would load `libHD.so`, and as a Rust library for tests
//! that step it. Geometry is exact (`arm.rs`), semantics are those that a client can observe: frames, current device,
//! error stack, scheduler, limits, ramp, calibration, temperature, watchdog, unplugging. Never installed, and no vendor
//! file, header or text is in it: all of it is written from the interface's description.
//! [`control`] is the side channel: faults, the led stylus, what arrived.

mod abi;
mod abi_control;
mod ailments;
mod arm;
mod clockwork;
pub mod codes;
pub mod control;
mod device;
mod errors;
mod eyes;
mod faults;
mod grip;
mod log;
mod motors;
mod parameters;
mod scheduler;
pub mod sight;
mod world;

pub use abi::functions;
pub use arm::{INKWELL_JOINTS_RAD, TORQUE_STEP_NM};
pub use device::Calibration;
pub use errors::ErrorInfo;
pub use faults::Fault;
pub use log::FrameRow;
pub use motors::WATCHDOG_S;
pub use world::{Mover, Setup, Timing};
