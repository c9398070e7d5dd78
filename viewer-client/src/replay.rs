//! A recording as a source of views: read once, then any time of it at hand.
//!
//! Nodes, reports, outlines and a tenth of the servo states are kept in memory; when they take more than
//! [`MOST_BYTES`], every second frame and servo state is dropped, as often as needed, so that a recording of any length
//! can be looked at. A file that was cut off or damaged plays up to that place.

use crate::feed::View;
use protocol::ports::{SceneFrame, SceneOutline};
use protocol::servo_state::ServoState;
use protocol::trace::{TraceEnd, TraceError, TraceItem, TraceReader};
use protocol::wound_report::WoundReport;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Memory that a recording may take.
const MOST_BYTES: usize = 768 << 20;
/// Of the servo's states every one of so many is kept: 100 a second.
const SERVO_EVERY: u64 = 10;

/// Why a recording cannot be looked at.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The file cannot be opened.
    #[error("{path}: cannot be opened ({source}); name a recording made with `haptic-server run --record`")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no recording or cannot be used.
    #[error("{path}: {source}")]
    Trace {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TraceError,
    },
    /// There is nothing to draw in it.
    #[error("{path}: holds no tissue with its outline; record again with `haptic-server run --record`")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Too much for the memory.
    #[error("{path}: its scenes alone take more than {limit_mib} MiB; record fewer scenes in one file")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit.
        limit_mib: usize,
    },
}

impl ReplayError {
    /// Whether the file is at fault, not its path.
    #[must_use]
    pub fn is_bad_data(&self) -> bool {
        !matches!(self, Self::Open { .. })
    }
}

/// Items in the order of time, every n-th of those that came.
struct Track<T> {
    every: u64,
    came: u64,
    items: Vec<(u64, T)>,
    /// Memory of one item, and of all that are kept.
    size: fn(&T) -> usize,
    bytes: usize,
}

impl<T> Track<T> {
    fn new(every: u64, size: fn(&T) -> usize) -> Self {
        Self { every, came: 0, items: Vec::new(), size, bytes: 0 }
    }

    /// Keeps an item if it is its turn. Time never goes back: a late item counts as of the last one's time.
    fn push(&mut self, time_ns: u64, item: T) {
        let turn = self.came.is_multiple_of(self.every);
        self.came += 1;
        if !turn {
            return;
        }
        let last = self.items.last().map_or(0, |(last, _)| *last);
        self.bytes += (self.size)(&item);
        self.items.push((time_ns.max(last), item));
    }

    /// Drops every second item, and of those to come as many.
    fn thin(&mut self) {
        let mut index = 0;
        self.items.retain(|_| {
            index += 1;
            index % 2 == 1
        });
        self.every *= 2;
        self.bytes = self.items.iter().map(|(_, item)| (self.size)(item)).sum();
    }

    /// Index of the newest item at a time.
    fn at(&self, time_ns: u64) -> Option<usize> {
        self.items.partition_point(|(time, _)| *time <= time_ns).checked_sub(1)
    }
}

/// A recording, and the view of it at one time.
pub struct Recording {
    servo: Track<ServoState>,
    reports: Track<Box<WoundReport>>,
    frames: Track<SceneFrame>,
    outlines: Track<SceneOutline>,
    /// Time of the first and the last item.
    span_ns: (u64, u64),
    ending: Option<String>,
    /// Frame and outline of the view.
    shown: (Option<usize>, Option<usize>),
    view: View,
}

impl Recording {
    /// Reads a recording and goes to its beginning.
    ///
    /// # Errors
    /// [`ReplayError`] when the file cannot be opened, is no recording, or shows no tissue.
    pub fn open(path: &Path) -> Result<Self, ReplayError> {
        Self::open_within(path, MOST_BYTES)
    }

