//! `lockstep --frames`: the viewer beside this program makes pictures of the run's recording.
//!
//! Lockstep writes a trace, `viewer-client --headless --replay` draws it: this program knows no graphics. That there is a viewer is
//! seen before the run begins. Deliberately absent: looking for an adapter; the viewer says in its own sentence what it lacks.

use super::LockstepArgs;
use crate::error::ServerError;
use crate::exit;
use crate::record::writing;
use crate::supervisor::child::beside_this_program;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Tissue and report in a recording that is asked for as such: as the live recorder, 30 Hz.
const VIEW_PERIOD: Duration = Duration::from_nanos(33_333_333);

/// The recording of a run, and what becomes of it.
pub(super) struct Frames {
    viewer: PathBuf,
    folder: PathBuf,
    arguments: Vec<String>,
}

/// A recording that is removed when it has been drawn, or was not.
struct Scratch(PathBuf);

/// Where a run's recording goes.
pub(super) struct Trace {
    path: PathBuf,
    view_period: Duration,
    _scratch: Option<Scratch>,
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Nothing can be done when it is gone already.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Frames {
    /// What `--frames` asks for; `None` without it.
    ///
    /// # Errors
    /// 69 without a viewer, 69 or 77 when the folder cannot be made.
    pub(super) fn asked(args: &LockstepArgs) -> Result<Option<Self>, ServerError> {
        let Some(folder) = &args.frames else { return Ok(None) };
        let viewer = beside_this_program("viewer-client")?;
        if !viewer.is_file() {
            return Err(ServerError::Unavailable(format!(
                "--frames needs the viewer, and {} is not there; build it with `cargo build --release -p viewer-client` or \
                 install it, or record with --record and draw later",
                viewer.display()
            )));
        }
        std::fs::create_dir_all(folder).map_err(|e| writing(folder, &e))?;
        let mut arguments = vec!["--fps".to_owned(), args.fps.to_string()];
        arguments.extend(args.size.iter().flat_map(|size| ["--size".to_owned(), size.clone()]));
        Ok(Some(Self { viewer, folder: folder.clone(), arguments }))
    }

    /// Draws the recording.
    ///
    /// # Errors
    /// The viewer's own exit code; it has said why.
    pub(super) fn draw(&self, trace: &Trace) -> Result<(), ServerError> {
        let mut command = Command::new(&self.viewer);
        command.arg("--headless").arg("--replay").arg(&trace.path).arg("--frames").arg(&self.folder);
        // Standard output is for the summary.
        command.args(&self.arguments).stdin(Stdio::null()).stdout(Stdio::null());
        let drawn = command.status().map_err(|e| {
            ServerError::Unavailable(format!("cannot start {}: {e}; build it again", self.viewer.display()))
        })?;
        match drawn.code() {
            Some(0) => Ok(()),
            Some(code) => Err(ServerError::Reported(u8::try_from(code).unwrap_or(exit::INTERNAL))),
            None => Err(ServerError::Internal("the viewer was killed while it drew the frames".to_owned())),
        }
    }
}

impl Trace {
    /// Where the recording of this run goes, if one is needed: to `--record`, else beside the frames for as long as they are drawn.
    pub(super) fn of(args: &LockstepArgs, frames: Option<&Frames>) -> Option<Self> {
        let frame_period = frames.map(|_| Duration::from_secs(1) / args.fps);
        let scratch = || {
            let path = frames?.folder.join(format!(".lockstep-{}.mcap", std::process::id()));
            Some((path.clone(), Some(Scratch(path))))
        };
        let (path, scratch) = args.record.clone().map(|path| (path, None)).or_else(scratch)?;
        Some(Self { path, view_period: frame_period.unwrap_or(VIEW_PERIOD).min(VIEW_PERIOD), _scratch: scratch })
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Time between two views in it.
    pub(super) fn view_period(&self) -> Duration {
        self.view_period
    }
}
