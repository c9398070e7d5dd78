//! The mouse as the hand: another process sends wishes, sutures a stitch, is killed or stopped in the middle of a pull, and is
//! followed by a second one that ties what the first has left.
//!
//! The sender is this test program once more. It sees the targets in `tissue_port` and moves as the synthetic surgeon does; in
//! the place of the mouse stands that hand, all the rest is the way that a viewer's wishes take.

use crate::child::Again;
use crate::watch::{Watch, force_n, pulls};
use crate::{LIMIT, alone, assert_no_fault, ended, run, solver_of, summary};
use haptic_server::device::HandView;
use haptic_server::hand::Hand;
use haptic_server::hand::pointer::{LET_GO_AFTER_S, SPEED_M_PER_S};
use haptic_server::hand::synthetic::{SyntheticHand, SyntheticHandParams};
use haptic_server::rig::workspace_centre_m;
use protocol::pointer_hand::PointerHand;
use protocol::ports::{PointerHandPublisher, PortNode, TissuePortSubscriber};
use protocol::run::RunDir;
use protocol::servo_state::{FLAG_POINTER, ServoState};
use protocol::wire::Field;
use rustix::process::Signal;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use suture_tests::processes::{Sandbox, wait_for};

const RUN_DIR: &str = "SUTURE_TEST_POINTER_RUN_DIR";
/// A viewer sends about as often.
const SEND_PERIOD: Duration = Duration::from_millis(8);
/// No device gives more, newtons.
const PEAK_N: f64 = 3.3;
/// Once nobody holds the line, the force has this long to fade, seconds: button, line and filter.
const FADED_AFTER_S: f64 = LET_GO_AFTER_S + 1.0;
/// Below this a force is none, newtons: what the stylus' own friction hides.
const ZERO_N: f64 = 0.26;
/// Ticks for which a sender that was stopped and goes on asks for the hand in vain.
const IN_VAIN: u64 = 2_000;
/// Ways are measured over at least this long, nanoseconds.
const STRIDE_NS: u64 = 20_000_000;
/// The stylus swings about the way of its hand: so much faster it may be for a moment.
const SWING: f64 = 2.0;

/// A sender that is killed with its guard.
struct Sender(Again);

impl Sender {
    fn start(run: &RunDir) -> Self {
        Self(Again::start("pointer::child_sends_wishes_until_it_is_killed", RUN_DIR, run))
    }

    fn signal(&self, signal: Signal) {
        self.0.signal(signal);
    }
}

/// Sees that the stylus never jumps.
#[derive(Default)]
struct Strides {
    last: Option<ServoState>,
    fastest_m_per_s: f64,
}

impl Strides {
    fn see(&mut self, state: &ServoState) {
        let last = self.last.get_or_insert(*state);
        let passed_ns = state.header.time_ns - last.header.time_ns;
        if passed_ns >= STRIDE_NS {
            let [was, is] = [&*last, state].map(|s| s.devices[0].position_m);
            let way_m = was.iter().zip(is).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
            self.fastest_m_per_s = self.fastest_m_per_s.max(way_m / (passed_ns as f64 * 1e-9));
            *last = *state;
        }
    }
}

/// Body of the sender; does nothing in an ordinary test run.
#[test]
fn child_sends_wishes_until_it_is_killed() {
    let Some(path) = std::env::var_os(RUN_DIR).map(PathBuf::from) else { return };
    let node = PortNode::join(&RunDir::open(&path).expect("the run"), "pointer-test").expect("anybody may join");
    let mut ports = TissuePortSubscriber::open(&node).expect("anybody may look");
    // The place of a sender that was killed is free once somebody has cleaned up after it.
    let publisher = wait_for(LIMIT, || PointerHandPublisher::open(&node).ok());
    let mut publisher = publisher.expect("the place of the sender is free");
    let mut hand = SyntheticHand::new(SyntheticHandParams::default(), workspace_centre_m());
    let mut view = HandView::unseen();
    // Wall clock: the time of a hand; an orphan ends by itself.
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        if let Some(port) = ports.newest().ok().flatten() {
            view = HandView::from(&port);
        }
        let wish = hand.target(start.elapsed().as_secs_f64(), &view);
        let (position_m, sender) = (wish.position_m.into(), std::process::id());
        let mut message = PointerHand { position_m, buttons: wish.buttons, sender, ..PointerHand::EMPTY };
        publisher.send(&mut message).expect("shared memory");
        std::thread::sleep(SEND_PERIOD);
    }
}

