//! Pictures without a screen: one PNG, a sequence of them, or frame times; of a running server or of a recording.
//!
//! The camera is set from the first complete frame and stays, so equal input gives equal pictures on one adapter.
//! Exit codes follow sysexits: 65 a bad recording, 66 no such file, 69 no adapter, no server or no picture in time.

use crate::feed::{Feed, View};
use crate::gpu::{GpuError, png};
use crate::render::Quality;
use crate::replay::{Recording, ReplayError};
use protocol::run::RunDir;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

mod args;
mod bench;
mod studio;

pub use args::HeadlessArgs;
pub use bench::Timing;
pub use studio::{Origin, Studio, frame};

/// sysexits: an input file is malformed.
const BAD_DATA: u8 = 65;
/// sysexits: an input file does not exist.
const NO_INPUT: u8 = 66;
/// sysexits: something needed is not there.
const UNAVAILABLE: u8 = 69;
/// A running server sends outline and frame within this time.
const FIRST_FRAME: Duration = Duration::from_secs(10);
/// The server counts as gone when its tick number stands still for so long.
const GONE: Duration = Duration::from_secs(3);
/// How often a running server is looked at while waiting.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// Of a recording, this time before a picture is in the panels' curves, in steps of a hundredth of a second.
const CURVES_S: f64 = 12.0;
const CURVE_STEP_S: f64 = 0.01;

/// Why there is no picture, and the exit code for it.
#[derive(Debug)]
pub struct Failure {
    /// One sentence.
    pub sentence: String,
    /// sysexits.
    pub code: u8,
}

impl Failure {
    fn unavailable(error: &impl ToString) -> Self {
        Self { sentence: error.to_string(), code: UNAVAILABLE }
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Self::unavailable(&error)
    }
}

impl From<ReplayError> for Failure {
    fn from(error: ReplayError) -> Self {
        Self { sentence: error.to_string(), code: if error.is_bad_data() { BAD_DATA } else { NO_INPUT } }
    }
}

/// Where views come from.
enum Source {
    Live { feed: Box<Feed>, cleaned: Instant },
    Replay(Box<Recording>),
}

/// Makes the pictures.
///
/// # Errors
/// [`Failure`] with one sentence and the exit code.
pub fn run(
    args: &HeadlessArgs,
    replay: Option<&Path>,
    join: impl Fn() -> Result<RunDir, String>,
) -> Result<(), Failure> {
    let mut look = args.look();
    if args.png.is_some() && look.quality == Quality::Auto {
        look.quality = Quality::Full;
    }
    let mut source = match replay {
        Some(path) => Source::Replay(Box::new(opened(path)?)),
        None => {
            let run = join().map_err(|e| Failure::unavailable(&e))?;
            let feed = Box::new(Feed::join(&run).map_err(|e| Failure::unavailable(&e))?);
            Source::Live { feed, cleaned: Instant::now() }
        }
    };
    let mut studio = Studio::open(args.size(), args.view(), look)?;
    if args.overlays {
        studio.show_panels(match &source {
            Source::Replay(_) => Origin::Recorded,
            Source::Live { .. } => Origin::Live,
        });
    }
    first_frame(&mut source, &mut studio)?;
    studio.camera.zoom(args.zoom);
    if let Some(path) = &args.png {
        let view = go_to(&mut source, &mut studio, args.at)?;
        let picture = studio.picture(view)?;
        say_notice(&studio);
        return png::save(&picture, path).map_err(|e| Failure::unavailable(&e));
    }
    if let Some(folder) = &args.frames {
        return sequence(args, &mut source, &mut studio, folder);
    }
    let Some(count) = args.bench else {
        let sentence = "--headless needs --png FILE, --frames DIR or --bench N".to_owned();
        return Err(Failure { sentence, code: 64 });
    };
    go_to(&mut source, &mut studio, args.at)?;
    bench::run(count, &mut source, &mut studio)
}

fn say_notice(studio: &Studio) {
    if let Some(notice) = studio.renderer().notice() {
        eprintln!("viewer-client: {notice}");
    }
}

