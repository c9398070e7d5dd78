//! The open HID arm through the whole loop: zero, force, and every fault that it can have while a hand holds a newton.
//!
//! The table is printed (`--nocapture`). "Ticks" is from the fault to the first tick after which the motors give nothing.

use crate::hid_peer::{ArmPeer, Trouble};
use crate::wire_rig::{Peer, WireRig, line};
use haptic_server::device::frame::SceneFromDevice;
use haptic_server::device::hid::arm::HidArm;
use haptic_server::device::hid::arm_kinematics::{ArmConfig, ArmParams};
use haptic_server::device::notice::{NOTICES, NoticeRing};
use haptic_server::device::wire::pump::{Pump, cells};
use haptic_server::device::wire::{LONGEST, Link, Opener, WireDriver, WireError, WirePort};
use haptic_server::servo::state_machine::{Mode, ServoFault};
use sim_core::vector::Vec3;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use suture_tests::processes::wait_for;

type Rig = WireRig<HidArm, ArmPeer>;

/// The arm is switched on in any pose.
const ANYWHERE: [i16; 3] = [300, -200, 40];
/// A hand works here: counts from the rest pose.
const PLACE: [i16; 3] = [0, 1_200, 6_800];
/// 10 mm of the forearm in counts.
const PULLED: i16 = 156;
/// A force that is held.
const HELD_N: f64 = 0.5;
/// Patience with a loaded machine.
const LIMIT: Duration = Duration::from_secs(60);

fn driver() -> HidArm {
    let params = ArmParams::new(&ArmConfig::default()).expect("the published build");
    HidArm::new(params, SceneFromDevice::workspace_at(Vec3::new(0.0, 0.0, 0.02)))
}

fn switched_on() -> Rig {
    let arm = driver();
    WireRig::new(arm, &arm.limits(), ArmPeer::new(ANYWHERE))
}

/// Holds it still in its rest pose, button down, until it has its zero.
fn find_zero(rig: &mut Rig) {
    rig.step(10);
    rig.step_with(700, |_, peer| peer.info = 1);
    rig.step_with(20, |_, peer| peer.info = 0);
    let told = rig.told();
    assert!(told.iter().any(|t| t == "calibrated"), "{told:?}");
}

/// Goes from here to there evenly.
fn go(rig: &mut Rig, to: [i16; 3], ticks: u32) {
    let from = rig.peer().counts;
    rig.step_with(ticks, |tick, peer| {
        peer.counts = std::array::from_fn(|i| {
            let way = i32::from(to[i]) - i32::from(from[i]);
            (i32::from(from[i]) + way * tick as i32 / ticks as i32) as i16
        });
    });
}

/// Takes the point and pulls it.
fn pull(rig: &mut Rig) {
    rig.hold(true);
    rig.step(20);
    go(rig, [PLACE[0], PLACE[1], PLACE[2] + PULLED], 100);
    rig.step(300);
    assert!(rig.arrived_n() > HELD_N, "{} N, {:?}", rig.arrived_n(), rig.mode());
}

fn holding() -> Rig {
    let mut rig = switched_on();
    find_zero(&mut rig);
    go(&mut rig, PLACE, 2_000);
    rig.step(3_000);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    pull(&mut rig);
    rig
}

/// Lets go, re-arms, finds the zero again if it must, and holds again.
fn assert_the_way_back(rig: &mut Rig, zero_is_lost: bool) {
    rig.hold(false);
    rig.step(200);
    assert_eq!(rig.mode(), Mode::Fault, "a latched fault does not go by itself");
    rig.rearm();
    if zero_is_lost {
        find_zero(rig);
    }
    go(rig, PLACE, 2_000);
    rig.step(3_000);
    assert_eq!(rig.mode(), Mode::Active, "{:?}", rig.told());
    pull(rig);
}

#[test]
fn before_the_zero_there_is_no_force_and_no_pose() {
    let mut rig = switched_on();
    rig.hold(true);
    rig.step_with(3_000, |tick, peer| {
        peer.counts[2] = 40 + (tick % 200) as i16;
        assert!(peer.arrived_n() == 0.0);
    });
    assert_eq!((rig.mode(), rig.state().fault, rig.state().devices[0].present), (Mode::Init, 0, 0));
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("rest pose") && t.contains("no force until then")), "{told:?}");
}