    /// Reads a recording into at most about as many bytes.
    ///
    /// # Errors
    /// As [`Recording::open`], and [`ReplayError::TooLarge`] when its outlines alone do not fit.
    pub fn open_within(path: &Path, most_bytes: usize) -> Result<Self, ReplayError> {
        let file = File::open(path).map_err(|source| ReplayError::Open { path: path.to_owned(), source })?;
        let trace = |source| ReplayError::Trace { path: path.to_owned(), source };
        let mut reader = TraceReader::open(BufReader::new(file)).map_err(trace)?;
        let mut recording = Self {
            servo: Track::new(SERVO_EVERY, |_| size_of::<ServoState>()),
            reports: Track::new(1, |_| size_of::<WoundReport>()),
            frames: Track::new(1, |f: &SceneFrame| size_of_val(f.elements.as_slice())),
            outlines: Track::new(1, |o: &SceneOutline| size_of_val(o.elements.as_slice())),
            span_ns: (u64::MAX, 0),
            ending: None,
            shown: (None, None),
            view: View::default(),
        };
        while let Some((time_ns, item)) = reader.next_item().map_err(trace)? {
            recording.take(time_ns, item);
            while recording.bytes() > most_bytes {
                if recording.frames.items.len() < 2 {
                    return Err(ReplayError::TooLarge { path: path.to_owned(), limit_mib: most_bytes >> 20 });
                }
                recording.frames.thin();
                recording.servo.thin();
                recording.reports.thin();
            }
        }
        recording.ending = match reader.end() {
            TraceEnd::Cut { byte } => Some(format!("the recording was cut off at byte {byte}")),
            TraceEnd::Damaged { byte, reason } => Some(format!("the recording is damaged at byte {byte}: {reason}")),
            TraceEnd::Complete | TraceEnd::Reading => None,
        };
        recording.seek(0.0);
        if recording.view.outline_of_frame().is_none() {
            return Err(ReplayError::Empty { path: path.to_owned() });
        }
        Ok(recording)
    }

    fn take(&mut self, time_ns: u64, item: TraceItem) {
        self.span_ns = (self.span_ns.0.min(time_ns), self.span_ns.1.max(time_ns));
        match item {
            TraceItem::ServoState(state) => self.servo.push(time_ns, *state),
            TraceItem::WoundReport(report) => self.reports.push(time_ns, report),
            TraceItem::Tissue(header, elements) => self.frames.push(time_ns, SceneFrame { header, elements }),
            TraceItem::Outline(header, elements) => self.outlines.push(time_ns, SceneOutline { header, elements }),
            TraceItem::Hand(_) => {}
        }
    }

    /// Memory of what is kept.
    fn bytes(&self) -> usize {
        self.frames.bytes + self.outlines.bytes + self.reports.bytes + self.servo.bytes
    }

    /// Length in seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.span_ns.1.saturating_sub(self.span_ns.0) as f64 * 1.0e-9
    }

    /// Frames that are kept.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.frames.items.len()
    }

    /// What was left out to fit into memory, as a sentence.
    #[must_use]
    pub fn thinning(&self) -> Option<String> {
        let every = self.frames.every;
        (every > 1).then(|| format!("the recording is long: one frame in {every} is shown"))
    }

    /// What a person should know before looking at it: what is missing at its end, and in between.
    pub fn remarks(&self) -> impl Iterator<Item = String> {
        self.ending.iter().map(|ending| format!("{ending}; what came before is shown")).chain(self.thinning())
    }

    /// What ended the recording before its time, as a sentence.
    #[must_use]
    pub fn ending(&self) -> Option<&str> {
        self.ending.as_deref()
    }

    /// Goes to a time, in seconds from the beginning, and returns the view of it.
    pub fn seek(&mut self, t_s: f64) -> &View {
        let within_s = if t_s.is_finite() { t_s.clamp(0.0, self.duration_s()) } else { 0.0 };
        let time_ns = self.span_ns.0.saturating_add((within_s * 1.0e9) as u64);
        let of = |at: Option<usize>| at.unwrap_or(0);
        self.view.servo = self.servo.at(time_ns).map(|i| self.servo.items[i].1);
        if let Some(i) = self.reports.at(time_ns) {
            self.view.report.get_or_insert_default().clone_from(&self.reports.items[i].1);
        } else {
            self.view.report = None;
        }
        // Before the first frame the first one is shown.
        let frame = Some(of(self.frames.at(time_ns))).filter(|i| *i < self.frames.items.len());
        if let Some(i) = frame.filter(|_| frame != self.shown.0) {
            let from = &self.frames.items[i].1;
            self.view.frame.header = from.header;
            self.view.frame.elements.clone_from(&from.elements);
            self.view.frames += 1;
        }
        // The outline of the frame may have been written after it.
        let generation = self.view.frame.header.scene_generation;
        let fits = |i: &usize| self.outlines.items[*i].1.header.scene_generation == generation;
        let newest = self.outlines.at(time_ns).filter(fits);
        let outline = newest.or_else(|| (0..self.outlines.items.len()).rfind(fits));
        if let Some(i) = outline.filter(|_| outline != self.shown.1) {
            let from = &self.outlines.items[i].1;
            self.view.outline.header = from.header;
            self.view.outline.elements.clone_from(&from.elements);
            self.view.outlines += 1;
        }
        self.shown = (frame, outline);
        &self.view
    }

    /// The view of the time that was gone to last.
    #[must_use]
    pub fn view(&self) -> &View {
        &self.view
    }
}
