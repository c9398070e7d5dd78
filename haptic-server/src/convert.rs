//! `haptic-server convert IN OUT`: hand recordings from CSV to MCAP and back.
//!
//! What comes in is told by its content (CSV headers, MCAP magic number), what goes out by the name. The result
//! is written beside OUT and takes its name only when it is whole, so a failed conversion destroys nothing.
//! A trace that is cut off or damaged is converted up to that place, and the place is reported as an error.
//! Positions keep their frame; our CSV layout knows the scene frame only, so the other way back is refused.

use crate::error::ServerError;
use crate::hand::csv::{self, HandFile, HandFileKind, HandSide};
use crate::hand::trace;
use crate::record::{origin, writing};
use protocol::trace::TraceEnd;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// What was converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Converted {
    /// One line for stdout.
    pub text: String,
    /// Where the input ended too early; the output holds what stands before.
    pub fault: Option<ServerError>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Mcap,
}

/// Converts a hand recording.
///
/// # Errors
/// 64 for an output that is neither .csv nor .mcap or the input itself, 65 and 66 for the input, 69 and 77 for
/// the output.
pub fn run(input: &Path, output: &Path) -> Result<Converted, ServerError> {
    let format = match output.extension().and_then(|e| e.to_str()) {
        Some("csv") => Format::Csv,
        Some("mcap") => Format::Mcap,
        _ => {
            let what = format!("{}: name the output .csv or .mcap", output.display());
            return Err(ServerError::Usage(what));
        }
    };
    if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize())
        && from == to
    {
        return Err(ServerError::Usage(format!("{}: input and output are one file; name another", output.display())));
    }
    let (file, end) = read_hand(input, HandSide::default())?;
    if format == Format::Csv && file.kind != HandFileKind::Scene {
        return Err(ServerError::BadData(format!(
            "{}: its positions are in the frame of another recorder, which our CSV cannot say; use the original \
             recording, or .mcap as output",
            input.display()
        )));
    }
    let temporary = temporary_beside(output);
    let written = write_hand(&file, input, format, &temporary)
        .and_then(|()| std::fs::rename(&temporary, output).map_err(|e| writing(output, &e)));
    if let Err(error) = written {
        // The error matters, not whether the half-written file could be removed.
        let _ = std::fs::remove_file(&temporary);
        return Err(error);
    }
    let recording = &file.recording;
    let text = format!(
        "{}: {} samples, {:.3} s, {} grips\n",
        output.display(),
        recording.times_s.len(),
        recording.duration_s(),
        recording.grips().count()
    );
    Ok(Converted { text, fault: end_fault(input, &end) })
}

/// Reads a hand recording of either format, told by content.
///
/// # Errors
/// 65 and 66, with the place.
pub fn read_hand(path: &Path, side: HandSide) -> Result<(HandFile, TraceEnd), ServerError> {
    if starts_as_mcap(path)? {
        let file = File::open(path).map_err(|e| ServerError::reading(path, &e))?;
        let hand = trace::read(&path.display().to_string(), BufReader::new(file))?;
        return Ok((hand.file, hand.end));
    }
    Ok((csv::read_path(path, side)?, TraceEnd::Complete))
}

/// Whether a file is called .mcap or begins as MCAP files do.
///
/// # Errors
/// 66 when it cannot be read.
pub fn starts_as_mcap(path: &Path) -> Result<bool, ServerError> {
    let reading = |e| ServerError::reading(path, &e);
    let mut magic = Vec::new();
    File::open(path).map_err(reading)?.take(trace::MAGIC.len() as u64).read_to_end(&mut magic).map_err(reading)?;
    // A file that was cut within the magic number is a cut MCAP file, unless it is empty.
    let begins_so = !magic.is_empty() && trace::MAGIC.starts_with(&magic);
    Ok(begins_so || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")))
}

/// The error that names where a trace ended too early.
#[must_use]
pub fn end_fault(path: &Path, end: &TraceEnd) -> Option<ServerError> {
    let remedy = "what stands before was used; record again, or convert the trace to keep that part";
    match end {
        TraceEnd::Complete | TraceEnd::Reading => None,
        TraceEnd::Cut { byte } => {
            let what = format!("{}: byte {byte}: the trace is cut off here; {remedy}", path.display());
            Some(ServerError::BadData(what))
        }
        TraceEnd::Damaged { byte, reason } => {
            let what =
                format!("{}: byte {byte}: the trace is damaged from here on ({reason}); {remedy}", path.display());
            Some(ServerError::BadData(what))
        }
    }
}

fn temporary_beside(output: &Path) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.partial", std::process::id()));
    output.with_file_name(name)
}

