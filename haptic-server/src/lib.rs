//! The 1 kHz servo process, the deformation solver, and the supervisor that guards the force.

pub mod clean;
pub mod cli;
pub mod convert;
pub mod device;
pub mod error;
pub mod exit;
pub mod flight_record;
pub mod hand;
pub mod inspect;
pub mod lockstep;
pub mod logging;
pub mod realtime;
pub mod record;
pub mod report;
pub mod rig;
pub mod scene_file;
pub mod servo;
pub mod servo_link;
pub mod servo_process;
pub mod servo_setup;
pub mod session;
pub mod solver;
pub mod solver_process;
pub mod summary;
pub mod supervisor;
pub mod telemetry;
