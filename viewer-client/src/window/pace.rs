//! When to look and when to draw: at the display's rate while something happens, seldom when nothing does, and never so often
//! that drawing takes more than some three quarters of the time. Pure; seconds since the viewer's start.

/// From picture to picture while something happens.
const LIVELY_S: f64 = 1.0 / 60.0;
/// When nothing new came for a moment.
const CALM_S: f64 = 0.1;
/// When nothing new came for longer, or nobody can see the window.
const ASLEEP_S: f64 = 0.25;
/// So long after the last news things are lively, and calm.
const NEWS_S: (f64, f64) = (0.5, 5.0);
/// A picture's work may fill at most the inverse of this part of the time.
const SHARE: f64 = 1.3;
/// A rest is no longer than this, however long a picture took: the first one compiles shaders.
const LONGEST_REST_S: f64 = 0.1;
/// Pictures whose times are kept.
const KEPT: usize = 128;

/// Whether anybody can see the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// Perhaps.
    Visible,
    /// It is covered or minimised.
    Hidden,
}

/// The rhythm of one window.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    seen: Seen,
    news_s: f64,
    /// Starts of pictures and the work for each, the newest last.
    starts_s: [f64; KEPT],
    work_s: [f64; KEPT],
    count: usize,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self { seen: Seen::Visible, news_s: 0.0, starts_s: [0.0; KEPT], work_s: [0.0; KEPT], count: 0 }
    }

    /// Something new came, or a person did something.
    pub(super) fn news(&mut self, now_s: f64) {
        self.news_s = now_s;
    }

    pub(super) fn see(&mut self, seen: Seen) {
        self.seen = seen;
    }

    pub(super) fn seen(&self) -> Seen {
        self.seen
    }

    /// A picture was drawn.
    pub(super) fn drew(&mut self, start_s: f64, work_s: f64) {
        self.starts_s[self.count % KEPT] = start_s;
        self.work_s[self.count % KEPT] = work_s;
        self.count += 1;
    }

    /// Pictures drawn so far.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// When to look next.
    pub(super) fn next_s(&self, now_s: f64, looked_s: f64) -> f64 {
        let quiet_s = now_s - self.news_s;
        let period_s = match self.seen {
            Seen::Hidden => ASLEEP_S,
            Seen::Visible if quiet_s > NEWS_S.1 => ASLEEP_S,
            Seen::Visible if quiet_s > NEWS_S.0 => CALM_S,
            Seen::Visible => LIVELY_S,
        };
        let newest = self.count.checked_sub(1).map(|last| last % KEPT);
        let rest_s = |work_s: f64| ((SHARE - 1.0) * work_s).min(LONGEST_REST_S);
        let rested_s = newest.map_or(0.0, |i| self.starts_s[i] + self.work_s[i] + rest_s(self.work_s[i]));
        (looked_s + period_s).max(rested_s)
    }

    /// Half of the pictures took less, one in a hundred took more, milliseconds; and pictures in the last second.
    pub(super) fn times(&self, now_s: f64) -> Option<(f64, f64, f64)> {
        let kept = self.count.min(KEPT);
        if kept < 10 {
            return None;
        }
        let mut sorted = self.work_s;
        let sorted = &mut sorted[..kept];
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| 1e3 * sorted[((kept - 1) as f64 * part).round() as usize];
        let recent = self.starts_s[..kept].iter().filter(|start| now_s - **start <= 1.0).count();
        Some((at(0.5), at(0.99), recent as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lively_calm_asleep() {
        let mut pace = Pace::new();
        pace.news(10.0);
        assert_eq!(pace.next_s(10.1, 10.1), 10.1 + LIVELY_S);
        assert_eq!(pace.next_s(11.0, 11.0), 11.0 + CALM_S);
        assert_eq!(pace.next_s(20.0, 20.0), 20.0 + ASLEEP_S);
        pace.news(20.0);
        pace.see(Seen::Hidden);
        assert_eq!(pace.next_s(20.0, 20.0), 20.0 + ASLEEP_S);
    }

    #[test]
    fn slow_pictures_leave_time_for_others() {
        let mut pace = Pace::new();
        pace.news(0.2);
        pace.drew(0.1, 0.2);
        assert!((pace.next_s(0.3, 0.1) - (0.1 + SHARE * 0.2)).abs() < 1e-12);
        pace.news(5.0);
        pace.drew(1.0, 4.0);
        assert!((pace.next_s(5.0, 1.0) - (5.0 + LONGEST_REST_S)).abs() < 1e-12);
    }

    #[test]
    fn percentiles_are_those_of_a_sorted_list() {
        let mut pace = Pace::new();
        assert_eq!(pace.times(0.0), None);
        for i in 0..300 {
            let work_ms = f64::from((i * 37) % 100);
            pace.drew(f64::from(i) * 0.01, 1e-3 * work_ms);
        }
        let (p50, p99, per_second) = pace.times(2.995).expect("enough");
        let mut last: Vec<f64> = (172..300).map(|i| f64::from((i * 37) % 100)).collect();
        last.sort_by(f64::total_cmp);
        assert!((p50 - last[64]).abs() < 1e-9 && (p99 - last[126]).abs() < 1e-9, "{p50} {p99}");
        assert_eq!(per_second, 100.0);
    }
}
