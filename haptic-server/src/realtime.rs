//! Real-time rights of the servo thread: asked for, and when missing said exactly, with the remedy.
//!
//! Asked: `SCHED_FIFO` (thread-priority), `mlockall`, a prefaulted stack, the smallest timer slack, optionally one
//! processor. Without rights the first fails with EPERM; `mlockall` fails with ENOMEM when RLIMIT_MEMLOCK is smaller than
//! the process and with EPERM when it is 0. Call [`acquire`] on the servo thread itself, before its loop.
//! Deliberately absent: unsafe code, and the decision what a missing right means for a device (see [`judge`]).

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, CpuSet, capabilities, sched_setaffinity, set_current_timer_slack};
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::num::NonZeroU64;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// Priority of the servo thread: above ordinary real-time work, below the kernel's interrupt threads' watchdogs.
pub const SERVO_PRIORITY: u8 = 80;
/// Stack that is touched before the loop, bytes; the servo thread is given 512 KiB.
const PREFAULT: usize = 256 * 1024;
/// Locked memory that the process may come to need, bytes: below it, locking what is mapped later would make a later
/// mapping fail.
pub const LOCK_ROOM: u64 = 256 * 1024 * 1024;
/// Size of a page at least, bytes.
const PAGE: usize = 4096;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealtimeConfig {
    /// `SCHED_FIFO` priority, 1 to 99.
    pub priority: u8,
    /// Processor to stay on.
    pub processor: Option<usize>,
}

impl Default for RealtimeConfig {
    fn default() -> Self {
        Self { priority: SERVO_PRIORITY, processor: None }
    }
}

/// Whether a run may go on without rights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RightsPolicy {
    /// A real device: no rights, no run.
    Required,
    /// Simulated, replayed or pointer device, or the operator said so: go on, marked degraded.
    DegradedAllowed,
}

/// A right that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Right {
    /// `SCHED_FIFO`.
    Scheduling,
    /// `mlockall`.
    Memory,
    /// One processor.
    Processor,
    /// Timer slack.
    TimerSlack,
}

impl Right {
    /// Whether the servo's promises hang on it.
    #[must_use]
    pub fn is_needed(self) -> bool {
        matches!(self, Self::Scheduling | Self::Memory)
    }
}

/// A right that was not given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingRight {
    /// Which.
    pub right: Right,
    /// What the system said.
    pub cause: String,
}

/// What was asked for and not given, and the limits found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealtimeRights {
    /// Priority asked for.
    pub priority: u8,
    /// Empty when everything was given.
    pub missing: Vec<MissingRight>,
    /// `RLIMIT_RTPRIO` (soft); `None` = unlimited.
    pub rtprio_limit: Option<u64>,
    /// `RLIMIT_MEMLOCK` (soft), bytes; `None` = unlimited.
    pub memlock_limit: Option<u64>,
}

/// A run that must not go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{rights}\n{REMEDY}\nor run without these rights under --allow-no-rt")]
pub struct RightsMissing {
    /// What is missing.
    pub rights: RealtimeRights,
}

/// How to get the rights.
pub const REMEDY: &str = "Give the rights in one of these ways:
  limits      write \"@haptic - rtprio 95\" and \"@haptic - memlock unlimited\" into /etc/security/limits.d/haptic.conf, log in again as a member of group haptic
  capability  setcap cap_sys_nice,cap_ipc_lock+ep haptic-server
  systemd     LimitRTPRIO=95 and LimitMEMLOCK=infinity in the unit";

/// Asks for everything on the calling thread; never fails, says what is missing.
#[must_use]
pub fn acquire(config: &RealtimeConfig) -> RealtimeRights {
    let mut missing = Vec::new();
    let mut note = |right, outcome: Result<(), String>| {
        if let Err(cause) = outcome {
            missing.push(MissingRight { right, cause });
        }
    };
    let memlock_limit = getrlimit(Resource::Memlock).current;
    note(Right::Memory, lock_memory(memlock_limit));
    note(Right::Scheduling, schedule_fifo(config.priority));
    note(Right::TimerSlack, set_current_timer_slack(NonZeroU64::new(1)).map_err(|e| e.to_string()));
    if let Some(processor) = config.processor {
        note(Right::Processor, stay_on(processor));
    }
    prefault_stack();
    RealtimeRights {
        priority: config.priority,
        missing,
        rtprio_limit: getrlimit(Resource::Rtprio).current,
        memlock_limit,
    }
}

/// Keeps every processor out of its deep sleeps while the file that is given back stays open; `None` where this user may not.
///
/// The kernel takes a 32-bit number of microseconds that a wake-up may cost (PM QoS) and forgets it when the file is closed.
#[must_use]
pub fn stay_awake() -> Option<File> {
    let mut node = OpenOptions::new().write(true).open("/dev/cpu_dma_latency").ok()?;
    node.write_all(&0_i32.to_ne_bytes()).ok()?;
    Some(node)
}

/// Whether the run may go on.
///
/// # Errors
/// [`RightsMissing`] under [`RightsPolicy::Required`] when a needed right is missing.
pub fn judge(rights: &RealtimeRights, policy: RightsPolicy) -> Result<(), RightsMissing> {
    match policy {
        RightsPolicy::Required if rights.is_degraded() => Err(RightsMissing { rights: rights.clone() }),
        RightsPolicy::Required | RightsPolicy::DegradedAllowed => Ok(()),
    }
}

