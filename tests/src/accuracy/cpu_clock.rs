//! Processor time: what other processes of a shared machine take does not count.

use rustix::time::{ClockId, clock_gettime};

/// Processor seconds of the calling thread so far.
pub(super) fn thread_cpu_s() -> f64 {
    seconds(ClockId::ThreadCPUTime)
}

/// Processor seconds of all threads of this process so far.
pub(super) fn process_cpu_s() -> f64 {
    seconds(ClockId::ProcessCPUTime)
}

fn seconds(clock: ClockId) -> f64 {
    let now = clock_gettime(clock);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
