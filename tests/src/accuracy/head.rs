//! What a figure cannot be read without: commit, compiler, processor, cores. No date: equal runs give equal heads.

use serde_json::{Map, Value, json};

/// Facts about this build and this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Head {
    /// Name and value, in the order in which they are printed.
    pub(super) facts: Vec<(&'static str, String)>,
}

impl Head {
    /// Of this binary on this machine.
    pub(super) fn measure() -> Self {
        let unknown = || "unknown".to_owned();
        let built = |value: Option<&str>| value.map_or_else(unknown, str::to_owned);
        let cores = std::thread::available_parallelism().map_or_else(|_| unknown(), |n| n.to_string());
        Self {
            facts: vec![
                ("commit", built(option_env!("SUTURE_COMMIT"))),
                ("version", env!("CARGO_PKG_VERSION").to_owned()),
                ("compiler", built(option_env!("SUTURE_COMPILER"))),
                ("target", built(option_env!("SUTURE_TARGET"))),
                ("opt_level", built(option_env!("SUTURE_OPT_LEVEL"))),
                ("cpu", cpu_name().unwrap_or_else(unknown)),
                ("cores", cores),
            ],
        }
    }

    /// As a JSON object.
    pub(super) fn to_json(&self) -> Map<String, Value> {
        self.facts.iter().map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
    }
}

fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fact_has_a_value() {
        assert!(Head::measure().facts.iter().all(|(_, value)| !value.is_empty()));
    }
}
