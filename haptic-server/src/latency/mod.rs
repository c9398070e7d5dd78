//! How well this machine keeps 1 kHz: a plain timer that does nothing else, and the grade for what was measured.
//!
//! Used by `latency-harness` (beside the live server) and by `doctor --latency` (alone, or under load).

mod grade;
mod plain_timer;

pub use grade::{Grade, grade, success_rate};
pub use plain_timer::{Baseline, Measured};
