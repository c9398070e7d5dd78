//! Viewers cost nobody anything: attached, killed, stopped, missing, or without a screen.
//!
//! Most viewers here are this test program once more: a reader of every topic, as a viewer's feed is. Only the paired
//! measurement, which is asked for by name, starts the viewer itself.

use crate::child::Again;
use crate::watch::Watch;
use crate::{LIMIT, PATIENT_SERVO, alone, assert_no_fault, ended, run, solver_of, summary};
use protocol::ports::{
    PortError, PortNode, SceneFrameSubscriber, SceneOutlineSubscriber, ServoStateReader, WoundReportSubscriber,
};
use protocol::run::RunDir;
use rustix::process::Signal;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use suture_tests::processes::{Sandbox, wait_for};

const RUN_DIR: &str = "SUTURE_TEST_VIEWER_RUN_DIR";
/// A screen's period.
const LOOK_PERIOD: Duration = Duration::from_millis(16);
/// Ticks that the servo goes on for, whatever its viewers do.
const ON: u64 = 2_000;
/// Receivers of a topic at a time.
const PLACES: usize = 32;

/// Everything that a viewer subscribes to.
struct Reader {
    servo: ServoStateReader,
    reports: WoundReportSubscriber,
    frames: SceneFrameSubscriber,
    outlines: SceneOutlineSubscriber,
}

impl Reader {
    fn join(run: &RunDir) -> Result<Self, PortError> {
        let node = PortNode::join(run, "viewer-test")?;
        Ok(Self {
            servo: ServoStateReader::new(&node),
            reports: WoundReportSubscriber::open(&node)?,
            frames: SceneFrameSubscriber::open(&node)?,
            outlines: SceneOutlineSubscriber::open(&node)?,
        })
    }

    /// Whether anything came.
    fn look(&mut self) -> Result<bool, PortError> {
        let outline = self.outlines.newest()?.is_some();
        let frame = self.frames.newest()?.is_some();
        Ok(self.servo.newest()?.is_some() | self.reports.newest()?.is_some() | outline | frame)
    }
}

/// A reader in a process of its own, killed with its guard.
pub(crate) struct Viewer(Again);

impl Viewer {
    pub(crate) fn start(run: &RunDir) -> Self {
        Self(Again::start("viewers::child_looks_until_it_is_killed", RUN_DIR, run))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.0.signal(signal);
    }
}

/// Body of a viewer; does nothing in an ordinary test run.
#[test]
fn child_looks_until_it_is_killed() {
    let Some(path) = std::env::var_os(RUN_DIR).map(PathBuf::from) else { return };
    let mut reader = Reader::join(&RunDir::open(&path).expect("the run")).expect("there is room");
    // Wall clock: an orphan ends by itself.
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        reader.look().expect("sound messages");
        std::thread::sleep(LOOK_PERIOD);
    }
}

#[test]
fn viewers_come_are_killed_and_stopped_and_the_run_goes_on() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600"]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    let viewers: Vec<Viewer> = (0..6).map(|_| Viewer::start(&run)).collect();
    let at_work = watch.until(LIMIT, |s| s.port_sequence > 0 && s.mode == 4);
    let at_work = at_work.unwrap_or_else(|| panic!("no force beside six viewers: {}", server.stderr()));
    for (viewer, signal) in viewers.iter().zip([Signal::KILL, Signal::KILL, Signal::STOP, Signal::STOP]) {
        viewer.signal(signal);
    }
    let later = watch.until(LIMIT, |s| s.ticks > at_work.ticks + ON && s.port_sequence > at_work.port_sequence);
    assert!(later.is_some(), "the servo stands still: {}", server.stderr());
    assert!(watch.report(LIMIT, |r| r.header.time_ns > at_work.header.time_ns).is_some(), "no report for the others");
    server.signal(Signal::TERM);
    let summary = summary(&ended(server));
    assert_no_fault(&summary);
    assert_eq!(summary["solver_restarts"], 0, "{summary}");
}

#[test]
fn the_places_of_killed_viewers_are_free_again_and_one_too_many_is_told_so() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600"]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    watch.report(LIMIT, |_| true).expect("the solver reports");
    for _ in 0..2 {
        // Killed at once, in the middle of their joining, or long after it.
        let killed: Vec<Viewer> = (0..10).map(|_| Viewer::start(&run)).collect();
        std::thread::sleep(10 * LOOK_PERIOD);
        killed[..5].iter().for_each(|viewer| viewer.signal(Signal::KILL));
        drop(killed);
    }
    // The watch and the bridge of the servo have a report's place each, so fewer than all places are left.
    let (mut readers, mut refused) = (Vec::new(), None);
    while refused.is_none() && readers.len() <= PLACES {
        match wait_for(Duration::from_secs(5), || Reader::join(&run).ok()) {
            Some(reader) => readers.push(reader),
            None => refused = Reader::join(&run).err(),
        }
    }
    let refused = refused.expect("places have an end").to_string();
    assert!(readers.len() >= 24, "room for {} viewers only: {refused}", readers.len());
    assert!(refused.contains("no room for another") && refused.contains("close one"), "{refused}");
    for reader in &mut readers {
        assert!(wait_for(LIMIT, || reader.look().expect("sound messages").then_some(())).is_some());
    }
    println!("{} readers at a time beside watch and bridge; then: {refused}", readers.len());
    drop(readers);
    assert!(wait_for(LIMIT, || Reader::join(&run).ok()).is_some(), "a place that was left is free");
    server.signal(Signal::TERM);
    assert_no_fault(&summary(&ended(server)));
}

#[test]
fn a_viewer_that_cannot_draw_is_told_of_once_and_the_run_goes_on() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let said = sandbox.folder().join("said");
    let script = format!("echo \"$*\" >> {}; echo 'no display' >&2; exit 69", said.display());
    let servo = sandbox.folder().join("servo.toml");
    std::fs::write(&servo, PATIENT_SERVO).expect("a sandbox is writable");
    let servo = servo.to_str().expect("a plain name");
    let arguments = ["run", "--json", "--servo", servo, "--viewer", "--duration", "3"];
    let ended = ended(sandbox.start(&sandbox.server_beside(Some(&script)), &arguments));
    let summary = summary(&ended);
    assert!(summary["ticks"].as_u64() > Some(2_000), "{summary}");
    let called = std::fs::read_to_string(&said).expect("it was started");
    let [call] = called.lines().collect::<Vec<_>>()[..] else { panic!("started again: {called}") };
    assert!(call.starts_with("--run-dir ") && call.contains("run-"), "{call}");
    let told = ended.stderr.matches("the viewer ended (exit code 69); the run goes on").count();
    assert_eq!(told, 1, "{}", ended.stderr);
}
