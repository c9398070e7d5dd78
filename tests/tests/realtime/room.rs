//! The room on a thread, against the wall clock; what is asserted is order and counts, never durations.

use crate::rig::{Grip, params, port};
use haptic_server::device::{DeviceCommand, DeviceSample, HandView, PulledDevice, SampleQuality, TickTime, run_pulled};
use haptic_server::servo::events::EventKind;
use haptic_server::servo::thread::LiveRoom;
use haptic_server::servo::tick::{Rights, Servo};
use haptic_server::servo_setup::{Recording, new_stats, open};
use protocol::servo_state::ServoState;
use sim_core::vector::Vec3;
use std::sync::atomic::Ordering;

/// A device that stands still and remembers when it was asked.
#[derive(Default)]
struct StillDevice {
    scheduled_ns: Vec<u64>,
    last_command: Option<DeviceCommand>,
}

impl PulledDevice for StillDevice {
    fn sample(&mut self, time: TickTime, _view: &HandView) -> DeviceSample {
        self.scheduled_ns.push(time.scheduled_ns);
        DeviceSample {
            time_ns: time.now_ns,
            position_m: Vec3::zeros(),
            velocity_m_per_s: Vec3::zeros(),
            orientation: [0.0, 0.0, 0.0, 1.0],
            buttons: 0,
            quality: SampleQuality::Fresh,
        }
    }

    fn command(&mut self, command: DeviceCommand) {
        self.last_command = Some(command);
    }
}

#[test]
fn the_loop_keeps_its_grid_takes_the_newest_port_and_ends_on_the_stop_order() {
    let params = params();
    let (links, ends, mut outer) = open(Recording::EveryTick);
    let mut device = StillDevice::default();
    let mut states: Vec<ServoState> = Vec::with_capacity(10_000);
    let sink = |state: &mut ServoState| states.push(*state);
    let room = LiveRoom::new(Servo::new(&params, Rights::Degraded), &params, ends, sink, new_stats().expect("bounds"));
    let (servo, stats) = std::thread::scope(|scope| {
        let running = scope.spawn(|| {
            let mut room = room;
            run_pulled(&mut device, &mut room);
            room.finish()
        });
        while links.ticks.load(Ordering::Relaxed) < 20 {
            std::thread::yield_now();
        }
        // Three at once: the cell keeps the newest.
        for sequence in 1..=3 {
            outer.ports.write(port(Grip::Free, 7, sequence, protocol::ports::monotonic_ns()));
        }
        let heard = links.ticks.load(Ordering::Relaxed);
        while links.ticks.load(Ordering::Relaxed) < heard + 20 {
            std::thread::yield_now();
        }
        links.order_stop();
        running.join().expect("servo thread")
    });

    let state = servo.state();
    assert_eq!((state.port_sequence, state.port_epoch), (3, 7));
    assert_eq!(state.flags, 3, "degraded and stopping");
    assert_eq!(device.last_command.map(|c| c.force_n), Some(Vec3::zeros()));
    let ticks = device.scheduled_ns.len() as u64;
    assert_eq!((state.ticks, stats.wake_ns.len()), (ticks, ticks));
    assert_eq!(states.len() as u64, ticks);
    assert_eq!(outer.record.as_ref().map(|ring| ring.slots() as u64), Some(ticks));
    // Every tick sits on the grid, and what is missing on it was counted.
    let steps: Vec<u64> = device.scheduled_ns.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(steps.iter().all(|step| *step > 0 && step.is_multiple_of(params.period_ns())));
    let skipped: u64 = steps.iter().map(|step| step / params.period_ns() - 1).sum();
    assert_eq!(state.missed, skipped);
    let is_stopping = std::iter::from_fn(|| outer.events.pop().ok()).any(|e| e.kind == EventKind::Stopping);
    assert!(is_stopping);
}