/// Waits for a first complete frame and takes it in: it sets the camera and what counts as rest.
fn first_frame(source: &mut Source, studio: &mut Studio) -> Result<(), Failure> {
    let started = Instant::now();
    loop {
        let view = match source {
            Source::Replay(recording) => recording.view(),
            Source::Live { feed, .. } => feed.look().map_err(|e| Failure::unavailable(&e))?,
        };
        if view.outline_of_frame().is_some() {
            let encoder = studio.draw(view);
            studio.gpu().queue.submit([encoder.finish()]);
            return Ok(());
        }
        if started.elapsed() > FIRST_FRAME {
            let sentence = format!(
                "no complete frame of the tissue came within {} s; check that the server runs and steps (`viewer-client --text`)",
                FIRST_FRAME.as_secs()
            );
            return Err(Failure { sentence, code: UNAVAILABLE });
        }
        std::thread::sleep(LOOK_AGAIN);
    }
}

/// The view at a time; the panels' curves are filled on the way there.
fn go_to<'s>(source: &'s mut Source, studio: &mut Studio, at_s: Option<f64>) -> Result<&'s View, Failure> {
    match source {
        Source::Replay(recording) => {
            let end_s = at_s.unwrap_or_else(|| recording.duration_s());
            let steps = (CURVES_S.min(end_s) / CURVE_STEP_S) as u32;
            for step in (1..=steps).rev() {
                studio.take(recording.seek(end_s - f64::from(step) * CURVE_STEP_S));
            }
            recording.seek(end_s);
            Ok(recording.view())
        }
        Source::Live { feed, .. } => {
            let started = Instant::now();
            let wait = Duration::from_secs_f64(at_s.unwrap_or(0.0));
            while started.elapsed() < wait {
                studio.take(feed.look().map_err(|e| Failure::unavailable(&e))?);
                std::thread::sleep(LOOK_AGAIN.min(wait.saturating_sub(started.elapsed())));
            }
            feed.look().map_err(|e| Failure::unavailable(&e))
        }
    }
}

/// Pictures until the end.
fn sequence(args: &HeadlessArgs, source: &mut Source, studio: &mut Studio, folder: &Path) -> Result<(), Failure> {
    let cannot = |e: &std::io::Error| format!("cannot make the folder {} ({e}); choose another one", folder.display());
    std::fs::create_dir_all(folder).map_err(|e| Failure::unavailable(&cannot(&e)))?;
    let period = 1.0 / f64::from(args.fps);
    let start_s = args.at.unwrap_or(0.0);
    let started = Instant::now();
    let (mut last_tick, mut alive) = (None, Instant::now());
    for number in 0_u64.. {
        let t_s = number as f64 * period;
        let (view, end) = match source {
            Source::Replay(recording) => {
                let end = start_s + t_s > recording.duration_s();
                (recording.seek(start_s + t_s), end)
            }
            Source::Live { feed, cleaned } => {
                std::thread::sleep(Duration::from_secs_f64(start_s + t_s).saturating_sub(started.elapsed()));
                if cleaned.elapsed() > Duration::from_secs(1) {
                    feed.clean_up();
                    *cleaned = Instant::now();
                }
                let view = feed.look().map_err(|e| Failure::unavailable(&e))?;
                let tick = view.servo.as_ref().map(|s| s.ticks);
                if tick != last_tick {
                    (last_tick, alive) = (tick, Instant::now());
                }
                (view, alive.elapsed() > GONE)
            }
        };
        if end {
            break;
        }
        let picture = studio.picture(view)?;
        let path = folder.join(format!("frame-{:05}.png", number + 1));
        png::save(&picture, &path).map_err(|e| Failure::unavailable(&e))?;
        if std::io::stderr().is_terminal() {
            eprint!("\r{} pictures", number + 1);
            // A terminal that is gone needs no progress.
            let _ = std::io::stderr().flush();
        }
    }
    if std::io::stderr().is_terminal() {
        eprintln!();
    }
    say_notice(studio);
    Ok(())
}

/// Opens a recording and says what is missing in it.
pub(crate) fn opened(path: &Path) -> Result<Recording, Failure> {
    let recording = Recording::open(path)?;
    recording.remarks().for_each(|remark| eprintln!("viewer-client: {}: {remark}", path.display()));
    Ok(recording)
}
