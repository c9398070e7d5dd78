//! Spring networks from a file (`spring-network/1`, JSON): read, checked, refused before memory is taken.
//!
//! The file is refused by its size first. Then it is parsed as a stream into arrays that stop growing at their limit, so
//! that no count in the file decides an allocation. Every index, length and number is checked. SI units.

use haptic_server::error::ServerError;
use serde::de::{Deserialize, Deserializer, Error as _, SeqAccess, Visitor};
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};
use sim_core::vector::Vec3;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::marker::PhantomData;
use std::path::Path;

/// Largest file, bytes.
pub(super) const MAX_BYTES: u64 = 256 << 20;
/// Most entries of one array: nodes, springs, loads.
const MAX_ENTRIES: usize = 2_000_000;

/// A network with its load and what another program computed for it.
#[derive(Clone, Debug)]
pub(super) struct NetworkFile {
    /// File name without folder, for reports.
    pub(super) name: String,
    pub(super) network: SpringNetwork,
    pub(super) loads: Vec<(u32, Vec3)>,
    /// Step that the file names, seconds.
    pub(super) time_step_s: f64,
    /// Time of the reference positions, seconds.
    pub(super) end_s: f64,
    /// Reference positions at that time, metres.
    pub(super) reference_m: Vec<Vec3>,
}

/// An array that refuses to grow beyond [`MAX_ENTRIES`].
#[derive(Debug)]
struct Bounded<T>(Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Bounded<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Bounded<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
                let mut kept = Vec::new();
                while let Some(entry) = entries.next_element()? {
                    if kept.len() == MAX_ENTRIES {
                        return Err(A::Error::custom(format!("an array has more than {MAX_ENTRIES} entries")));
                    }
                    kept.push(entry);
                }
                Ok(Bounded(kept))
            }
        }
        deserializer.deserialize_seq(Entries(PhantomData))
    }
}

/// One value for all, or one for each.
#[derive(Debug, serde::Deserialize)]
#[serde(untagged)]
enum OneOrEach {
    One(f64),
    Each(Bounded<f64>),
}

impl OneOrEach {
    fn each(&self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        match self {
            Self::One(value) => Ok(vec![*value; count]),
            Self::Each(values) if values.0.len() == count => Ok(values.0.clone()),
            Self::Each(values) => Err(format!("{what} has {} entries for {count}", values.0.len())),
        }
    }
}

#[derive(Debug, serde::Deserialize)]
struct Document {
    format: String,
    node_mass_kg: OneOrEach,
    stiffness_n_per_m: OneOrEach,
    drag_n_s_per_m: OneOrEach,
    time_step_s: f64,
    end_s: f64,
    positions_m: Bounded<[f64; 3]>,
    pinned: Bounded<u32>,
    springs: Bounded<[u32; 2]>,
    rest_lengths_m: Bounded<f64>,
    #[serde(default = "no_load")]
    loads: Bounded<LoadEntry>,
    reference: Reference,
}

fn no_load() -> Bounded<LoadEntry> {
    Bounded(Vec::new())
}

#[derive(Debug, serde::Deserialize)]
struct LoadEntry {
    node: u32,
    force_n: [f64; 3],
}

#[derive(Debug, serde::Deserialize)]
struct Reference {
    positions_at_end_m: Bounded<[f64; 3]>,
}

/// Reads a file.
///
/// # Errors
/// [`ServerError::NoInput`] when it cannot be read, [`ServerError::BadData`] with path and place when it is not such a
/// network or larger than is taken.
pub(super) fn read(path: &Path) -> Result<NetworkFile, ServerError> {
    let file = File::open(path).map_err(|e| ServerError::reading(path, &e))?;
    let facts = file.metadata().map_err(|e| ServerError::reading(path, &e))?;
    if facts.is_dir() {
        return Err(ServerError::NoInput(format!("{}: is a folder; give a spring-network/1 file", path.display())));
    }
    let bad = |what: String| {
        ServerError::BadData(format!("{}: {what}; give a spring-network/1 file (JSON, SI units)", path.display()))
    };
    let too_large = || bad(format!("larger than {MAX_BYTES} bytes, the most that is read"));
    if facts.len() > MAX_BYTES {
        return Err(too_large());
    }
    // A pipe has no length: the reader stops one byte beyond the limit.
    let mut reader = BufReader::new(file.take(MAX_BYTES + 1));
    let parsed: Result<Document, _> = serde_json::from_reader(&mut reader);
    if reader.get_ref().limit() == 0 {
        return Err(too_large());
    }
    let document = parsed.map_err(|e| bad(e.to_string()))?;
    let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
    checked(&document, name).map_err(bad)
}

fn checked(document: &Document, name: String) -> Result<NetworkFile, String> {
    if document.format != "spring-network/1" {
        return Err(format!("the format is \"{}\", not \"spring-network/1\"", document.format));
    }
    let (nodes, springs) = (document.positions_m.0.len(), document.springs.0.len());
    if nodes == 0 || springs == 0 {
        return Err("it has no node or no spring".into());
    }
    for (what, found, wanted) in [
        ("rest_lengths_m", document.rest_lengths_m.0.len(), springs),
        ("reference.positions_at_end_m", document.reference.positions_at_end_m.0.len(), nodes),
    ] {
        if found != wanted {
            return Err(format!("{what} has {found} entries for {wanted}"));
        }
    }
    let duration = |v: f64| v.is_finite() && v > 0.0;
    if !duration(document.time_step_s) || !duration(document.end_s) || document.end_s / document.time_step_s > 1e7 {
        return Err("time_step_s and end_s must be above 0, and end_s at most ten million steps".into());
    }
    let vector = |v: &[f64; 3]| Vec3::new(v[0], v[1], v[2]);
    let reference_m: Vec<Vec3> = document.reference.positions_at_end_m.0.iter().map(vector).collect();
    if !reference_m.iter().all(|v| v.iter().all(|c| c.is_finite())) {
        return Err("a reference position is not finite".into());
    }
    let mut fixed = vec![0_u8; nodes];
    for &node in &document.pinned.0 {
        *fixed.get_mut(node as usize).ok_or_else(|| format!("pinned node {node} does not exist"))? = 1;
    }
    let mut loads = Vec::with_capacity(document.loads.0.len());
    for load in &document.loads.0 {
        if load.node as usize >= nodes || !load.force_n.iter().all(|f| f.is_finite()) {
            return Err(format!("the load on node {} names no node or is not finite", load.node));
        }
        loads.push((load.node, vector(&load.force_n)));
    }
    let stiffness = document.stiffness_n_per_m.each(springs, "stiffness_n_per_m")?;
    let ends = document.springs.0.iter().zip(stiffness).zip(&document.rest_lengths_m.0);
    let springs = ends.map(|(([a, b], stiffness_n_per_m), rest)| Spring {
        a: *a,
        b: *b,
        stiffness_n_per_m,
        rest_length_m: *rest,
        family: SpringFamily::Structural,
    });
    let network = SpringNetwork::new(
        document.positions_m.0.iter().map(vector).collect(),
        document.node_mass_kg.each(nodes, "node_mass_kg")?,
        document.drag_n_s_per_m.each(nodes, "drag_n_s_per_m")?,
        fixed,
        springs.collect(),
    )
    .map_err(|e| e.to_string())?;
    let (time_step_s, end_s) = (document.time_step_s, document.end_s);
    Ok(NetworkFile { name, network, loads, time_step_s, end_s, reference_m })
}

#[cfg(test)]
#[path = "networks_tests.rs"]
mod tests;
