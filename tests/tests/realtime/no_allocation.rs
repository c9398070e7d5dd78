//! No tick allocates, in any mode, on any rung, held or pulled, faulted or stopping.

use crate::allocator;
use crate::rig::{Grip, MS, Rig, Solver, params};
use haptic_server::cli::choice::{DeviceChoice, HandChoice, HandSide};
use haptic_server::device::{DeviceCommand, HandView, SampleQuality, ServoRoom, TickTime};
use haptic_server::hand::pointer::PointerWish;
use haptic_server::rig::{self, RigChoice};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::thread::LiveRoom;
use haptic_server::servo::tick::{Rights, Servo, StopOrder};
use haptic_server::servo_link::RunLength;
use haptic_server::servo_setup::{Recording, new_stats, open};
use protocol::servo_state::ServoState;
use sim_core::vector::Vec3;

/// What happens from which tick on.
fn script(tick: u64, rig: &mut Rig) {
    match tick {
        2_400 => rig.grip = Grip::Held,
        3_000..3_100 => rig.sample.position_m.y += 5e-5,
        3_400 => {
            rig.grip = Grip::Pulled;
            rig.epoch += 1;
        }
        3_500..3_600 => rig.sample.position_m.z += 1e-4,
        4_000 => rig.solver = Solver::Stands,
        4_500 => rig.solver = Solver::Runs,
        7_000 => rig.orders.solver_deaths = 1,
        7_400 => rig.sample.position_m.x = f64::NAN,
        7_402 => rig.sample.position_m.x = 0.004,
        7_500 => rig.sample.quality = SampleQuality::Lost,
        7_600 => {
            rig.sample.quality = SampleQuality::Fresh;
            rig.orders.rearms = 1;
        }
        9_950 => rig.orders.stop = StopOrder::Stop,
        _ => {}
    }
}

#[derive(Default)]
struct Seen {
    modes: [bool; 6],
    rungs: [bool; 5],
    handles: [bool; 4],
}

impl Seen {
    fn look(&mut self, state: &ServoState) {
        self.modes[state.mode as usize] = true;
        self.rungs[state.port_rung as usize] = true;
        self.handles[state.handles[0].mode as usize] |= state.devices[0].force_n != [0.0; 3];
        self.handles[state.handles[1].mode as usize] |= state.devices[0].force_n != [0.0; 3];
    }

    fn assert_everything(&self) {
        // Init lasts until the first tick only, so it is never left behind by one.
        assert_eq!(self.modes, [false, true, true, true, true, true], "modes");
        assert_eq!(self.rungs, [true; 5], "rungs");
        assert_eq!(self.handles, [true; 4], "handles with a force");
    }
}

#[test]
fn no_tick_of_ten_thousand_allocates() {
    let mut rig = Rig::new();
    let mut seen = Seen::default();
    let mut allocations = 0;
    assert_eq!(rig.servo.mode(), Mode::Init);
    for tick in 1..=10_050 {
        script(tick, &mut rig);
        let before = allocator::calls();
        rig.tick();
        allocations += allocator::calls() - before;
        seen.look(rig.servo.state());
    }
    assert_eq!(allocations, 0);
    assert!(rig.servo.is_stopped());
    seen.assert_everything();
}

#[test]
fn no_tick_of_the_live_room_allocates() {
    let params = params();
    let (links, ends, mut outer) = open(Recording::EveryTick);
    let mut published = 0;
    let sink = |state: &mut ServoState| published = state.ticks;
    let stats = new_stats().expect("histograms");
    let mut room = LiveRoom::new(Servo::new(&params, Rights::Full), &params, ends, sink, stats);
    // The rig only makes ports and samples here.
    let mut rig = Rig::new();
    let mut allocations = 0;
    for tick in 1..=10_000 {
        script(tick, &mut rig);
        rig.now_ns += MS;
        if let Some(port) = rig.next_port() {
            outer.ports.write(port);
        }
        let time = TickTime { scheduled_ns: rig.now_ns, now_ns: rig.now_ns, dt_s: 1e-3 };
        let before = allocator::calls();
        let command = room.tick(time, &rig.sample);
        let view = room.view();
        allocations += allocator::calls() - before;
        assert!(command.force_n.iter().all(|f| f.is_finite()));
        assert!(tick < 10 || view.valid);
    }
    let (servo, stats) = room.finish();
    assert_eq!((allocations, servo.state().ticks, published), (0, 10_000, 10_000));
    assert_eq!(stats.compute_ns.len(), 10_000);
    assert!(stats.peak_force_n > 0.5, "{}", stats.peak_force_n);
    // Nobody empties the recording's ring here: it is full, and what found no room was counted.
    let held = outer.record.as_ref().map_or(0, |ring| ring.slots() as u64);
    let lost = links.lost_records.load(std::sync::atomic::Ordering::Relaxed);
    assert_eq!(held + lost, 10_000);
}

#[test]
fn no_tick_of_a_pointer_device_allocates() {
    let rig = rig::build(&RigChoice {
        device: &DeviceChoice::Pointer,
        hand: &HandChoice::Synthetic,
        side: HandSide::Right,
        length: RunLength::Given,
        library: None,
        device_file: None,
    });
    let mut rig = rig.expect("a pointer needs nothing");
    let mut wishes = rig.wishes.take().expect("a pointer has a way for its wishes");
    let device = rig.device.pulled().expect("it is asked");
    let (mut allocations, mut buttons) = (0, 0);
    for tick in 0..6_000_u32 {
        // Several turns, places in and out of reach, some that are none, and two long silences.
        let along = f64::from(tick % 700) * 1e-3;
        let place = if tick.is_multiple_of(50) { f64::NAN } else { along - 0.3 };
        let (buttons_wished, turn) = (u32::from(tick % 400 > 100), 1 + tick / 1_500);
        let is_silent = (2_000..3_200).contains(&tick) || (5_000..5_500).contains(&tick);
        let scheduled_ns = u64::from(tick) * MS;
        let time = TickTime { scheduled_ns, now_ns: scheduled_ns, dt_s: 1e-3 };
        let before = allocator::calls();
        if !is_silent {
            wishes.write(PointerWish { position_m: Vec3::new(place, along, 0.0), buttons: buttons_wished, turn });
        }
        let sample = device.sample(time, &HandView::unseen());
        device.command(DeviceCommand { force_n: Vec3::new(along, 0.0, 0.1) });
        allocations += allocator::calls() - before;
        buttons += sample.buttons;
    }
    assert_eq!(allocations, 0);
    assert!(buttons > 1_000, "the button was down for {buttons} ticks only");
}

#[test]
fn even_a_servo_that_was_suspended_in_mid_pull_does_not_allocate() {
    let mut rig = Rig::holding();
    rig.wakefulness = Wakefulness::Suspended;
    let before = allocator::calls();
    rig.tick_after(400);
    assert_eq!(allocator::calls() - before, 0);
    assert_eq!(rig.servo.mode(), Mode::Fault);
    rig.wakefulness = Wakefulness::Awake;
    rig.run(20);
    assert_eq!(rig.last_force, Vec3::zeros());
}
