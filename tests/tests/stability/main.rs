//! Stability where formulas say so, and sound endings where nothing else can be asked.

mod extremes;
mod maps;
