//! `haptic-server inspect FILE [--json]`: what a recording, scene file or mesh holds.
//!
//! For a trace: topics with counts and spans, metadata, the last ledger, and whether it is whole or where it
//! was cut or damaged. For a hand recording as CSV: layout, samples, duration, grips. The whole file is read, so that
//! every message is known to be sound. For an OBJ mesh: counts, extent in the file's own unit, and whether it can be an organ's
//! surface. A scene file is told as `scene check` does.

use crate::cli::{Format, files};
use crate::convert::{end_fault, starts_as_mcap};
use crate::error::ServerError;
use crate::hand::csv::{self, HandFileKind, HandSide};
use crate::scene_file::read_capped;
use crate::solver::mesh_obj::{ObjLimits, read_obj};
use protocol::trace::{TraceEnd, TraceError, TraceItem, TraceReader};
use serde_json::{Value, json};
use std::fmt::Write;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

const NS_PER_S: f64 = 1e9;

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspected {
    /// For stdout.
    pub text: String,
    /// What is wrong with the file, besides what the text says.
    pub fault: Option<ServerError>,
}

/// Looks at a file; scene files and meshes are known by their names.
///
/// # Errors
/// 65 for a file that is none of these, 66 for one that cannot be read.
pub fn run(file: &Path, format: Format) -> Result<Inspected, ServerError> {
    let (found, fault) = match file.extension().and_then(|e| e.to_str()) {
        Some("toml") => return Ok(Inspected { text: files::scene_check(file, format)?, fault: None }),
        Some("obj") => (inspect_mesh(file)?, None),
        _ if starts_as_mcap(file)? => inspect_trace(file)?,
        _ => (inspect_csv(file)?, None),
    };
    let text = match format {
        Format::Json => format!("{found:#}\n"),
        Format::Text => readable(&found),
    };
    Ok(Inspected { text, fault })
}

/// A mesh does not say its unit: read as if in millimetres, nearly (a power of two loses no digit), so that an organ is
/// not refused for its size.
const UNIT_M: f64 = 1.0 / 1024.0;

fn inspect_mesh(file: &Path) -> Result<Value, ServerError> {
    let limits = ObjLimits::default();
    let bytes = read_capped(file, limits.bytes as u64)?;
    let mesh = read_obj(&bytes, &file.display().to_string(), UNIT_M, limits);
    let mesh = mesh.map_err(|e| ServerError::BadData(e.to_string()))?;
    let extent = |axis: usize| {
        let along = || mesh.vertices_m.iter().map(|v| v[axis]);
        (along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)) / UNIT_M
    };
    Ok(json!({
        "file": file.display().to_string(),
        "kind": "mesh",
        "vertices": mesh.vertices_m.len(),
        "triangles": mesh.faces.len(),
        "extent": [extent(0), extent(1), extent(2)],
        "refused_as_organ": mesh.check_closed().err().map(|e| e.to_string()),
    }))
}

fn inspect_csv(file: &Path) -> Result<Value, ServerError> {
    let hand = csv::read_path(file, HandSide::default())?;
    let layout = match hand.kind {
        HandFileKind::Scene => "scene",
        HandFileKind::Jigsaws => "jigsaws",
        HandFileKind::Touch => "touch",
    };
    Ok(json!({
        "file": file.display().to_string(),
        "kind": "hand",
        "layout": layout,
        "samples": hand.recording.times_s.len(),
        "duration_s": hand.recording.duration_s(),
        "grips": hand.recording.grips().count(),
    }))
}

