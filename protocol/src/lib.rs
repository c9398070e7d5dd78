//! The wire of the suture-surgery server: POD messages (one file each), service names, versions,
//! ports per role, run directory and trace format. No physics.

pub mod names;
pub mod pointer_hand;
pub mod ports;
pub mod run;
pub mod scene_frame;
pub mod servo_state;
pub mod session_command;
pub mod text;
pub mod tissue_port;
pub mod trace;
pub mod wire;
pub mod words;
pub mod wound_report;
