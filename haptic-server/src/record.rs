//! `--record`: writes a session to an MCAP file, on a thread of its own.
//!
//! The servo thread pushes each tick into a ring and never waits; this thread empties it
//! every 20 ms, adds the stylus pose at 100 Hz and at button changes, and at 30 Hz the newest wound report and tissue
//! frame from the solver's topics; the outline once per scene. When the file cannot be written (disk full) recording
//! stops, the reason is kept for the summary, the ring is emptied on, and what was written stays readable.
//! Absent: any influence on the run.

pub mod origin;

use crate::error::ServerError;
use crate::servo::flight_recorder::TickRecord;
use crate::servo_setup::ServoLinks;
use protocol::ports::{PortError, PortNode, SceneFrame, SceneFrameSubscriber, SceneOutline};
use protocol::ports::{SceneOutlineSubscriber, WoundReportSubscriber};
use protocol::run::RunDir;
use protocol::servo_state::ServoState;
use protocol::trace::{HandPose, Metadata, TraceError, TraceWriter};
use protocol::wound_report::WoundReport;
use rtrb::Consumer;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Pause between two looks into the ring.
const RING_PAUSE: Duration = Duration::from_millis(20);
/// Period of reports and tissue frames: 30 Hz.
const SCENE_PERIOD: Duration = Duration::from_nanos(33_333_333);
/// Pause between two attempts to join the solver's topics.
const JOIN_PAUSE: Duration = Duration::from_secs(1);
/// Ticks per stylus pose: 100 Hz of 1 kHz.
const TICKS_PER_POSE: u64 = 10;

/// What became of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordOutcome {
    /// Ticks handed to the file; if recording stopped, the last of them (one chunk) did not reach the disk.
    pub ticks: u64,
    /// Ticks that were not recorded: the ring was full, or writing had stopped.
    pub lost_ticks: u64,
    /// Messages that no reader would accept and that were left out.
    pub refused: u64,
    /// Why recording stopped before the end.
    pub stopped: Option<String>,
}

/// What became of one message.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Written {
    Whole,
    Refused,
    NotAnyMore,
}

/// A trace that is being written, from any thread's point of view independent of ports and clock.
pub struct Recording<W: Write> {
    writer: Option<TraceWriter<W>>,
    outcome: RecordOutcome,
    last_buttons: u32,
}

impl<W: Write> Recording<W> {
    /// Begins the trace.
    ///
    /// # Errors
    /// What the writer says.
    pub fn create(sink: W, metadata: &Metadata) -> Result<Self, TraceError> {
        let writer = Some(TraceWriter::create(sink, metadata)?);
        Ok(Self { writer, outcome: RecordOutcome::default(), last_buttons: 0 })
    }

    /// Records a tick, and the stylus when it is due.
    pub fn tick(&mut self, state: &ServoState) {
        match self.write(|writer| writer.servo_state(state)) {
            Written::Whole => self.outcome.ticks += 1,
            Written::Refused => {}
            Written::NotAnyMore => {
                self.outcome.lost_ticks += 1;
                return;
            }
        }
        let device = &state.devices[0];
        if device.present != 0 && (state.ticks.is_multiple_of(TICKS_PER_POSE) || device.buttons != self.last_buttons) {
            self.last_buttons = device.buttons;
            let pose =
                HandPose { position_m: device.position_m, orientation: device.orientation, buttons: device.buttons };
            self.write(|writer| writer.hand(state.header.time_ns, &pose));
        }
    }

    /// Records a wound report.
    pub fn report(&mut self, report: &WoundReport) {
        self.write(|writer| writer.wound_report(report));
    }

    /// Records a tissue frame.
    pub fn frame(&mut self, frame: &SceneFrame) {
        self.write(|writer| writer.tissue(&frame.header, &frame.elements));
    }

    /// Records an outline.
    pub fn outline(&mut self, outline: &SceneOutline) {
        self.write(|writer| writer.outline(&outline.header, &outline.elements));
    }

    /// Whether the file takes messages.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.writer.is_some()
    }

    /// Ends the trace.
    pub fn finish(mut self) -> RecordOutcome {
        if let Some(Err(error)) = self.writer.take().map(TraceWriter::finish) {
            self.stop(&error);
        }
        self.outcome
    }

    fn write(&mut self, message: impl FnOnce(&mut TraceWriter<W>) -> Result<(), TraceError>) -> Written {
        match self.writer.as_mut().map(message) {
            Some(Ok(())) => Written::Whole,
            Some(Err(TraceError::Unusable { .. })) => {
                self.outcome.refused += 1;
                Written::Refused
            }
            Some(Err(error)) => {
                self.stop(&error);
                Written::NotAnyMore
            }
            None => Written::NotAnyMore,
        }
    }

    fn stop(&mut self, error: &TraceError) {
        self.writer = None;
        self.outcome.stopped = Some(error.to_string());
    }
}

/// The recording thread.
#[derive(Debug)]
pub struct Recorder {
    thread: JoinHandle<RecordOutcome>,
    end: Arc<AtomicBool>,
    failed: Arc<AtomicBool>,
}

