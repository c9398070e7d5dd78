//! One frame of the library as a sample of the servo: millimetres become metres, the device's frame the scene's.
//!
//! The velocity is our own (`velocity_filter.rs`), not the library's smoothed one, whose delay is not documented. The
//! rotation is made orthogonal again, since the library's is not quite. Numbers that are none go through to the servo's
//! gate, which refuses them; the filter does not see them.
//! Also here: the sign of a configuration that was read with a decimal comma: every link length, reduction and offset is
//! cut to its whole part, and the position stays at (0, −110, −35) mm exactly.

use crate::device::frame::SceneFromDevice;
use crate::device::velocity_filter::VelocityFilter;
use crate::device::{DeviceSample, SampleQuality, TickTime};
use sim_core::vector::{Mat3, Vec3};

/// The place of an arm whose joints all read zero, millimetres.
const ZERO_JOINTS_MM: [f64; 3] = [0.0, -110.0, -35.0];
/// Within this distance of it, millimetres: the library computes in single precision.
const SAME_MM: f64 = 1e-4;
/// So many ticks there in a row are no chance: nobody holds a stylus within one encoder count for so long.
const COMMA_TICKS: u32 = 500;

/// What the library gave in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    /// Millimetres.
    pub(super) position_mm: [f64; 3],
    /// Column by column.
    pub(super) transform: [f64; 16],
    /// Mask.
    pub(super) buttons: i32,
}

/// From readings to samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    frame: SceneFromDevice,
    filter: VelocityFilter,
    last: DeviceSample,
    at_zero: u32,
}

impl Sampler {
    pub(super) fn new(frame: SceneFromDevice) -> Self {
        Self {
            frame,
            filter: VelocityFilter::default(),
            last: DeviceSample::resting(frame.translation_m()),
            at_zero: 0,
        }
    }

    /// Where the device stands.
    pub(super) fn frame(&self) -> SceneFromDevice {
        self.frame
    }

    /// Forgets the motion so far: the position is about to jump.
    pub(super) fn restart(&mut self) {
        self.filter = VelocityFilter::default();
    }

    /// The sample of a reading.
    pub(super) fn sample(&mut self, reading: &Reading, time: TickTime, quality: SampleQuality) -> DeviceSample {
        let device_mm = Vec3::from(reading.position_mm);
        let position_m = self.frame.point(device_mm * 1e-3);
        let is_finite = position_m.iter().all(|c| c.is_finite());
        self.at_zero = if (device_mm - Vec3::from(ZERO_JOINTS_MM)).amax() < SAME_MM { self.at_zero + 1 } else { 0 };
        let velocity_m_per_s =
            if is_finite { self.filter.update(position_m, time.dt_s) } else { self.last.velocity_m_per_s };
        let orientation = orthogonal(&reading.transform).map_or(self.last.orientation, |r| self.frame.orientation(&r));
        self.last = DeviceSample {
            time_ns: time.now_ns,
            position_m: if is_finite { position_m } else { self.last.position_m },
            velocity_m_per_s,
            orientation,
            buttons: reading.buttons.cast_unsigned(),
            quality,
        };
        DeviceSample { position_m, ..self.last }
    }

    /// The last good sample with another worth.
    pub(super) fn last(&self, time: TickTime, quality: SampleQuality) -> DeviceSample {
        DeviceSample { time_ns: time.now_ns, velocity_m_per_s: Vec3::zeros(), quality, ..self.last }
    }

    /// Whether the pose has the sign of the decimal comma (told in one tick only).
    pub(super) fn shows_decimal_comma(&self) -> bool {
        self.at_zero == COMMA_TICKS
    }

    /// A force of the scene on the device's axes.
    pub(super) fn device_force(&self, scene_n: Vec3) -> Vec3 {
        self.frame.inverse_vector(scene_n)
    }
}

