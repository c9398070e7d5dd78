//! What arrived: one row per frame, for reading back.
//!
//! A row holds the time, the force that the client set, the force that the motors gave, and where the stylus truly
//! was. Rows are kept in memory that is taken beforehand and written as CSV when the device is closed. Device frame,
//! newtons, millimetres, nanoseconds of the monotonic clock (of the virtual one when a test steps).

use sim_core::vector::Vec3;
use std::io::Write;
use std::path::PathBuf;

/// Rows kept: a bit more than two minutes.
const ROOM: usize = 1 << 17;

/// One frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRow {
    /// End of the frame.
    pub time_ns: u64,
    /// Device.
    pub device: u32,
    /// What the client set.
    pub asked_n: Vec3,
    /// What the motors gave.
    pub arrived_n: Vec3,
    /// Joint torques of what was asked minus what was given, newton metres.
    pub torque_error_nm: Vec3,
    /// Where the stylus was.
    pub position_mm: Vec3,
}

/// The rows.
pub(crate) struct FrameLog {
    rows: Vec<FrameRow>,
    file: Option<PathBuf>,
    lost: u64,
}

impl FrameLog {
    /// An empty log, written to `file` when one is given.
    pub(crate) fn new(file: Option<PathBuf>) -> Self {
        Self { rows: Vec::with_capacity(ROOM), file, lost: 0 }
    }

    /// One more frame; what finds no room is counted.
    pub(crate) fn push(&mut self, row: FrameRow) {
        if self.rows.len() < ROOM {
            self.rows.push(row);
        } else {
            self.lost += 1;
        }
    }

    /// The rows so far, taken out.
    pub(crate) fn take(&mut self) -> Vec<FrameRow> {
        let rows = self.rows.clone();
        self.rows.clear();
        rows
    }

    /// Writes the file, if there is one; a file that cannot be written is told on stderr.
    pub(crate) fn write(&self) {
        let Some(path) = &self.file else { return };
        let written = std::fs::File::create(path).and_then(|file| {
            let mut out = std::io::BufWriter::new(file);
            writeln!(out, "# {} rows, {} lost", self.rows.len(), self.lost)?;
            writeln!(out, "TIME_NS,DEVICE,ASKED_X_N,ASKED_Y_N,ASKED_Z_N,X_N,Y_N,Z_N,TX_NM,TY_NM,TZ_NM,X_MM,Y_MM,Z_MM")?;
            for row in &self.rows {
                write!(out, "{},{}", row.time_ns, row.device)?;
                for v in [row.asked_n, row.arrived_n, row.torque_error_nm, row.position_mm] {
                    write!(out, ",{},{},{}", v.x, v.y, v.z)?;
                }
                writeln!(out)?;
            }
            out.flush()
        });
        if let Err(error) = written {
            // Nothing can be done when stderr is gone.
            let _ = writeln!(std::io::stderr(), "virtual device: cannot write {}: {error}", path.display());
        }
    }
}
