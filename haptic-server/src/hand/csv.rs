//! Hand recordings as CSV: three layouts, told apart by their header.
//!
//! | layout | columns | units | buttons |
//! |---|---|---|---|
//! | JIGSAWS | `TIME_S`, `MASTER_LEFT_POS_X` …, `MASTER_LEFT_GRIPPER_ANGLE`, the same for `RIGHT` | m, rad | closing the gripper |
//! | Touch | `TIME_S`, `X_MM`, `Y_MM`, `Z_MM`, more | mm | none |
//! | scene | `TIME_S`, `X_M`, `Y_M`, `Z_M`, `BUTTONS` | m, scene frame | bit mask |
//!
//! Columns may come in any order and more may be there. Positions become metres and stay in the file's frame. Bytes and
//! rows are capped, every fault names file, line and column (bytes, counted as if nothing were quoted).

use crate::hand::file_fault::HandFileFault;
use crate::hand::{HandRecording, gripper};
use sim_core::vector::Vec3;
use std::io::{Read, Write};
use std::path::Path;

/// Largest file, bytes.
pub const MAX_BYTES: u64 = 64 * 1024 * 1024;
/// Longest recording, samples (17 minutes at 1 kHz).
pub const MAX_ROWS: usize = 1_000_000;
/// Largest coordinate that a hand can have, metres.
const LARGEST_COORDINATE_M: f64 = 10.0;
/// Largest time, seconds.
const LARGEST_TIME_S: f64 = 1e7;

/// Which of two recorded hands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HandSide {
    /// Left.
    Left,
    /// Right.
    #[default]
    Right,
}

/// Layout of a hand file; it also says in which frame the positions are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandFileKind {
    /// Surgical robot masters: metres, x left, y up in the view, z into the view.
    Jigsaws,
    /// Touch or Omni: x right, y up, z to the user.
    Touch,
    /// Our own: scene frame.
    Scene,
}

/// A hand file as read.
#[derive(Clone, Debug, PartialEq)]
pub struct HandFile {
    /// Its layout.
    pub kind: HandFileKind,
    /// Its motion, metres, in the file's frame.
    pub recording: HandRecording,
}

/// Columns of one layout.
struct Layout {
    kind: HandFileKind,
    names: [&'static str; 4],
    button_column: Option<&'static str>,
    metres_per_unit: f64,
}

/// Reads a hand file; `side` chooses the hand where a file has two.
pub fn read_path(path: &Path, side: HandSide) -> Result<HandFile, HandFileFault> {
    let name = path.display().to_string();
    let unreadable = |fault| HandFileFault::from_io(&name, fault);
    let file = std::fs::File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    read_bytes(&name, &bytes, side)
}

/// Reads a hand file that is already in memory; `name` appears in faults.
pub fn read_bytes(name: &str, bytes: &[u8], side: HandSide) -> Result<HandFile, HandFileFault> {
    if bytes.len() as u64 > MAX_BYTES {
        return Err(HandFileFault::TooLarge { path: name.into(), limit_bytes: MAX_BYTES });
    }
    if let Err(fault) = std::str::from_utf8(bytes) {
        let (line, column) = place(bytes, fault.valid_up_to());
        return Err(HandFileFault::bad(
            name,
            line,
            column,
            "these bytes are not UTF-8 text",
            "save the file as plain CSV",
        ));
    }
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let csv_fault = |fault: csv::Error| {
        let line = fault.position().map_or(1, csv::Position::line);
        HandFileFault::bad(name, line, 1, &format!("this is not CSV ({fault})"), "save the file as plain CSV")
    };
    let header = reader.headers().map_err(csv_fault)?.clone();
    let layout = Layout::of(&header, side).ok_or_else(|| {
        let what = "the header is that of no known hand file";
        let remedy = "name the columns TIME_S, X_M, Y_M, Z_M and BUTTONS, or use a JIGSAWS or Touch recording";
        HandFileFault::bad(name, 1, 1, what, remedy)
    })?;
    let find = |wanted: &str| {
        header.iter().position(|found| found.trim() == wanted).ok_or_else(|| {
            let what = format!("the header has no column {wanted}");
            HandFileFault::bad(name, 1, 1, &what, "add the column or restore the header")
        })
    };
    let mut columns = [0; 4];
    for (column, wanted) in columns.iter_mut().zip(layout.names) {
        *column = find(wanted)?;
    }
    let button_column = layout.button_column.map(find).transpose()?;

    let mut recording = HandRecording::default();
    let mut angles_rad = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(csv_fault)? {
        let row = Row { name, bytes, header: &header, record: &record };
        if record.len() != header.len() {
            let what = format!("the row has {} fields but the header has {}", record.len(), header.len());
            return Err(row.fault(record.len() - 1, &what, "complete or remove the row; was the file cut off?"));
        }
        if recording.times_s.len() == MAX_ROWS {
            let what = format!("the recording has more than {MAX_ROWS} samples");
            return Err(row.fault(0, &what, "split it into shorter files"));
        }
        let time_s = row.number(columns[0], LARGEST_TIME_S)?;
        if recording.times_s.last().is_some_and(|&last| time_s <= last) {
            return Err(row.fault(
                columns[0],
                "the time does not increase",
                "sort the rows by time and drop repeated ones",
            ));
        }
        let largest = LARGEST_COORDINATE_M / layout.metres_per_unit;
        let mut position = Vec3::zeros();
        for axis in 0..3 {
            position[axis] = row.number(columns[axis + 1], largest)? * layout.metres_per_unit;
        }
        match (button_column, layout.kind) {
            (Some(column), HandFileKind::Jigsaws) => angles_rad.push(row.number(column, 100.0)?),
            (Some(column), _) => recording.buttons.push(row.mask(column)?),
            (None, _) => recording.buttons.push(0),
        }
        recording.times_s.push(time_s);
        recording.positions_m.push(position);
    }
    if recording.times_s.is_empty() {
        return Err(HandFileFault::bad(
            name,
            1,
            1,
            "the file has a header but no samples",
            "record at least one sample",
        ));
    }
    if layout.kind == HandFileKind::Jigsaws {
        recording.buttons = gripper::buttons(&angles_rad);
    }
    Ok(HandFile { kind: layout.kind, recording })
}

/// Writes a recording in our own layout; the numbers read back bit by bit.
pub fn write_scene(recording: &HandRecording, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "TIME_S,X_M,Y_M,Z_M,BUTTONS")?;
    let rows = recording.times_s.iter().zip(&recording.positions_m).zip(&recording.buttons);
    for ((time_s, p), buttons) in rows {
        writeln!(out, "{time_s},{},{},{},{buttons}", p.x, p.y, p.z)?;
    }
    Ok(())
}

