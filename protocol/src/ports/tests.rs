//! Two ends with nodes of their own, as in two processes; and one end that is killed for good.

use super::*;
use crate::run::{ActiveRun, Environment, RunDir, RunRoot};
use crate::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use crate::servo_state::ServoState;
use crate::session_command::Order;
use crate::wire::Field;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Generous: the machine may be loaded. A failure is a failure, not a slow machine.
const PATIENCE: Duration = Duration::from_secs(20);
const CHILD_RUN_DIR: &str = "SUTURE_TEST_CHILD_RUN_DIR";

pub(super) struct TestRun {
    active: Option<ActiveRun>,
    root: RunRoot,
    _keep: TempDir,
}

impl TestRun {
    pub(super) fn start() -> Self {
        let keep = TempDir::new().unwrap();
        let environment = Environment { xdg_runtime_dir: Some(keep.path().to_owned()), ..Environment::of_process() };
        let root = RunRoot::open(&environment).unwrap();
        Self { active: Some(root.start().unwrap()), root, _keep: keep }
    }

    pub(super) fn dir(&self) -> &RunDir {
        self.active.as_ref().unwrap().run()
    }

    pub(super) fn node(&self) -> PortNode {
        PortNode::join(self.dir(), "test").unwrap()
    }
}

impl Drop for TestRun {
    fn drop(&mut self) {
        if let Some(active) = self.active.take() {
            let mut cleaned = active.finish(&self.root).unwrap();
            // Wall clock: patience with another thread; nothing is measured.
            let start = Instant::now();
            // A joining thread that was given up may need a moment to end.
            while !cleaned.in_use.is_empty() && start.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(10));
                cleaned = self.root.clean().unwrap();
            }
        }
    }
}

