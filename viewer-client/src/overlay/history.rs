//! What the viewer has seen over the last seconds: force, gap of the pair at work, wake-up spread of the servo.
//!
//! The servo ticks on a grid of one millisecond and skips what it misses, so a state's time minus its place on that
//! grid, `time − 1 ms · (ticks + missed)`, is constant but for the jitter of its tick. The viewer sees one tick in some dozen:
//! the spread it tells is that of the ticks it saw, not of all.

use crate::feed::View;
use crate::series::Series;

/// Seconds of force and gap that are shown.
const SHOWN_S: f64 = 10.0;
/// Seconds over which the spread is taken.
const SPREAD_S: f64 = 2.0;
/// Period of the servo, nanoseconds.
const PERIOD_NS: u64 = 1_000_000;
/// States that make a spread worth telling.
const ENOUGH: usize = 20;

/// Distance of the pair at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Suture pair, from 0.
    pub pair: u32,
    /// Distance of its two points, metres.
    pub distance_m: f64,
}

/// Curves over time.
#[derive(Clone, Debug)]
pub(super) struct History {
    pub(super) force: Series,
    pub(super) gap: Series,
    /// Place on the grid of each state seen, microseconds from the first.
    wake: Series,
    origin: Option<(u64, u64)>,
    /// Pair and generation whose gap is in the curve.
    followed: (u32, u32),
    missed_at_start: Option<u64>,
}

impl Default for History {
    fn default() -> Self {
        Self {
            force: Series::new(SHOWN_S),
            gap: Series::new(SHOWN_S),
            wake: Series::new(SPREAD_S),
            origin: None,
            followed: (0, 0),
            missed_at_start: None,
        }
    }
}

impl History {
    /// Takes in what the view holds; a view that was taken in before adds nothing.
    pub(super) fn take(&mut self, view: &View) {
        if let Some(servo) = &view.servo {
            let time_s = servo.header.time_ns as f64 * 1e-9;
            let force = servo.devices.iter().map(|d| norm(&d.force_n)).fold(0.0, f64::max);
            self.force.push(time_s, force);
            self.missed_at_start.get_or_insert(servo.missed);
            let slot = servo.ticks.saturating_add(servo.missed);
            let origin = *self.origin.get_or_insert((servo.header.time_ns, slot));
            match off_grid_us(origin, (servo.header.time_ns, slot)) {
                Some(off_us) => self.wake.push(time_s, off_us),
                None => {
                    // Another run, or a replay that was wound back.
                    self.origin = None;
                    self.wake.clear();
                }
            }
        }
        if let Some(gap) = gap(view) {
            let followed = (gap.pair, view.frame.header.scene_generation);
            if followed != self.followed {
                self.gap.clear();
                self.followed = followed;
            }
            self.gap.push(view.frame.header.sim_time_s, gap.distance_m);
        } else {
            self.gap.clear();
        }
    }

    /// Spread of the wake-ups that were seen, microseconds; `None` while there are too few.
    pub(super) fn wake_spread_us(&self) -> Option<f64> {
        let range = self.wake.range()?;
        (self.wake.recent().count() >= ENOUGH).then(|| range[1] - range[0])
    }

    /// Ticks missed since this viewer looks.
    pub(super) fn missed_since(&self, missed: u64) -> u64 {
        missed.saturating_sub(self.missed_at_start.unwrap_or(missed))
    }
}

/// Microseconds by which a state is off the grid that the first one began; `None` when it lies before that.
fn off_grid_us(first: (u64, u64), now: (u64, u64)) -> Option<f64> {
    let time = now.0.checked_sub(first.0)?;
    let grid = now.1.checked_sub(first.1)?.checked_mul(PERIOD_NS)?;
    Some((time as f64 - grid as f64) * 1e-3)
}

/// The pair at work and its distance: the pair in the hand, else the first one without a stitch.
#[must_use]
pub fn gap(view: &View) -> Option<Gap> {
    let parts = view.outline_of_frame()?;
    let report = view.report.as_ref()?;
    let in_hand = view.servo.iter().flat_map(|s| &s.handles).find(|h| h.mode != 0).map(|h| h.pair);
    let rows = report.rows.get(..report.row_count as usize).unwrap_or(&[]);
    let tied = |pair: u32| rows.iter().any(|row| row.scene_index == report.scene_index && row.pair == pair);
    let count = (parts.pairs.len() / 2) as u32;
    let pair = in_hand.or_else(|| (0..count).find(|pair| !tied(*pair)))?;
    let nodes = parts.pairs.get(2 * pair as usize..2 * pair as usize + 2)?;
    let [left, right] = [nodes[0], nodes[1]].map(|n| view.frame.elements.get(n as usize).map(|n| n.position_m));
    let (left, right) = (left?, right?);
    let apart = [0, 1, 2].map(|k| f64::from(left[k] - right[k]));
    Some(Gap { pair, distance_m: norm(&apart) })
}

/// |v|.
pub(super) fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::example;

    #[test]
    fn the_pair_in_the_hand_is_at_work_else_the_first_without_a_stitch() {
        let mut view = example::view();
        let tied = view.report.as_ref().map_or(0, |r| r.row_count);
        assert_eq!(gap(&view).map(|g| g.pair), Some(tied));
        if let Some(servo) = &mut view.servo {
            servo.handles[0].mode = 1;
            servo.handles[0].pair = 0;
        }
        let found = gap(&view).expect("a pair");
        // The example's pairs are 10 mm apart, in single precision.
        assert_eq!(found.pair, 0);
        assert!((found.distance_m - 0.010).abs() < 1e-8, "{found:?}");
        view.outlines = 0;
        assert_eq!(gap(&view), None);
    }

    #[test]
    fn missed_ticks_are_not_jitter_and_a_late_tick_is() {
        let mut history = History::default();
        let mut view = example::view();
        let mut state = view.servo.take().expect("a servo state");
        for i in 0..100_u64 {
            state.ticks = 16 * i;
            state.missed = i / 10;
            let late_ns = if i == 60 { 40_000 } else { 0 };
            state.header.time_ns = 5_000_000_000 + PERIOD_NS * (state.ticks + state.missed) + late_ns;
            view.servo = Some(state);
            history.take(&view);
        }
        let spread = history.wake_spread_us().expect("enough states");
        assert!((spread - 40.0).abs() < 1e-6, "{spread}");
        assert_eq!(history.missed_since(state.missed), 9);
        assert_eq!(off_grid_us((10, 10), (9, 11)), None);
    }
}
