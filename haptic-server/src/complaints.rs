//! Messages that are rejected: the last good one stays in use, and the log hears of it once in a while, with their number.
//!
//! A writer may send nonsense as often as it likes; the log of a reader grows by a line a second at most. Time comes in with the
//! call that tests use, else from the monotonic clock.

use protocol::ports::PortError;
use protocol::wire::WireError;
use std::time::{Duration, Instant};

/// Rejected messages are logged at most this often.
const PERIOD: Duration = Duration::from_secs(1);

/// What one reader was sent and could not use.
#[derive(Debug, Default)]
pub struct Complaints {
    last: Option<Instant>,
    untold: u64,
}

impl Complaints {
    /// A rejected message counts as none; any other error stays one.
    ///
    /// # Errors
    /// Whatever is not [`PortError::Rejected`].
    pub fn kept<M>(&mut self, received: Result<Option<M>, PortError>) -> Result<Option<M>, PortError> {
        match received {
            Err(PortError::Rejected(error)) => {
                self.hear(&error);
                Ok(None)
            }
            other => other,
        }
    }

    /// The same for a reader that hands messages over by another way.
    ///
    /// # Errors
    /// Whatever is not [`PortError::Rejected`].
    pub fn passed(&mut self, received: Result<(), PortError>) -> Result<(), PortError> {
        self.kept(received.map(Some)).map(drop)
    }

    /// Counts a rejected message, and logs it when the log has not heard of any for a while.
    fn hear(&mut self, error: &WireError) {
        if let Some(count) = self.due(Instant::now()) {
            tracing::warn!("{count} messages were rejected, lately: {error}; the last good one stays in use");
        }
    }

    /// One more; how many there are to tell, if it is time to.
    fn due(&mut self, now: Instant) -> Option<u64> {
        self.untold += 1;
        if self.last.is_some_and(|last| now.saturating_duration_since(last) < PERIOD) {
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_seconds_of_nonsense_are_told_ten_times_and_counted_whole() {
        let mut complaints = Complaints::default();
        // Wall clock: only where the count begins; the test makes the times after it.
        let began = Instant::now();
        let told: Vec<u64> = (0..10_000).filter_map(|ms| complaints.due(began + Duration::from_millis(ms))).collect();
        assert_eq!(told, [1, 1_000, 1_000, 1_000, 1_000, 1_000, 1_000, 1_000, 1_000, 1_000]);
        assert_eq!(complaints.untold, 999);
    }

    #[test]
    fn only_what_was_rejected_counts_as_nothing() {
        let mut complaints = Complaints::default();
        let rejected = PortError::Rejected(WireError::Magic { found: 7 });
        assert_eq!(complaints.kept::<u32>(Err(rejected)), Ok(None));
        assert_eq!(complaints.kept(Ok(Some(3))), Ok(Some(3)));
        let broken = PortError::JoinTimeout { seconds: 2 };
        assert_eq!(complaints.kept::<u32>(Err(broken.clone())), Err(broken));
    }
}