#[test]
fn a_packet_goes_out_in_every_tick_and_the_force_is_the_commanded_one() {
    let mut rig = holding();
    let before = rig.peer().writes;
    rig.step(1_000);
    assert_eq!(rig.peer().writes - before, 1_000, "the firmware's watchdog is fed with force and without");
    let commanded = Vec3::from(rig.state().devices[0].force_n);
    // Scene (x, y, z) from device (x right, y up, z to the user): (x, −z, y).
    let [x, y, z] = rig.peer().force();
    let arrived = Vec3::new(x, -z, y);
    // Half a milliampere in each of three motors, and truncation: 0.02 N.
    assert!((arrived - commanded).norm() < 0.02, "{arrived} against {commanded}");
    assert!(rig.state().energy_to_hand_j < 1e-3);
}

#[test]
fn silence_takes_the_force_within_twenty_ticks_and_is_latched() {
    let mut rig = holding();
    let outcome = rig.after(40, |peer| peer.trouble = Trouble::Silent);
    assert!(outcome.zero_ms.is_some_and(|ms| ms <= 20), "{outcome:?}");
    assert_eq!(rig.fault(), Some(ServoFault::DeviceLost));
    assert!(outcome.told.iter().any(|t| t.contains("no packet for 20 ticks")), "{outcome:?}");
    line("reports stop", &outcome, "fault, latched");
    rig.peer().trouble = Trouble::None;
    assert_the_way_back(&mut rig, true);
}

#[test]
fn a_few_missing_reports_are_bridged_and_ten_take_some_force_for_a_while() {
    let mut rig = holding();
    let held_n = rig.arrived_n();
    for _ in 0..20 {
        rig.step_with(1, |_, peer| peer.trouble = Trouble::Silent);
        rig.step_with(2, |_, peer| peer.trouble = Trouble::None);
        assert!((rig.arrived_n() - held_n).abs() < 0.1 * held_n, "one in three is bridged: {}", rig.arrived_n());
    }
    let outcome = rig.after(10, |peer| peer.trouble = Trouble::Silent);
    assert!(outcome.zero_ms.is_none() && rig.arrived_n() < held_n, "{outcome:?}");
    rig.peer().trouble = Trouble::None;
    rig.step(300);
    assert_eq!((rig.mode(), rig.fault()), (Mode::Active, None));
    assert!((rig.arrived_n() - held_n).abs() < 0.1 * held_n);
    line("ten reports missing", &outcome, "active");
}

#[test]
fn garbage_is_refused_counted_and_told_and_only_garbage_is_silence() {
    let mut rig = holding();
    rig.step_with(30, |tick, peer| peer.trouble = if tick % 2 == 0 { Trouble::Garbage } else { Trouble::None });
    assert_eq!((rig.mode(), rig.fault()), (Mode::Active, None));
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("1 packets of the wrong form were refused")), "{told:?}");
    let outcome = rig.after(40, |peer| peer.trouble = Trouble::Garbage);
    assert!(outcome.zero_ms.is_some_and(|ms| ms <= 20), "{outcome:?}");
    assert_eq!(rig.fault(), Some(ServoFault::DeviceLost));
    line("garbage only", &outcome, "fault, latched");
    rig.peer().trouble = Trouble::None;
    assert_the_way_back(&mut rig, true);
}

#[test]
fn an_unplugged_arm_is_lost_at_once_and_back_only_by_hand() {
    for (trouble, name) in [(Trouble::Unplugged, "unplugged"), (Trouble::WriteFails, "a write fails")] {
        let mut rig = holding();
        let outcome = rig.after(40, |peer| peer.trouble = trouble);
        // The read fails before the tick, the write after it: its loss is seen by the next one.
        assert_eq!(outcome.zero_ms, Some(0), "{outcome:?}");
        assert_eq!(rig.fault(), Some(ServoFault::DeviceLost), "{name}");
        assert!(outcome.told.iter().any(|t| t.contains("opened again by itself")), "{outcome:?}");
        line(name, &outcome, "fault, latched");
        rig.plug_in(ArmPeer::new(ANYWHERE));
        assert_the_way_back(&mut rig, true);
    }
}