pub(super) fn wait_for<T>(mut poll: impl FnMut() -> Option<T>) -> T {
    // Wall clock: patience with another process; nothing is measured.
    let start = Instant::now();
    loop {
        if let Some(value) = poll() {
            return value;
        }
        assert!(start.elapsed() < PATIENCE, "nothing came");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn port(epoch: u32) -> TissuePort {
    TissuePort { epoch, ..TissuePort::EMPTY }
}

#[test]
fn the_latest_tissue_port_wins_across_threads() {
    let run = TestRun::start();
    let dir = run.dir().clone();
    let mut receiver = TissuePortSubscriber::open(&run.node()).unwrap();
    assert_eq!(receiver.newest().unwrap(), None);
    let (done, until_read) = std::sync::mpsc::channel::<()>();
    let sender = std::thread::spawn(move || {
        let mut publisher = TissuePortPublisher::open(&PortNode::join(&dir, "sender").unwrap()).unwrap();
        for epoch in 1..=100 {
            publisher.send(&mut port(epoch)).unwrap();
        }
        let _ = until_read.recv();
    });
    let last = wait_for(|| receiver.newest().unwrap().filter(|p| p.epoch == 100));
    assert_eq!(last.header.sequence, 100);
    assert_eq!(receiver.newest().unwrap(), None);
    drop(done);
    sender.join().unwrap();
}

#[test]
fn a_late_joiner_gets_the_outline_without_a_new_send() {
    let run = TestRun::start();
    let mut publisher = SceneOutlinePublisher::open(&run.node(), 4).unwrap();
    let mut header = OutlineHeader {
        scene_generation: 7,
        node_count: 3,
        triangle_count: 1,
        pair_count: 1,
        edge_count: 1,
        ..OutlineHeader::EMPTY
    };
    let words = [0, 1, 2, 10, 11, 12, 0, 1, 2];
    publisher.send(&mut header, words.len(), |i| words[i]).unwrap();
    let mut receiver = SceneOutlineSubscriber::open(&run.node()).unwrap();
    assert!(receiver.newest().unwrap().is_none());
    publisher.serve_late_joiners().unwrap();
    let outline = receiver.newest().unwrap().expect("history reaches a late joiner");
    assert_eq!(outline.elements, words);
    let parts = outline.header.split(&outline.elements).unwrap();
    assert_eq!((parts.triangles, parts.layers), (&words[..3], &words[3..6]));
    assert_eq!((parts.pairs, parts.edges), (&words[6..8], &words[8..]));
}

#[test]
fn a_frame_may_grow_and_a_wrong_count_is_refused_by_both_ends() {
    let run = TestRun::start();
    let mut publisher = SceneFramePublisher::open(&run.node(), 10).unwrap();
    assert!(!publisher.has_receivers());
    let mut receiver = SceneFrameSubscriber::open(&run.node()).unwrap();
    assert!(publisher.has_receivers());
    for count in [10_u16, 5000, 0, 7] {
        let mut header = FrameHeader { node_count: u32::from(count), ..FrameHeader::EMPTY };
        let node = |i: usize| FrameNode { position_m: [i as f32, 0.0, 0.0], ..FrameNode::EMPTY };
        publisher.send(&mut header, usize::from(count), node).unwrap();
        let frame = receiver.newest().unwrap().unwrap();
        assert_eq!(frame.elements.len(), usize::from(count));
        assert!(frame.elements.iter().enumerate().all(|(i, n)| n.position_m[0] == i as f32));
    }
    let mut header = FrameHeader { node_count: 3, ..FrameHeader::EMPTY };
    let refused = publisher.send(&mut header, 2, |_| FrameNode::EMPTY);
    assert!(matches!(refused, Err(PortError::Count { announced: 3, carried: 2, .. })));
    let not_finite = |_| FrameNode { position_m: [f32::NAN; 3], ..FrameNode::EMPTY };
    publisher.send(&mut header, 3, not_finite).unwrap();
    assert!(matches!(receiver.newest(), Err(PortError::Rejected(_))));
}

#[test]
fn an_outline_that_points_outside_is_rejected() {
    let run = TestRun::start();
    let mut publisher = SceneOutlinePublisher::open(&run.node(), 4).unwrap();
    let mut receiver = SceneOutlineSubscriber::open(&run.node()).unwrap();
    let mut header = OutlineHeader { node_count: 1, triangle_count: 1, ..OutlineHeader::EMPTY };
    publisher.send(&mut header, 4, |_| 0).unwrap();
    assert!(receiver.newest().unwrap().is_some());
    publisher.send(&mut header, 4, |i| u32::from(i == 1)).unwrap();
    assert!(matches!(receiver.newest(), Err(PortError::Rejected(_))));
}

#[test]
fn servo_state_is_read_whenever_its_writer_appears_and_readers_may_come_and_go() {
    let run = TestRun::start();
    let mut early = ServoStateReader::new(&run.node());
    assert_eq!(early.newest().unwrap(), None);
    let mut writer = ServoStateWriter::create(&run.node()).unwrap();
    wait_for(|| early.connected_for_test().unwrap().then_some(()));
    assert_eq!(early.newest().unwrap(), None, "nothing is written yet");
    for ticks in 1..=50 {
        writer.write(&mut ServoState { ticks, ..ServoState::EMPTY });
        let mut passing = ServoStateReader::new(&run.node());
        assert_eq!(wait_for(|| passing.newest().unwrap()).ticks, ticks);
    }
    assert_eq!(early.newest().unwrap().unwrap().ticks, 50);
    assert_eq!(early.newest().unwrap(), None, "no tick since");
    assert!(matches!(ServoStateWriter::create(&run.node()), Err(PortError::Full { role: "writer", .. })));
}

#[test]
fn a_state_with_a_bad_number_is_rejected_and_the_next_good_one_accepted() {
    let run = TestRun::start();
    let mut writer = ServoStateWriter::create(&run.node()).unwrap();
    let mut reader = ServoStateReader::new(&run.node());
    writer.write(&mut ServoState { energy_to_hand_j: f64::NAN, ..ServoState::EMPTY });
    assert!(matches!(reader.newest(), Err(PortError::Rejected(_))));
    writer.write(&mut ServoState::EMPTY.clone());
    assert_eq!(reader.newest().unwrap().unwrap().header.sequence, 2);
}

#[test]
fn commands_of_several_senders_all_arrive() {
    let run = TestRun::start();
    let mut receiver = SessionCommandSubscriber::open(&run.node()).unwrap();
    let mut first = SessionCommandPublisher::open(&run.node()).unwrap();
    let mut second = SessionCommandPublisher::open(&run.node()).unwrap();
    assert_eq!(first.send(Order::Next).unwrap(), 1);
    first.send(Order::Tie).unwrap();
    second.send(Order::Restore).unwrap();
    let mut commands = Vec::new();
    receiver.look().unwrap();
    while let Some(command) = receiver.next_command() {
        commands.push(command.command);
    }
    commands.sort_unstable();
    assert_eq!(commands, [Order::Restore, Order::Next, Order::Tie].map(Order::code));
}

#[test]
fn a_second_publisher_is_refused_while_the_first_lives() {
    let run = TestRun::start();
    let first = TissuePortPublisher::open(&run.node()).unwrap();
    let second = TissuePortPublisher::open(&run.node());
    assert!(matches!(second, Err(PortError::Full { role: "writer", .. })), "{second:?}");
    drop(first);
    TissuePortPublisher::open(&run.node()).unwrap();
}

#[expect(dead_code, unreachable_pub, reason = "the macro makes whole public types")]
mod other_layout {
    use crate::wire::{Header, message, pod};
    use iceoryx2::prelude::ZeroCopySend;

    pod! {
        /// As `tissue_port`, with another layout.
        pub struct OtherPort as "suture.v4.TissuePort" {
            /// Header.
            pub header: Header,
            /// Another field.
            pub other: u64,
        }
    }
    message!(OtherPort, "tissue_port", parts: [], check: |_| None);
}
use other_layout::OtherPort;

#[test]
fn another_layout_of_the_same_topic_refuses_in_both_directions() {
    let run = TestRun::start();
    let _here = TissuePortSubscriber::open(&run.node()).unwrap();
    let error = LatestPublisher::<OtherPort>::open(&run.node()).unwrap_err();
    assert!(matches!(error, PortError::Incompatible { topic: "tissue_port", .. }), "{error}");
    let other = TestRun::start();
    let _there = LatestPublisher::<OtherPort>::open(&other.node()).unwrap();
    let error = TissuePortSubscriber::open(&other.node()).unwrap_err();
    assert!(matches!(error, PortError::Incompatible { .. }), "{error}");
}

fn spawn_publisher(run: &RunDir) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "ports::tests::child_publishes_until_it_is_killed", "--nocapture"])
        .env(CHILD_RUN_DIR, run.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Body of the child process; does nothing in an ordinary test run.
#[test]
fn child_publishes_until_it_is_killed() {
    let Some(path) = std::env::var_os(CHILD_RUN_DIR) else { return };
    let node = PortNode::join(&RunDir::open(path.as_ref()).unwrap(), "child").unwrap();
    let mut publisher = TissuePortPublisher::open(&node).unwrap();
    // Wall clock: an orphan must end by itself.
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        publisher.send(&mut port(std::process::id())).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_successor_of_a_killed_publisher_is_picked_up_without_action() {
    let run = TestRun::start();
    let node = run.node();
    let mut receiver = TissuePortSubscriber::open(&node).unwrap();
    let mut last_sequence = 0;
    for _ in 0..3 {
        let mut child = spawn_publisher(run.dir());
        let from_child = wait_for(|| receiver.newest().unwrap().filter(|p| p.epoch == child.id()));
        let later = wait_for(|| receiver.newest().unwrap().filter(|p| p.header.sequence > 20));
        assert!(last_sequence == 0 || from_child.header.sequence < last_sequence, "sequence restarts");
        last_sequence = later.header.sequence.max(last_sequence);
        child.kill().unwrap();
        child.wait().unwrap();
        // What it sent before it died may still wait.
        let _ = receiver.newest().unwrap();
    }
    node.clean_up_dead();
    assert_eq!(node.clean_up_dead(), 0);
}

/// The run's segment that every joining node maps.
fn management_segment(run: &RunDir) -> std::path::PathBuf {
    let of_run = |path: &std::path::PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(&run.prefix()) && name.ends_with("global_mgmt")
    };
    let mut files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    files.find(of_run).expect("a joined node has made it")
}

#[test]
fn a_truncated_management_segment_ends_in_a_message_and_not_in_a_hang() {
    let run = TestRun::start();
    let early = run.node();
    let segment = std::fs::OpenOptions::new().write(true).open(management_segment(run.dir())).unwrap();
    segment.set_len(0).unwrap();
    let error = PortNode::join(run.dir(), "late").unwrap_err();
    assert_eq!(error, PortError::JoinTimeout { seconds: 2 });
    // Lets the joining thread that was given up come to its end.
    std::fs::remove_file(management_segment(run.dir())).unwrap();
    drop(early);
}

#[test]
fn a_run_is_independent_of_what_is_left_of_another() {
    let first = TestRun::start();
    let node = first.node();
    std::fs::write(management_segment(first.dir()), [0xff; 16]).unwrap();
    assert!(PortNode::join(first.dir(), "late").is_err());
    let second = TestRun::start();
    PortNode::join(second.dir(), "undisturbed").unwrap();
    drop(node);
}
