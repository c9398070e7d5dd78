//! One part of the report: words, figures as SVG text, and rows of named values.
//!
//! Absent: how a section is printed or stored.

use serde_json::Value;
use std::sync::atomic::{AtomicBool, Ordering};

/// How much work a report may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// The whole report in under 2 minutes on 2 cores.
    Quick,
    /// The whole report in under 30 minutes on 2 cores.
    Full,
}

/// One row: values by column name, in the order of the columns. Every row of a section has the same columns.
pub type Row = Vec<(&'static str, Value)>;

/// One figure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// File name without ending, unique in the report.
    pub name: String,
    /// One or two sentences under the figure.
    pub caption: String,
    /// A whole `<svg>` element.
    pub svg: String,
}

/// One part of the report.
#[derive(Clone, Debug)]
pub struct Section {
    /// JSON key of the rows, and name of their CSV file.
    pub key: &'static str,
    /// Heading.
    pub title: String,
    /// Paragraphs in plain words: what was done, what it shows, what it does not show.
    pub words: Vec<String>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Rows of the table.
    pub rows: Vec<Row>,
}

/// Where a measurement says how far it is, and learns that it shall stop.
pub struct Progress<'a> {
    /// Set when the report shall end with what it has.
    pub stop: &'a AtomicBool,
    /// Called with a short line about what is being done.
    pub say: &'a (dyn Fn(&str) + Sync),
}

impl Progress<'_> {
    /// True when the measurement shall return what it has.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
