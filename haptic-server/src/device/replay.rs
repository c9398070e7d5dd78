//! Open-loop device: the recorded hand's pose is the device pose, and the force moves nothing.
//!
//! For latency work and for driving a server with a known input. The last force is kept and can be
//! read back. The pose is that of the scheduled time, and the time stamp says so. A replay can never show an instability, because no force returns into the motion: use the
//! simulated device for that. Metres, scene frame; no heap after construction.
//! Deliberately absent: encoder rounding (the recording has its own), mass, friction.

use crate::device::velocity_filter::VelocityFilter;
use crate::device::{
    Device, DeviceCommand, DeviceLimits, DeviceSample, HandView, PulledDevice, SampleQuality, ServoRoom, TickTime,
    run_pulled,
};
use crate::hand::Hand;
use sim_core::vector::Vec3;

/// A hand that is the device.
pub struct ReplayDevice {
    hand: Box<dyn Hand>,
    filter: VelocityFilter,
    start_ns: Option<u64>,
    last_ns: u64,
    sample: DeviceSample,
    force_n: Vec3,
}

impl ReplayDevice {
    /// A device that shows the hand's wish as its pose.
    #[must_use]
    pub fn new(hand: Box<dyn Hand>) -> Self {
        Self {
            hand,
            filter: VelocityFilter::default(),
            start_ns: None,
            last_ns: 0,
            sample: DeviceSample::resting(Vec3::zeros()),
            force_n: Vec3::zeros(),
        }
    }

    /// The force that a real device would have rendered last, newtons, scene frame.
    #[must_use]
    pub fn last_force_n(&self) -> Vec3 {
        self.force_n
    }
}

impl PulledDevice for ReplayDevice {
    fn sample(&mut self, time: TickTime, view: &HandView) -> DeviceSample {
        let start_ns = *self.start_ns.get_or_insert(time.scheduled_ns);
        let since_start_s = time.scheduled_ns.saturating_sub(start_ns) as f64 * 1e-9;
        let wish = self.hand.target(since_start_s, view);
        if !wish.position_m.iter().all(|c| c.is_finite()) {
            self.sample = DeviceSample { time_ns: time.scheduled_ns, quality: SampleQuality::Stale, ..self.sample };
            return self.sample;
        }
        let dt_s = time.scheduled_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = time.scheduled_ns;
        self.sample = DeviceSample {
            time_ns: time.scheduled_ns,
            position_m: wish.position_m,
            velocity_m_per_s: self.filter.update(wish.position_m, dt_s),
            buttons: wish.buttons,
            quality: SampleQuality::Fresh,
            ..self.sample
        };
        self.sample
    }

    fn command(&mut self, command: DeviceCommand) {
        self.force_n = command.force_n;
    }
}

impl Device for ReplayDevice {
    fn name(&self) -> &str {
        "replay"
    }

    fn limits(&self) -> DeviceLimits {
        DeviceLimits::OMNI
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        run_pulled(self, room);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::HandTarget;

    struct Sweep;

    impl Hand for Sweep {
        fn target(&mut self, time_s: f64, _view: &HandView) -> HandTarget {
            let x = if time_s > 0.8 { f64::NAN } else { 0.05 * time_s };
            HandTarget { position_m: Vec3::new(x, 0.0, 0.0), buttons: u32::from(time_s >= 0.5) }
        }
    }

    #[test]
    fn the_pose_is_the_hand_and_force_moves_nothing() {
        let mut device = ReplayDevice::new(Box::new(Sweep));
        let view = HandView::unseen();
        for tick in 0..=700_u64 {
            let now = 5_000_000_000 + tick * 1_000_000;
            let sample = device.sample(TickTime { scheduled_ns: now, now_ns: now + 40_000, dt_s: 1e-3 }, &view);
            assert!((sample.position_m.x - 0.05 * tick as f64 * 1e-3).abs() < 1e-12);
            assert_eq!(sample.buttons, u32::from(tick >= 500));
            assert_eq!(sample.time_ns, now, "the pose is that of the scheduled time");
            if tick > 100 {
                assert!((sample.velocity_m_per_s.x - 0.05).abs() < 1e-6);
            }
            device.command(DeviceCommand { force_n: Vec3::new(1.0, 2.0, 3.0) });
        }
        assert_eq!(device.last_force_n(), Vec3::new(1.0, 2.0, 3.0));
        let late = TickTime { scheduled_ns: 6_000_000_000, now_ns: 6_000_000_000, dt_s: 0.3 };
        assert_eq!(device.sample(late, &view).quality, SampleQuality::Stale, "no pose is better than a wrong one");
    }
}
