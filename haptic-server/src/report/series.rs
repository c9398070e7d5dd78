//! Curves over time in stacked panels with one common time axis: force and gap of a run.

use super::svg::{Anchor, Svg, nice_step};

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel<'a> {
    /// Axis label with unit.
    pub label: &'a str,
    /// Curves: name, colour, values at the common times.
    pub curves: Vec<(&'a str, &'a str, &'a [f64])>,
    /// A dashed level, if any: value and name.
    pub level: Option<(f64, &'a str)>,
}

const WIDTH: f64 = 900.0;
const PANEL_HEIGHT: f64 = 190.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const GAP: f64 = 26.0;
/// More points than this on a curve cannot be told apart at this width; the curve keeps each bucket's extremes.
const BUCKETS: usize = 900;

/// Draws the panels.
#[must_use]
pub fn series_svg(title: &str, times_s: &[f64], panels: &[Panel<'_>]) -> String {
    let height = TOP + panels.len() as f64 * (PANEL_HEIGHT + GAP) + 20.0;
    let mut svg = Svg::new(WIDTH, height);
    svg.text((WIDTH / 2.0, 20.0), 15.0, Anchor::Middle, title);
    let end = times_s.last().copied().unwrap_or(0.0).max(1e-9);
    for (index, panel) in panels.iter().enumerate() {
        let top = TOP + index as f64 * (PANEL_HEIGHT + GAP);
        draw_panel(&mut svg, top, end, times_s, panel);
    }
    svg.text((WIDTH / 2.0, height - 6.0), 12.0, Anchor::Middle, "time (s)");
    svg.finish()
}

fn draw_panel(svg: &mut Svg, top: f64, end: f64, times: &[f64], panel: &Panel<'_>) {
    let values = panel.curves.iter().flat_map(|c| c.2.iter().copied()).chain(panel.level.map(|l| l.0));
    let (low, high) = values.filter(|v| v.is_finite()).fold((0.0_f64, 1e-6_f64), |(l, h), v| (l.min(v), h.max(v)));
    let step = nice_step(high - low, 4.0);
    let (low, high) = ((low / step).floor() * step, (high / step).ceil() * step);
    let x = |t: f64| LEFT + (WIDTH - LEFT - RIGHT) * t / end;
    let y = |v: f64| top + PANEL_HEIGHT * (1.0 - (v - low) / (high - low));
    for i in 0..=((high - low) / step).round() as usize {
        let v = low + i as f64 * step;
        svg.line((LEFT, y(v)), (WIDTH - RIGHT, y(v)), "#e4e4e4", 1.0);
        let digits = usize::from(step < 1.0) + usize::from(step < 0.1);
        svg.text((LEFT - 6.0, y(v) + 4.0), 11.0, Anchor::End, &format!("{v:.digits$}"));
    }
    let time_step = nice_step(end, 8.0);
    for i in 0..=(end / time_step).floor() as usize {
        let t = i as f64 * time_step;
        svg.line((x(t), top), (x(t), top + PANEL_HEIGHT), "#f0f0f0", 1.0);
        let digits = usize::from(time_step < 1.0);
        svg.text((x(t), top + PANEL_HEIGHT + 13.0), 10.0, Anchor::Middle, &format!("{t:.digits$}"));
    }
    if let Some((level, name)) = panel.level {
        let ends = [(LEFT, y(level)), (WIDTH - RIGHT, y(level))];
        svg.polyline(&ends, r##"fill="none" stroke="#888" stroke-dasharray="4 3""##);
        svg.text((WIDTH - RIGHT - 4.0, y(level) - 4.0), 10.0, Anchor::End, name);
    }
    for (row, (name, colour, curve)) in panel.curves.iter().enumerate() {
        let points: Vec<(f64, f64)> = thin(times, curve).into_iter().map(|(t, v)| (x(t), y(v))).collect();
        svg.polyline(&points, &format!(r#"fill="none" stroke="{colour}" stroke-width="1.2""#));
        let label = (LEFT + 10.0 + 150.0 * row as f64, top + 14.0);
        svg.dot((label.0, label.1 - 4.0), 3.5, colour);
        svg.text((label.0 + 8.0, label.1), 11.0, Anchor::Start, name);
    }
    svg.text((LEFT, top - 5.0), 12.0, Anchor::Start, panel.label);
}

/// First, smallest, largest and last of each bucket, so that no peak is lost in the picture.
fn thin(times: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let count = times.len().min(values.len());
    let size = count.div_ceil(BUCKETS).max(1);
    let mut points = Vec::with_capacity(4 * BUCKETS.min(count));
    for start in (0..count).step_by(size) {
        let bucket = start..(start + size).min(count);
        let by = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let low = bucket.clone().min_by(by).unwrap_or(start);
        let high = bucket.clone().max_by(by).unwrap_or(start);
        let mut picked = [start, low, high, bucket.end - 1];
        picked.sort_unstable();
        for (i, p) in picked.into_iter().enumerate() {
            if i == 0 || picked[i - 1] != p {
                points.push((times[p], values[p]));
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_a_single_spike() {
        let times: Vec<f64> = (0..60_000).map(|i| f64::from(i) * 1e-3).collect();
        let mut values = vec![0.0; times.len()];
        values[31_234] = 3.3;
        let thinned = thin(&times, &values);
        assert!(thinned.len() < 4 * BUCKETS + 4);
        assert!(thinned.contains(&(times[31_234], 3.3)));
    }

    #[test]
    fn panels_with_no_data_are_drawn_empty() {
        let svg = series_svg("t", &[], &[Panel { label: "force (N)", curves: vec![("F", "#000", &[])], level: None }]);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    }
}
