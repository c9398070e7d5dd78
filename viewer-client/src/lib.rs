//! Looks at a running server through shared memory and says in a terminal what it sees: servo, suturing, Table 1.
//! Depends on `protocol` only: a viewer that is late, dead or attached ten times costs the servo nothing.
//! Deliberately absent: drawing.

pub mod app;
pub mod camera;
pub mod colour;
pub mod feed;
pub mod gpu;
pub mod headless;
pub mod notice;
pub mod orders;
pub mod overlay;
pub mod pick;
pub mod render;
pub mod replay;
pub mod samples;
pub mod series;
pub mod status;
