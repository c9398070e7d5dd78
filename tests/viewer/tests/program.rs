//! The program on a run that this test plays: it yields to everybody else, and it times no frame twice.

#![expect(clippy::unwrap_used, reason = "a helper of a test may panic as a test may")]

use clap::Parser;
use protocol::ports::{PortNode, SceneFramePublisher, SceneOutlinePublisher};
use protocol::run::{ActiveRun, Environment, RunDir, RunRoot};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use viewer_client::headless::{self, HeadlessArgs};
use viewer_tests::adapters;
use viewer_tests::scene::{Kind, view};

/// Patience with a loaded machine.
const LIMIT: Duration = Duration::from_secs(60);
/// What the viewer adds to its nice value.
const NICER: i64 = 10;
/// Far slower than a small picture is drawn.
const FRAME_PERIOD: Duration = Duration::from_millis(60);
/// Pictures whose time counts, and those in front of them.
const TIMED: u64 = 3;
const IN_FRONT: u64 = 10;

/// A run without a server, in a folder of its own.
struct Stage {
    active: Option<ActiveRun>,
    root: RunRoot,
    _keep: tempfile::TempDir,
}

impl Stage {
    fn start() -> Self {
        let keep = tempfile::tempdir().unwrap();
        let environment = Environment { xdg_runtime_dir: Some(keep.path().to_owned()), ..Environment::of_process() };
        let root = RunRoot::open(&environment).unwrap();
        Self { active: Some(root.start().unwrap()), root, _keep: keep }
    }

    fn dir(&self) -> &RunDir {
        self.active.as_ref().unwrap().run()
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if let Some(active) = self.active.take() {
            drop(active.finish(&self.root));
        }
    }
}

/// A viewer that ends with the test.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _gone = self.0.kill().and_then(|()| self.0.wait());
    }
}

/// Nice values of all threads of a process, as the system lists them.
fn nice_values(process: u32) -> Vec<i64> {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let stats = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("stat")).ok());
    // Behind the name, which may hold anything, the state is field 3 and the nice value field 19.
    stats.filter_map(|stat| stat.rsplit_once(')')?.1.split_whitespace().nth(16)?.parse().ok()).collect()
}

#[test]
fn a_viewer_yields_to_everything_else() {
    let stage = Stage::start();
    let own = nice_values(std::process::id())[0];
    let viewer = Command::new(env!("CARGO_BIN_EXE_viewer-of-tests"))
        .args(["--text", "--interval", "600", "--run-dir"])
        .arg(stage.dir().path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    let viewer = Started(viewer.unwrap());
    let wanted = (own + NICER).min(19);
    // Wall clock: the program needs a moment to get there.
    let start = Instant::now();
    let mut seen = Vec::new();
    while start.elapsed() < LIMIT && (seen.is_empty() || seen.iter().any(|nice| *nice != wanted)) {
        std::thread::sleep(Duration::from_millis(5));
        seen = nice_values(viewer.0.id());
    }
    assert!(!seen.is_empty() && seen.iter().all(|nice| *nice == wanted), "{seen:?}, the test itself {own}");
}

/// Sends a scene, and new frames of it until it is told to end or has sent so many.
fn play(run: &RunDir, most: u64, sent: &AtomicU64, end: &AtomicBool) {
    let node = PortNode::join(run, "played-solver").unwrap();
    let scene = view(Kind::Skin);
    let (mut outline, words) = (scene.outline.header, scene.outline.elements);
    let (mut header, nodes) = (scene.frame.header, scene.frame.elements);
    let mut outlines = SceneOutlinePublisher::open(&node, words.len()).unwrap();
    let mut frames = SceneFramePublisher::open(&node, nodes.len()).unwrap();
    outlines.send(&mut outline, words.len(), |i| words[i]).unwrap();
    while !end.load(Ordering::Relaxed) {
        outlines.serve_late_joiners().unwrap();
        if frames.has_receivers() && sent.load(Ordering::Relaxed) < most {
            frames.send(&mut header, nodes.len(), |i| nodes[i]).unwrap();
            sent.fetch_add(1, Ordering::Relaxed);
        }
        std::thread::sleep(FRAME_PERIOD);
    }
}

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    pictures: HeadlessArgs,
}

/// Times pictures of a played run that sends so many frames; gives the outcome and how many it had sent by then.
fn bench(most: u64) -> (Result<(), headless::Failure>, u64) {
    let stage = Stage::start();
    let (sent, end) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
    let solver = std::thread::spawn({
        let (run, sent, end) = (stage.dir().clone(), sent.clone(), end.clone());
        move || play(&run, most, &sent, &end)
    });
    let (count, size) = (TIMED.to_string(), "32x32");
    let line =
        Line::try_parse_from(["viewer-client", "--bench", &count, "--size", size]).unwrap_or_else(|e| panic!("{e}"));
    let done = headless::run(&line.pictures, None::<&Path>, || Ok(stage.dir().clone()));
    let by_then = sent.load(Ordering::Relaxed);
    end.store(true, Ordering::Relaxed);
    solver.join().unwrap();
    (done, by_then)
}

#[test]
fn a_running_server_is_timed_with_a_new_frame_for_each_picture_or_not_at_all() {
    if adapters().is_empty() {
        return;
    }
    let (done, sent) = bench(u64::MAX);
    assert!(done.is_ok(), "{:?}", done.err());
    assert!(sent > TIMED + IN_FRONT, "{sent} frames for {} pictures", TIMED + IN_FRONT);
    let (done, sent) = bench(IN_FRONT);
    let failure = done.expect_err("there were not enough frames");
    assert!(failure.code == 69 && failure.sentence.contains("no new frame"), "{failure:?}");
    assert_eq!(sent, IN_FRONT);
}
