//! Room for a run: shared memory, open files, the run directory, leftovers of killed runs, the other programs.
//!
//! A full `/dev/shm` ends a process by SIGBUS in the middle of its start, too few open files end it with an unhelpful error; both
//! are told here instead. Sizes were measured on runs of the three presets and rounded up. Nothing is created or removed.

use super::check::Check;
use crate::exit;
use crate::machine::Machine;
use protocol::run::{Environment, RunRoot};
use std::path::PathBuf;

/// Shared memory that a run with a few viewers takes at most, bytes.
const SHARED_NEED: u64 = 16 << 20;
/// Shared memory below which a second run or a larger mesh may not fit, bytes.
const SHARED_COMFORT: u64 = 64 << 20;
/// Open files of the process that has most.
const FILES_NEED: u64 = 256;

/// Free and whole size of a file system, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Space {
    pub(super) free: u64,
    pub(super) size: u64,
}

/// The space of a file system that is there.
pub(super) fn space_of(path: &str) -> Option<Space> {
    let facts = rustix::fs::statvfs(path).ok()?;
    Some(Space {
        free: facts.f_bavail.saturating_mul(facts.f_frsize),
        size: facts.f_blocks.saturating_mul(facts.f_frsize),
    })
}

/// Shared memory.
pub(super) fn shared_memory(space: Option<Space>) -> Check {
    const NAME: &str = "shared_memory";
    let enlarge = "as root: mount -o remount,size=256m /dev/shm (a container: --shm-size=256m)";
    let Some(Space { free, size }) = space else {
        return Check::fail(NAME, "/dev/shm is not there", "as root: mount -t tmpfs tmpfs /dev/shm", exit::UNAVAILABLE);
    };
    let found = format!("{} of {} MiB free in /dev/shm", free >> 20, size >> 20);
    if free < SHARED_NEED {
        Check::fail(NAME, format!("{found}, a run needs {} MiB", SHARED_NEED >> 20), enlarge, exit::UNAVAILABLE)
    } else if free < SHARED_COMFORT {
        Check::warn(NAME, found, enlarge)
    } else {
        Check::ok(NAME, found)
    }
}

/// Open files.
pub(super) fn open_files(machine: &Machine) -> Check {
    use super::rights::{Limit, soft_limit};
    const NAME: &str = "open_files";
    match soft_limit(&machine.text("/proc/self/limits").unwrap_or_default(), "Max open files") {
        Some(Limit::Most(most)) if most < FILES_NEED => {
            let found = format!("at most {most}, a run needs {FILES_NEED}");
            Check::fail(NAME, found, format!("ulimit -n {}", 4 * FILES_NEED), exit::UNAVAILABLE)
        }
        Some(Limit::Most(most)) => Check::ok(NAME, format!("at most {most}")),
        Some(Limit::Unlimited) => Check::ok(NAME, "without limit"),
        None => Check::warn(NAME, "not told by the kernel", "look at `ulimit -n`"),
    }
}

/// The run directory and what killed runs left in it.
pub(super) fn runs(environment: &Environment) -> Vec<Check> {
    let unusable = |error: protocol::run::RunError| {
        let remedy = "remove the folder that is named, or set XDG_RUNTIME_DIR to a folder of your own with mode 0700";
        vec![Check::fail("run_directory", error.to_string(), remedy, exit::PERMISSION)]
    };
    let root = match RunRoot::existing(environment) {
        Ok(Some(root)) => root,
        Ok(None) => {
            let found = "none yet, the first run makes it";
            return vec![Check::ok("run_directory", found), Check::ok("stale_runs", "none")];
        }
        Err(error) => return unusable(error),
    };
    let survey = match root.survey() {
        Ok(survey) => survey,
        Err(error) => return unusable(error),
    };
    let place = Check::ok("run_directory", format!("{}, {} in use", root.path().display(), survey.in_use.len()));
    let stale = match (survey.dead.len(), survey.unclear.first()) {
        (0, None) => Check::ok("stale_runs", "none"),
        (0, Some((path, reason))) => {
            Check::warn("stale_runs", format!("{}: {reason}", path.display()), format!("rm -r {}", path.display()))
        }
        (dead, _) => Check::warn("stale_runs", format!("{dead} left by killed servers"), "haptic-server clean"),
    };
    vec![place, stale]
}

