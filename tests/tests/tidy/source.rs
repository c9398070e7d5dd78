//! The files under check: path relative to the repository root, text, and the text as code only.
//!
//! Files come from `git ls-files` (tracked and new, not ignored) or, without git, from a walk that
//! leaves out `target`, `.git` and anything that is not UTF-8.

use crate::scan;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One file of the project.
pub(crate) struct SourceFile {
    /// Path from the repository root, with `/`.
    pub(crate) path: String,
    /// As written.
    pub(crate) text: String,
    /// Rust only: comments and literals blanked, same lines and columns.
    pub(crate) code: String,
    /// Rust only: `code` with items under `#[cfg(test)]` blanked; empty in a file of tests.
    pub(crate) product: String,
}

impl SourceFile {
    /// A file from its path and text.
    pub(crate) fn new(path: &str, text: &str) -> Self {
        let (code, product) = if path.ends_with(".rs") {
            let code = scan::blank_comments_and_literals(text);
            let product = if is_test_path(path) { String::new() } else { scan::blank_test_items(&code) };
            (code, product)
        } else {
            (String::new(), String::new())
        };
        Self { path: path.to_owned(), text: text.to_owned(), code, product }
    }

    /// Whether this is Rust.
    pub(crate) fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// `path:line` of a byte offset.
    pub(crate) fn place(&self, offset: usize) -> String {
        let line = self.text[..offset].bytes().filter(|b| *b == b'\n').count() + 1;
        format!("{}:{line}", self.path)
    }
}

/// Files that hold nothing but tests or their support.
fn is_test_path(path: &str) -> bool {
    path.starts_with("tests/") || path.contains("/tests/") || path.ends_with("/tests.rs") || path.ends_with("_tests.rs")
}

/// The repository root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every text file of the project.
pub(crate) fn tracked_files() -> Vec<SourceFile> {
    let root = root();
    let mut paths = git_paths(&root).unwrap_or_else(|| walk(&root));
    paths.sort();
    paths
        .iter()
        .filter_map(|path| Some(SourceFile::new(path, &std::fs::read_to_string(root.join(path)).ok()?)))
        .collect()
}

fn git_paths(root: &Path) -> Option<Vec<String>> {
    let list = ["ls-files", "--cached", "--others", "--exclude-standard"];
    let output = Command::new("git").arg("-C").arg(root).args(list).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.is_empty()).then(|| text.lines().map(str::to_owned).collect())
}

fn walk(root: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![root.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = entry.file_name();
            if name == "target" || name == ".git" {
                continue;
            }
            if path.is_dir() {
                open.push(path);
            } else if let Ok(relative) = path.strip_prefix(root) {
                found.push(relative.to_string_lossy().into_owned());
            }
        }
    }
    found
}

#[test]
fn git_and_the_walk_see_the_same_rust_files() {
    let root = root();
    let rust = |mut paths: Vec<String>| {
        paths.retain(|p| p.ends_with(".rs") && root.join(p).is_file());
        paths.sort();
        paths
    };
    let walked = rust(walk(&root));
    assert!(walked.iter().any(|p| p == "sim-core/src/lib.rs"), "{walked:?}");
    if let Some(listed) = git_paths(&root) {
        assert_eq!(rust(listed), walked);
    }
}
