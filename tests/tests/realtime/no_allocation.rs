//! No tick allocates, in any mode, on any rung, held or pulled, faulted or stopping.

use crate::allocator;
use crate::rig::{Grip, MS, Rig, Solver, params};
use haptic_server::device::{SampleQuality, ServoRoom, TickTime};
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::state_machine::Mode;
use haptic_server::servo::thread::LiveRoom;
use haptic_server::servo::tick::{Rights, Servo, StopOrder};
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
