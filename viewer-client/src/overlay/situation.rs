//! What the panels show beyond the view itself: the connection, the camera, what the window is doing.

use crate::camera::Camera;
use crate::colour::Legend;
use crate::notice::Notice;
use crate::samples::Samples;
use nalgebra::{Matrix4, Point3};

/// A servo state older than this is told in the banner, nanoseconds.
pub const GONE_NS: u64 = 1_000_000_000;

/// Where the pictures come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// A run that has not said anything yet.
    Waiting,
    /// A run; how old its newest servo state is, nanoseconds.
    Live(u64),
    /// The run has ended or is not answering.
    Gone,
    /// A file.
    Recorded,
}

impl Link {
    /// From the clock and the newest servo state.
    #[must_use]
    pub fn live(now_ns: u64, newest_ns: Option<u64>) -> Self {
        match newest_ns.map(|newest| now_ns.saturating_sub(newest)) {
            None => Self::Waiting,
            Some(age_ns) if age_ns > GONE_NS => Self::Gone,
            Some(age_ns) => Self::Live(age_ns),
        }
    }
}

/// Whether the mouse is the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HandMode {
    /// The server drives another device.
    #[default]
    NoPointer,
    /// It could be.
    Idle,
    /// It is.
    Hand,
}

/// What the window does with the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Picture {
    /// The newest.
    #[default]
    Running,
    /// Held still.
    Paused,
}

/// A recording that is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeLine {
    /// Where it is, seconds from the start.
    pub at_s: f64,
    /// Its length, seconds.
    pub duration_s: f64,
    /// 1 is as it was recorded.
    pub speed: f64,
    /// Whether it runs.
    pub playing: bool,
}

/// Recent times from picture to picture, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTime {
    /// Work for one picture: half of them took less.
    pub work_p50_ms: f64,
    /// Work for one picture: one in a hundred took more.
    pub work_p99_ms: f64,
    /// Pictures in the last second.
    pub per_second: f64,
}

/// All of it.
#[derive(Clone, Debug)]
pub struct Situation<'a> {
    /// Where the pictures come from.
    pub link: Link,
    /// The camera's right, up and forward.
    pub axes: [[f32; 3]; 3],
    /// Scene to clip space; `None` where nothing may be painted into the scene (side by side).
    pub projection: Option<Matrix4<f32>>,
    /// Picked nodes.
    pub samples: &'a Samples,
    /// The last sentence.
    pub notice: Option<&'a Notice>,
    /// What the colours mean.
    pub legend: Option<Legend>,
    /// Whether the picture runs.
    pub picture: Picture,
    /// Whether the mouse is the hand.
    pub hand: HandMode,
    /// The recording that is played.
    pub time_line: Option<TimeLine>,
    /// Frame times.
    pub frame_time: Option<FrameTime>,
}

impl<'a> Situation<'a> {
    /// Seen by this camera in a picture of this shape; nothing else is going on.
    #[must_use]
    pub fn seen_by(camera: &Camera, aspect: f32, link: Link, samples: &'a Samples) -> Self {
        Self {
            link,
            axes: [camera.right(), camera.up(), camera.forward()].map(Into::into),
            projection: Some(camera.view_projection(aspect)),
            samples,
            notice: None,
            legend: None,
            picture: Picture::Running,
            hand: HandMode::NoPointer,
            time_line: None,
            frame_time: None,
        }
    }

    /// Where a point of the scene lies in the picture (0 to 1, down and to the right); `None` behind the camera.
    #[must_use]
    pub fn on_picture(&self, at_m: [f32; 3]) -> Option<[f32; 2]> {
        let clip = self.projection? * Point3::from(at_m).to_homogeneous();
        (clip.w > 0.0).then(|| [0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silent_run_is_gone_and_one_that_never_spoke_is_awaited() {
        assert_eq!(Link::live(5, None), Link::Waiting);
        assert_eq!(Link::live(2 * GONE_NS, Some(2 * GONE_NS - 7)), Link::Live(7));
        assert_eq!(Link::live(3 * GONE_NS, Some(GONE_NS)), Link::Gone);
        assert_eq!(Link::live(1, Some(2)), Link::Live(0));
    }

    #[test]
    fn what_the_camera_turns_about_is_in_the_middle() {
        let (camera, samples) = (Camera::default(), Samples::default());
        let situation = Situation::seen_by(&camera, 1.5, Link::Recorded, &samples);
        let [x, y] = situation.on_picture(camera.target_m().into()).expect("in front");
        assert!((x - 0.5).abs() < 1e-5 && (y - 0.5).abs() < 1e-5);
        let behind = camera.target_m() - camera.forward() * (2.0 * camera.distance_m());
        assert_eq!(situation.on_picture(behind.into()), None);
    }
}
