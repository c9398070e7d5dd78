//! The 1 kHz servo process, the deformation solver, and the supervisor that guards the force.

pub mod device;
pub mod hand;
pub mod report;
pub mod servo;