/// The programs that `run` starts, by what looking for each gave.
pub(super) fn programs(solver: Result<PathBuf, String>, viewer: Result<PathBuf, String>) -> Check {
    const NAME: &str = "programs";
    let remedy = "install all programs of one build into one folder";
    match (solver, viewer) {
        (Ok(solver), Ok(_)) => {
            let folder = solver.parent().map_or_else(String::new, |f| f.display().to_string());
            Check::ok(NAME, format!("solver and viewer stand beside this program in {folder}"))
        }
        (Ok(_), Err(missing)) => Check::warn(NAME, format!("no viewer: {missing}"), remedy),
        (Err(missing), _) => Check::fail(NAME, missing, remedy, exit::UNAVAILABLE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Status;
    use crate::doctor::fixture::Tree;
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    #[test]
    fn shared_memory_fails_where_a_run_would_die() {
        let status = |free: u64| shared_memory(Some(Space { free, size: 1 << 30 })).status;
        assert_eq!(status(SHARED_NEED - 1), Status::Fail);
        assert_eq!(status(SHARED_NEED), Status::Warn);
        assert_eq!(status(SHARED_COMFORT), Status::Ok);
        assert_eq!(shared_memory(None).status, Status::Fail);
        assert!(space_of("/no/such/place").is_none() && space_of("/").is_some_and(|s| s.size >= s.free));
    }

    #[test]
    fn too_few_open_files_fail() {
        let row = |most: &str| {
            let text = format!("Max open files            {most}                 524288               files\n");
            open_files(&Tree::new().with("proc/self/limits", &text).machine()).status
        };
        assert_eq!((row("8"), row("1024"), row("unlimited")), (Status::Fail, Status::Ok, Status::Ok));
    }

    fn environment(place: &Path) -> Environment {
        Environment {
            xdg_runtime_dir: Some(place.to_owned()),
            run_user_dir: place.join("none"),
            temp_dir: place.to_owned(),
            shared_memory_dir: place.to_owned(),
        }
    }

    #[test]
    fn leftovers_are_seen_and_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let here = environment(folder.path());
        let status = || runs(&here).iter().map(|c| c.status).collect::<Vec<_>>();
        assert_eq!(status(), [Status::Ok, Status::Ok]);
        assert_eq!(std::fs::read_dir(folder.path()).expect("own").count(), 0, "nothing is made");
        let root = RunRoot::open(&here).expect("made");
        assert_eq!(status(), [Status::Ok, Status::Ok]);
        let active = root.start().expect("a run");
        let rows = runs(&here);
        assert!(rows[0].found.contains("1 in use") && rows[1].status == Status::Ok, "{rows:?}");
        let left = root.path().join("run-00000000000000aa");
        std::fs::create_dir(&left).expect("own folder");
        std::fs::set_permissions(&left, std::fs::Permissions::from_mode(0o700)).expect("own folder");
        assert_eq!(status(), [Status::Ok, Status::Warn]);
        assert!(left.exists());
        active.finish(&root).expect("finished");
        assert!(!left.exists(), "the next end of a run cleans");
        std::fs::set_permissions(root.path(), std::fs::Permissions::from_mode(0o755)).expect("own folder");
        let rows = runs(&here);
        assert_eq!((rows.len(), rows[0].status), (1, Status::Fail), "{rows:?}");
    }

    #[test]
    fn a_missing_solver_fails_and_a_missing_viewer_warns() {
        let here = || Ok(PathBuf::from("bin/x"));
        let gone = || Err("not there".to_owned());
        assert_eq!(programs(here(), here()).status, Status::Ok);
        assert_eq!(programs(here(), gone()).status, Status::Warn);
        assert_eq!(programs(gone(), here()).status, Status::Fail);
    }
}
