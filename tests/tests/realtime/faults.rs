//! Faults latch at zero force; only the operator leads out; a stop order fades.

use crate::rig::{Grip, MS, Rig, ZERO_N};
use haptic_server::device::SampleQuality;
use haptic_server::servo::clock::Wakefulness;
use haptic_server::servo::events::EventKind;
use haptic_server::servo::state_machine::{Mode, ServoFault};
use haptic_server::servo::tick::StopOrder;
use sim_core::vector::Vec3;

/// From the peak at 0.5 N per tick, with the filter's tail.
const TICKS_TO_ZERO: u64 = 20;

fn assert_latched(rig: &mut Rig, fault: ServoFault) {
    assert_eq!((rig.servo.mode(), rig.servo.state().fault), (Mode::Fault, fault.code()));
    rig.run(TICKS_TO_ZERO);
    assert_eq!(rig.last_force, Vec3::zeros());
    rig.sample.quality = SampleQuality::Fresh;
    rig.run(1_000);
    assert_eq!((rig.servo.mode(), rig.last_force), (Mode::Fault, Vec3::zeros()), "a fault is left by nobody");
}

#[test]
fn a_lost_device_is_a_fault_at_once() {
    let mut rig = Rig::holding();
    rig.sample.quality = SampleQuality::Lost;
    let events = rig.run(1);
    assert!(events.contains(&EventKind::Faulted(ServoFault::DeviceLost)));
    assert_latched(&mut rig, ServoFault::DeviceLost);
}

#[test]
fn stale_samples_fade_and_the_twentieth_is_a_fault() {
    let mut rig = Rig::holding();
    rig.sample.quality = SampleQuality::Stale;
    rig.run(5);
    let at_five = rig.last_force.norm();
    rig.run(10);
    assert!(rig.last_force.norm() < 0.6 * at_five);
    rig.run(4);
    assert_eq!(rig.servo.mode(), Mode::Active);
    rig.run(1);
    assert_latched(&mut rig, ServoFault::SamplesStale);
}

#[test]
fn a_glitch_moves_nothing_and_the_fourth_in_a_row_is_a_fault() {
    let mut rig = Rig::holding();
    let (steady, place) = (rig.last_force, rig.sample.position_m);
    for _ in 0..3 {
        rig.sample.position_m = place + Vec3::new(0.1, 0.0, 0.0);
        rig.run(3);
        assert!((rig.last_force - steady).norm() < 1e-3);
        rig.sample.position_m = place;
        rig.run(2);
        assert!((rig.last_force - steady).norm() < 1e-3);
    }
    rig.sample.position_m = place + Vec3::new(0.1, 0.0, 0.0);
    rig.run(4);
    assert_latched(&mut rig, ServoFault::SamplesImplausible);
}

#[test]
fn missed_ticks_are_counted_and_twenty_in_a_row_are_a_fault() {
    for (missed, mode) in
        [(1, Mode::Active), (5, Mode::Active), (19, Mode::Active), (20, Mode::Fault), (100, Mode::Fault)]
    {
        let mut rig = Rig::holding();
        let before = rig.last_force;
        let output = rig.tick_after(missed);
        assert!(output.events.as_slice().iter().any(|e| e.kind == EventKind::TicksMissed(missed)));
        assert_eq!((rig.servo.mode(), rig.servo.state().missed), (mode, missed), "{missed} missed");
        // A gap buys no jump: two periods' worth of slew at most.
        assert!((rig.last_force - before).norm() <= 1.0 + 1e-12);
        if mode == Mode::Fault {
            assert_latched(&mut rig, ServoFault::DeadlineMissed);
        }
    }
    let mut rig = Rig::holding();
    for _ in 0..20 {
        assert_eq!(rig.servo.mode(), Mode::Active);
        rig.tick_after(1);
    }
    assert_eq!(rig.servo.state().fault, ServoFault::DeadlineMissed.code());
}

#[test]
fn a_suspend_is_a_fault() {
    let mut rig = Rig::holding();
    rig.wakefulness = Wakefulness::Suspended;
    rig.run(1);
    rig.wakefulness = Wakefulness::Awake;
    assert_latched(&mut rig, ServoFault::Suspended);
}

#[test]
fn the_operator_re_arms_by_command_or_by_the_back_button_and_passes_the_ramp() {
    for by_button in [0, 2] {
        let mut rig = Rig::holding();
        rig.sample.quality = SampleQuality::Lost;
        rig.run(1);
        rig.sample.quality = SampleQuality::Fresh;
        rig.grip = Grip::Free;
        // The front button sutures; it does not re-arm.
        rig.sample.buttons = 1;
        rig.run(50);
        assert_eq!(rig.servo.mode(), Mode::Fault);
        rig.sample.buttons = by_button;
        rig.orders.rearms += u32::from(by_button == 0);
        let events = rig.run(3);
        assert!(events.contains(&EventKind::Rearmed));
        assert_eq!((rig.servo.mode(), rig.servo.state().fault), (Mode::Monitor, 0));
        rig.run(200);
        assert_eq!(rig.servo.mode(), Mode::Ramp);
    }
}

#[test]
fn a_re_arm_while_the_cause_lasts_stays_in_fault() {
    let mut rig = Rig::holding();
    rig.sample.quality = SampleQuality::Lost;
    rig.run(1);
    rig.orders.rearms += 1;
    rig.run(100);
    assert_eq!(rig.servo.mode(), Mode::Fault);
    // The order is spent: it does not act when the device comes back by itself.
    rig.sample.quality = SampleQuality::Fresh;
    rig.run(100);
    assert_eq!(rig.servo.mode(), Mode::Fault);
}

#[test]
fn a_stop_order_fades_within_its_time() {
    let mut rig = Rig::holding();
    rig.orders.stop = StopOrder::Stop;
    let events = rig.run(25);
    assert!(events.contains(&EventKind::Stopping));
    let half = rig.last_force.norm();
    assert!(half > 0.3 && !rig.servo.is_stopped());
    rig.run(25);
    // 50 ms of fade; what the filter still holds is below a tenth.
    assert!(rig.last_force.norm() < 0.05);
    rig.run(10);
    assert!(rig.servo.is_stopped());
    assert!(rig.last_force.norm() < ZERO_N);
}

#[test]
fn broken_ports_are_refused_and_age_like_missing_ones() {
    let mut rig = Rig::holding();
    let mut broken = crate::rig::port(Grip::Held, rig.epoch, 1 << 40, rig.now_ns);
    broken.handles[0].mass_kg = -1.0;
    rig.solver = crate::rig::Solver::Stands;
    let mut refused = 0;
    for _ in 0..12 {
        rig.now_ns += MS;
        broken.publish_ns = rig.now_ns;
        let time = haptic_server::device::TickTime { scheduled_ns: rig.now_ns, now_ns: rig.now_ns, dt_s: 1e-3 };
        let input = haptic_server::servo::tick::TickInput {
            time,
            sample: &rig.sample,
            new_port: Some(&broken),
            orders: rig.orders,
            wakefulness: Wakefulness::Awake,
        };
        let output = rig.servo.tick(&input);
        refused += output.events.as_slice().iter().filter(|e| matches!(e.kind, EventKind::PortRefused(_))).count();
    }
    assert_eq!(refused, 12);
    assert_eq!(rig.servo.state().port_rung, 1);
}