fn inspect_trace(file: &Path) -> Result<(Value, Option<ServerError>), ServerError> {
    let name = file.display();
    let source = File::open(file).map_err(|e| ServerError::reading(file, &e))?;
    let fault = |e: &TraceError| match e {
        TraceError::Read { .. } => ServerError::NoInput(format!("{name}: {e}")),
        _ => ServerError::BadData(format!("{name}: {e}")),
    };
    let mut reader = TraceReader::open(BufReader::new(source)).map_err(|e| fault(&e))?;
    let (mut unusable, mut first_unusable) = (0_u64, None);
    let (mut stitches, mut er_max) = (None, None);
    loop {
        match reader.next_item() {
            Ok(None) => break,
            Ok(Some((_, TraceItem::WoundReport(report)))) => {
                stitches = Some(report.row_count);
                er_max = Some(report.er_max);
            }
            Ok(Some(_)) => {}
            Err(error @ TraceError::Message { .. }) => {
                unusable += 1;
                first_unusable.get_or_insert_with(|| fault(&error));
            }
            Err(error) => return Err(fault(&error)),
        }
    }
    let used = || reader.channels().filter(|c| c.messages > 0);
    let start_ns = used().map(|c| c.first_ns).min().unwrap_or(0);
    let end_ns = used().map(|c| c.last_ns).max().unwrap_or(start_ns);
    let since_start = |ns: u64| ns.saturating_sub(start_ns) as f64 / NS_PER_S;
    let channels: Vec<Value> = reader
        .channels()
        .map(|c| {
            let (first_s, last_s) = (since_start(c.first_ns), since_start(c.last_ns));
            json!({
                "topic": c.topic, "encoding": c.encoding, "messages": c.messages, "first_s": first_s, "last_s": last_s,
            })
        })
        .collect();
    let end = match reader.end() {
        TraceEnd::Complete | TraceEnd::Reading => json!({"state": "complete"}),
        TraceEnd::Cut { byte } => json!({"state": "cut", "byte": byte}),
        TraceEnd::Damaged { byte, reason } => json!({"state": "damaged", "byte": byte, "reason": reason}),
    };
    let found = json!({
        "file": name.to_string(),
        "kind": "trace",
        "end": end,
        "duration_s": since_start(end_ns),
        "messages": reader.channels().map(|c| c.messages).sum::<u64>(),
        "unusable": unusable,
        "stitches": stitches,
        "er_max": er_max,
        "channels": channels,
        "metadata": reader.metadata(),
    });
    Ok((found, end_fault(file, reader.end()).or(first_unusable)))
}

/// The same for people.
fn readable(found: &Value) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{}", plain(&found["file"]));
    for (key, value) in found.as_object().into_iter().flatten() {
        match key.as_str() {
            "file" | "channels" | "metadata" | "end" => {}
            _ if value.is_null() => {}
            _ => drop(writeln!(text, "  {key}: {}", plain(value))),
        }
    }
    match &found["end"] {
        Value::Null => {}
        end if end["byte"].is_null() => text.push_str("  whole\n"),
        end => drop(writeln!(text, "  {} at byte {}", plain(&end["state"]), end["byte"])),
    }
    for channel in found["channels"].as_array().into_iter().flatten() {
        let [topic, messages] = ["topic", "messages"].map(|key| plain(&channel[key]));
        let [first, last] = ["first_s", "last_s"].map(|key| channel[key].as_f64().unwrap_or(0.0));
        let _ = writeln!(text, "  {topic:<18}{messages:>9} messages  {first:>10.3} to {last:.3} s");
    }
    for (group, values) in found["metadata"].as_object().into_iter().flatten() {
        for (key, value) in values.as_object().into_iter().flatten() {
            let _ = writeln!(text, "  {group}: {key} = {}", plain(value));
        }
    }
    text
}

fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;
    use protocol::servo_state::ServoState;
    use protocol::trace::{Metadata, TraceWriter};
    use protocol::wire::{Field, Message};
    use protocol::wound_report::WoundReport;
    use std::fs;

    fn small_trace() -> Vec<u8> {
        let metadata = Metadata::from([("scene".to_owned(), [("kind".to_owned(), "skin".to_owned())].into())]);
        let mut writer = TraceWriter::create(Vec::new(), &metadata).unwrap();
        for tick in 1..=1500 {
            let mut state = ServoState { ticks: tick, ..ServoState::EMPTY };
            state.stamp(tick, 7_000_000_000 + tick * 1_000_000);
            writer.servo_state(&state).unwrap();
        }
        let mut report = WoundReport { row_count: 3, er_max: 0.08, ..WoundReport::EMPTY };
        report.stamp(1, 8_000_000_000);
        writer.wound_report(&report).unwrap();
        writer.finish().unwrap()
    }

    #[test]
    fn a_whole_trace_is_told_in_json_and_in_words() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("t.mcap");
        fs::write(&file, small_trace()).unwrap();
        let answer = run(&file, Format::Json).unwrap();
        assert_eq!(answer.fault, None);
        let found: Value = serde_json::from_str(&answer.text).unwrap();
        assert_eq!(found["end"]["state"], "complete");
        assert_eq!(found["messages"], 1501);
        assert_eq!(found["duration_s"], 1.499);
        assert_eq!((&found["stitches"], &found["er_max"]), (&json!(3), &json!(0.08)));
        assert_eq!(found["metadata"]["scene"]["kind"], "skin");
        let servo = found["channels"].as_array().unwrap().iter().find(|c| c["topic"] == "/servo_state").unwrap();
        assert_eq!((&servo["messages"], &servo["last_s"]), (&json!(1500), &json!(1.499)));
        let words = run(&file, Format::Text).unwrap().text;
        assert!(words.contains("whole") && words.contains("/servo_state") && words.contains("kind = skin"), "{words}");
    }

    #[test]
    fn cut_and_damaged_traces_are_told_with_their_place_and_end_with_65() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("t.mcap");
        let whole = small_trace();
        fs::write(&file, &whole[..whole.len() / 2]).unwrap();
        let cut = run(&file, Format::Json).unwrap();
        let found: Value = serde_json::from_str(&cut.text).unwrap();
        assert_eq!(found["end"]["state"], "cut");
        assert!(found["end"]["byte"].as_u64().unwrap() <= whole.len() as u64 / 2);
        assert_eq!(cut.fault.unwrap().exit_code(), exit::BAD_DATA);

        fs::write(&file, &whole).unwrap();
        let sound = run(&file, Format::Text).unwrap().text;
        let told = (4..12).filter(|sixteenth| {
            let mut damaged = whole.clone();
            damaged[whole.len() * sixteenth / 16] ^= 0x55;
            fs::write(&file, damaged).unwrap();
            let answer = run(&file, Format::Text).unwrap();
            let Some(fault) = answer.fault else {
                // An index between two chunks, which nothing is read from.
                assert_eq!(answer.text, sound);
                return false;
            };
            assert!(answer.text.contains("damaged at byte"), "{}", answer.text);
            assert!(fault.to_string().contains("byte"));
            true
        });
        assert!(told.count() >= 4);
    }

    #[test]
    fn other_files_are_told_or_refused() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let file = dir.path().join(name);
            fs::write(&file, text).unwrap();
            file
        };
        let hand = write("h.csv", "TIME_S,X_M,Y_M,Z_M,BUTTONS\n0,0,0,0,0\n2.5,0,0,0,1\n");
        let found: Value = serde_json::from_str(&run(&hand, Format::Json).unwrap().text).unwrap();
        assert_eq!((&found["samples"], &found["duration_s"], &found["grips"]), (&json!(2), &json!(2.5), &json!(1)));
        let mesh = write("t.obj", "v 0 0 0\nv 3 0 0\nv 0 1 0\nv 0 0 2\nf 1 2 3\nf 1 4 2\n");
        let found: Value = serde_json::from_str(&run(&mesh, Format::Json).unwrap().text).unwrap();
        assert_eq!((&found["vertices"], &found["triangles"]), (&json!(4), &json!(2)));
        assert_eq!(found["extent"], json!([3.0, 1.0, 2.0]));
        assert!(found["refused_as_organ"].as_str().is_some_and(|why| why.contains("open")), "{found}");
        let organ = "v 0 0 0\nv 150 0 0\nv 0 150 0\nv 0 0 150\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let found: Value = serde_json::from_str(&run(&write("organ.obj", organ), Format::Json).unwrap().text).unwrap();
        assert_eq!((&found["extent"], &found["refused_as_organ"]), (&json!([150.0, 150.0, 150.0]), &Value::Null));
        for (name, text, says) in [
            ("s.toml", "kind = 1", "s.toml:1:1: unknown key"),
            ("m.obj", "v 0 0 0\nv 0 1 x\n", "m.obj:2:7"),
            ("e.mcap", "", "no MCAP file"),
            ("n.mcap", "TIME_S,X_M\n", "no MCAP file"),
            ("x.bin", "\u{1}\u{2}", "header"),
        ] {
            let error = run(&write(name, text), Format::Text).unwrap_err();
            assert_eq!(error.exit_code(), exit::BAD_DATA, "{name}: {error}");
            assert!(error.to_string().contains(says), "{name}: {error}");
        }
        assert_eq!(run(Path::new("absent.mcap"), Format::Text).unwrap_err().exit_code(), exit::NO_INPUT);
    }
}
