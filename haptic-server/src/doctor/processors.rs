//! Processors: how many, how fast they run, how deep they sleep.
//!
//! The servo needs one for itself now and then, the solver another. A governor other than `performance` lets the clock fall while
//! the servo sleeps. Leaving a deep sleep costs up to its exit latency; the server holds `/dev/cpu_dma_latency` at 0 while it
//! runs, where it may open it. Sources: kernel documentation of cpufreq, cpuidle and PM QoS.

use super::check::Check;
use crate::machine::Machine;

/// Exit latency above which a sleep is felt in the wake-up figures, microseconds.
const DEEP_US: u64 = 50;
/// Most processors that a kernel numbers.
const MOST: u64 = 8192;

/// The rows of this family.
pub(super) fn checks(machine: &Machine) -> Vec<Check> {
    vec![count(machine), governor(machine), sleep(machine)]
}

/// Members of a kernel list (`0-3,6`).
pub(super) fn list_length(list: &str) -> Option<u64> {
    let mut total = 0;
    for part in list.trim().split(',').filter(|p| !p.is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (u64, u64) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        if last < first || last >= MOST {
            return None;
        }
        total += last - first + 1;
    }
    Some(total)
}

fn count(machine: &Machine) -> Check {
    let status = machine.text("/proc/self/status").unwrap_or_default();
    let list =
        status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).map(str::trim).unwrap_or_default();
    let isolated = machine.value("/sys/devices/system/cpu/isolated").filter(|l| !l.is_empty());
    let isolated = isolated.map_or_else(String::new, |list| format!(", isolated: {list}"));
    match list_length(list) {
        None | Some(0) => Check::warn("processors", "not told by the kernel", "look at `nproc`"),
        Some(1) => Check::warn(
            "processors",
            format!("one processor ({list}) for servo and solver together{isolated}"),
            "give this session two: taskset, cpuset, or the machine's settings",
        ),
        Some(many) => Check::ok("processors", format!("{many} ({list}){isolated}")),
    }
}

/// Folders of the processors.
fn folders(machine: &Machine) -> Vec<String> {
    let is_number =
        |name: &&str| name.strip_prefix("cpu").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let names = machine.names("/sys/devices/system/cpu");
    names.iter().map(String::as_str).filter(is_number).map(|name| format!("/sys/devices/system/cpu/{name}")).collect()
}

fn governor(machine: &Machine) -> Check {
    let read = |folder: &String| machine.value(&format!("{folder}/cpufreq/scaling_governor"));
    let governors: Vec<String> = folders(machine).iter().filter_map(read).collect();
    let Some(slow) = governors.iter().find(|g| *g != "performance") else {
        return match governors.len() {
            0 => Check::ok("governor", "no frequency scaling is visible"),
            n => Check::ok("governor", format!("performance on {n} processors")),
        };
    };
    let many = governors.iter().filter(|g| *g != "performance").count();
    Check::warn(
        "governor",
        format!("{slow} on {many} of {} processors", governors.len()),
        "as root: cpupower frequency-set -g performance (Debian: apt install linux-cpupower)",
    )
}

/// Deepest sleep that is switched on: name and exit latency in microseconds.
fn deepest(machine: &Machine) -> Option<(String, u64)> {
    let mut worst = None;
    for processor in folders(machine) {
        for state in machine.names(&format!("{processor}/cpuidle")) {
            let value = |what: &str| machine.value(&format!("{processor}/cpuidle/{state}/{what}"));
            let latency_us = value("latency").and_then(|text| text.parse::<u64>().ok());
            if let Some(latency_us) = latency_us.filter(|_| value("disable").as_deref() != Some("1"))
                && worst.as_ref().is_none_or(|(_, most)| latency_us > *most)
            {
                worst = Some((value("name").unwrap_or(state), latency_us));
            }
        }
    }
    worst
}

fn sleep(machine: &Machine) -> Check {
    const NODE: &str = "/dev/cpu_dma_latency";
    match deepest(machine) {
        None => Check::ok("c_states", "no sleep states are visible"),
        Some((name, us)) if us <= DEEP_US => Check::ok("c_states", format!("deepest is {name}, {us} µs to wake")),
        Some((name, us)) if machine.is_usable(NODE) => Check::ok(
            "c_states",
            format!("deepest is {name}, {us} µs to wake; the server holds {NODE} at 0 while it runs"),
        ),
        Some((name, us)) => Check::warn(
            "c_states",
            format!("deepest is {name}, {us} µs to wake, and this user may not hold {NODE}"),
            "install the package's udev rules and join group haptic, or boot with processor.max_cstate=1",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use proptest::prelude::*;

    fn laptop() -> Tree {
        Tree::new()
            .with("proc/self/status", "Name:\tx\nCpus_allowed_list:\t0-1\n")
            .with("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n")
            .with("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance\n")
            .with("sys/devices/system/cpu/cpufreq/policy0", "")
            .with("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "0\n")
            .with("sys/devices/system/cpu/cpu0/cpuidle/state3/latency", "890\n")
            .with("sys/devices/system/cpu/cpu0/cpuidle/state3/name", "C10\n")
            .with("sys/devices/system/cpu/cpu0/cpuidle/state3/disable", "0\n")
    }

    #[test]
    fn a_laptop_is_told_what_slows_it() {
        let rows = checks(&laptop().locked());
        let status: Vec<_> = rows.iter().map(|c| c.status).collect();
        assert_eq!(status, [Status::Ok, Status::Warn, Status::Warn]);
        assert_eq!(rows[1].found, "powersave on 1 of 2 processors");
        assert!(rows[2].found.contains("C10, 890 µs"), "{rows:?}");
        assert_eq!(sleep(&laptop().machine()).status, Status::Ok, "held by the server");
        let disabled = laptop().with("sys/devices/system/cpu/cpu0/cpuidle/state3/disable", "1\n");
        assert_eq!(sleep(&disabled.locked()).status, Status::Ok);
    }

    #[test]
    fn lists_of_the_kernel_are_counted() {
        for (list, expected) in [
            ("0", Some(1)),
            ("0-3,6", Some(5)),
            ("", Some(0)),
            ("3-1", None),
            ("0-18446744073709551615", None),
            ("x", None),
        ] {
            assert_eq!(list_length(list), expected, "{list}");
        }
        let one = Tree::new().with("proc/self/status", "Cpus_allowed_list:\t1\n");
        assert_eq!(count(&one.machine()).status, Status::Warn);
    }

    proptest! {
        #[test]
        fn no_text_stops_the_reading(list in "[0-9,-]{0,30}", latency in ".{0,25}") {
            let tree = Tree::new()
                .with("proc/self/status", &format!("Cpus_allowed_list:\t{list}\n"))
                .with("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", &latency);
            prop_assert_eq!(checks(&tree.machine()).len(), 3);
        }
    }
}
