//! The accuracy report: error against run time, stability, extreme cases, validation, and what each scene paid for.
//!
//! A part of the report is one file with one function `measure(effort, progress) -> Section`, named once in `parts`. A
//! [`section::Section`] carries words, figures and rows; the rows become the HTML table, the CSV file and the JSON array
//! of the same key. `cli` runs the parts in order and writes the report anew after each, so that a run that is stopped
//! leaves what it has.

mod awake;
mod cases;
mod choice;
mod cli;
mod cpu_clock;
pub mod curves;
pub mod deviations;
mod document;
pub mod extremes;
mod head;
mod kernels;
mod network_file;
mod networks;
mod non_smooth;
mod page;
mod paid;
mod parts;
pub mod plot;
mod rates;
pub mod refinement;
mod regression;
pub mod section;
mod side_by_side;
pub mod stability_map;
pub mod statics;
mod tissue_run;
mod truth;
pub mod validation;
mod work_precision;
pub mod wound_figures;

pub use cli::main;
