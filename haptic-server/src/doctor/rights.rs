//! Real-time rights: what the limits and capabilities promise, and what the kernel did when it was asked.
//!
//! SCHED_FIFO 80 needs RLIMIT_RTPRIO ≥ 80 or CAP_SYS_NICE; locked memory needs RLIMIT_MEMLOCK ≥ 256 MiB or CAP_IPC_LOCK. The
//! remedy depends on how far the machine is prepared: no limits file, no member of the group, not logged in again since.
//! Throttling and control groups stand in `budget.rs`. Sources: `setrlimit(2)`, `capabilities(7)`, `pam_limits(8)`.

use super::check::Check;
use crate::exit;
use crate::machine::{GROUP, Machine, Membership};
use crate::realtime::{LOCK_ROOM, RealtimeRights, Right, SERVO_PRIORITY};

/// CAP_IPC_LOCK and CAP_SYS_NICE: their bits in `/proc/self/status`.
const IPC_LOCK: u32 = 14;
const SYS_NICE: u32 = 23;

/// A resource limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    /// At most this.
    Most(u64),
    /// None.
    Unlimited,
}

impl Limit {
    fn allows(self, need: u64) -> bool {
        match self {
            Self::Most(most) => most >= need,
            Self::Unlimited => true,
        }
    }
}

/// The soft limit of this name in `/proc/self/limits`.
pub(super) fn soft_limit(limits: &str, name: &str) -> Option<Limit> {
    let value = limits.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?;
    if value == "unlimited" { Some(Limit::Unlimited) } else { value.parse().ok().map(Limit::Most) }
}

/// Whether `/proc/self/status` says that this capability is in effect.
pub(super) fn has_capability(status: &str, bit: u32) -> bool {
    let set = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    set.and_then(|hex| u64::from_str_radix(hex.trim(), 16).ok()).is_some_and(|set| set >> bit & 1 == 1)
}

/// The rows of this family; `asked` is what the kernel said to a thread that asked for everything.
pub(super) fn checks(machine: &Machine, asked: &RealtimeRights) -> Vec<Check> {
    vec![rtprio(machine), memlock(machine), trial(machine, asked)]
}

fn rtprio(machine: &Machine) -> Check {
    let limit = soft_limit(&machine.text("/proc/self/limits").unwrap_or_default(), "Max realtime priority");
    if has_capability(&machine.text("/proc/self/status").unwrap_or_default(), SYS_NICE) {
        return Check::ok("rtprio_limit", "CAP_SYS_NICE stands in for it");
    }
    let need = u64::from(SERVO_PRIORITY);
    match limit {
        Some(limit) if limit.allows(need) => Check::ok("rtprio_limit", priority_text(limit)),
        Some(limit) => Check::fail(
            "rtprio_limit",
            format!("{}, the servo needs {need}", priority_text(limit)),
            remedy(machine),
            exit::PERMISSION,
        ),
        None => Check::warn("rtprio_limit", "not told by the kernel", "look at `ulimit -r`"),
    }
}

fn priority_text(limit: Limit) -> String {
    match limit {
        Limit::Most(most) => format!("real-time priority up to {most}"),
        Limit::Unlimited => "real-time priority without limit".to_owned(),
    }
}

fn memlock(machine: &Machine) -> Check {
    let limit = soft_limit(&machine.text("/proc/self/limits").unwrap_or_default(), "Max locked memory");
    if has_capability(&machine.text("/proc/self/status").unwrap_or_default(), IPC_LOCK) {
        return Check::ok("memlock_limit", "CAP_IPC_LOCK stands in for it");
    }
    let room_mib = LOCK_ROOM >> 20;
    match limit {
        Some(Limit::Unlimited) => Check::ok("memlock_limit", "locked memory without limit"),
        Some(limit @ Limit::Most(most)) => {
            let found = format!("locked memory up to {} KiB", most >> 10);
            if limit.allows(LOCK_ROOM) {
                Check::ok("memlock_limit", found)
            } else {
                let found = format!("{found}, the servo needs {room_mib} MiB");
                Check::fail("memlock_limit", found, remedy(machine), exit::PERMISSION)
            }
        }
        None => Check::warn("memlock_limit", "not told by the kernel", "look at `ulimit -l`"),
    }
}

fn trial(machine: &Machine, asked: &RealtimeRights) -> Check {
    let refused: Vec<Right> = asked.missing.iter().map(|m| m.right).filter(|r| r.is_needed()).collect();
    if refused.is_empty() {
        let found = format!("a thread got SCHED_FIFO {} and its memory was locked", asked.priority);
        return Check::ok("real_time_trial", found);
    }
    let reasons: Vec<String> = asked.reasons();
    Check::fail("real_time_trial", reasons.join("; "), trial_remedy(machine, asked), exit::PERMISSION)
}

/// Where the limit would allow it and the kernel refused, it is the control group.
fn trial_remedy(machine: &Machine, asked: &RealtimeRights) -> String {
    let limited = |limit: Option<u64>| limit.is_some_and(|l| l < u64::from(SERVO_PRIORITY));
    let refused = asked.missing.iter().any(|m| m.right == Right::Scheduling);
    if refused && (machine.is_root() || !limited(asked.rtprio_limit)) {
        "give the control group real-time time (see real_time_budget), or a container --cap-add sys_nice --cap-add ipc_lock".to_owned()
    } else {
        remedy(machine)
    }
}

