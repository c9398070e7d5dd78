//! Kinematics of suture points and attachments (Zhang et al., Eq. (1)–(3)): small `Copy` values and
//! slices in, small `Copy` values out. No heap, no clock, no upper module: every function here may run
//! inside the 1 kHz servo tick.

pub mod attachment;
pub mod capstan;
pub mod coupling;
pub mod integrate;
pub mod line_pull;
pub mod literal_tick;
mod node_equation;
pub mod patch;
pub mod port_tick;
pub mod suture_point;
