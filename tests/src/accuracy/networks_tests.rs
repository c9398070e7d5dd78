//! Spring network files: what is taken, what is refused, and that no text makes the reader panic.

use super::*;
use proptest::prelude::*;
use serde_json::{Value, json};

fn small() -> Value {
    json!({
        "format": "spring-network/1", "units": "SI", "node_mass_kg": 1e-3, "stiffness_n_per_m": [160.0, 80.0],
        "drag_n_s_per_m": 3.0, "time_step_s": 1e-3, "end_s": 0.1,
        "positions_m": [[0.0, 0.0, 0.0], [2e-3, 0.0, 0.0], [4e-3, 0.0, 0.0]], "pinned": [0, 2],
        "springs": [[0, 1], [2, 1]], "rest_lengths_m": [2e-3, 2e-3],
        "loads": [{ "node": 1, "force_n": [0.1, 0.0, 0.0] }],
        "reference": { "method": "none", "positions_at_end_m": [[0.0, 0.0, 0.0], [2e-3, 0.0, 0.0], [4e-3, 0.0, 0.0]] }
    })
}

fn parse(value: &Value) -> Result<NetworkFile, String> {
    let document: Document = serde_json::from_str(&value.to_string()).map_err(|e| e.to_string())?;
    checked(&document, "small".into())
}

#[test]
fn a_small_network_is_taken_as_it_stands() {
    let file = parse(&small()).unwrap();
    assert_eq!((file.network.node_count(), file.network.springs.len(), file.loads.len()), (3, 2, 1));
    assert_eq!(file.network.fixed, [1, 0, 1]);
    assert_eq!(file.network.springs[1].stiffness_n_per_m, 80.0);
}

#[test]
fn what_cannot_be_used_is_refused_with_its_name() {
    let cases: [(&str, Value, &str); 8] = [
        ("format", json!("spring-network/2"), "spring-network/2"),
        ("springs", json!([[0, 1], [2, 9]]), "does not exist"),
        ("springs", json!([[0, 1], [1, 1]]), "itself"),
        ("rest_lengths_m", json!([1e-3]), "rest_lengths_m"),
        ("pinned", json!([7]), "pinned node 7"),
        ("node_mass_kg", json!(0.0), "mass"),
        ("loads", json!([{ "node": 5, "force_n": [0, 0, 0] }]), "load on node 5"),
        ("time_step_s", json!(-1.0), "time_step_s"),
    ];
    for (key, value, word) in cases {
        let mut document = small();
        document[key] = value;
        let error = parse(&document).unwrap_err();
        assert!(error.contains(word), "{key}: {error}");
    }
}

#[test]
fn a_folder_and_a_missing_file_are_no_input() {
    let folder = std::env::temp_dir();
    for path in [folder.as_path(), &folder.join("no-such-network.json")] {
        assert_eq!(read(path).unwrap_err().exit_code(), haptic_server::exit::NO_INPUT);
    }
}

#[test]
fn an_array_beyond_its_limit_is_refused_while_it_is_read() {
    /// An opening bracket, then ones for ever.
    struct Endless(u64);
    impl Read for Endless {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            for byte in buffer.iter_mut() {
                *byte = match self.0 {
                    0 => b'[',
                    at if at % 2 == 1 => b'1',
                    _ => b',',
                };
                self.0 += 1;
            }
            Ok(buffer.len())
        }
    }
    let error = serde_json::from_reader::<_, Bounded<u32>>(BufReader::with_capacity(1 << 16, Endless(0))).unwrap_err();
    assert!(error.to_string().contains("entries"), "{error}");
}

proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(text in ".{0,300}") {
        let _ = serde_json::from_str::<Document>(&text);
    }

    #[test]
    fn a_changed_number_is_taken_or_refused_in_words(
        key in prop::sample::select(vec!["node_mass_kg", "stiffness_n_per_m", "drag_n_s_per_m", "time_step_s", "end_s"]),
        value in prop::num::f64::ANY,
    ) {
        let mut document = small();
        document[key] = json!(value);
        match parse(&document) {
            Ok(file) => prop_assert!(file.network.mass_kg.iter().all(|m| *m > 0.0) && file.end_s > 0.0),
            Err(error) => prop_assert!(!error.is_empty()),
        }
    }
}