impl Layout {
    fn of(header: &csv::StringRecord, side: HandSide) -> Option<Self> {
        let has = |wanted: &[&str]| header.iter().any(|found| wanted.contains(&found.trim()));
        if header.iter().any(|found| found.trim().starts_with("MASTER_")) {
            let (names, gripper) = match side {
                HandSide::Left => (
                    ["TIME_S", "MASTER_LEFT_POS_X", "MASTER_LEFT_POS_Y", "MASTER_LEFT_POS_Z"],
                    "MASTER_LEFT_GRIPPER_ANGLE",
                ),
                HandSide::Right => (
                    ["TIME_S", "MASTER_RIGHT_POS_X", "MASTER_RIGHT_POS_Y", "MASTER_RIGHT_POS_Z"],
                    "MASTER_RIGHT_GRIPPER_ANGLE",
                ),
            };
            return Some(Self {
                kind: HandFileKind::Jigsaws,
                names,
                button_column: Some(gripper),
                metres_per_unit: 1.0,
            });
        }
        if has(&["X_MM", "Y_MM", "Z_MM"]) {
            let names = ["TIME_S", "X_MM", "Y_MM", "Z_MM"];
            return Some(Self { kind: HandFileKind::Touch, names, button_column: None, metres_per_unit: 1e-3 });
        }
        has(&["X_M", "Y_M", "Z_M"]).then_some(Self {
            kind: HandFileKind::Scene,
            names: ["TIME_S", "X_M", "Y_M", "Z_M"],
            button_column: Some("BUTTONS"),
            metres_per_unit: 1.0,
        })
    }
}

/// One row with what is needed to say where it is.
struct Row<'a> {
    name: &'a str,
    bytes: &'a [u8],
    header: &'a csv::StringRecord,
    record: &'a csv::StringRecord,
}

impl Row<'_> {
    fn number(&self, column: usize, largest: f64) -> Result<f64, HandFileFault> {
        let text = self.record.get(column).unwrap_or_default().trim();
        let value: f64 = text.parse().map_err(|_| self.field_fault(column, text, "is not a number"))?;
        if !value.is_finite() {
            return Err(self.field_fault(column, text, "is not a finite number"));
        }
        if value.abs() > largest {
            return Err(self.field_fault(column, text, &format!("is beyond ±{largest}")));
        }
        Ok(value)
    }

    fn mask(&self, column: usize) -> Result<u32, HandFileFault> {
        let text = self.record.get(column).unwrap_or_default().trim();
        text.parse().map_err(|_| self.field_fault(column, text, "is not a button mask (0, 1, 2 or 3)"))
    }

    fn field_fault(&self, column: usize, text: &str, complaint: &str) -> HandFileFault {
        let shown: String = text.chars().take(40).collect();
        let what = format!("{} {shown:?} {complaint}", self.header.get(column).unwrap_or_default().trim());
        self.fault(column, &what, "correct or remove the row")
    }

    fn fault(&self, column: usize, what: &str, remedy: &'static str) -> HandFileFault {
        let position = self.record.position();
        // The reader's place lies before the blank lines that it skipped.
        let start = position.map_or(0, |p| p.byte() as usize).min(self.bytes.len());
        let blank = self.bytes[start..].iter().take_while(|&&b| b == b'\n' || b == b'\r');
        let skipped = blank.filter(|&&b| b == b'\n').count() as u64;
        let line = position.map_or(1, csv::Position::line) + skipped;
        let offset = self.record.range(column).map_or(0, |range| range.start + column);
        HandFileFault::bad(self.name, line, offset as u64 + 1, what, remedy)
    }
}

/// Line and column, both from 1, of a byte.
fn place(bytes: &[u8], offset: usize) -> (u64, u64) {
    let before = &bytes[..offset];
    let line = before.iter().filter(|&&b| b == b'\n').count() as u64 + 1;
    let column = before.iter().rev().take_while(|&&b| b != b'\n').count() as u64 + 1;
    (line, column)
}
