//! Session commands of several senders: one that sends without end delays nobody, and is told of once.
//!
//! The flood is this test program once more.

use crate::child::Again;
use crate::watch::Watch;
use crate::{LIMIT, alone, assert_no_fault, ended, run, solver_of, summary};
use protocol::ports::{PortNode, SessionCommandPublisher};
use protocol::run::RunDir;
use protocol::session_command::Order;
use rustix::process::Signal;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use suture_tests::processes::{Sandbox, binary, wait_for};

const RUN_DIR: &str = "SUTURE_TEST_FLOOD_RUN_DIR";
/// Commands in a burst, and the pause after it: a thousand times as many as are obeyed.
const BURST: usize = 64;
const PAUSE: Duration = Duration::from_millis(1);

/// Body of the flood; does nothing in an ordinary test run.
#[test]
fn child_floods_until_it_is_killed() {
    let Some(path) = std::env::var_os(RUN_DIR).map(PathBuf::from) else { return };
    let node = PortNode::join(&RunDir::open(&path).expect("the run"), "flood-test").expect("anybody may join");
    let mut publisher = SessionCommandPublisher::open(&node).expect("there is room");
    // Wall clock: an orphan ends by itself.
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        // Refused: nothing has been taken.
        (0..BURST).for_each(|_| drop(publisher.send(Order::Tie)));
        std::thread::sleep(PAUSE);
    }
}

#[test]
fn a_flood_of_commands_delays_nobody_elses_and_is_told_once() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600", "--device", "pointer"]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    watch.report(LIMIT, |_| true).expect("the solver reports");
    let flood = Again::start("commands::child_floods_until_it_is_killed", RUN_DIR, &run);
    let told = |what: &str| server.stderr().matches(what).count();
    let began = wait_for(LIMIT, || (told("faster than they are obeyed") > 0).then_some(()));
    assert!(began.is_some(), "no flood is told: {}", server.stderr());
    for control in ["control-off", "control-on", "control-paper", "control-off"] {
        let answered = ended(sandbox.start(&binary("haptic-server"), &["session", control]));
        assert_eq!(answered.code, Some(0), "{control}: {}", answered.stderr);
    }
    assert_eq!(watch.report(LIMIT, |r| r.control == 0).map(|r| r.control), Some(0));
    assert_eq!((told("faster than they are obeyed"), told("is over")), (1, 0), "{}", server.stderr());
    drop(flood);
    let over = wait_for(LIMIT, || (told("is over") > 0).then_some(()));
    assert!(over.is_some(), "the flood never ends: {}", server.stderr());
    server.stderr().lines().filter(|line| line.contains("session commands")).for_each(|line| println!("{line}"));
    server.signal(Signal::TERM);
    let ended = ended(server);
    assert_eq!(ended.stderr.matches("session commands").count(), 2, "{}", ended.stderr);
    assert_no_fault(&summary(&ended));
}
