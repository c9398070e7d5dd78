//! One JSON line per event on standard output, for scripts and tests (`--tell`).
//!
//! `started` · `camera` (16 numbers of the matrix from the scene to clip space, column by column, and the picture's size) · `picked`
//! · `servo` (state, fault and rights, when they change) · `saved` (screenshot or sample curves) · `notice` (what became of an order, and every other sentence) · `hand` ·
//! `gone` · `quit`. Sentences are for people, events and numbers for programs.

use serde_json::{Value, json};
use std::io::Write;

/// Whether events are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tell {
    /// No.
    #[default]
    Silent,
    /// On standard output.
    Lines,
}

impl Tell {
    /// Tells one event with its fields (an object).
    pub fn say(self, event: &str, fields: Value) {
        if self == Self::Lines {
            let mut out = std::io::stdout().lock();
            // A reader that has gone has heard enough.
            let _ = writeln!(out, "{}", line(event, fields)).and_then(|()| out.flush());
        }
    }
}

fn line(event: &str, mut fields: Value) -> Value {
    if let Some(object) = fields.as_object_mut() {
        object.insert("event".to_owned(), json!(event));
        return fields;
    }
    json!({ "event": event, "value": fields })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_names_its_event_and_is_one_line() {
        let told = line("saved", json!({ "file": "a\n\"b\".png" })).to_string();
        let back: Value = serde_json::from_str(&told).expect("JSON");
        assert_eq!((&back["event"], &back["file"]), (&json!("saved"), &json!("a\n\"b\".png")));
        assert!(!told.contains('\n'));
        assert_eq!(line("gone", Value::Null)["event"], "gone");
    }
}
