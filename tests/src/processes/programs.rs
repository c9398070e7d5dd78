//! Our own programs, built for the tests that start them.
//!
//! cargo compiles a crate once for each set of features, and the features of a third-party crate are the sum of what the
//! packages ask for that are built together, those of tests included when a test is among the targets. A program that is
//! asked for in another company than the running test's brings 22 crates and most of ours a second time: minutes on two processors.
//! So it is asked for in the same company: the same packages, with the running test as one more target (it is up to date),
//! in the same profile, for the same system, into the same folder. What is then left to do is to link it.
//!
//! Whether the viewer's packages are in that company is told by feature `with-viewer`, which viewer-tests switches on.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// What the tests start, but for the viewer: no graphics crate is compiled for these.
const PROGRAMS: [&str; 4] = ["haptic-server", "deformation-solver", "latency-harness", "virtual-omni-eyes"];

/// Packages that the programs and the tests belong to.
const PACKAGES: [&str; 3] = ["haptic-server", "suture-tests", "virtual-omni"];

/// Path of one of our programs, built when it is not up to date. For integration tests.
///
/// # Panics
/// When cargo cannot build it.
#[must_use]
pub fn binary(name: &str) -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let build = || {
        let place = Place::of_this_test();
        let mut cargo = place.cargo();
        if cfg!(feature = "with-viewer") {
            cargo.arg("--workspace");
        } else {
            cargo.args(PACKAGES.iter().flat_map(|package| ["--package", package]));
        }
        cargo.args(PROGRAMS.iter().flat_map(|program| ["--bin", program])).args(["--test", &place.test]);
        finish(&mut cargo);
        place.folder
    };
    BUILT.get_or_init(build).join(name)
}

/// Path of the viewer, built likewise, with all its graphics crates: for tests that are asked for by name.
///
/// # Panics
/// When cargo cannot build it.
#[must_use]
pub fn viewer() -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let build = || {
        let place = Place::of_this_test();
        finish(place.cargo().args(["--workspace", "--bin", "viewer-client"]));
        place.folder
    };
    BUILT.get_or_init(build).join("viewer-client")
}

/// Path of the virtual Omni's shared library, which cargo builds beside the tests that depend on it.
///
/// # Panics
/// When it is not there: the running test does not depend on it.
#[must_use]
pub fn virtual_omni() -> PathBuf {
    let this = std::env::current_exe().expect("a test knows its own path");
    let library = this.with_file_name("libvirtual_omni.so");
    assert!(library.exists(), "{} is missing", library.display());
    library
}

/// Where cargo has put a test: …/TARGET-FOLDER/[SYSTEM/]PROFILE/deps/TEST-HASH.
#[derive(Debug, PartialEq)]
struct Place {
    /// Where programs of its build lie.
    folder: PathBuf,
    target_folder: PathBuf,
    /// The system, when the tests were built by `--target`.
    system: Option<&'static str>,
    profile: String,
    test: String,
}

impl Place {
    fn of_this_test() -> Self {
        let this = std::env::current_exe().expect("a test knows its own path");
        Self::of(&this, option_env!("SUTURE_TARGET")).expect("a test lies where cargo puts it")
    }

    fn of(test: &Path, system: Option<&'static str>) -> Option<Self> {
        let (name, _hash) = test.file_name()?.to_str()?.rsplit_once('-')?;
        let folder = test.ancestors().nth(2)?;
        let profile = match folder.file_name()?.to_str()? {
            // That of `cargo test`, equal to `dev` unless somebody has set it otherwise.
            "debug" => "test",
            other => other,
        };
        let above = folder.parent()?;
        let system = system.filter(|system| above.file_name() == Some(OsStr::new(system)));
        let target_folder = if system.is_some() { above.parent()? } else { above };
        Some(Self {
            folder: folder.to_owned(),
            target_folder: target_folder.to_owned(),
            system,
            profile: profile.to_owned(),
            test: name.to_owned(),
        })
    }

    /// A build in this place.
    fn cargo(&self) -> Command {
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--quiet", "--profile", &self.profile]).current_dir(env!("CARGO_MANIFEST_DIR"));
        build.arg("--target-dir").arg(&self.target_folder);
        build.args(self.system.iter().flat_map(|system| ["--target", system]));
        build
    }
}

fn finish(build: &mut Command) {
    let status = build.status().expect("cargo runs");
    assert!(status.success(), "cargo could not build the programs: {build:?}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_system_and_folder_are_those_of_the_test() {
        let read = |path: &str| {
            let place = Place::of(Path::new(path), Some("m68k-none")).expect(path);
            let folders = (place.folder.display().to_string(), place.target_folder.display().to_string());
            (folders.0, folders.1, place.system, place.profile, place.test)
        };
        let expected = |folder: &str, target: &str, system, profile: &str, test: &str| {
            (folder.to_owned(), target.to_owned(), system, profile.to_owned(), test.to_owned())
        };
        assert_eq!(read("/t/debug/deps/live-0a"), expected("/t/debug", "/t", None, "test", "live"));
        assert_eq!(read("/t/release/deps/a-b-0a"), expected("/t/release", "/t", None, "release", "a-b"));
        let system = Some("m68k-none");
        assert_eq!(read("/t/m68k-none/dist/deps/a-0a"), expected("/t/m68k-none/dist", "/t", system, "dist", "a"));
        assert_eq!(Place::of(Path::new("live"), None), None);
    }
}
