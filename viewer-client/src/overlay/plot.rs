//! Curves, painted with egui's painter: a frame, a few round grid lines with their numbers, the curve.
//!
//! `y_px = bottom − (y − y_low)/(y_high − y_low) · height`. A curve of more points than the plot has columns is drawn by the
//! lowest and highest point of each column, so that a peak is never lost. Deliberately absent: zooming in plots.

use super::style;
use crate::series::Series;
use egui::{Align2, Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

/// Room for the numbers left of a plot.
const NUMBERS: f32 = 26.0;
/// Grid lines that fit.
const LINES: f64 = 3.0;

/// A linear axis from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) step: f64,
}

impl Axis {
    /// From zero (or below, when there are negative values) to a round number at or above the largest value; at least
    /// `least` high, so that noise does not fill the plot.
    pub(super) fn covering(range: Option<[f64; 2]>, least: f64) -> Self {
        let [low, high] = range.unwrap_or([0.0, 0.0]);
        let (low, high) = (low.min(0.0), high.max(least));
        let step = round_step((high - low) / LINES);
        Self { low: (low / step).floor() * step, high: (high / step).ceil() * step, step }
    }

    /// 0 at `low`, 1 at `high`.
    fn part(&self, value: f64) -> f32 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0) as f32
    }

    fn lines(&self) -> impl Iterator<Item = f64> + '_ {
        let count = ((self.high - self.low) / self.step).round().clamp(0.0, 12.0) as usize;
        (0..=count).map(|i| self.low + i as f64 * self.step)
    }

    /// As many decimals as the step needs.
    fn number(&self, value: f64) -> String {
        let decimals = (-self.step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$}")
    }
}

/// 1, 2 or 5 times a power of ten, at or above `raw`.
fn round_step(raw: f64) -> f64 {
    if !(raw.is_finite() && raw > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= raw * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// The place of a plot with its frame and grid drawn.
pub(super) struct Plot {
    painter: Painter,
    area: Rect,
    x: Axis,
    y: Axis,
}

impl Plot {
    /// Takes the whole width of the panel.
    pub(super) fn begin(ui: &mut Ui, height: f32, x: Axis, y: Axis) -> Self {
        let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), height), Sense::hover());
        let area = Rect::from_min_max(response.rect.min + vec2(NUMBERS, 4.0), response.rect.max - vec2(2.0, 4.0));
        painter.rect_filled(area, 2.0, style::PLOT);
        let plot = Self { painter, area, x, y };
        for value in y.lines() {
            let at = plot.at([x.low, value]);
            plot.painter.hline(area.x_range(), at.y, Stroke::new(1.0, style::GRID));
            plot.painter.text(at - vec2(4.0, 0.0), Align2::RIGHT_CENTER, y.number(value), style::small(), style::WEAK);
        }
        plot
    }

    /// Where a point lies.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> Pos2 {
        let size = self.area.size();
        pos2(self.area.left() + self.x.part(x) * size.x, self.area.bottom() - self.y.part(y) * size.y)
    }

    /// A curve whose x only goes forward.
    pub(super) fn curve(&self, points: impl Iterator<Item = [f64; 2]>, colour: Color32) {
        let mut line = Vec::with_capacity(2 * self.area.width() as usize + 2);
        by_column(points.map(|p| self.at(p)), &mut line);
        if line.len() > 1 {
            self.painter.add(Shape::line(line, Stroke::new(1.5, colour)));
        }
    }

    /// A curve that may go back and forth, thinned to points that are apart.
    pub(super) fn path(&self, points: impl Iterator<Item = [f64; 2]>, colour: Color32) {
        let mut line: Vec<Pos2> = Vec::new();
        for point in points.map(|p| self.at(p)) {
            if line.last().is_none_or(|last| last.distance_sq(point) >= 1.0) {
                line.push(point);
            }
        }
        let last = line.last().copied();
        if line.len() > 1 {
            self.painter.add(Shape::line(line, Stroke::new(1.2, colour)));
        }
        if let Some(last) = last {
            self.painter.circle_filled(last, 2.5, colour);
        }
    }

    /// A level across the plot with its name, dashed.
    pub(super) fn level(&self, y: f64, name: &str, colour: Color32) {
        let ends = [self.at([self.x.low, y]), self.at([self.x.high, y])];
        self.painter.extend(Shape::dashed_line(&ends, Stroke::new(1.0, colour), 4.0, 3.0));
        self.painter.text(ends[1] - vec2(2.0, 1.0), Align2::RIGHT_BOTTOM, name, style::small(), colour);
    }

    /// Small text in the upper left corner.
    pub(super) fn note(&self, text: &str) {
        let corner = self.area.left_top() + vec2(3.0, 1.0);
        self.painter.text(corner, Align2::LEFT_TOP, text, style::small(), style::WEAK.gamma_multiply(0.7));
    }
}

