//! What a run leaves behind: pictures (`radar`, `series`) and tables (`tables`). Plain SVG and CSV text, made
//! after the run; nothing here is near the servo.

pub mod radar;
pub mod series;
pub mod svg;
pub mod tables;
