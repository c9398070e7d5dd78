//! `haptic-server run`: the parent of servo, solver and viewer, and the guard of the force.

pub mod child;
pub mod guard;
pub mod signals;
