//! The report as data: one JSON document, one CSV file per section, one SVG file per figure.
//!
//! Values that are not finite have no JSON number; they are `null` there and empty in the CSV. A part that was not
//! measured has an empty array and stands in `report.not_measured`.

use super::head::Head;
use super::page;
use super::regression::Worse;
use super::section::{Effort, Section};
use haptic_server::error::ServerError;
use serde_json::{Map, Value, json};
use std::path::Path;

/// What one part of the report took.
#[derive(Clone, Debug)]
pub(super) struct Spent {
    /// First key of the part.
    pub(super) part: &'static str,
    /// Processor time of all threads, seconds.
    pub(super) cpu_s: f64,
    /// By the wall clock, seconds.
    pub(super) wall_s: f64,
}

/// All that was measured so far.
#[derive(Clone, Debug)]
pub(super) struct Report {
    pub(super) head: Head,
    pub(super) effort: Effort,
    pub(super) sections: Vec<Section>,
    /// What each part took.
    pub(super) spent: Vec<Spent>,
    /// Keys of the parts that were not begun.
    pub(super) not_measured: Vec<&'static str>,
    /// Key of the part in which the report was stopped.
    pub(super) stopped_in: Option<&'static str>,
    /// What got worse than the stored report, when one was given.
    pub(super) worse: Option<Vec<Worse>>,
}

impl Report {
    /// True when every part was measured to its end.
    pub(super) fn complete(&self) -> bool {
        self.not_measured.is_empty() && self.stopped_in.is_none()
    }

    /// The parts, and what each took.
    pub(super) fn all_sections(&self) -> impl Iterator<Item = Section> + '_ {
        let row = |s: &Spent| vec![("part", json!(s.part)), ("cpu_s", json!(s.cpu_s)), ("wall_s", json!(s.wall_s))];
        let whole = |of: fn(&Spent) -> f64| self.spent.iter().map(of).sum::<f64>();
        let spent = Section {
            key: "sections",
            title: "What this report took".to_owned(),
            words: vec![format!(
                "{:.0} s of processor time in {:.0} s, by part. Parts that print times work on one core, the others on two.",
                whole(|s| s.cpu_s),
                whole(|s| s.wall_s)
            )],
            figures: Vec::new(),
            rows: self.spent.iter().map(row).collect(),
        };
        self.sections.iter().cloned().chain([spent])
    }

    /// The JSON document.
    pub(super) fn to_json(&self) -> Value {
        let mut head = self.head.to_json();
        head.insert("effort".into(), json!(effort_name(self.effort)));
        head.insert("complete".into(), json!(self.complete()));
        head.insert("stopped_in".into(), json!(self.stopped_in));
        head.insert("not_measured".into(), json!(self.not_measured));
        let mut document = Map::new();
        document.insert("report".into(), Value::Object(head));
        for key in &self.not_measured {
            document.insert((*key).into(), json!([]));
        }
        for section in self.all_sections() {
            let rows = section.rows.iter().map(|row| {
                Value::Object(row.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect())
            });
            document.insert(section.key.into(), Value::Array(rows.collect()));
        }
        if let Some(worse) = &self.worse {
            document.insert("worse".into(), Value::Array(worse.iter().map(Worse::to_json).collect()));
        }
        Value::Object(document)
    }

    /// Writes report.html, report.json, a CSV per section and an SVG per figure.
    pub(super) fn write(&self, folder: &Path) -> Result<(), ServerError> {
        std::fs::create_dir_all(folder).map_err(|e| writing(folder, &e))?;
        save(folder, "report.html", page::html(self).as_bytes())?;
        save(folder, "report.json", format!("{:#}\n", self.to_json()).as_bytes())?;
        for section in self.all_sections() {
            save(folder, &format!("{}.csv", section.key), &csv(&section)?)?;
            for figure in &section.figures {
                save(folder, &format!("{}.svg", figure.name), figure.svg.as_bytes())?;
            }
        }
        Ok(())
    }
}

/// Name of an effort in the outputs.
pub(super) const fn effort_name(effort: Effort) -> &'static str {
    match effort {
        Effort::Quick => "quick",
        Effort::Full => "full",
    }
}

/// Writes beside the target and renames, so that a reader never sees half a file.
fn save(folder: &Path, name: &str, content: &[u8]) -> Result<(), ServerError> {
    let (path, fresh) = (folder.join(name), folder.join(format!(".{name}.new")));
    std::fs::write(&fresh, content).and_then(|()| std::fs::rename(&fresh, &path)).map_err(|e| writing(&path, &e))
}

/// Makes the folder and tries it, before the minutes of a report are spent.
pub(super) fn prepare(folder: &Path) -> Result<(), ServerError> {
    let probe = folder.join(".report.new");
    let tried = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&probe, []));
    tried.and_then(|()| std::fs::remove_file(&probe)).map_err(|e| writing(folder, &e))
}

fn writing(path: &Path, error: &std::io::Error) -> ServerError {
    let sentence = format!("{}: cannot write: {error}; choose another folder with --out", path.display());
    match error.kind() {
        std::io::ErrorKind::PermissionDenied => ServerError::Permission(sentence),
        _ => ServerError::Unavailable(sentence),
    }
}

fn csv(section: &Section) -> Result<Vec<u8>, ServerError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let fail = |e: &dyn std::fmt::Display| ServerError::Internal(format!("{}.csv cannot be made: {e}", section.key));
    if let Some(first) = section.rows.first() {
        writer.write_record(first.iter().map(|(name, _)| *name)).map_err(|e| fail(&e))?;
    }
    for row in &section.rows {
        writer.write_record(row.iter().map(|(_, value)| plain(value))).map_err(|e| fail(&e))?;
    }
    writer.into_inner().map_err(|e| fail(&e))
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
