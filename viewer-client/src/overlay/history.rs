//! What the viewer has seen over the last seconds: force, gap of the pair at work, wake-up spread of the servo.
//!
//! The servo ticks on a grid of its period T and skips what it misses, so a state's time minus its place on that
//! grid, `time − T · (ticks + missed)`, is constant but for the jitter of its tick. The viewer sees one tick in some dozen:
//! the spread it tells is that of the ticks it saw, not of all.

use crate::feed::View;
use crate::series::Series;

/// Seconds of force and gap that are shown.
const SHOWN_S: f64 = 10.0;
/// Seconds over which the spread is taken.
const SPREAD_S: f64 = 2.0;
/// Period of a servo that does not tell it (an old recording), nanoseconds.
const UNTOLD_PERIOD_NS: u64 = 1_000_000;
/// Suturing stage: all stitches are tied.
const DONE: u32 = 5;
/// States that make a spread worth telling.
const ENOUGH: usize = 20;

/// Distance of the pair at work, as the solver ties by it: between the means of its patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Suture pair, from 0.
    pub pair: u32,
    /// Distance of its two points, metres.
    pub distance_m: f64,
    /// At or below this it is closed, metres.
    pub closed_m: f64,
}

/// A state on the grid of its servo: time and period in nanoseconds, number of the slot.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    time_ns: u64,
    number: u64,
    period_ns: u64,
}

/// Curves over time.
#[derive(Clone, Debug)]
pub(super) struct History {
    pub(super) force: Series,
    pub(super) gap: Series,
    /// Place on the grid of each state seen, microseconds from the first.
    wake: Series,
    origin: Option<Slot>,
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
            let slot = Slot {
                time_ns: servo.header.time_ns,
                number: servo.ticks.saturating_add(servo.missed),
                period_ns: if servo.period_ns == 0 { UNTOLD_PERIOD_NS } else { servo.period_ns },
            };
            let origin = *self.origin.get_or_insert(slot);
            match off_grid_us(origin, slot) {
                Some(off_us) => self.wake.push(time_s, off_us),
                None => {
                    // Another run, or a replay that was wound back.
                    self.origin = None;
                    self.wake.clear();
                }
            }
        }
        if let (Some(report), Some(gap)) = (&view.report, gap(view)) {
            let followed = (gap.pair, report.scene_generation);
            if followed != self.followed {
                self.gap.clear();
                self.followed = followed;
            }
            self.gap.push(report.sim_time_s, gap.distance_m);
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

/// Microseconds by which a state is off the grid that the first one began; `None` when it is of another grid or lies before that.
fn off_grid_us(first: Slot, now: Slot) -> Option<f64> {
    let time = now.time_ns.checked_sub(first.time_ns)?;
    let grid = now.number.checked_sub(first.number)?.checked_mul(now.period_ns)?;
    (now.period_ns == first.period_ns).then_some((time as f64 - grid as f64) * 1e-3)
}

/// The pair at work and its distance, as the solver tells them; `None` when the last one is tied, and in old recordings.
#[must_use]
pub fn gap(view: &View) -> Option<Gap> {
    let report = view.report.as_ref()?;
    let is_told = report.pair < report.pair_count && report.closed_gap_m > 0.0 && report.stage != DONE;
    is_told.then_some(Gap { pair: report.pair, distance_m: report.gap_m, closed_m: report.closed_gap_m })
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
    fn the_gap_is_the_one_that_the_solver_ties_by() {
        let mut view = example::view();
        // The surface nodes of the pair are 10 mm apart, their patches less.
        assert_eq!(gap(&view), Some(Gap { pair: 3, distance_m: 0.0098, closed_m: 0.0013 }));
        let mut history = History::default();
        history.take(&view);
        assert_eq!(history.gap.newest().map(|p| p[1]), Some(0.0098));
        if let Some(report) = &mut view.report {
            report.stage = DONE;
        }
        assert_eq!(gap(&view), None);
    }

    #[test]
    fn a_servo_of_another_period_has_another_grid() {
        for (period_ns, told_ns) in [(500_000, 500_000), (1_000_000, 0)] {
            let mut history = History::default();
            let mut view = example::view();
            let mut state = view.servo.take().expect("a servo state");
            for i in 0..100_u64 {
                (state.ticks, state.missed, state.period_ns) = (16 * i, 0, told_ns);
                state.header.time_ns = 5_000_000_000 + period_ns * state.ticks;
                view.servo = Some(state);
                history.take(&view);
            }
            assert_eq!(history.wake_spread_us(), Some(0.0));
        }
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
            state.header.time_ns = 5_000_000_000 + state.period_ns * (state.ticks + state.missed) + late_ns;
            view.servo = Some(state);
            history.take(&view);
        }
        let spread = history.wake_spread_us().expect("enough states");
        assert!((spread - 40.0).abs() < 1e-6, "{spread}");
        assert_eq!(history.missed_since(state.missed), 9);
        let slot = Slot { time_ns: 10, number: 10, period_ns: 1 };
        assert_eq!(off_grid_us(slot, Slot { time_ns: 9, number: 11, ..slot }), None);
    }
}