impl RealtimeRights {
    /// Whether a right is missing on which the servo's promises hang.
    #[must_use]
    pub fn is_degraded(&self) -> bool {
        self.missing.iter().any(|m| m.right.is_needed())
    }

    /// One sentence per missing right, for reports.
    #[must_use]
    pub fn reasons(&self) -> Vec<String> {
        let limit = |limit: Option<u64>| limit.map_or_else(|| "unlimited".to_owned(), |l| l.to_string());
        let sentence = |m: &MissingRight| match m.right {
            Right::Scheduling => format!(
                "no real-time scheduling: SCHED_FIFO {} was refused ({}); RLIMIT_RTPRIO is {}",
                self.priority,
                m.cause,
                limit(self.rtprio_limit)
            ),
            Right::Memory => format!(
                "memory is not locked: mlockall was refused ({}); RLIMIT_MEMLOCK is {} bytes",
                m.cause,
                limit(self.memlock_limit)
            ),
            Right::Processor => format!("the servo thread is not bound to its processor ({})", m.cause),
            Right::TimerSlack => format!("the timer slack stays as it is ({})", m.cause),
        };
        self.missing.iter().map(sentence).collect()
    }
}

impl fmt::Display for RealtimeRights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.missing.is_empty() {
            return write!(f, "real-time rights are complete: SCHED_FIFO {}, memory locked", self.priority);
        }
        f.write_str(&self.reasons().join("; "))
    }
}

/// Locks what is mapped; what is mapped later, too, unless the limit could then make a mapping fail.
fn lock_memory(limit: Option<u64>) -> Result<(), String> {
    let is_unbounded = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    let has_room = is_unbounded || limit.is_none_or(|bytes| bytes >= LOCK_ROOM);
    let later = if has_room { MlockAllFlags::FUTURE } else { MlockAllFlags::empty() };
    mlockall(MlockAllFlags::CURRENT | later).map_err(|e| e.to_string())
}

fn schedule_fifo(priority: u8) -> Result<(), String> {
    let priority = priority.try_into().map_err(|_| format!("priority {priority} is out of range"))?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), fifo).map_err(|e| {
        match e {
            thread_priority::Error::OS(errno) => std::io::Error::from_raw_os_error(errno).to_string(),
            other => other.to_string(),
        }
    })
}

fn stay_on(processor: usize) -> Result<(), String> {
    if processor >= CpuSet::MAX_CPU {
        return Err(format!("there is no processor {processor}"));
    }
    let mut set = CpuSet::new();
    set.set(processor);
    sched_setaffinity(None, &set).map_err(|e| e.to_string())
}

/// Touches the stack that the loop may come to use.
#[inline(never)]
fn prefault_stack() {
    let mut stack = [0_u8; PREFAULT];
    for page in stack.chunks_mut(PAGE) {
        page[0] = std::hint::black_box(1);
    }
    std::hint::black_box(&stack);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lacking(rights: &[Right]) -> RealtimeRights {
        let missing = rights
            .iter()
            .map(|&right| MissingRight { right, cause: "Operation not permitted (os error 1)".to_owned() });
        RealtimeRights { priority: 80, missing: missing.collect(), rtprio_limit: Some(0), memlock_limit: Some(65_536) }
    }

    #[test]
    fn what_is_missing_is_said_with_its_limit_and_remedy() {
        let rights = lacking(&[Right::Scheduling, Right::Memory]);
        let error = judge(&rights, RightsPolicy::Required).expect_err("rights are missing").to_string();
        for part in
            ["SCHED_FIFO 80", "RLIMIT_RTPRIO is 0", "65536 bytes", "limits.d", "setcap", "systemd", "--allow-no-rt"]
        {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
        assert_eq!(judge(&rights, RightsPolicy::DegradedAllowed), Ok(()));
        assert_eq!(rights.reasons().len(), 2);
    }

    #[test]
    fn comfort_is_no_right() {
        let rights = lacking(&[Right::TimerSlack, Right::Processor]);
        assert!(!rights.is_degraded());
        assert_eq!(judge(&rights, RightsPolicy::Required), Ok(()));
        assert!(lacking(&[]).to_string().contains("complete"));
    }

    #[test]
    fn asking_tells_what_the_kernel_says_afterwards() {
        // On its own thread: a test runner's threads keep their scheduling.
        let (rights, is_fifo) = std::thread::spawn(|| {
            let rights = acquire(&RealtimeConfig { processor: Some(usize::MAX), ..RealtimeConfig::default() });
            let policy = thread_priority::thread_schedule_policy().expect("own policy");
            // Locked memory is for the whole process: give it back.
            rustix::mm::munlockall().expect("nothing can forbid it");
            (rights, policy == ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo))
        })
        .join()
        .expect("thread");
        assert_eq!(is_fifo, !rights.missing.iter().any(|m| m.right == Right::Scheduling));
        assert!(rights.missing.iter().any(|m| m.right == Right::Processor));
    }
}
