//! Kernel, its preemption model, the machine below it, its clock, its timer slack.
//!
//! Only PREEMPT_RT bounds the time to a wake-up; every other model is a warning, because the server runs on it and is late now
//! and then. A hypervisor takes the processor away without telling its guest. A clock source other than the processor's own
//! costs microseconds per look. Sources: kernel documentation of `preempt=`, LinuxCNC latency tests.

use super::check::Check;
use crate::machine::Machine;

/// Coarsest step of the clock with which 1 kHz can be slept, nanoseconds: high-resolution timers have 1.
const COARSEST_NS: u64 = 1_000;

/// How the kernel gives way to a thread of higher priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Preemption {
    /// PREEMPT_RT.
    RealTime,
    /// Anywhere in the kernel but under locks.
    Full,
    /// Chosen at boot, to something less than full or unknown to us.
    Dynamic,
    /// At the end of system calls only, or at a few more points.
    Server,
}

/// Reads the model from `/proc/version`, `/sys/kernel/realtime`, the boot line and the debug file (`none (full) lazy`).
pub(super) fn preemption(version: &str, realtime: Option<&str>, boot: &str, debug: Option<&str>) -> Preemption {
    let has = |word: &str| version.split_whitespace().any(|w| w == word);
    let booted_full = boot.split_whitespace().any(|w| w == "preempt=full");
    if realtime == Some("1") || has("PREEMPT_RT") {
        Preemption::RealTime
    } else if has("PREEMPT_DYNAMIC") {
        let is_full = debug.map_or(booted_full, |modes| modes.contains("(full)"));
        if is_full { Preemption::Full } else { Preemption::Dynamic }
    } else if has("PREEMPT") {
        Preemption::Full
    } else {
        Preemption::Server
    }
}

/// The rows of this family. `resolution_ns` is the step of the monotonic clock, `slack_kept` why the timer slack could not be set.
pub(super) fn checks(machine: &Machine, resolution_ns: u64, slack_kept: Option<&str>) -> Vec<Check> {
    vec![kernel(machine), hypervisor(machine), clock(machine, resolution_ns), timer_slack(machine, slack_kept)]
}

fn kernel(machine: &Machine) -> Check {
    let Some(version) = machine.value("/proc/version") else {
        return Check::fail("kernel", "/proc is not there", "mount -t proc proc /proc", crate::exit::UNAVAILABLE);
    };
    let release = version.split_whitespace().nth(2).unwrap_or("unknown").to_owned();
    let model = preemption(
        &version,
        machine.value("/sys/kernel/realtime").as_deref(),
        &machine.text("/proc/cmdline").unwrap_or_default(),
        machine.text("/sys/kernel/debug/sched/preempt").as_deref(),
    );
    let install = "install a real-time kernel (Debian: apt install linux-image-rt-amd64) and boot it";
    match model {
        Preemption::RealTime => Check::ok("kernel", format!("Linux {release}, PREEMPT_RT")),
        Preemption::Full => {
            Check::warn("kernel", format!("Linux {release}, fully preemptible, wake-ups not bounded"), install)
        }
        Preemption::Dynamic => Check::warn(
            "kernel",
            format!("Linux {release}, preemption chosen at boot and not known to be full, wake-ups not bounded"),
            format!("boot with preempt=full, or {install}"),
        ),
        Preemption::Server => {
            Check::warn("kernel", format!("Linux {release}, not preemptible, wake-ups late by milliseconds"), install)
        }
    }
}

fn hypervisor(machine: &Machine) -> Check {
    let cpuinfo = machine.text("/proc/cpuinfo").unwrap_or_default();
    let flags = cpuinfo.lines().find(|line| line.starts_with("flags")).unwrap_or_default();
    let is_guest = flags.split_whitespace().any(|flag| flag == "hypervisor") || machine.has("/sys/hypervisor/type");
    if !is_guest {
        return Check::ok("hypervisor", "none seen");
    }
    let found = "a virtual machine: its host takes processors away unseen, hard real time cannot be promised";
    Check::warn("hypervisor", found, "drive a real device from the machine itself, not from a guest")
}