#[test]
fn a_position_jump_is_bridged_three_times_and_then_a_fault() {
    let mut rig = holding();
    let before = rig.arrived_n();
    let mut outcome = rig.after(3, |peer| peer.trouble = Trouble::Jump(800));
    assert!(outcome.zero_ms.is_none() && rig.arrived_n() <= before * 1.05, "{outcome:?}");
    rig.step_with(50, |_, peer| peer.trouble = Trouble::None);
    assert_eq!((rig.mode(), rig.fault()), (Mode::Active, None), "{:?}", rig.told());
    rig.step(2_000);
    outcome = rig.after(10, |peer| peer.trouble = Trouble::Jump(800));
    assert!(outcome.zero_ms.is_some_and(|ms| ms <= 4), "{outcome:?}");
    assert_eq!(rig.fault(), Some(ServoFault::SamplesImplausible));
    line("position jumps by 50 mm", &outcome, "fault, latched");
    rig.peer().trouble = Trouble::None;
    assert_the_way_back(&mut rig, false);
}

#[test]
fn a_button_that_is_stuck_at_the_start_gives_no_zero_and_presses_nothing() {
    let mut rig = switched_on();
    rig.step_with(5_000, |_, peer| peer.info = 1);
    let told = rig.told();
    assert!(!told.iter().any(|t| t == "calibrated"), "{told:?}");
    assert_eq!((rig.state().devices[0].press_count[0], rig.arrived_n()), (0, 0.0));
}

#[test]
fn a_firmware_that_does_not_take_its_zero_is_told_and_gives_no_force() {
    let mut rig = switched_on();
    rig.peer().trouble = Trouble::Deaf;
    rig.step(10);
    rig.step_with(1_000, |_, peer| peer.info = 1);
    let told = rig.told();
    assert!(told.iter().any(|t| t.contains("did not take the zero")), "{told:?}");
    assert_eq!((rig.mode(), rig.arrived_n()), (Mode::Init, 0.0));
}

#[test]
fn a_host_that_stands_still_loses_the_force_to_the_firmware() {
    let mut rig = holding();
    let peer = rig.peer();
    let zero_ms = (0..1_000_u32).find(|_| {
        peer.pass();
        peer.arrived_n() == 0.0
    });
    assert_eq!(zero_ms, Some(499), "0.5 s after the last report");
    println!("| the servo stands still | 500 (firmware) | supervisor ends the process | |");
}

/// The same peer behind the wire's own thread.
#[derive(Clone)]
struct SharedPeer(Arc<Mutex<ArmPeer>>);

impl WirePort for SharedPeer {
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
        let mut peer = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !wait.is_zero() {
            peer.pass();
        }
        peer.receive(buffer, wait)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).send(bytes)
    }
}

impl Opener for SharedPeer {
    type Port = Self;

    fn open(&mut self) -> Result<Self, WireError> {
        let mut peer = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        peer.trouble = Trouble::None;
        Ok(self.clone())
    }
}

#[test]
fn the_thread_of_the_wire_reads_writes_opens_again_and_ends_with_a_rest() {
    let shared = SharedPeer(Arc::new(Mutex::new(ArmPeer::new(PLACE))));
    let mut opener = shared.clone();
    let ring = NoticeRing::new(NOTICES);
    let arm = driver();
    let (mut link, ends) = cells(arm.rest());
    let pump = Pump { opener: &mut opener, port: Some(shared.clone()), ends, ring: &ring, is_sound: HidArm::is_sound };
    let peer = || shared.0.lock().unwrap_or_else(PoisonError::into_inner);
    std::thread::scope(|scope| {
        let stop = link.stop_at_the_end();
        scope.spawn(move || pump.run());
        let arrived = wait_for(LIMIT, || link.take().newest.map(|_| ()));
        assert!(arrived.is_some(), "no report arrives");
        assert!(peer().writes >= 1, "the first packet starts the stream");
        peer().trouble = Trouble::Unplugged;
        let broken = wait_for(LIMIT, || link.take().broken);
        assert_eq!(broken, Some(WireError::Gone));
        let back = wait_for(LIMIT, || Some(link.take()).filter(|a| a.generation == 1 && a.newest.is_some()));
        assert!(back.is_some_and(|arrival| arrival.broken.is_none()), "it is opened again by itself");
        peer().writes = 0;
        link.put(&arm.rest());
        drop(stop);
    });
    assert!(peer().writes >= 1, "the last packet has been sent");
    assert_eq!(peer().arrived_n(), 0.0);
    let told: Vec<String> = std::iter::from_fn(|| ring.pop()).map(|n| n.what.to_string()).collect();
    assert!(told.iter().any(|t| t.contains("is open again")), "{told:?}");
}
