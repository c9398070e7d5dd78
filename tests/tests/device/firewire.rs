//! The Omni on FireWire through the whole loop: the talk at the start, pose, force with a scale only, and every fault.
//!
//! The table is printed (`--nocapture`). "Ticks" is from the fault to the first tick after which the motors give nothing.

use crate::firewire_node::{FakeNode, SERIAL, SessionPeer, TRUE_SCALE, Trouble};
use crate::wire_rig::{Peer, WireRig, line};
use haptic_server::device::firewire::arm::{DOCK_RAD, FireWireOmni};
use haptic_server::device::firewire::force_scale::ForceScaleFile;
use haptic_server::device::firewire::packet::Motors;
use haptic_server::device::frame::SceneFromDevice;
use haptic_server::device::wire::{WireDriver, WireError};
use haptic_server::device::{encoder, omni};
use haptic_server::servo::state_machine::{Mode, ServoFault};
use sim_core::vector::Vec3;

type Rig = WireRig<FireWireOmni, SessionPeer>;

/// A hand works here, device frame.
const PLACE_M: Vec3 = Vec3::new(0.004, 0.0, 0.0);
const SERIAL_TEXT: &str = "51231700321";
/// The file allows no more.
const MAX_N: f64 = 1.2;
/// A force that is held.
const HELD_N: f64 = 0.5;
/// Motor counts are whole: three of 2e-4 N·m at 0.13 m.
const COUNT_N: f64 = 0.01;

fn scale() -> ForceScaleFile {
    ForceScaleFile {
        serial: SERIAL_TEXT.to_owned(),
        torque_n_m_per_count: TRUE_SCALE,
        max_count: 2_000,
        max_force_n: MAX_N,
        residual_share: [0.02; 3],
        readings: 24,
    }
}

fn driver(with: Option<&ForceScaleFile>) -> FireWireOmni {
    let scale = with.map(|file| file.check(SERIAL_TEXT).expect("a sound file"));
    FireWireOmni::new(scale, SceneFromDevice::workspace_at(Vec3::new(0.0, 0.0, 0.02)))
}

fn switched_on(with: Option<&ForceScaleFile>) -> Rig {
    let omni = driver(with);
    let peer = SessionPeer::open(FakeNode::new(), omni.rest().bytes()).expect("a device that is well");
    assert_eq!(peer.serial(), SERIAL_TEXT);
    WireRig::new(omni, &omni.limits(), peer)
}

/// Moves the gimbal evenly.
fn go(rig: &mut Rig, to_m: Vec3, ticks: u32) {
    let from_m = omni::forward(rig.peer().node.omni().joints);
    rig.step_with(ticks, |tick, peer| {
        let mut device = peer.node.omni();
        device.is_docked = false;
        device.joints = omni::inverse(from_m + (to_m - from_m) * (f64::from(tick) / f64::from(ticks)));
    });
}

fn put_into_dock(rig: &mut Rig) {
    go(rig, omni::forward(Vec3::from(DOCK_RAD)), 1_000);
    rig.step_with(200, |_, peer| {
        let mut device = peer.node.omni();
        (device.joints, device.is_docked) = (Vec3::from(DOCK_RAD), true);
    });
}

fn pull(rig: &mut Rig) {
    rig.hold(true);
    rig.step(20);
    go(rig, PLACE_M + Vec3::new(0.0, 0.0, -0.005), 100);
    rig.step(300);
    assert!(rig.arrived_n() > HELD_N, "{} N, {:?}", rig.arrived_n(), rig.told());
}

fn holding() -> Rig {
    let mut rig = switched_on(Some(&scale()));
    rig.step(200);
    go(&mut rig, PLACE_M, 1_000);
    rig.step(3_000);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    pull(&mut rig);
    rig
}

fn assert_the_way_back(rig: &mut Rig, zero_is_lost: bool) {
    rig.hold(false);
    rig.step(200);
    assert_eq!(rig.mode(), Mode::Fault, "a latched fault does not go by itself");
    rig.rearm();
    if zero_is_lost {
        put_into_dock(rig);
    }
    go(rig, PLACE_M, 1_000);
    rig.step(3_000);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    pull(rig);
}

