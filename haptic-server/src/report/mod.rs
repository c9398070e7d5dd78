//! What a run leaves behind: pictures (`radar`, `series`). Plain SVG text, made
//! after the run; nothing here is near the servo.

pub mod radar;
pub mod series;
mod svg;
