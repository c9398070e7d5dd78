//! Pictures without a screen: one PNG, a sequence of them, or frame times; of a running server or of a recording.
//!
//! The camera is set from the first complete frame and stays, so equal input gives equal pictures on one adapter.
//! Exit codes follow sysexits: 65 a bad recording, 66 no such file, 69 no adapter, no server or no picture in time.

use crate::camera::{Camera, FixedView};
use crate::colour::ColourBy;
use crate::feed::{Feed, View};
use crate::gpu::{Gpu, GpuError, Offscreen, Picture, png};
use crate::render::{Background, Look, Quality, Renderer, Stereo};
use crate::replay::{Recording, ReplayError};
use protocol::run::RunDir;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

mod bench;

pub use bench::Timing;

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
/// How much of the picture the wound takes in the surgeon's view.
const WOUND_SHARE: f32 = 0.64;

/// Options of `viewer-client --headless`.
#[derive(Clone, Debug, clap::Args)]
pub struct HeadlessArgs {
    /// One picture into this file.
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// A sequence of pictures into this folder: until the server or the recording ends.
    #[arg(long, value_name = "DIR", conflicts_with = "png")]
    frames: Option<PathBuf>,
    /// Draws so many pictures and says how long they took.
    #[arg(long, value_name = "N", conflicts_with_all = ["png", "frames"], value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    bench: Option<u32>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// When: seconds from the beginning of the recording, or from now.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    at: Option<f64>,
    /// Pictures a second of a sequence.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=1000))]
    fps: u32,
    /// What the tissue is coloured by.
    #[arg(long, value_enum, default_value = "tissue")]
    colour: ColourBy,
    /// Where one looks from.
    #[arg(long, value_enum, default_value = "surgeon")]
    view: FixedView,
    /// Nearer by this factor.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor)]
    zoom: f32,
    /// What is behind the tissue.
    #[arg(long, value_enum, default_value = "room")]
    background: Background,
    /// How much work a picture may take; a single picture gets all of it.
    #[arg(long, value_enum, default_value = "auto")]
    quality: Quality,
    /// One picture for each eye, side by side.
    #[arg(long)]
    stereo: bool,
}

impl HeadlessArgs {
    /// How the pictures are to look.
    #[must_use]
    pub fn look(&self) -> Look {
        Look {
            colour: self.colour,
            background: self.background,
            quality: self.quality,
            stereo: if self.stereo { Stereo::SideBySide } else { Stereo::Off },
        }
    }

    /// Where one looks from.
    #[must_use]
    pub fn view(&self) -> FixedView {
        self.view
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| SIDES.contains(side)) => Ok(sides),
        Some(_) => Err(format!("a side is outside {} to {} pixels", SIDES.start(), SIDES.end())),
        None => Err(format!("{text:?} is no size; write it as 1280x720")),
    }
}

fn factor(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (0.01..=100.0).contains(&number) => Ok(number),
        _ => Err(format!("{text:?} is no factor from 0.01 to 100")),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=1.0e6).contains(&number) => Ok(number),
        _ => Err(format!("{text:?} is no number of seconds from 0 to 1000000")),
    }
}

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

/// Everything that makes pictures of one size.
pub struct Studio {
    gpu: Gpu,
    renderer: Renderer,
    offscreen: Offscreen,
    /// Where one looks from.
    pub camera: Camera,
    /// How the pictures look.
    pub look: Look,
    framed: bool,
}

impl Studio {
    /// Opens an adapter.
    ///
    /// # Errors
    /// [`GpuError`] when there is none.
    pub fn open(size: [u32; 2], view: FixedView, look: Look) -> Result<Self, GpuError> {
        Ok(Self::on(Gpu::headless()?, size, view, look))
    }

    /// Uses an adapter that is open.
    #[must_use]
    pub fn on(gpu: Gpu, size: [u32; 2], view: FixedView, look: Look) -> Self {
        let mut camera = Camera::default();
        camera.fixed(view);
        let renderer = Renderer::new(&gpu, Offscreen::FORMAT);
        let offscreen = Offscreen::new(&gpu, size);
        Self { gpu, renderer, offscreen, camera, look, framed: false }
    }

    /// The adapter.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The renderer, for its legend and notice.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Draws a view and hands it in; the picture stays in the adapter.
    fn draw(&mut self, view: &View) -> wgpu::CommandEncoder {
        let [width, height] = self.offscreen.size();
        if !self.framed && view.outline_of_frame().is_some() {
            frame(&mut self.camera, view, width as f32 / height as f32);
            self.framed = true;
        }
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.update(&self.gpu, view, &self.look);
        let target = self.offscreen.view();
        self.renderer.draw(&self.gpu, &mut encoder, target, [width, height], &self.camera, &self.look);
        encoder
    }

    /// Draws a view.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`] when the device was lost.
    pub fn picture(&mut self, view: &View) -> Result<Picture, GpuError> {
        let encoder = self.draw(view);
        self.offscreen.read(&self.gpu, encoder)
    }
}

/// Frames a view: from the surgeon's side the wound with the tissue around it, otherwise the whole tissue.
pub fn frame(camera: &mut Camera, view: &View, aspect: f32) {
    let nodes = &view.frame.elements;
    let place = |node: &u32| nodes.get(*node as usize).map(|n| n.position_m);
    let parts = view.outline_of_frame();
    let wound = parts.into_iter().flat_map(|p| p.edges.iter().chain(p.pairs)).filter_map(place);
    let surgeon = {
        let mut like = camera.clone();
        like.fixed(FixedView::Surgeon);
        like == *camera
    };
    camera.frame_all(nodes.iter().map(|n| n.position_m), aspect);
    if surgeon && parts.is_some_and(|p| !p.edges.is_empty() || !p.pairs.is_empty()) {
        let whole_m = camera.distance_m();
        camera.frame_all(wound, aspect);
        let near = camera.distance_m() / WOUND_SHARE;
        camera.zoom(camera.distance_m() / near.min(whole_m));
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
        Some(path) => Source::Replay(Box::new(Recording::open(path)?)),
        None => {
            let run = join().map_err(|e| Failure::unavailable(&e))?;
            let feed = Box::new(Feed::join(&run).map_err(|e| Failure::unavailable(&e))?);
            Source::Live { feed, cleaned: Instant::now() }
        }
    };
    let mut studio = Studio::open(args.size, args.view, look)?;
    first_frame(&mut source, &mut studio)?;
    studio.camera.zoom(args.zoom);
    if let Some(path) = &args.png {
        let view = go_to(&mut source, args.at)?;
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
    go_to(&mut source, args.at)?;
    bench::run(count, &mut source, &mut studio)
}

fn say_notice(studio: &Studio) {
    if let Some(notice) = studio.renderer.notice() {
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
            studio.gpu.queue.submit([encoder.finish()]);
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

/// The view at a time.
fn go_to(source: &mut Source, at_s: Option<f64>) -> Result<&View, Failure> {
    match source {
        Source::Replay(recording) => {
            if let Some(at_s) = at_s {
                recording.seek(at_s);
            } else {
                recording.seek(recording.duration_s());
            }
            Ok(recording.view())
        }
        Source::Live { feed, .. } => {
            let started = Instant::now();
            let wait = Duration::from_secs_f64(at_s.unwrap_or(0.0));
            while started.elapsed() < wait {
                feed.look().map_err(|e| Failure::unavailable(&e))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_two_sides_within_bounds() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "640x", "x480", "640x480x3", "8x8", "1280x90000", "-1x20"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert!(seconds("nan").is_err() && seconds("-1").is_err() && seconds("2.5") == Ok(2.5));
    }
}
