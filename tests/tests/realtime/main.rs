//! The servo's promises, against a virtual clock: no allocation in a tick, equal bits for equal inputs, a bounded force
//! whatever comes in, the late-solver ladder, faults that latch, and the room on its thread. No wall-clock asserts.

mod allocator;
mod bounds;
mod coupling;
mod determinism;
mod faults;
mod ladder;
mod no_allocation;
mod ramp;
mod rig;
mod room;
mod solver_steps;
