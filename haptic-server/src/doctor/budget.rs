//! How much real-time work the kernel grants: the global throttle, and the control group of this process.
//!
//! `sched_rt_runtime_us` of each `sched_rt_period_us` is all that real-time threads get together (95 % by default, −1 without
//! limit); the servo uses well below a fifth. With CONFIG_RT_GROUP_SCHED a group of version 1 has its own `cpu.rt_runtime_us`, 0 until
//! somebody gives it some, and SCHED_FIFO is refused in it even to root. A group of version 2 may have a quota (`cpu.max`).

use super::check::Check;
use crate::exit;
use crate::machine::Machine;

/// Least share of the time that real-time threads must get together: twice what the servo may use.
const LEAST_SHARE: f64 = 0.4;

/// The rows of this family.
pub(super) fn checks(machine: &Machine) -> Vec<Check> {
    vec![throttle(machine), group(machine)]
}

fn throttle(machine: &Machine) -> Check {
    const NAME: &str = "real_time_throttle";
    let number = |path: &str| machine.value(path).and_then(|text| text.parse::<i64>().ok());
    let runtime = number("/proc/sys/kernel/sched_rt_runtime_us");
    let period = number("/proc/sys/kernel/sched_rt_period_us").filter(|p| *p > 0);
    let (Some(runtime), Some(period)) = (runtime, period) else {
        return Check::ok(NAME, "the kernel has none");
    };
    if runtime < 0 {
        return Check::ok(NAME, "switched off (the servo never spins a whole period)");
    }
    let share = runtime as f64 / period as f64;
    let found = format!("real-time threads get {runtime} of {period} µs");
    let remedy = "sysctl -w kernel.sched_rt_runtime_us=950000";
    if runtime == 0 {
        Check::fail(NAME, found, remedy, exit::PERMISSION)
    } else if share < LEAST_SHARE {
        Check::warn(NAME, found, remedy)
    } else {
        Check::ok(NAME, found)
    }
}

/// The group of this process, as `/proc/self/cgroup` tells it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Group {
    /// Version 1: the folder of the processor controller.
    One(String),
    /// Version 2: the folder.
    Two(String),
}

/// Reads `id:controllers:path`; the processor controller of version 1 counts before version 2.
pub(super) fn own_group(text: &str) -> Option<Group> {
    let rows = || {
        text.lines().filter_map(|line| {
            let (_, rest) = line.split_once(':')?;
            rest.split_once(':')
        })
    };
    let first = rows().find(|(controllers, _)| controllers.split(',').any(|c| c == "cpu"));
    first
        .map(|(controllers, path)| Group::One(format!("/sys/fs/cgroup/{controllers}{}", path.trim_end_matches('/'))))
        .or_else(|| {
            rows()
                .find(|(controllers, _)| controllers.is_empty())
                .map(|(_, path)| Group::Two(path.trim_end_matches('/').to_owned()))
        })
}

fn group(machine: &Machine) -> Check {
    const NAME: &str = "real_time_budget";
    match own_group(&machine.text("/proc/self/cgroup").unwrap_or_default()) {
        Some(Group::One(folder)) => {
            let file = format!("{folder}/cpu.rt_runtime_us");
            match machine.value(&file).and_then(|text| text.parse::<i64>().ok()) {
                Some(0) => Check::fail(
                    NAME,
                    format!("the control group {folder} has no real-time time"),
                    format!("as root: echo 950000 > {file} (its parents first)"),
                    exit::PERMISSION,
                ),
                Some(micros) => Check::ok(NAME, format!("{micros} µs for the control group of this process")),
                None => Check::ok(NAME, "the control group sets none"),
            }
        }
        Some(Group::Two(path)) => match quota(machine, &path) {
            Some((folder, quota)) => Check::warn(
                NAME,
                format!("the control group {folder} has a processor quota: {quota}"),
                "systemctl set-property --runtime SLICE CPUQuota= (empty), or start the container without --cpus",
            ),
            None => Check::ok(NAME, "the control group sets none"),
        },
        None => Check::ok(NAME, "no control groups"),
    }
}

/// The first quota from the group upwards.
fn quota(machine: &Machine, path: &str) -> Option<(String, String)> {
    let mut path = path;
    while !path.is_empty() {
        let folder = format!("/sys/fs/cgroup{path}");
        let max = machine.value(&format!("{folder}/cpu.max"));
        if let Some(max) = max.filter(|m| !m.is_empty() && !m.starts_with("max")) {
            return Some((folder, max));
        }
        path = path.rsplit_once('/').map_or("", |(parent, _)| parent);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use proptest::prelude::*;

    #[test]
    fn the_throttle_is_a_failure_only_where_nothing_is_left() {
        for (runtime, expected) in [
            ("950000", Status::Ok),
            ("-1", Status::Ok),
            ("100000", Status::Warn),
            ("0", Status::Fail),
            ("much", Status::Ok),
        ] {
            let tree = Tree::new()
                .with("proc/sys/kernel/sched_rt_runtime_us", runtime)
                .with("proc/sys/kernel/sched_rt_period_us", "1000000");
            assert_eq!(throttle(&tree.machine()).status, expected, "{runtime}");
        }
    }

    #[test]
    fn groups_of_both_versions_are_found() {
        let mixed = "9:name=systemd:/\n3:cpu,cpuacct:/user.slice\n0::/x\n";
        assert_eq!(own_group(mixed), Some(Group::One("/sys/fs/cgroup/cpu,cpuacct/user.slice".into())));
        assert_eq!(
            own_group("0::/user.slice/session-1.scope\n"),
            Some(Group::Two("/user.slice/session-1.scope".into()))
        );
        assert_eq!(own_group("nonsense"), None);
    }

    #[test]
    fn a_group_without_time_fails_and_one_with_a_quota_warns() {
        let none =
            Tree::new().with("proc/self/cgroup", "1:cpu:/a\n").with("sys/fs/cgroup/cpu/a/cpu.rt_runtime_us", "0\n");
        let row = group(&none.machine());
        assert_eq!(row.status, Status::Fail);
        assert!(row.remedy.is_some_and(|r| r.contains("/sys/fs/cgroup/cpu/a/cpu.rt_runtime_us")));
        let quota = Tree::new()
            .with("proc/self/cgroup", "0::/a/b\n")
            .with("sys/fs/cgroup/a/b/cpu.max", "max 100000\n")
            .with("sys/fs/cgroup/a/cpu.max", "50000 100000\n");
        let row = group(&quota.machine());
        assert_eq!(row.status, Status::Warn);
        assert!(row.found.contains("/sys/fs/cgroup/a has") && row.found.contains("50000"), "{row:?}");
        let free = quota.with("sys/fs/cgroup/a/cpu.max", "max 100000\n");
        assert_eq!(group(&free.machine()).status, Status::Ok);
    }

    proptest! {
        #[test]
        fn no_text_stops_the_reading(text in "([0-9]:(cpu)?:)?.{0,60}", value in ".{0,12}") {
            let tree = Tree::new().with("proc/self/cgroup", &text).with("proc/sys/kernel/sched_rt_runtime_us", &value);
            prop_assert_eq!(checks(&tree.machine()).len(), 2);
        }
    }
}
