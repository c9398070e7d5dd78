//! What `--record` and `--frames` keep of a lockstep run: a trace as the live recorder writes it, on the virtual clock.
//!
//! Every tick, the stylus at 100 Hz, tissue and wound report once per period of the views, the outline with every new scene. Times are
//! those of the virtual clock and the origin names no machine and no hour, so equal runs give equal bytes.
//! Deliberately absent: a thread of its own. Lockstep waits for its disk.

use super::Kept;
use crate::error::ServerError;
use crate::record::{RecordOutcome, Recording, writing};
use crate::solver::session::SolverSession;
use protocol::ports::{SceneFrame, SceneOutline};
use protocol::servo_state::ServoState;
use protocol::wire::Message;
use std::fs::File;
use std::io::BufWriter;

/// A recording in the making.
pub(super) struct Film {
    recording: Recording<BufWriter<File>>,
    view_period_ns: u64,
    next_view_ns: u64,
    shown_generation: Option<u32>,
    views: u64,
    outlines: u64,
    /// Reused from view to view.
    frame: SceneFrame,
}

impl Film {
    /// Begins the file.
    ///
    /// # Errors
    /// 69 or 77 when it cannot be created.
    pub(super) fn create(kept: &Kept) -> Result<Self, ServerError> {
        let path = &kept.path;
        let file = File::create(path).map_err(|e| writing(path, &e))?;
        let recording = Recording::create(BufWriter::new(file), &kept.origin)
            .map_err(|e| ServerError::Unavailable(format!("{}: {e}", path.display())))?;
        Ok(Self {
            recording,
            view_period_ns: kept.view_period.as_nanos().try_into().unwrap_or(u64::MAX),
            next_view_ns: 0,
            shown_generation: None,
            views: 0,
            outlines: 0,
            frame: SceneFrame::default(),
        })
    }

    /// Keeps one tick, and what the eyes see when that is due.
    pub(super) fn keep(&mut self, state: &ServoState, session: &SolverSession) {
        let now_ns = state.header.time_ns;
        if self.shown_generation != Some(session.scene_generation()) {
            self.shown_generation = Some(session.scene_generation());
            self.outlines += 1;
            let (mut header, elements) = session.outline();
            header.stamp(self.outlines, now_ns);
            self.recording.outline(&SceneOutline { header, elements });
            self.next_view_ns = now_ns;
        }
        if now_ns >= self.next_view_ns {
            // Counted from the last due time, so that a period that is no whole number of ticks keeps its rate.
            self.next_view_ns = (self.next_view_ns + self.view_period_ns).max(now_ns);
            self.views += 1;
            self.frame.header = session.frame(&mut self.frame.elements);
            self.frame.header.stamp(self.views, now_ns);
            self.recording.frame(&self.frame);
            let mut report = *session.report();
            report.stamp(self.views, now_ns);
            self.recording.report(&report);
        }
        self.recording.tick(state);
    }

    /// Ends the file.
    pub(super) fn finish(self) -> RecordOutcome {
        self.recording.finish()
    }
}