impl Recorder {
    /// Creates the file and starts the thread, which empties `ring`.
    ///
    /// # Errors
    /// 69 or 77 when the file cannot be created; nothing was started then.
    pub fn start(
        path: &Path,
        metadata: &Metadata,
        run: RunDir,
        mut ring: Consumer<TickRecord>,
        links: Arc<ServoLinks>,
    ) -> Result<Self, ServerError> {
        let file = File::create(path).map_err(|e| writing(path, &e))?;
        let recording = Recording::create(BufWriter::new(file), metadata)
            .map_err(|e| ServerError::Unavailable(format!("{}: {e}", path.display())))?;
        let (end, failed) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let (end_seen, failed_told, path) = (Arc::clone(&end), Arc::clone(&failed), PathBuf::from(path));
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || {
                let mut outcome = record(recording, &path, &run, &mut ring, &end_seen, &failed_told);
                outcome.lost_ticks += links.lost_records.load(Ordering::Relaxed);
                outcome
            })
            .map_err(|e| ServerError::Unavailable(format!("cannot start the recording thread: {e}; free memory")))?;
        Ok(Self { thread, end, failed })
    }

    /// Whether recording stopped because the file could not be written.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Writes what is still in the ring, ends the file, and gives what became of it.
    ///
    /// # Errors
    /// 70 when the thread panicked.
    pub fn finish(self) -> Result<RecordOutcome, ServerError> {
        self.end.store(true, Ordering::Relaxed);
        self.thread
            .join()
            .map_err(|_| ServerError::Internal("the recording thread panicked; the trace ends before that".to_owned()))
    }
}

/// The solver's topics, joined when they can be.
struct SceneTopics {
    reports: WoundReportSubscriber,
    frames: SceneFrameSubscriber,
    outlines: SceneOutlineSubscriber,
    node: PortNode,
}

impl SceneTopics {
    fn join(run: &RunDir) -> Result<Self, PortError> {
        let node = PortNode::join(run, "recorder")?;
        Ok(Self {
            reports: WoundReportSubscriber::open(&node)?,
            frames: SceneFrameSubscriber::open(&node)?,
            outlines: SceneOutlineSubscriber::open(&node)?,
            node,
        })
    }

    /// Records what is new; gives the number of messages that were not sound.
    fn record<W: Write>(&mut self, recording: &mut Recording<W>) -> u64 {
        let mut unsound = 0;
        // The outline first: a frame is of no use without it.
        match self.outlines.newest() {
            Ok(outline) => outline.into_iter().for_each(|o| recording.outline(o)),
            Err(_) => unsound += 1,
        }
        match self.frames.newest() {
            Ok(frame) => frame.into_iter().for_each(|f| recording.frame(f)),
            Err(_) => unsound += 1,
        }
        match self.reports.newest() {
            Ok(report) => report.iter().for_each(|r| recording.report(r)),
            Err(_) => unsound += 1,
        }
        unsound
    }
}

fn record<W: Write>(
    mut recording: Recording<W>,
    path: &Path,
    run: &RunDir,
    ring: &mut Consumer<TickRecord>,
    end: &AtomicBool,
    failed: &AtomicBool,
) -> RecordOutcome {
    let start = Instant::now();
    let (mut topics, mut next_join, mut next_scene) = (None, start, start);
    loop {
        // Read before the ring is emptied: what was pushed before the end was asked for is recorded.
        let is_last = end.load(Ordering::Relaxed);
        while let Ok(tick) = ring.pop() {
            recording.tick(&tick.state);
        }
        let now = Instant::now();
        if topics.is_none() && now >= next_join {
            next_join = now + JOIN_PAUSE;
            match SceneTopics::join(run) {
                Ok(joined) => topics = Some(joined),
                Err(error) => tracing::warn!(%error, "the recording does not see the tissue yet"),
            }
        }
        if let Some(topics) = &mut topics
            && (now >= next_scene || is_last)
        {
            // Counted from the last due time, so that the pause of the ring does not lower the rate.
            next_scene = (next_scene + SCENE_PERIOD).max(now);
            recording.outcome.refused += topics.record(&mut recording);
            if now >= next_join {
                next_join = now + JOIN_PAUSE;
                topics.node.clean_up_dead();
            }
        }
        if !recording.is_open() && !failed.swap(true, Ordering::Relaxed) {
            let reason = recording.outcome.stopped.as_deref().unwrap_or_default();
            tracing::error!(file = %path.display(), reason, "recording stopped; the run goes on");
        }
        if is_last {
            break;
        }
        std::thread::sleep(RING_PAUSE);
    }
    recording.finish()
}

/// Class of a failure to create or write a file.
pub(crate) fn writing(path: &Path, error: &std::io::Error) -> ServerError {
    let sentence = |remedy| format!("{}: cannot write: {error}; {remedy}", path.display());
    match error.kind() {
        std::io::ErrorKind::PermissionDenied => ServerError::Permission(sentence("choose a folder of your own")),
        std::io::ErrorKind::NotFound => ServerError::Unavailable(sentence("create the folder first")),
        _ => ServerError::Unavailable(sentence("check the path and the free space")),
    }
}

#[cfg(test)]
mod tests;