/// What this user has to do on this machine.
pub(super) fn remedy(machine: &Machine) -> String {
    let user = machine.user_name();
    if machine.is_root() {
        return format!(
            "run as an ordinary user of group {GROUP}, or give this container the capabilities sys_nice and ipc_lock"
        );
    }
    let file = format!("/etc/security/limits.d/{GROUP}.conf");
    if !machine.has(&file) {
        return format!(
            "install the package, or as root: groupadd -f {GROUP}; printf '@{GROUP} - rtprio 95\\n@{GROUP} - memlock unlimited\\n' > {file}; \
             usermod -aG {GROUP} {user}; then log in again"
        );
    }
    match machine.membership() {
        Membership::NoGroup => format!("as root: groupadd -f {GROUP}; usermod -aG {GROUP} {user}; then log in again"),
        Membership::NotListed => format!("as root: usermod -aG {GROUP} {user}; then log in again"),
        Membership::ListedLater => format!("log in again: this session began before {user} joined group {GROUP}"),
        Membership::Member => {
            format!(
                "log in by a way that applies {file} (su -l, ssh, a display manager), or systemctl start haptic-server@{user}"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use crate::realtime::MissingRight;
    use proptest::prelude::*;

    const LIMITS: &str = "Limit                     Soft Limit           Hard Limit           Units     
Max open files            1024                 524288               files     
Max locked memory         8388608              unlimited            bytes     
Max realtime priority     95                   99                   \n";

    fn asked(missing: &[Right], rtprio: u64) -> RealtimeRights {
        let missing = missing.iter().map(|&right| MissingRight { right, cause: "refused".into() }).collect();
        RealtimeRights { priority: SERVO_PRIORITY, missing, rtprio_limit: Some(rtprio), memlock_limit: Some(0) }
    }

    #[test]
    fn limits_and_capabilities_are_read_as_the_kernel_writes_them() {
        assert_eq!(soft_limit(LIMITS, "Max open files"), Some(Limit::Most(1024)));
        assert_eq!(
            soft_limit("Max locked memory  unlimited unlimited bytes", "Max locked memory"),
            Some(Limit::Unlimited)
        );
        assert_eq!(soft_limit(LIMITS, "Max wishes"), None);
        let status = "Name:\tx\nCapEff:\t0000000000804000\n";
        assert!(has_capability(status, IPC_LOCK) && has_capability(status, SYS_NICE) && !has_capability(status, 0));
        assert!(!has_capability("CapEff: many", SYS_NICE) && !has_capability("", SYS_NICE));
    }

    #[test]
    fn a_limit_that_is_too_low_fails_and_a_capability_heals_it() {
        let poor = Tree::new().with("proc/self/limits", LIMITS).with("proc/self/status", "CapEff:\t0\n");
        let status =
            |tree: &Tree| checks(&tree.machine(), &asked(&[], 95)).iter().map(|c| c.status).collect::<Vec<_>>();
        assert_eq!(status(&poor), [Status::Ok, Status::Fail, Status::Ok]);
        let able = poor.with("proc/self/status", "CapEff:\t0000000000804000\n");
        assert_eq!(status(&able), [Status::Ok; 3]);
        let refused = checks(&able.machine(), &asked(&[Right::Scheduling, Right::TimerSlack], 95));
        assert_eq!(refused[2].status, Status::Fail);
        assert!(refused[2].remedy.as_ref().is_some_and(|r| r.contains("control group")), "{refused:?}");
        assert_eq!(checks(&able.machine(), &asked(&[Right::TimerSlack], 95))[2].status, Status::Ok);
    }

    #[test]
    fn the_remedy_is_the_next_step_and_no_other() {
        let bare = Tree::new().with("etc/passwd", "ann:x:1001:1001::/:/bin/sh\n");
        assert!(
            remedy(&bare.machine()).contains("limits.d") && remedy(&bare.machine()).contains("usermod -aG haptic ann")
        );
        let file = bare.with("etc/security/limits.d/haptic.conf", "@haptic - rtprio 95\n");
        assert!(remedy(&file.machine()).starts_with("as root: groupadd"));
        let group = file.with("etc/group", "haptic:x:990:\n");
        assert!(remedy(&group.machine()).starts_with("as root: usermod"));
        let joined = group.with("etc/group", "haptic:x:990:ann\n");
        assert!(remedy(&joined.machine()).starts_with("log in again"));
        let member = joined.with("etc/group", "haptic:x:1001:ann\n");
        assert!(remedy(&member.machine()).contains("systemctl start haptic-server@ann"));
    }

    proptest! {
        #[test]
        fn no_text_stops_the_reading(limits in "(Max (realtime priority|locked memory))?.{0,60}", status in "(CapEff:)?.{0,40}") {
            let tree = Tree::new().with("proc/self/limits", &limits).with("proc/self/status", &status);
            prop_assert_eq!(checks(&tree.machine(), &asked(&[Right::Memory], 0)).len(), 3);
        }
    }
}