#[test]
fn a_node_that_is_no_omni_or_not_well_is_refused_by_the_step_that_failed() {
    let refused = |change: fn(&FakeNode)| {
        let node = FakeNode::new();
        change(&node);
        SessionPeer::open(node, driver(None).rest().bytes()).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert_eq!(refused(|_| {}), "");
    for (why, change) in [
        ("another maker", (|n| _ = n.omni().quadlets.insert(0x1006_000c, 0x0011_0600)) as fn(&FakeNode)),
        ("health registers", |n| _ = n.omni().registers.insert(0x1083, 0)),
        ("does not keep what is written", |n| n.omni().keeps_writes = false),
        ("serial number", |n| _ = n.omni().quadlets.insert(0x1006_0010, SERIAL & !1)),
        ("no channel left", |n| n.omni().free_channels.truncate(1)),
        ("gone", |n| n.omni().trouble = Trouble::Unplugged),
    ] {
        let told = refused(change);
        assert!(told.contains(why), "{why}: {told:?}");
    }
}

#[test]
fn packets_flow_on_the_reserved_channels_and_stop_with_the_session() {
    let node = FakeNode::new();
    let peer = SessionPeer::open(node.clone(), driver(None).rest().bytes()).expect("well");
    assert_eq!(node.omni().registers.get(&0x1000), Some(&4));
    assert_eq!(node.omni().registers.get(&0x1001), Some(&9));
    assert_eq!(node.omni().registers.get(&0x1087), Some(&8));
    assert_eq!(node.omni().sent, 1, "the rest comes before anything flows");
    drop(peer);
    assert_eq!(node.omni().registers.get(&0x1087), Some(&0));
}

#[test]
fn without_a_scale_there_is_the_pose_and_never_a_motor() {
    let mut rig = switched_on(None);
    rig.step(200);
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("calibrate-force")), "{told:?}");
    rig.hold(true);
    go(&mut rig, PLACE_M, 1_000);
    rig.step_with(3_000, |_, peer| {
        peer.node.omni().buttons = 0b10;
        assert_eq!(peer.node.omni().motors, Motors::Off);
    });
    let shown = Vec3::from(rig.state().devices[0].position_m) - Vec3::new(0.0, 0.0, 0.02);
    // Half a count of each of three joints.
    assert!((shown - PLACE_M).norm() < 1.5e-4, "{shown}");
    assert_eq!((rig.state().devices[0].buttons, rig.state().devices[0].force_n), (0b10, [0.0; 3]));
    assert_eq!(rig.fault(), None);
}

#[test]
fn before_the_dock_there_is_no_pose_and_the_encoders_may_wrap() {
    let mut rig = switched_on(Some(&scale()));
    rig.step_with(500, |_, peer| peer.node.omni().is_docked = false);
    assert_eq!((rig.mode(), rig.state().devices[0].present), (Mode::Init, 0));
    assert!(rig.told().iter().any(|t| t.contains("inkwell")));
    put_into_dock(&mut rig);
    // Both ways across the wrap of the first encoder, which stands six counts below it in the dock.
    for turn in [0.3, -0.3] {
        let at = omni::forward(Vec3::new(turn, DOCK_RAD[1], DOCK_RAD[2]));
        go(&mut rig, at, 1_000);
        rig.step(100);
        let shown = Vec3::from(rig.state().devices[0].position_m) - Vec3::new(0.0, 0.0, 0.02);
        let frame = SceneFromDevice::workspace_at(Vec3::zeros());
        let wanted = frame.point(omni::forward(encoder::round_joints(omni::inverse(at))));
        assert!((shown - wanted).norm() < 1.5e-4, "{shown} for {wanted}");
    }
    assert_eq!(rig.fault(), None);
}

#[test]
fn gimbals_are_ratiometric_and_turn_the_stylus() {
    let mut rig = switched_on(None);
    rig.step(200);
    let level = rig.state().devices[0].orientation;
    rig.step_with(300, |_, peer| peer.node.omni().shares = [0.5, 0.35, 0.5]);
    let turned = rig.state().devices[0].orientation;
    let dot: f64 = level.iter().zip(turned).map(|(a, b)| a * b).sum();
    // 5.28 · 0.15 rad about one axis.
    assert!((2.0 * dot.abs().acos() - 5.28 * 0.15).abs() < 1e-3, "{}", 2.0 * dot.abs().acos());
}

