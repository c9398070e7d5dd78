//! Processor time of the calling thread: what other processes of a shared machine take does not count.

use rustix::time::{ClockId, clock_gettime};

/// Processor seconds of this thread so far.
pub(super) fn thread_cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