/// The rotation of a transform, orthogonal; `None` when there is none in it.
fn orthogonal(transform: &[f64; 16]) -> Option<Mat3> {
    let column = |i: usize| Vec3::new(transform[4 * i], transform[4 * i + 1], transform[4 * i + 2]);
    let unit = |v: Vec3| Some(v.norm()).filter(|n| *n > 0.5 && n.is_finite()).map(|n| v / n);
    let x = unit(column(0))?;
    let y = unit(column(1) - x * x.dot(&column(1)))?;
    Some(Mat3::from_columns(&[x, y, x.cross(&y)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::omni;

    fn time(tick: u64) -> TickTime {
        TickTime { scheduled_ns: tick * 1_000_000, now_ns: tick * 1_000_000, dt_s: 1e-3 }
    }

    fn reading(position_mm: [f64; 3], rotation: &Mat3) -> Reading {
        let mut transform = [0.0; 16];
        for column in 0..3 {
            transform[4 * column..4 * column + 3].copy_from_slice(rotation.column(column).as_slice());
        }
        Reading { position_mm, transform, buttons: 2 }
    }

    #[test]
    fn millimetres_become_metres_of_the_scene_and_the_velocity_is_ours() {
        let mut sampler = Sampler::new(SceneFromDevice::workspace_at(Vec3::new(0.0, 0.0, 0.02)));
        let mut sample = DeviceSample::resting(Vec3::zeros());
        for tick in 1..200 {
            let y = 0.05 * tick as f64;
            sample = sampler.sample(&reading([10.0, y, -5.0], &Mat3::identity()), time(tick), SampleQuality::Fresh);
        }
        assert!((sample.position_m - Vec3::new(0.01, 0.005, 0.02 + 0.05 * 0.199)).amax() < 1e-12);
        assert!((sample.velocity_m_per_s - Vec3::new(0.0, 0.0, 0.05)).amax() < 1e-6, "{}", sample.velocity_m_per_s);
        assert_eq!(sample.buttons, 2);
        assert_eq!(sampler.device_force(Vec3::z()), Vec3::y());
    }

    #[test]
    fn a_rotation_that_is_not_quite_one_gives_a_unit_quaternion() {
        let exact = omni::stylus_rotation(Vec3::new(0.3, 0.7, 0.2), Vec3::new(0.2, -0.4, 0.6));
        let mut sampler = Sampler::new(SceneFromDevice::workspace_at(Vec3::zeros()));
        let slack = exact * 1.01 + Mat3::from_element(1e-3);
        let fuzzy = sampler.sample(&reading([0.0; 3], &slack), time(1), SampleQuality::Fresh).orientation;
        let sharp = sampler.sample(&reading([0.0; 3], &exact), time(2), SampleQuality::Fresh).orientation;
        assert!((fuzzy.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(fuzzy.iter().zip(sharp).all(|(a, b)| (a - b).abs() < 3e-3));
    }

    #[test]
    fn garbage_is_passed_on_once_and_never_into_the_filter() {
        let mut sampler = Sampler::new(SceneFromDevice::workspace_at(Vec3::zeros()));
        sampler.sample(&reading([1.0, 0.0, 0.0], &Mat3::identity()), time(1), SampleQuality::Fresh);
        let broken = Reading { position_mm: [f64::NAN; 3], transform: [f64::NAN; 16], buttons: 0 };
        let sample = sampler.sample(&broken, time(2), SampleQuality::Fresh);
        assert!(sample.position_m.x.is_nan() && sample.orientation.iter().all(|c| c.is_finite()));
        let sample = sampler.sample(&reading([1.0, 0.0, 0.0], &Mat3::identity()), time(3), SampleQuality::Fresh);
        assert!(sample.velocity_m_per_s.norm() < 1e-9);
        assert!(sampler.last(time(4), SampleQuality::Lost).position_m.x > 0.0);
    }

    #[test]
    fn the_place_of_the_decimal_comma_is_noticed_once() {
        let mut sampler = Sampler::new(SceneFromDevice::workspace_at(Vec3::zeros()));
        let noticed = |sampler: &mut Sampler, at: [f64; 3]| {
            (0..2_000)
                .filter(|tick| {
                    sampler.sample(&reading(at, &Mat3::identity()), time(*tick), SampleQuality::Fresh);
                    sampler.shows_decimal_comma()
                })
                .count()
        };
        assert_eq!(noticed(&mut sampler, ZERO_JOINTS_MM), 1);
        assert_eq!(noticed(&mut sampler, [0.0, -110.0, -35.1]), 0);
    }
}
