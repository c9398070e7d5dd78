//! The viewer's only clock: seconds since it was started.

use std::time::{Duration, Instant};

/// Seconds since a start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    start: Instant,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self { start: Instant::now() }
    }

    pub(super) fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// The instant at which so many seconds have passed.
    pub(super) fn at(&self, now_s: f64) -> Instant {
        self.start + Duration::from_secs_f64(now_s.max(0.0))
    }
}
