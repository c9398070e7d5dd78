//! Recordings as a source of views, and the headless program on them: pictures, exit codes, sentences.

#![expect(clippy::unwrap_used, reason = "a helper of a test may panic as a test may")]

use clap::Parser;
use protocol::ports::SceneFrame;
use protocol::trace::{Metadata, TraceWriter};
use protocol::wire::Message;
use std::path::{Path, PathBuf};
use viewer_client::gpu::png;
use viewer_client::headless::{self, HeadlessArgs};
use viewer_client::replay::{Recording, ReplayError};
use viewer_tests::adapters;
use viewer_tests::compare::Difference;
use viewer_tests::scene::{Kind, view};

/// Frames of the recording, a tenth of a second apart.
const FRAMES: u64 = 20;
const NS_PER_FRAME: u64 = 100_000_000;

/// A sheet that rises by a tenth of a millimetre with each frame.
fn record(path: &Path) {
    let file = std::fs::File::create(path).unwrap();
    let mut writer = TraceWriter::create(file, &Metadata::new()).unwrap();
    let start = view(Kind::Skin);
    let (mut outline, SceneFrame { mut header, mut elements }) = (start.outline.clone(), start.frame.clone());
    outline.header.stamp(1, NS_PER_FRAME);
    writer.outline(&outline.header, &outline.elements).unwrap();
    for k in 1..=FRAMES {
        header.stamp(k, k * NS_PER_FRAME);
        elements.iter_mut().for_each(|n| n.position_m[2] += 1.0e-4);
        writer.tissue(&header, &elements).unwrap();
        let (mut report, mut servo) = (start.report.clone().unwrap(), start.servo.unwrap());
        report.stamp(k, k * NS_PER_FRAME);
        report.solver_steps = k;
        writer.wound_report(&report).unwrap();
        for tick in 0..10 {
            servo.stamp(10 * k + tick, k * NS_PER_FRAME + tick);
            servo.ticks = 10 * k + tick;
            writer.servo_state(&servo).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn recording() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.mcap");
    record(&path);
    (folder, path)
}

#[test]
fn any_time_is_at_hand() {
    let (_folder, path) = recording();
    let mut recording = Recording::open(&path).unwrap();
    assert!((recording.duration_s() - 1.9).abs() < 1e-6, "{}", recording.duration_s());
    assert_eq!(recording.ending(), None);
    let mut last = recording.view().frames;
    for (t_s, frame) in [(0.0, 1), (0.55, 6), (1.9, 20), (0.1, 2), (99.0, 20), (-1.0, 1), (f64::NAN, 1)] {
        let view = recording.seek(t_s);
        assert_eq!(view.frame.header.header.sequence, frame, "at {t_s}");
        assert_eq!(view.report.as_ref().map(|r| r.solver_steps), Some(frame));
        assert!(view.outline_of_frame().is_some() && view.outlines == 1);
        assert!(view.frames >= last);
        last = view.frames;
    }
    let before = recording.view().frames;
    recording.seek(0.01);
    assert_eq!(recording.view().frames, before, "the same frame is not new");
}

#[test]
fn a_cut_file_plays_up_to_the_cut() {
    let (folder, path) = recording();
    let bytes = std::fs::read(&path).unwrap();
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let recording = Recording::open(&cut).unwrap();
    assert!(recording.ending().is_some_and(|e| e.contains("cut off")));
    assert!(recording.frame_count() > 2 && recording.frame_count() < FRAMES as usize);
}

#[test]
fn what_is_no_recording_is_refused() {
    let (folder, path) = recording();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let bytes = std::fs::read(&path).unwrap();
    let refusal = |path: &Path| Recording::open(path).map(|_| ()).unwrap_err();
    let text = refusal(&write("text.mcap", b"no recording")).to_string();
    assert!(text.contains("no MCAP file"), "{text}");
    assert!(matches!(refusal(&write("early.mcap", &bytes[..4000])), ReplayError::Empty { .. }));
    assert!(matches!(refusal(&folder.path().join("absent.mcap")), ReplayError::Open { .. }));
    let small = Recording::open_within(&path, 100).map(|_| ()).unwrap_err();
    assert!(matches!(small, ReplayError::TooLarge { .. }), "{small}");
}

#[test]
fn a_long_recording_is_thinned_to_the_memory_given() {
    let (_folder, path) = recording();
    let whole = Recording::open(&path).unwrap();
    assert_eq!(whole.remarks().count(), 0);
    let frame = size_of_val(whole.view().frame.elements.as_slice());
    let mut thinned = Recording::open_within(&path, 12 * frame).unwrap();
    assert!(thinned.frame_count() * frame <= 12 * frame && thinned.frame_count() >= 3);
    assert_eq!(thinned.duration_s(), whole.duration_s());
    assert!(thinned.remarks().any(|r| r.contains("one frame in")), "{:?}", thinned.remarks().collect::<Vec<_>>());
    assert_eq!(thinned.seek(0.0).frame.header.header.sequence, 1);
}

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    pictures: HeadlessArgs,
}

fn run(replay: &Path, options: &[&str]) -> Result<(), headless::Failure> {
    let line = Line::try_parse_from(["viewer-client"].iter().chain(options)).unwrap_or_else(|e| panic!("{e}"));
    headless::run(&line.pictures, Some(replay), || Err("no server".to_owned()))
}

#[test]
fn the_program_writes_one_picture_or_many() {
    if adapters().is_empty() {
        return;
    }
    let (folder, path) = recording();
    let at = |name: &str| folder.path().join(name);
    let load = |path: PathBuf| png::decode(&std::fs::read(path).unwrap()).unwrap();
    let one = |name: &str, at_s: &str| {
        let file = at(name);
        run(&path, &["--png", file.to_str().unwrap(), "--size", "96x64", "--at", at_s]).unwrap();
        load(file)
    };
    let (early, late) = (one("early.png", "0"), one("late.png", "1.9"));
    assert_eq!(early.size, [96, 64]);
    assert_eq!(one("again.png", "0"), early);
    assert!(!Difference::of(&early, &late).is_small());
    let frames = at("frames");
    run(&path, &["--frames", frames.to_str().unwrap(), "--size", "32x32", "--fps", "5"]).unwrap();
    let count = std::fs::read_dir(&frames).unwrap().count();
    assert_eq!(count, 10, "five pictures a second of 1.9 seconds, the first at 0");
    run(&path, &["--bench", "3", "--size", "32x32"]).unwrap();
}

#[test]
fn what_cannot_be_drawn_has_its_exit_code() {
    let (folder, path) = recording();
    let out = folder.path().join("out.png");
    let png = ["--png", out.to_str().unwrap()];
    let code = |result: Result<(), headless::Failure>| result.map_err(|f| (f.code, f.sentence)).unwrap_err();
    assert_eq!(code(run(&folder.path().join("absent.mcap"), &png)).0, 66);
    let text = folder.path().join("text.mcap");
    std::fs::write(&text, b"no recording").unwrap();
    assert_eq!(code(run(&text, &png)).0, 65);
    let line = Line::try_parse_from(["viewer-client", "--png", "x.png"]).unwrap_or_else(|e| panic!("{e}"));
    let nobody = headless::run(&line.pictures, None, || Err("no server runs".to_owned()));
    assert_eq!(code(nobody), (69, "no server runs".to_owned()));
    if !adapters().is_empty() {
        assert_eq!(code(run(&path, &[])).0, 64);
        let folder_instead = folder.path().to_str().unwrap();
        assert_eq!(code(run(&path, &["--png", folder_instead])).0, 69);
    }
    for wrong in [["--size", "5x5"], ["--at", "-3"], ["--fps", "0"], ["--zoom", "0"], ["--colour", "mauve"]] {
        assert!(Line::try_parse_from(["viewer-client"].iter().chain(&wrong)).is_err(), "{wrong:?}");
    }
}
