//! A curve over time that never grows: a ring of the newest points inside a time window.
//!
//! Its memory is taken once. A full ring forgets its oldest point, so a viewer that looks faster than expected sees a
//! shorter past, not a larger memory. Times only go forward; a point from the past (a replay that was wound back, a
//! new server) begins a new curve.

/// Points that a curve keeps: 20 s at 60 pictures a second.
const CAPACITY: usize = 1200;

/// Newest values of one quantity.
#[derive(Clone, Debug)]
pub struct Series {
    points: Vec<[f64; 2]>,
    /// Where the oldest point lies once the ring is full.
    oldest: usize,
    window_s: f64,
}

impl Series {
    /// Nothing yet; points older than `window_s` seconds are not shown.
    #[must_use]
    pub fn new(window_s: f64) -> Self {
        Self { points: Vec::with_capacity(CAPACITY), oldest: 0, window_s }
    }

    /// Adds a point; values that are not finite and a time that stands still are passed over.
    pub fn push(&mut self, time_s: f64, value: f64) {
        if !time_s.is_finite() || !value.is_finite() {
            return;
        }
        match self.newest() {
            Some([last, _]) if time_s == last => return,
            Some([last, _]) if time_s < last => self.clear(),
            _ => {}
        }
        if self.points.len() < CAPACITY {
            self.points.push([time_s, value]);
        } else {
            self.points[self.oldest] = [time_s, value];
            self.oldest = (self.oldest + 1) % CAPACITY;
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.points.clear();
        self.oldest = 0;
    }

    /// Seconds that the window spans.
    #[must_use]
    pub fn window_s(&self) -> f64 {
        self.window_s
    }

    /// The last point.
    #[must_use]
    pub fn newest(&self) -> Option<[f64; 2]> {
        let count = self.points.len();
        (count > 0).then(|| self.points[(self.oldest + count - 1) % count])
    }

    /// Points inside the window, oldest first, as (seconds before the newest, negative; value).
    pub fn recent(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let end = self.newest().map_or(0.0, |p| p[0]);
        let (tail, head) = self.points.split_at(self.oldest);
        head.iter().chain(tail).map(move |p| [p[0] - end, p[1]]).filter(|p| p[0] >= -self.window_s)
    }

    /// Smallest and largest value inside the window.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        self.recent()
            .map(|p| p[1])
            .fold(None, |range, v| Some(range.map_or([v, v], |[low, high]: [f64; 2]| [low.min(v), high.max(v)])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    #[test]
    fn a_full_ring_keeps_the_newest_in_order() {
        let mut series = Series::new(1e9);
        let mut reference = VecDeque::new();
        for i in 0..(2 * CAPACITY + 17) {
            let point = [i as f64 * 0.5, (i * i) as f64];
            series.push(point[0], point[1]);
            reference.push_back(point);
            if reference.len() > CAPACITY {
                reference.pop_front();
            }
        }
        let end = series.newest().expect("full")[0];
        let shown: Vec<_> = series.recent().map(|p| [p[0] + end, p[1]]).collect();
        assert_eq!(shown, Vec::from(reference));
        assert_eq!(series.points.capacity(), CAPACITY);
    }

    #[test]
    fn the_window_ends_at_the_newest_and_the_range_is_of_the_window() {
        let mut series = Series::new(1.0);
        for (t, v) in [(0.0, 100.0), (1.5, -2.0), (2.0, 3.0), (2.5, f64::NAN), (2.0, 9.0)] {
            series.push(t, v);
        }
        assert_eq!(series.recent().collect::<Vec<_>>(), [[-0.5, -2.0], [0.0, 3.0]]);
        assert_eq!(series.range(), Some([-2.0, 3.0]));
    }

    #[test]
    fn a_step_back_in_time_begins_anew() {
        let mut series = Series::new(10.0);
        series.push(5.0, 1.0);
        series.push(1.0, 2.0);
        assert_eq!(series.recent().collect::<Vec<_>>(), [[0.0, 2.0]]);
        series.clear();
        assert_eq!((series.newest(), series.range()), (None, None));
    }
}