#[test]
fn a_pointer_sutures_and_the_death_of_its_viewer_in_a_pull_is_survived() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--device", "pointer", "--duration", "600"]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    let resting = watch.until(LIMIT, |s| s.port_sequence > 0 && s.devices[0].present != 0);
    let resting = resting.unwrap_or_else(|| panic!("nothing runs: {}", server.stderr()));
    assert_ne!(resting.flags & FLAG_POINTER, 0);
    assert_eq!(resting.devices[0].buttons, 0);

    let first = Sender::start(&run);
    let pulling = watch.until(LIMIT, pulls);
    let pulling = pulling.unwrap_or_else(|| panic!("the pointer never pulled: {}", server.stderr()));
    drop(first);
    let mut most_n = 0.0_f64;
    let let_go = watch.until(LIMIT, |s| {
        most_n = most_n.max(force_n(s));
        s.devices[0].buttons == 0
    });
    let let_go = let_go.unwrap_or_else(|| panic!("the button of a dead viewer stays down: {}", server.stderr()));
    let seconds = |later: &ServoState| (later.header.time_ns - pulling.header.time_ns) as f64 * 1e-9;
    println!("the button is up {:.2} s after the pull was seen, at most {most_n:.2} N", seconds(&let_go));
    let faded = watch.until(LIMIT, |s| seconds(s) > FADED_AFTER_S && force_n(s) < ZERO_N);
    assert!(faded.is_some_and(|s| s.mode == 4), "{faded:?}");
    assert!(most_n <= PEAK_N, "{most_n} N");

    let _second = Sender::start(&run);
    let tied = watch.report(LIMIT, |r| r.row_count > 0);
    assert!(tied.is_some(), "the second pointer ties nothing: {}", server.stderr());
    server.signal(Signal::TERM);
    let summary = summary(&ended(server));
    assert_no_fault(&summary);
    assert_eq!((summary["device"].as_str(), summary["hand"].as_str()), (Some("pointer"), Some("pointer")));
    assert!(summary["stitches"].as_u64() > Some(0) && summary["peak_force_n"].as_f64() <= Some(PEAK_N), "{summary}");
}

#[test]
fn a_viewer_that_is_stopped_in_a_pull_is_followed_and_goes_on_in_vain() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--device", "pointer", "--duration", "600"]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    let first = Sender::start(&run);
    let pulling = watch.until(LIMIT, pulls);
    let pulling = pulling.unwrap_or_else(|| panic!("the pointer never pulled: {}", server.stderr()));
    assert_eq!((pulling.hand_sender, pulling.hand_turn), (first.0.id(), 1));

    first.signal(Signal::STOP);
    let second = Sender::start(&run);
    let mut strides = Strides::default();
    let mut held = None;
    let followed = watch.until(LIMIT, |s| {
        strides.see(s);
        if s.hand_sender == first.0.id() {
            held = Some(*s);
        }
        s.hand_sender == second.0.id()
    });
    let followed = followed.unwrap_or_else(|| panic!("a stopped viewer keeps the hand: {}", server.stderr()));
    let held = held.expect("it was the hand until a moment ago");
    println!(
        "the hand of a stopped viewer was free {:.2} s after the pull was seen and taken {:.2} s after it",
        (held.header.time_ns - pulling.header.time_ns) as f64 * 1e-9,
        (followed.header.time_ns - pulling.header.time_ns) as f64 * 1e-9
    );
    assert_eq!((followed.hand_turn, followed.devices[0].buttons), (2, 0), "a take-over presses nothing");

    first.signal(Signal::CONT);
    let mut others = 0;
    let in_vain = watch.until(LIMIT, |s| {
        strides.see(s);
        others += u64::from(s.hand_sender != second.0.id());
        s.ticks > followed.ticks + IN_VAIN
    });
    let in_vain = in_vain.unwrap_or_else(|| panic!("the servo stands still: {}", server.stderr()));
    assert_eq!((others, in_vain.hand_turn), (0, 2), "one that goes on is one of the others");
    let tied = watch.report(LIMIT, |r| r.row_count > 0);
    assert!(tied.is_some(), "the second pointer ties nothing: {}", server.stderr());
    println!("the stylus was never faster than {:.3} m/s", strides.fastest_m_per_s);
    assert!(strides.fastest_m_per_s <= SWING * SPEED_M_PER_S, "{} m/s", strides.fastest_m_per_s);

    drop(second);
    let back = watch.until(LIMIT, |s| s.hand_turn == 3);
    assert!(back.is_some_and(|s| s.hand_sender == first.0.id()), "the place of a killed viewer stays taken: {back:?}");
    server.signal(Signal::TERM);
    assert_no_fault(&summary(&ended(server)));
}
