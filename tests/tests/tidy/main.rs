//! Invariants that a machine can check (`docs/ARCHITECTURE.md`), one test per invariant.
//!
//! Each check is a function from source files to findings. Each has two tests: the project has no
//! finding, and a small bad snippet has one (a check that cannot fail proves nothing). A finding
//! says where, what, and how to mend it.

mod graphics;
mod house;
mod layers;
mod manifests;
mod paper_table;
mod purity;
mod scan;
mod servo_room;
mod source;

use source::SourceFile;

/// Fails with every finding of `check` over the project's tracked files.
fn assert_clean(check: fn(&[SourceFile]) -> Vec<String>) {
    let files = source::tracked_files();
    assert!(files.len() > 10, "found only {} files: is this the repository root?", files.len());
    let findings = check(&files);
    assert!(findings.is_empty(), "{} finding(s):\n{}", findings.len(), findings.join("\n"));
}

/// Fails unless `check` finds something in `bad` and nothing in `good`.
fn assert_discerns(check: fn(&[SourceFile]) -> Vec<String>, bad: &[(&str, &str)], good: &[(&str, &str)]) {
    for snippet in bad {
        let findings = check(&[SourceFile::new(snippet.0, snippet.1)]);
        assert!(!findings.is_empty(), "nothing found in {}:\n{}", snippet.0, snippet.1);
    }
    for snippet in good {
        let findings = check(&[SourceFile::new(snippet.0, snippet.1)]);
        assert!(findings.is_empty(), "found in {}:\n{}\n{}", snippet.0, snippet.1, findings.join("\n"));
    }
}
