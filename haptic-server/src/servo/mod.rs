//! The 1 kHz room, behind a lint wall.
//!
//! Nothing in here may allocate, lock, log, print, read a file or the network, sleep, or read a clock by itself: the
//! lists in `clippy.toml` are denied in this module and its children. What needs the heap (rings, histograms) is made
//! outside, in `servo_setup.rs`. Only [`thread`] touches device and ports; a force leaves only through [`safety`].

#![deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::disallowed_macros)]

pub mod clock;
pub mod coupling;
pub mod energy;
pub mod events;
pub mod flight_recorder;
pub mod ladder;
pub mod orders;
pub mod params;
pub mod safety;
pub mod sample;
mod second_arm;
pub mod state_machine;
pub mod stats;
pub mod thread;
pub mod tick;
