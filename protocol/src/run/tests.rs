//! Runs are private, unique, refuse a second server, and leave nothing behind.

use super::directory::Description;
use super::*;
use crate::names::{run_directory, run_prefix};
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use tempfile::TempDir;

struct Place {
    _keep: TempDir,
    environment: Environment,
}

fn place() -> Place {
    let keep = TempDir::new().unwrap();
    let xdg = keep.path().join("xdg");
    let shm = keep.path().join("shm");
    fs::create_dir(&xdg).unwrap();
    fs::create_dir(&shm).unwrap();
    let environment = Environment {
        xdg_runtime_dir: Some(xdg),
        run_user_dir: keep.path().join("absent"),
        temp_dir: keep.path().to_owned(),
        shared_memory_dir: shm,
    };
    Place { _keep: keep, environment }
}

impl Place {
    fn root(&self) -> RunRoot {
        RunRoot::open(&self.environment).unwrap()
    }

    fn root_path(&self) -> PathBuf {
        self.environment.xdg_runtime_dir.clone().unwrap().join(crate::names::ROOT_DIRECTORY)
    }
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

#[test]
fn a_run_is_announced_found_and_gone_after_its_end() {
    let place = place();
    let root = place.root();
    assert!(matches!(root.attach(), Err(RunError::NotRunning { .. })));
    let active = root.start().unwrap();
    assert_eq!(mode(root.path()), 0o700);
    assert_eq!(mode(active.run().path()), 0o700);
    assert_eq!(mode(&root.path().join("current")), 0o600);
    let found = root.attach().unwrap();
    assert_eq!(found.run_id(), active.run().run_id());
    assert_eq!(found.prefix(), run_prefix(found.run_id()));
    assert_eq!(found.supervisor_pid(), std::process::id());

    let shm = place.environment.shared_memory_dir.join(format!("{}data", found.prefix()));
    let foreign = place.environment.shared_memory_dir.join("hs_of_somebody_else");
    fs::write(&shm, "x").unwrap();
    fs::write(&foreign, "x").unwrap();
    let path = found.path().to_owned();
    drop(found);
    let cleaned = active.finish(&root).unwrap();
    assert_eq!(cleaned.removed, [RemovedRun { directory: path.clone(), shared_memory: vec![shm.clone()] }]);
    assert!(!path.exists() && !shm.exists() && foreign.exists());
    assert!(matches!(root.attach(), Err(RunError::NotRunning { .. })));
}

#[test]
fn a_second_start_is_refused_and_names_the_process() {
    let place = place();
    let root = place.root();
    let first = root.start().unwrap();
    match place.root().start() {
        Err(RunError::AlreadyRunning { pid }) => assert_eq!(pid, Some(std::process::id())),
        other => panic!("{other:?}"),
    }
    drop(first);
    root.start().unwrap();
}

#[test]
fn runs_have_different_ids() {
    let place = place();
    let root = place.root();
    let first = root.start().unwrap();
    let id = first.run().run_id();
    first.finish(&root).unwrap();
    assert_ne!(root.start().unwrap().run().run_id(), id);
}

#[test]
fn a_run_in_use_survives_cleaning_and_a_killed_one_does_not_hinder_the_next() {
    let place = place();
    let root = place.root();
    let active = root.start().unwrap();
    let viewer = root.attach().unwrap();
    let path = viewer.path().to_owned();
    // A killed supervisor: its locks are freed by the kernel, everything else stays.
    drop(active);
    let next = root.start().unwrap();
    assert!(path.exists(), "the viewer still uses it");
    assert_eq!(root.clean().unwrap().in_use.len(), 2);
    drop(viewer);
    assert_eq!(root.clean().unwrap().removed.len(), 1);
    assert!(!path.exists());
    assert!(next.run().path().exists());
}

#[test]
fn leftovers_of_a_half_made_run_are_removed() {
    let place = place();
    let root = place.root();
    for leftover in ["new".to_owned(), run_directory(7)] {
        let path = root.path().join(leftover);
        fs::create_dir(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o700)).unwrap();
        fs::write(path.join("run.json"), "half").unwrap();
    }
    let active = root.start().unwrap();
    assert!(!root.path().join("new").exists());
    assert!(!root.path().join(run_directory(7)).exists());
    assert!(active.run().path().exists());
}

#[test]
fn symlinks_and_open_directories_are_refused() {
    let place = place();
    let elsewhere = place.environment.temp_dir.join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    fs::set_permissions(&elsewhere, fs::Permissions::from_mode(0o700)).unwrap();
    symlink(&elsewhere, place.root_path()).unwrap();
    assert!(matches!(RunRoot::open(&place.environment), Err(RunError::Unsafe { .. })));

    fs::remove_file(place.root_path()).unwrap();
    fs::create_dir(place.root_path()).unwrap();
    fs::set_permissions(place.root_path(), fs::Permissions::from_mode(0o750)).unwrap();
    assert!(matches!(RunRoot::open(&place.environment), Err(RunError::Unsafe { .. })));
}

#[test]
fn a_parent_that_others_may_write_must_be_sticky() {
    let place = place();
    let parent = place.environment.xdg_runtime_dir.clone().unwrap();
    fs::set_permissions(&parent, fs::Permissions::from_mode(0o777)).unwrap();
    assert!(matches!(RunRoot::open(&place.environment), Err(RunError::Unsafe { .. })));
    fs::set_permissions(&parent, fs::Permissions::from_mode(0o1777)).unwrap();
    assert!(RunRoot::open(&place.environment).is_ok());
}

#[test]
fn a_root_of_another_user_is_refused() {
    let place = place();
    fs::create_dir(place.root_path()).unwrap();
    fs::set_permissions(place.root_path(), fs::Permissions::from_mode(0o700)).unwrap();
    let nobody = rustix::fs::Uid::from_raw(65534);
    if rustix::fs::chown(place.root_path(), Some(nobody), None).is_err() {
        println!("skipped: only root can give a directory away");
        return;
    }
    assert!(matches!(RunRoot::open(&place.environment), Err(RunError::Unsafe { .. })));
}

#[test]
fn without_a_runtime_directory_the_temporary_one_serves() {
    let mut place = place();
    place.environment.xdg_runtime_dir = None;
    let root = place.root();
    let uid = rustix::process::geteuid().as_raw().to_string();
    assert!(root.path().starts_with(place.environment.temp_dir.canonicalize().unwrap()));
    assert!(root.path().to_str().unwrap().ends_with(&uid));
}

#[test]
fn another_wire_version_is_refused_with_both_numbers() {
    let place = place();
    let root = place.root();
    let active = root.start().unwrap();
    let file = active.run().path().join("run.json");
    let mut description = Description::parse(&fs::read_to_string(&file).unwrap(), &file).unwrap();
    description.wire_version = 4711;
    fs::write(&file, serde_json::to_string(&description).unwrap()).unwrap();
    let text = root.attach().unwrap_err().to_string();
    assert!(text.contains("4711") && text.contains(&crate::wire::WIRE_VERSION.to_string()), "{text}");
}

#[test]
fn a_damaged_announcement_is_an_error_that_leads_nowhere_else() {
    let place = place();
    let root = place.root();
    let evil = r#"{"wire_version":1,"directory":"../../etc","prefix":"x","supervisor_pid":1}"#;
    for text in ["", "{", "null", "[1]", evil, &"x".repeat(100_000)] {
        fs::write(root.path().join("current"), text).unwrap();
        assert!(matches!(root.attach(), Err(RunError::Damaged { .. })), "{text:.40}");
    }
}
