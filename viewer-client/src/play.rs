//! Where a played recording stands: time, speed, playing or not. Pure; the recording itself is in `replay.rs`.

use crate::overlay::situation::TimeLine;
use crate::overlay::wish::PlayWish;

/// A step forward or back, seconds of the recording.
const STEP_S: f64 = 1.0 / 30.0;
/// Slowest and fastest speed.
const SPEEDS: (f64, f64) = (1.0 / 64.0, 16.0);

/// The time line's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    line: TimeLine,
}

impl Play {
    /// From the start, playing as recorded.
    #[must_use]
    pub fn new(duration_s: f64) -> Self {
        Self { line: TimeLine { at_s: 0.0, duration_s: duration_s.max(0.0), speed: 1.0, playing: true } }
    }

    /// For the panel.
    #[must_use]
    pub fn line(&self) -> TimeLine {
        self.line
    }

    /// Lets this much of real time pass; the end is where playing stops.
    pub fn advance(&mut self, passed_s: f64) {
        if self.line.playing && passed_s > 0.0 {
            self.line.at_s = (self.line.at_s + passed_s * self.line.speed).min(self.line.duration_s);
            self.line.playing = self.line.at_s < self.line.duration_s;
        }
    }

    /// Carries out a wish.
    pub fn fulfil(&mut self, wish: PlayWish) {
        let line = &mut self.line;
        match wish {
            PlayWish::Toggle => {
                line.playing = !line.playing;
                if line.playing && line.at_s >= line.duration_s {
                    line.at_s = 0.0;
                }
            }
            PlayWish::Back => self.go(self.line.at_s - STEP_S),
            PlayWish::Forward => self.go(self.line.at_s + STEP_S),
            PlayWish::Slower => line.speed = (line.speed / 2.0).max(SPEEDS.0),
            PlayWish::Faster => line.speed = (line.speed * 2.0).min(SPEEDS.1),
            PlayWish::Seek(at_s) => {
                if at_s.is_finite() {
                    line.at_s = at_s.clamp(0.0, line.duration_s);
                }
            }
        }
    }

    /// To a time, and stay there.
    fn go(&mut self, at_s: f64) {
        self.line.at_s = at_s.clamp(0.0, self.line.duration_s);
        self.line.playing = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_plays_at_its_speed_and_stops_at_the_end() {
        let mut play = Play::new(10.0);
        play.fulfil(PlayWish::Faster);
        play.advance(1.5);
        assert_eq!(play.line().at_s, 3.0);
        play.advance(100.0);
        assert_eq!((play.line().at_s, play.line().playing), (10.0, false));
        play.fulfil(PlayWish::Toggle);
        assert_eq!((play.line().at_s, play.line().playing), (0.0, true));
    }

    #[test]
    fn steps_hold_it_still_and_nothing_leaves_the_recording() {
        let mut play = Play::new(1.0);
        play.fulfil(PlayWish::Forward);
        play.advance(5.0);
        assert_eq!((play.line().at_s, play.line().playing), (STEP_S, false));
        for _ in 0..3 {
            play.fulfil(PlayWish::Back);
        }
        assert_eq!(play.line().at_s, 0.0);
        for (wish, at_s) in [(7.0, 1.0), (-1.0, 0.0), (0.25, 0.25), (f64::NAN, 0.25)] {
            play.fulfil(PlayWish::Seek(wish));
            assert_eq!(play.line().at_s, at_s);
        }
        for _ in 0..40 {
            play.fulfil(PlayWish::Slower);
        }
        assert_eq!(play.line().speed, SPEEDS.0);
    }
}