/// Keeps the lowest and the highest point of every pixel column, in their order.
fn by_column(points: impl Iterator<Item = Pos2>, line: &mut Vec<Pos2>) {
    // First and second extreme of the column so far, in order of arrival.
    let mut column: Option<(f32, Pos2, Pos2)> = None;
    let mut close = |column: Option<(f32, Pos2, Pos2)>| {
        if let Some((_, a, b)) = column {
            line.push(a);
            if b != a {
                line.push(b);
            }
        }
    };
    for p in points {
        column = match column {
            Some((x, a, b)) if p.x.floor() == x => {
                let (low, high) = (a.y.min(b.y), a.y.max(b.y));
                if p.y < low {
                    Some((x, if a.y == high { a } else { b }, p))
                } else if p.y > high {
                    Some((x, if a.y == low { a } else { b }, p))
                } else {
                    Some((x, a, b))
                }
            }
            before => {
                close(before);
                Some((p.x.floor(), p, p))
            }
        };
    }
    close(column);
}

/// A quantity over its time window.
pub(super) fn over_time(ui: &mut Ui, height: f32, series: &Series, scale: f64, least: f64, colour: Color32) -> Plot {
    let y = Axis::covering(series.range().map(|r| r.map(|v| v * scale)), least);
    let x = Axis { low: -series.window_s(), high: 0.0, step: series.window_s() };
    let plot = Plot::begin(ui, height, x, y);
    plot.curve(series.recent().map(|[t, v]| [t, v * scale]), colour);
    plot.note(&format!("last {:.0} s", series.window_s()));
    plot
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers_around_the_data() {
        for (range, least) in [([0.0, 0.37], 0.1), ([-0.2, 1.9], 1.0), ([3.0, 9.99], 0.5), ([0.0, 1e-7], 1e-9)] {
            let axis = Axis::covering(Some(range), least);
            assert!(axis.low <= range[0].min(0.0) && axis.high >= range[1].max(least), "{axis:?} for {range:?}");
            let count = axis.lines().count();
            assert!((2..=6).contains(&count), "{count} lines for {range:?}");
            let power = axis.step / 10_f64.powf(axis.step.log10().floor());
            assert!([1.0, 2.0, 5.0, 10.0].iter().any(|m| (power - m).abs() < 1e-9), "step {}", axis.step);
        }
        assert_eq!(Axis::covering(None, 2.0).number(1.0), "1");
        assert_eq!(Axis::covering(None, 0.3).number(0.1), "0.1");
    }

    #[test]
    fn a_peak_between_two_columns_is_kept() {
        let points = (0..1000).map(|i| pos2(i as f32 * 0.1, if i == 555 { 90.0 } else { (i % 3) as f32 }));
        let mut line = Vec::new();
        by_column(points.clone(), &mut line);
        assert!(line.len() <= 200 && line.iter().any(|p| p.y == 90.0));
        assert!(line.windows(2).all(|w| w[0].x <= w[1].x));
        let mut few = Vec::new();
        by_column(points.step_by(100), &mut few);
        assert_eq!(few.len(), 10);
    }
}
