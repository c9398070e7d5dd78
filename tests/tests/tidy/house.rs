//! Habits of the house: heads, lengths, reasons, no paths of one machine, nothing left open.

use crate::scan::words;
use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

/// Longest file; one that grows past it has begun to do a second thing.
const MAX_LINES: usize = 400;

/// Fewest words of a head that says something.
const MIN_HEAD_WORDS: usize = 3;

/// Folders that only one machine has.
const MACHINE_FOLDERS: [&str; 5] = [
    concat!("/wo", "rk/"),
    concat!("/ro", "ot/"),
    concat!("/ho", "me/"),
    concat!("/tmp", "/wt"),
    concat!("/Us", "ers/"),
];

/// Marks of unfinished work.
const OPEN_ENDS: [&str; 4] = [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("XX", "X"), concat!("HA", "CK")];

fn head_findings(files: &[SourceFile]) -> Vec<String> {
    let poor = |f: &&SourceFile| {
        let head = f.text.lines().take_while(|l| l.starts_with("//!")).map(|l| &l[3..]);
        f.is_rust() && head.flat_map(str::split_whitespace).count() < MIN_HEAD_WORDS
    };
    let mend = "begins without a `//!` head; say its role, formula, units and source";
    files.iter().filter(poor).map(|f| format!("{}: {mend}", f.path)).collect()
}

fn length_findings(files: &[SourceFile]) -> Vec<String> {
    let long =
        files.iter().filter(|f| f.is_rust()).map(|f| (f, f.text.lines().count())).filter(|(_, n)| *n > MAX_LINES);
    long.map(|(f, n)| format!("{}: {n} lines, at most {MAX_LINES}; split it by what it does", f.path)).collect()
}

fn machine_path_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.path != "Cargo.lock") {
        for folder in MACHINE_FOLDERS {
            let own = |at: usize| {
                at == 0
                    || !file.text.as_bytes()[at - 1].is_ascii_alphanumeric()
                        && !b"._-".contains(&file.text.as_bytes()[at - 1])
            };
            findings.extend(file.text.match_indices(folder).filter(|(at, _)| own(*at)).map(|(at, _)| {
                format!("{}: path of one machine ({folder}); make it relative to the repository", file.place(at))
            }));
        }
    }
    findings
}

fn open_end_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.path != "Cargo.lock") {
        for mark in OPEN_ENDS {
            findings.extend(words(&file.text, mark).map(|at| format!("{}: {mark}; do it or drop it", file.place(at))));
        }
        if file.is_rust() {
            for call in ["todo!", "unimplemented!", "dbg!"] {
                findings.extend(words(&file.code, call).map(|at| format!("{}: {call} left in", file.place(at))));
            }
        }
    }
    findings
}

fn attribute_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.is_rust()) {
        for (mark, mend) in [
            ("#[ignore]", "say why: #[ignore = \"reason\"]"),
            ("#[allow(", "use #[expect(lint, reason = \"…\")]"),
            ("#![allow(", "use #![expect(lint, reason = \"…\")] on the item that needs it"),
        ] {
            findings.extend(file.code.match_indices(mark).map(|(at, _)| format!("{}: {mark}; {mend}", file.place(at))));
        }
    }
    findings
}

/// A test that reads the wall clock says why, on the line or just above.
fn wall_clock_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.is_rust()) {
        let lines: Vec<&str> = file.text.lines().collect();
        for at in words(&file.code, "Instant::now") {
            let in_test = file.product.get(at..at + 1) != Some("I");
            let line = file.text[..at].bytes().filter(|b| *b == b'\n').count();
            let reasoned = lines[line.saturating_sub(2)..=line].iter().any(|l| l.contains("// "));
            if in_test && !reasoned {
                let place = file.place(at);
                findings
                    .push(format!("{place}: a test reads the wall clock; use a virtual clock, or say why just above"));
            }
        }
    }
    findings
}

#[test]
fn every_file_has_a_head() {
    assert_clean(head_findings);
    assert_discerns(
        head_findings,
        &[("a.rs", "fn f() {}"), ("a.rs", "//! x\nfn f() {}"), ("a.rs", "// plain words of comment\nfn f() {}")],
        &[("a.rs", "//! Relaxed Long\n//! Range Attachments.\nfn f() {}")],
    );
}

#[test]
fn no_file_is_too_long() {
    assert_clean(length_findings);
    let long = "//! Head of it.\n".repeat(MAX_LINES + 1);
    let just = "//! Head of it.\n".repeat(MAX_LINES);
    assert_discerns(length_findings, &[("a.rs", &long)], &[("a.rs", &just), ("data.csv", &long)]);
}

#[test]
fn no_path_of_one_machine() {
    assert_clean(machine_path_findings);
    let bad = MACHINE_FOLDERS.map(|folder| format!("read {folder}x"));
    let bad: Vec<(&str, &str)> = bad.iter().map(|text| ("docs/a.md", text.as_str())).collect();
    assert_discerns(machine_path_findings, &bad, &[("docs/a.md", "read ../shared/traces and docs/work/x")]);
}

#[test]
fn nothing_is_left_open() {
    assert_clean(open_end_findings);
    let marks = OPEN_ENDS.map(|mark| format!("// {mark}: later"));
    let mut bad: Vec<(&str, &str)> = marks.iter().map(|text| ("a.rs", text.as_str())).collect();
    bad.push(("a.rs", "fn f() { todo!() }"));
    assert_discerns(open_end_findings, &bad, &[("a.rs", "fn f() { let todo = 1; }")]);
}

#[test]
fn ignored_tests_and_silenced_lints_have_a_reason() {
    assert_clean(attribute_findings);
    assert_discerns(
        attribute_findings,
        &[("a.rs", "#[ignore]\nfn f() {}"), ("a.rs", "#[allow(dead_code)]\nfn f() {}")],
        &[("a.rs", "#[ignore = \"needs a device\"]\nfn f() {}"), ("a.rs", "// #[ignore]\nfn f() {}")],
    );
}

#[test]
fn tests_that_read_the_wall_clock_say_why() {
    assert_clean(wall_clock_findings);
    assert_discerns(
        wall_clock_findings,
        &[
            ("tests/tests/a.rs", "fn f() {\n\n    let t = Instant::now();\n}"),
            ("haptic-server/src/a.rs", "#[cfg(test)]\nmod tests {\n\n\n fn f() { Instant::now(); } }"),
        ],
        &[
            (
                "tests/tests/a.rs",
                "fn f() {\n    // A deadline for a hung child, not an assertion.\n    Instant::now();\n}",
            ),
            ("haptic-server/src/a.rs", "fn f() { Instant::now(); }"),
        ],
    );
}