fn write_hand(file: &HandFile, input: &Path, format: Format, output: &Path) -> Result<(), ServerError> {
    let fail = |e: std::io::Error| writing(output, &e);
    let mut sink = BufWriter::new(File::create(output).map_err(fail)?);
    let mut sink = match format {
        Format::Csv => {
            csv::write_scene(&file.recording, &mut sink).map_err(fail)?;
            sink
        }
        Format::Mcap => {
            let mut metadata = origin::origin();
            let name = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
            metadata.entry("hand".to_owned()).or_default().insert("converted_from".to_owned(), name);
            trace::write(file, metadata, sink)
                .map_err(|e| ServerError::Unavailable(format!("{}: {e}", output.display())))?
        }
    };
    sink.flush().map_err(fail)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;
    use std::fs;

    const OWN: &str = "TIME_S,X_M,Y_M,Z_M,BUTTONS\n0,0.1,0.2,0.3,0\n0.033333,0.1,0.25,-0.3,1\n0.5,0,0,0,0\n";

    #[test]
    fn our_csv_survives_the_way_through_mcap_byte_for_byte() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.csv", "b.mcap", "c.csv"].map(|name| dir.path().join(name));
        fs::write(&a, OWN).unwrap();
        let there = run(&a, &b).unwrap();
        assert_eq!(there.fault, None);
        assert!(there.text.contains("3 samples, 0.500 s, 1 grips"), "{}", there.text);
        run(&b, &c).unwrap();
        assert_eq!(fs::read_to_string(&c).unwrap(), OWN);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3, "no temporary file stays");
    }

    #[test]
    fn a_cut_trace_is_converted_up_to_the_cut_which_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.csv", "b.mcap", "c.csv"].map(|name| dir.path().join(name));
        fs::write(&a, OWN).unwrap();
        run(&a, &b).unwrap();
        let whole = fs::read(&b).unwrap();
        fs::write(&b, &whole[..whole.len() - 1]).unwrap();
        let fault = run(&b, &c).unwrap().fault.unwrap();
        assert_eq!(fault.exit_code(), exit::BAD_DATA);
        assert!(fault.to_string().contains("b.mcap: byte "), "{fault}");
        assert_eq!(fs::read_to_string(&c).unwrap(), OWN);
    }

    #[test]
    fn every_refusal_has_its_class_and_leaves_the_output_alone() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        fs::write(path("a.csv"), OWN).unwrap();
        fs::write(path("bad.csv"), "TIME_S,X_M\n1,2\n").unwrap();
        fs::write(path("bad.mcap"), &trace::MAGIC[..5]).unwrap();
        fs::write(path("touch.csv"), "TIME_S,X_MM,Y_MM,Z_MM\n0,1,2,3\n1,1,2,3\n").unwrap();
        fs::write(path("kept.csv"), "precious").unwrap();
        for (input, output, code) in [
            ("a.csv", "out.txt", exit::USAGE),
            ("a.csv", "a.csv", exit::USAGE),
            ("absent.csv", "kept.csv", exit::NO_INPUT),
            ("bad.csv", "kept.csv", exit::BAD_DATA),
            ("bad.mcap", "kept.csv", exit::BAD_DATA),
            ("touch.csv", "kept.csv", exit::BAD_DATA),
            ("a.csv", "absent/out.mcap", exit::UNAVAILABLE),
        ] {
            let error = run(&path(input), &path(output)).unwrap_err();
            assert_eq!(error.exit_code(), code, "{input} {output}: {error}");
        }
        assert_eq!(fs::read_to_string(path("kept.csv")).unwrap(), "precious");
        run(&path("touch.csv"), &path("touch.mcap")).unwrap();
        assert_eq!(read_hand(&path("touch.mcap"), HandSide::Right).unwrap().0.kind, HandFileKind::Touch);
    }
}
