//! A report against a stored one: which values got worse, by name.
//!
//! Rows are matched by their section and by the columns that say what was measured; rows that only one of the reports has
//! are passed over. Errors count when they grow by more than a tenth, costs only beyond half as much again (run times of a
//! shared machine scatter), verdicts when they turn bad.

use super::section::Section;
use haptic_server::error::ServerError;
use serde_json::{Map, Value, json};
use std::fmt;
use std::path::Path;

/// Columns that say what a row measured.
const IDENTITY: [&str; 26] = [
    "scene",
    "case",
    "drag",
    "integrator",
    "dt_s",
    "file",
    "precision",
    "path",
    "topology",
    "stage",
    "rate_hz",
    "delay_ms",
    "jitter_ms",
    "port",
    "model",
    "mesh",
    "method",
    "deviation",
    "spacing_mm",
    "nodes",
    "reading",
    "mode",
    "kernel",
    "scheme",
    "parameter",
    "value",
];
/// Growth of an error that counts.
const ERROR_GROWTH: f64 = 1.10;
/// Growth of a cost that counts.
const COST_GROWTH: f64 = 1.50;
/// Errors below this are rounding: their growth means nothing.
const ERROR_FLOOR: f64 = 1e-9;
/// Largest stored report that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// One value that got worse.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Worse {
    section: String,
    row: String,
    column: String,
    before: Value,
    now: Value,
}

impl Worse {
    pub(super) fn to_json(&self) -> Value {
        json!({ "section": self.section, "row": self.row, "column": self.column, "before": self.before, "now": self.now })
    }
}

impl fmt::Display for Worse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]: {} was {}, is {}", self.section, self.row, self.column, self.before, self.now)
    }
}

/// Reads a stored report.
pub(super) fn read(path: &Path) -> Result<Value, ServerError> {
    let size = std::fs::metadata(path).map_err(|e| ServerError::reading(path, &e))?.len();
    if size > MAX_BYTES {
        return Err(ServerError::BadData(format!(
            "{}: {size} bytes, more than a report has ({MAX_BYTES}); give the report.json of an earlier run",
            path.display()
        )));
    }
    let bytes = std::fs::read(path).map_err(|e| ServerError::reading(path, &e))?;
    let bad = |what: String| {
        ServerError::BadData(format!("{}: {what}; give the report.json of an earlier run", path.display()))
    };
    let document: Value = serde_json::from_slice(&bytes).map_err(|e| bad(e.to_string()))?;
    match document.get("report") {
        Some(Value::Object(_)) => Ok(document),
        _ => Err(bad("no object \"report\" in it".to_owned())),
    }
}

/// What got worse in `sections` than in the stored document.
pub(super) fn compare(stored: &Value, sections: &[Section]) -> Vec<Worse> {
    let mut worse = Vec::new();
    for section in sections {
        let Some(Value::Array(old_rows)) = stored.get(section.key) else { continue };
        let mut used = vec![false; old_rows.len()];
        for row in &section.rows {
            let row: Map<String, Value> = row.iter().map(|(n, v)| ((*n).to_owned(), v.clone())).collect();
            let name = identity(&row);
            let same = |(i, old): &(usize, &Value)| !used[*i] && old.as_object().is_some_and(|o| identity(o) == name);
            let Some((index, old)) = old_rows.iter().enumerate().find(same) else { continue };
            used[index] = true;
            for (column, now) in &row {
                let Some(before) = old.get(column) else { continue };
                if got_worse(column, before, now) {
                    worse.push(Worse {
                        section: section.key.to_owned(),
                        row: name.clone(),
                        column: column.clone(),
                        before: before.clone(),
                        now: now.clone(),
                    });
                }
            }
        }
    }
    worse
}

fn identity(row: &Map<String, Value>) -> String {
    let parts = IDENTITY.iter().filter_map(|name| {
        let value = row.get(*name)?;
        Some(format!("{name} {}", value.as_str().map_or_else(|| value.to_string(), str::to_owned)))
    });
    parts.collect::<Vec<_>>().join(", ")
}

fn got_worse(column: &str, before: &Value, now: &Value) -> bool {
    match column {
        "pass" | "agree" => *before == Value::Bool(true) && *now == Value::Bool(false),
        "unstable" => *before == Value::Bool(false) && *now == Value::Bool(true),
        "outcome" => before != "wrong" && now == "wrong",
        "cpu_per_sim" | "ns_per_spring_step" => grew(before, now, COST_GROWTH, 0.0),
        _ if column.contains("error") => grew(before, now, ERROR_GROWTH, ERROR_FLOOR),
        _ => false,
    }
}

fn grew(before: &Value, now: &Value, growth: f64, floor: f64) -> bool {
    match (before.as_f64(), now.as_f64()) {
        (Some(before), Some(now)) => now.abs() > floor && now.abs() > before.abs().max(floor) * growth,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(error: f64, cost: f64, unstable: bool) -> Section {
        let row = vec![
            ("scene", json!("skin")),
            ("dt_s", json!(1e-3)),
            ("position_error", json!(error)),
            ("cpu_per_sim", json!(cost)),
            ("unstable", json!(unstable)),
        ];
        Section { key: "work_precision", title: String::new(), words: vec![], figures: vec![], rows: vec![row] }
    }

    fn against(now: &Section) -> Vec<String> {
        let stored = json!({ "report": {}, "work_precision": [
            { "scene": "liver", "dt_s": 1e-3, "position_error": 1e-9 },
            { "scene": "skin", "dt_s": 1e-3, "position_error": 1e-3, "cpu_per_sim": 0.2, "unstable": false } ] });
        compare(&stored, std::slice::from_ref(now)).into_iter().map(|w| w.column).collect()
    }

    #[test]
    fn errors_costs_and_verdicts_each_have_their_measure() {
        assert!(against(&section(1.09e-3, 0.29, false)).is_empty());
        assert_eq!(against(&section(1.2e-3, 0.2, false)), ["position_error"]);
        assert_eq!(against(&section(1e-3, 0.31, true)), ["cpu_per_sim", "unstable"]);
    }

    #[test]
    fn rows_that_only_one_report_has_are_passed_over() {
        let stored = json!({ "report": {}, "work_precision": [], "stability": [{ "topology": "sheet" }] });
        assert!(compare(&stored, &[section(1.0, 1.0, true)]).is_empty());
    }
}
