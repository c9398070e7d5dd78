//! Looks at a running server through shared memory, or at a recording: in a window, without a screen, or as lines of text.
//! Depends on `protocol` only: a viewer that is late, dead or attached ten times costs the servo nothing.

pub mod app;
pub mod camera;
pub mod colour;
mod desk;
pub mod feed;
pub mod gpu;
pub mod hand_thread;
pub mod headless;
pub mod notice;
pub mod orders;
pub mod overlay;
pub mod pick;
pub mod play;
pub mod pointer;
pub mod render;
pub mod replay;
pub mod samples;
pub mod series;
pub mod source;
pub mod status;
pub mod tell;
pub mod window;

// Under this name the scenes and the comparison of pictures, which are shared with the viewer's tests, know it.
#[cfg(test)]
extern crate self as viewer_client;