#[test]
fn with_a_scale_the_force_is_the_commanded_one_and_never_more_than_the_file_allows() {
    let mut rig = holding();
    let commanded = Vec3::from(rig.state().devices[0].force_n);
    let arrived = SceneFromDevice::workspace_at(Vec3::zeros()).point(rig.peer().node.omni().force());
    assert!((arrived - commanded).norm() < COUNT_N, "{arrived} against {commanded}");
    // 20 mm on 170 N/m are far beyond the file's most.
    go(&mut rig, PLACE_M + Vec3::new(0.0, 0.0, -0.020), 300);
    rig.step_with(200, |_, peer| assert!(peer.arrived_n() < MAX_N + COUNT_N, "{}", peer.arrived_n()));
    assert!(rig.peer().arrived_n() > 0.6, "the continuous force of the motors at least");
}

#[test]
fn a_scale_with_few_counts_limits_all_motors_alike() {
    let few = ForceScaleFile { max_count: 100, ..scale() };
    let mut rig = switched_on(Some(&few));
    rig.step(200);
    go(&mut rig, PLACE_M, 1_000);
    rig.step(3_000);
    rig.hold(true);
    rig.step(20);
    go(&mut rig, PLACE_M + Vec3::new(0.0, 0.0, -0.010), 200);
    rig.step_with(300, |_, peer| {
        let Motors::On(counts) = peer.node.omni().motors else { panic!("forces are on") };
        assert!(counts.iter().all(|n| n.abs() <= 100), "{counts:?}");
    });
}

#[test]
fn faults_take_the_force_and_the_way_back_is_by_hand() {
    // Fault, what it is called, ticks to zero at most, servo's fault, whether the zero is lost, what is told.
    for (trouble, name, most_ms, fault, zero_is_lost, words) in [
        (Trouble::Silent, "packets stop", 20, ServoFault::DeviceLost, true, "no packet for 20 ticks"),
        (
            Trouble::Repeated,
            "the same packet again and again",
            20,
            ServoFault::DeviceLost,
            true,
            "came twice or too late",
        ),
        (Trouble::Garbage, "garbage only", 20, ServoFault::DeviceLost, true, "of the wrong form were refused"),
        (Trouble::Jump, "position jumps by 500 counts a joint", 4, ServoFault::SamplesImplausible, false, ""),
    ] {
        let mut rig = holding();
        let outcome = rig.after(40, |peer| peer.node.omni().trouble = trouble);
        assert!(outcome.zero_ms.is_some_and(|ms| ms <= most_ms), "{name}: {outcome:?}");
        assert_eq!(rig.fault(), Some(fault), "{name}");
        assert!(words.is_empty() || outcome.told.iter().any(|t| t.contains(words)), "{name}: {outcome:?}");
        line(name, &outcome, "fault, latched");
        rig.peer().node.omni().trouble = Trouble::None;
        assert_the_way_back(&mut rig, zero_is_lost);
    }
}

#[test]
fn an_unplugged_omni_is_lost_at_once_and_calibrated_anew() {
    let mut rig = holding();
    let outcome = rig.after(40, |peer| peer.node.omni().trouble = Trouble::Unplugged);
    assert_eq!((outcome.zero_ms, rig.fault()), (Some(0), Some(ServoFault::DeviceLost)));
    line("unplugged", &outcome, "fault, latched");
    let peer = SessionPeer::open(FakeNode::new(), driver(None).rest().bytes()).expect("well again");
    assert!(outcome.told.iter().any(|t| t.contains(&WireError::Gone.to_string())), "{outcome:?}");
    rig.plug_in(peer);
    assert_the_way_back(&mut rig, true);
}

#[test]
fn lost_and_swapped_packets_are_told_and_the_force_goes_on() {
    for (trouble, name, words) in [
        (Trouble::HalfLost, "every second packet is lost", "did not arrive"),
        (Trouble::Swapped, "packets in the wrong order", "came twice or too late"),
    ] {
        let mut rig = holding();
        let held_n = rig.arrived_n();
        let outcome = rig.after(1_000, |peer| peer.node.omni().trouble = trouble);
        assert_eq!((outcome.zero_ms, rig.mode(), rig.fault()), (None, Mode::Active, None), "{name}: {outcome:?}");
        assert!((rig.arrived_n() - held_n).abs() < 0.15 * held_n, "{name}: {} of {held_n}", rig.arrived_n());
        assert!(outcome.told.iter().any(|t| t.contains(words)), "{name}: {outcome:?}");
        line(name, &outcome, "active");
    }
}

#[test]
fn a_button_that_is_stuck_at_the_start_presses_nothing() {
    let mut rig = switched_on(Some(&scale()));
    rig.step_with(2_000, |_, peer| peer.node.omni().buttons = 0b11);
    assert_eq!(rig.state().devices[0].press_count, [0, 0]);
}