fn clock(machine: &Machine, resolution_ns: u64) -> Check {
    let name = machine.value("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    let name = name.unwrap_or_else(|| "not told".to_owned());
    let found = format!("source {name}, step {resolution_ns} ns");
    if resolution_ns > COARSEST_NS {
        let remedy = "use a kernel with CONFIG_HIGH_RES_TIMERS, and no highres=off in the boot line";
        return Check::fail("clock", found, remedy, crate::exit::UNAVAILABLE);
    }
    match name.as_str() {
        "hpet" | "acpi_pm" | "jiffies" | "refined-jiffies" | "pit" => {
            Check::warn("clock", found, "see `dmesg | grep -i tsc` for why the processor's own clock is not used")
        }
        _ => Check::ok("clock", found),
    }
}

fn timer_slack(machine: &Machine, kept: Option<&str>) -> Check {
    let slack = machine.value("/proc/self/timerslack_ns").unwrap_or_else(|| "not told".to_owned());
    match kept {
        None => Check::ok("timer_slack", format!("{slack} ns here, the servo sets its own to 1 ns")),
        Some(cause) => Check::warn(
            "timer_slack",
            format!("{slack} ns, and it stays as it is ({cause})"),
            "give real-time scheduling, which has no slack",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use proptest::prelude::*;

    #[test]
    fn the_model_is_read_from_what_kernels_say_of_themselves() {
        let debian_rt = "Linux version 6.1.0-56-rt-amd64 (x@y) (gcc) #1 SMP PREEMPT_RT Debian 6.1.1";
        let dynamic = "Linux version 6.18 (x@y) #1 SMP PREEMPT_DYNAMIC @0";
        for (version, realtime, boot, debug, expected) in [
            (debian_rt, None, "", None, Preemption::RealTime),
            ("Linux version 5 #1 SMP PREEMPT RT", Some("1"), "", None, Preemption::RealTime),
            (dynamic, None, "quiet", None, Preemption::Dynamic),
            (dynamic, None, "quiet preempt=full", None, Preemption::Full),
            (dynamic, None, "preempt=full", Some("(none) voluntary full"), Preemption::Dynamic),
            (dynamic, Some("0"), "", Some("none voluntary (full) lazy"), Preemption::Full),
            ("Linux version 4 #1 SMP PREEMPT", None, "", None, Preemption::Full),
            ("Linux version 4 #1 SMP", None, "", None, Preemption::Server),
        ] {
            assert_eq!(preemption(version, realtime, boot, debug), expected, "{version} {boot} {debug:?}");
        }
    }

    #[test]
    fn a_rig_is_well_and_a_guest_with_a_coarse_clock_is_not() {
        let rig = Tree::new()
            .with("proc/version", "Linux version 6.1.0-rt (x) #1 SMP PREEMPT_RT Debian")
            .with("proc/cpuinfo", "processor : 0\nflags\t: fpu vme\n")
            .with("proc/self/timerslack_ns", "50000\n")
            .with("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
        assert!(checks(&rig.machine(), 1, None).iter().all(|c| c.status == Status::Ok));
        let guest = Tree::new()
            .with("proc/version", "Linux version 6.1.0 (x) #1 SMP")
            .with("proc/cpuinfo", "flags : fpu hypervisor")
            .with("sys/devices/system/clocksource/clocksource0/current_clocksource", "acpi_pm\n");
        let rows = checks(&guest.machine(), 4_000_000, Some("refused"));
        let status: Vec<_> = rows.iter().map(|c| c.status).collect();
        assert_eq!(status, [Status::Warn, Status::Warn, Status::Fail, Status::Warn]);
        assert_eq!(clock(&guest.machine(), 1).status, Status::Warn);
        assert_eq!(kernel(&Tree::new().machine()).status, Status::Fail, "no /proc");
    }

    proptest! {
        #[test]
        fn no_text_stops_the_reading(version in ".{0,80}", other in ".{0,40}") {
            let tree = Tree::new().with("proc/version", &version).with("proc/cpuinfo", &other).with("proc/cmdline", &other);
            prop_assert_eq!(checks(&tree.machine(), 1, None).len(), 4);
        }
    }
}
