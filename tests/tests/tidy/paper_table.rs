//! `docs/paper.md` tells the truth: every file and every test that its table names exists.
//!
//! A row is `| Eq. (1) … | files | tests |` (also Algorithm, Table, Fig.); names stand in backquotes. An equation,
//! algorithm or table with numbers needs at least one file and one test; a row that has none says why.

use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

const DOCUMENT: &str = "docs/paper.md";

/// What must have a row with at least one file and one test.
const REQUIRED: [&str; 8] =
    ["Eq. (1)", "Eq. (2)", "Eq. (3)", "Algorithm 1", "Algorithm 2", "Table 1", "Table 2", "Fig. 8"];

/// First words of the rows that are checked.
const KINDS: [&str; 5] = ["Eq. ", "Algorithm ", "Table ", "Fig. ", "§"];

/// Cells of one table line.
fn cells(line: &str) -> Vec<&str> {
    line.trim().trim_matches('|').split('|').map(str::trim).collect()
}

/// Cells of the rows of the paper's parts: those under the heading `Parts`.
fn rows(text: &str) -> Vec<Vec<&str>> {
    let parts = text.split("\n## ").find(|section| section.starts_with("Parts")).unwrap_or_default();
    let lines = parts.lines().filter(|l| l.starts_with('|')).map(cells);
    lines.filter(|row: &Vec<&str>| KINDS.iter().any(|kind| row[0].starts_with(kind))).collect()
}

/// Names in backquotes.
fn quoted(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

fn paper_findings(files: &[SourceFile]) -> Vec<String> {
    let Some(document) = files.iter().find(|f| f.path == DOCUMENT) else {
        return vec![format!("{DOCUMENT} is missing")];
    };
    let mut findings = Vec::new();
    let rows = rows(&document.text);
    for row in &rows {
        if row.len() < 3 {
            findings.push(format!("{DOCUMENT}: row {:?} needs a file cell and a test cell", row[0]));
            continue;
        }
        for path in quoted(row[1]) {
            if !files.iter().any(|f| f.path == path) {
                findings.push(format!("{DOCUMENT}: row {:?} names {path}, which does not exist", row[0]));
            }
        }
        for test in quoted(row[2]) {
            let head = format!("fn {test}(");
            if !files.iter().any(|f| f.is_rust() && f.code.contains(&head)) {
                findings.push(format!("{DOCUMENT}: row {:?} names the test {test}, which does not exist", row[0]));
            }
        }
    }
    for part in REQUIRED {
        let told = |row: &&Vec<&str>| {
            row[0].starts_with(part) && row.len() >= 3 && !quoted(row[1]).is_empty() && !quoted(row[2]).is_empty()
        };
        if !rows.iter().any(|row| told(&row)) {
            findings.push(format!("{DOCUMENT}: no row of {part} names a file and a test"));
        }
    }
    findings
}

/// The check on a document of its own, beside one source file with one test.
fn findings_of(document: &str) -> Vec<String> {
    let source = SourceFile::new("sim-core/src/a.rs", "fn eq1_holds() {}");
    paper_findings(&[SourceFile::new(DOCUMENT, document), source])
}

#[test]
fn every_row_names_a_file_and_a_test_that_exist() {
    assert_clean(paper_findings);
    let rows: String = REQUIRED.map(|part| format!("| {part} | `sim-core/src/a.rs` | `eq1_holds` |\n")).concat();
    let table = format!("# Paper\n\n## Parts\n{rows}\n## Readings\n| Eq. (3) | no file | `no_test` |\n");
    assert_eq!(findings_of(&table), Vec::<String>::new());
    for (from, to) in [("a.rs", "b.rs"), ("eq1_holds", "eq1_gone"), ("| `eq1_holds` |", "| |"), ("Eq. (1)", "Eq. (9)")]
    {
        assert!(!findings_of(&table.replacen(from, to, 1)).is_empty(), "{from} → {to} was not noticed");
    }
    assert_discerns(paper_findings, &[("README.md", "")], &[]);
}
