//! What a trace says about its origin: program, machine, scene, parameters, seeds.
//!
//! Metadata groups `program`, `machine`, `scene`, `parameters`, `seeds`, each a table of text values. A nested
//! configuration becomes dotted keys (`tissue.layers.0.thickness_mm`), so that it can be compared line by line.
//! Facts that the machine does not tell are left out. Absent: host and user name.

use protocol::trace::Metadata;
use protocol::wire::WIRE_VERSION;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

/// Values of one metadata group.
pub type Group = BTreeMap<String, String>;

/// Deepest nesting that becomes keys; what lies deeper stays JSON text.
const DEEPEST: usize = 16;
/// Longest value, bytes; a model name or kernel release is far shorter.
const LONGEST_FACT: u64 = 4096;

/// Metadata with the groups `program` and `machine`; the caller adds the rest.
#[must_use]
pub fn origin() -> Metadata {
    Metadata::from([("program".to_owned(), program()), ("machine".to_owned(), machine())])
}

/// A configuration as a metadata group.
///
/// # Errors
/// What serde says of a value that JSON cannot hold.
pub fn group(configuration: &impl Serialize) -> Result<Group, serde_json::Error> {
    let mut group = Group::new();
    flatten("", &serde_json::to_value(configuration)?, 0, &mut group);
    Ok(group)
}

/// Metadata of what is the same whenever and wherever it is computed: the group `program`, without machine and hour.
#[must_use]
pub fn timeless_origin() -> Metadata {
    Metadata::from([("program".to_owned(), build())])
}

fn build() -> Group {
    Group::from([
        ("name".to_owned(), env!("CARGO_PKG_NAME").to_owned()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("wire_version".to_owned(), WIRE_VERSION.to_string()),
        ("build".to_owned(), if cfg!(debug_assertions) { "debug" } else { "release" }.to_owned()),
    ])
}

fn program() -> Group {
    let mut group = build();
    // Log times are monotonic; these two tell wall-clock time.
    if let Ok(now) = SystemTime::now().duration_since(UNIX_EPOCH) {
        group.insert("start_unix_ns".to_owned(), now.as_nanos().to_string());
        group.insert("start_monotonic_ns".to_owned(), protocol::ports::monotonic_ns().to_string());
    }
    group
}

fn machine() -> Group {
    let mut group = Group::from([("architecture".to_owned(), std::env::consts::ARCH.to_owned())]);
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value.filter(|v| !v.is_empty()) {
            group.insert(name.to_owned(), value);
        }
    };
    add("kernel", fact("/proc/sys/kernel/osrelease"));
    add("kernel_version", fact("/proc/sys/kernel/version"));
    add("realtime_kernel", fact("/sys/kernel/realtime"));
    add("cpu", cpu_model());
    add("cpus", std::thread::available_parallelism().ok().map(|n| n.to_string()));
    group
}

fn fact(path: &str) -> Option<String> {
    use std::io::Read;
    let mut text = String::new();
    std::fs::File::open(path).ok()?.take(LONGEST_FACT).read_to_string(&mut text).ok()?;
    Some(text.trim().to_owned())
}

fn cpu_model() -> Option<String> {
    let text = fact("/proc/cpuinfo")?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn flatten(key: &str, value: &Value, depth: usize, group: &mut Group) {
    let child = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        Value::Object(fields) if depth < DEEPEST => {
            fields.iter().for_each(|(name, value)| flatten(&child(name), value, depth + 1, group));
        }
        Value::Array(items) if depth < DEEPEST && items.iter().any(|i| i.is_object() || i.is_array()) => {
            items.iter().enumerate().for_each(|(i, value)| flatten(&child(&i.to_string()), value, depth + 1, group));
        }
        Value::Null => {}
        Value::String(text) => drop(group.insert(key.to_owned(), text.clone())),
        other => drop(group.insert(key.to_owned(), other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_nested_configuration_becomes_dotted_keys() {
        let config =
            json!({"scene": "skin", "beta": 0.5, "layers": [{"d": 1}, {"d": 2}], "dims": [1, 2], "none": null});
        let expected =
            [("beta", "0.5"), ("dims", "[1,2]"), ("layers.0.d", "1"), ("layers.1.d", "2"), ("scene", "skin")];
        let found = group(&config).unwrap();
        assert_eq!(found.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn the_origin_names_program_version_and_machine() {
        let origin = origin();
        assert_eq!(origin["program"]["version"], env!("CARGO_PKG_VERSION"));
        assert!(origin["machine"].contains_key("kernel") && origin["machine"].contains_key("cpus"));
    }
}
