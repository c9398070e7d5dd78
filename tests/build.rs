//! Hands the commit and the compiler to the accuracy report, without running git: `.git/HEAD` is read as a file.
//!
//! Absent where the sources are not a checkout; the report then says "unknown".

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if let Some(commit) = git_folder().and_then(|folder| commit(&folder)) {
        println!("cargo:rustc-env=SUTURE_COMMIT={commit}");
    }
    let compiler = std::env::var_os("RUSTC").and_then(|rustc| Command::new(rustc).arg("--version").output().ok());
    if let Some(version) = compiler.and_then(|o| String::from_utf8(o.stdout).ok()) {
        println!("cargo:rustc-env=SUTURE_COMPILER={}", version.trim());
    }
    for (name, key) in [("SUTURE_TARGET", "TARGET"), ("SUTURE_OPT_LEVEL", "OPT_LEVEL")] {
        if let Ok(value) = std::env::var(key) {
            println!("cargo:rustc-env={name}={value}");
        }
    }
}

/// The `.git` folder; in a linked worktree `.git` is a file that names it.
fn git_folder() -> Option<PathBuf> {
    let at = Path::new(&std::env::var_os("CARGO_MANIFEST_DIR")?).join("../.git");
    if at.is_dir() {
        return Some(at);
    }
    let text = std::fs::read_to_string(&at).ok()?;
    Some(PathBuf::from(text.strip_prefix("gitdir:")?.trim()))
}

fn commit(folder: &Path) -> Option<String> {
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).ok()?;
        println!("cargo:rerun-if-changed={}", path.display());
        Some(text)
    };
    let head = read(folder.join("HEAD"))?;
    let Some(reference) = head.trim().strip_prefix("ref: ") else { return Some(head.trim().to_owned()) };
    let common = read(folder.join("commondir")).map_or_else(|| folder.to_owned(), |c| folder.join(c.trim()));
    if let Some(id) = read(folder.join(reference)).or_else(|| read(common.join(reference))) {
        return Some(id.trim().to_owned());
    }
    let packed = read(common.join("packed-refs"))?;
    packed.lines().find_map(|l| l.strip_suffix(reference)).map(|id| id.trim().to_owned())
}
