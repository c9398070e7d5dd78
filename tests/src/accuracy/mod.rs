//! The accuracy report: error against run time, stability, extreme cases, validation, and what each scene paid for.
//!
//! A part of the report is one file with one function `measure(effort, progress) -> Section`. A [`section::Section`] carries
//! words, figures and rows; the rows become the HTML table, the CSV file and the JSON array of the same key.

pub mod section;
