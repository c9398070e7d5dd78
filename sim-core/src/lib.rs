//! The suture simulator of Zhang et al. as pure functions of their inputs: no clock, file, socket,
//! environment or random source; equal inputs give equal bits.

pub mod absent;
pub mod finite;
pub mod kinematics;
pub mod scene;
pub mod suture_line;
pub mod tissue;
pub mod units;
pub mod vector;
pub mod wound;
