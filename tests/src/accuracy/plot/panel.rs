//! Panels side by side: curves and points on two axes, levels drawn across, crosses for unstable runs.
//!
//! Crosses belong to a series and sit on the upper rim of the panel at their x: an unstable run has a cost but no error.

use super::axis::{Axis, Fitted};
use super::style::{Marker, Style, draw_marker};
use haptic_server::report::svg::{Anchor, Svg, escape};

/// One series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Look.
    pub style: Style,
    /// Points, joined in this order.
    pub points: Vec<(f64, f64)>,
    /// x of unstable runs, drawn as × on the upper rim.
    pub unstable_at: Vec<f64>,
    /// Points with a ring around them: a choice, a default.
    pub chosen: Vec<(f64, f64)>,
}

impl Series {
    /// A series of points joined by lines.
    #[must_use]
    pub fn new(name: &str, style: Style, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), style, points, unstable_at: Vec::new(), chosen: Vec::new() }
    }
}

/// A labelled dashed line across a panel.
#[derive(Clone, Debug, PartialEq)]
pub enum Level {
    /// Vertical, at this x: the real-time line.
    X(f64, String),
    /// Horizontal, at this y: the 5 % force line.
    Y(f64, String),
}

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Lines across.
    pub levels: Vec<Level>,
}

const PLOT: (f64, f64) = (300.0, 230.0);
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 46.0;
const HEAD: f64 = 34.0;
const LEGEND_ROW: f64 = 18.0;
const LEGEND_COLUMN: f64 = 215.0;

/// Draws panels in rows of `columns` with one legend for all; series of equal name share their entry.
#[must_use]
pub fn panels_svg(title: &str, panels: &[Panel], columns: usize) -> String {
    let columns = columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns);
    let (cell_w, cell_h) = (LEFT + PLOT.0 + RIGHT, TOP + PLOT.1 + BOTTOM);
    let width = (cell_w * columns as f64).max(430.0);
    let legend = legend_entries(panels);
    let per_row = ((width - LEFT) / LEGEND_COLUMN).floor().max(1.0) as usize;
    let legend_height = LEGEND_ROW * legend.len().div_ceil(per_row) as f64 + 10.0;
    let mut svg = Svg::new(width, HEAD + cell_h * rows as f64 + legend_height);
    svg.text((width / 2.0, 21.0), 15.0, Anchor::Middle, title);
    for (i, panel) in panels.iter().enumerate() {
        let at = (cell_w * (i % columns) as f64 + LEFT, HEAD + cell_h * (i / columns) as f64 + TOP);
        draw_panel(&mut svg, at, panel);
    }
    for (i, (name, style, has_cross)) in legend.iter().enumerate() {
        let x = LEFT + LEGEND_COLUMN * (i % per_row) as f64;
        let y = HEAD + cell_h * rows as f64 + LEGEND_ROW * (i / per_row) as f64 + 10.0;
        svg.polyline(&[(x - 8.0, y - 4.0), (x + 16.0, y - 4.0)], &stroke(*style));
        draw_marker(&mut svg, (x + 4.0, y - 4.0), style.marker, style.colour);
        let note = if *has_cross { " (× unstable)" } else { "" };
        svg.text((x + 22.0, y), 12.0, Anchor::Start, &format!("{name}{note}"));
    }
    svg.finish()
}

fn stroke(style: Style) -> String {
    let dash = if style.dash.is_empty() { String::new() } else { format!(r#" stroke-dasharray="{}""#, style.dash) };
    format!(r#"fill="none" stroke="{}" stroke-width="1.5"{dash}"#, style.colour)
}

fn legend_entries(panels: &[Panel]) -> Vec<(String, Style, bool)> {
    let mut entries: Vec<(String, Style, bool)> = Vec::new();
    for series in panels.iter().flat_map(|p| &p.series) {
        match entries.iter_mut().find(|(name, _, _)| *name == series.name) {
            Some(entry) => entry.2 |= !series.unstable_at.is_empty(),
            None => entries.push((series.name.clone(), series.style, !series.unstable_at.is_empty())),
        }
    }
    entries
}

fn draw_panel(svg: &mut Svg, (left, top): (f64, f64), panel: &Panel) {
    let points = || panel.series.iter().flat_map(|s| &s.points);
    let level = |want_x: bool| {
        panel.levels.iter().filter_map(move |l| match l {
            Level::X(v, _) if want_x => Some(*v),
            Level::Y(v, _) if !want_x => Some(*v),
            _ => None,
        })
    };
    let crosses = panel.series.iter().flat_map(|s| s.unstable_at.iter().copied());
    // A vertical level stands inside the panel, not on its rim.
    let beyond = level(true).flat_map(|v| [v / 1.5, v * 1.5]);
    let x_axis = Fitted::new(&panel.x, points().map(|p| p.0).chain(beyond).chain(crosses));
    let y_axis = Fitted::new(&panel.y, points().map(|p| p.1).chain(level(false)));
    let (right, bottom) = (left + PLOT.0, top + PLOT.1);
    let px = |v: f64| x_axis.place(v).map(|t| left + t * PLOT.0);
    let py = |v: f64| y_axis.place(v).map(|t| bottom - t * PLOT.1);
    for (value, label) in x_axis.ticks() {
        let Some(x) = px(value) else { continue };
        svg.line((x, top), (x, bottom), "#e8e8e8", 1.0);
        svg.text((x, bottom + 15.0), 11.0, Anchor::Middle, &label);
    }
    for (value, label) in y_axis.ticks() {
        let Some(y) = py(value) else { continue };
        svg.line((left, y), (right, y), "#e8e8e8", 1.0);
        svg.text((left - 6.0, y + 4.0), 11.0, Anchor::End, &label);
    }
    svg.polygon(
        &[(left, top), (right, top), (right, bottom), (left, bottom)],
        r##"fill="none" stroke="#888" stroke-width="1""##,
    );
    for l in &panel.levels {
        draw_level(svg, l, (left, top, right, bottom), (&px, &py));
    }
    let inside = |p: &(f64, f64)| {
        let at = (px(p.0)?, py(p.1)?);
        let tolerance = 0.5;
        let fits = at.0 >= left - tolerance
            && at.0 <= right + tolerance
            && at.1 >= top - tolerance
            && at.1 <= bottom + tolerance;
        fits.then_some(at)
    };
    let mut hidden = 0;
    for series in &panel.series {
        let shown: Vec<(f64, f64)> = series.points.iter().filter_map(inside).collect();
        hidden += series.points.len() - shown.len();
        svg.polyline(&shown, &stroke(series.style));
        for at in &shown {
            draw_marker(svg, *at, series.style.marker, series.style.colour);
        }
        for at in series.chosen.iter().filter_map(inside) {
            svg.element(&format!(
                r##"<circle cx="{:.2}" cy="{:.2}" r="9" fill="none" stroke="#222" stroke-width="1.5"/>"##,
                at.0, at.1
            ));
        }
        for x in series.unstable_at.iter().filter_map(|v| px(*v)) {
            draw_marker(svg, (x.clamp(left, right), top + 8.0), Marker::Cross, series.style.colour);
        }
    }
    svg.text(((left + right) / 2.0, top - 8.0), 13.0, Anchor::Middle, &panel.title);
    svg.text(((left + right) / 2.0, bottom + 34.0), 12.0, Anchor::Middle, &panel.x.label);
    let (lx, ly) = (left - 48.0, (top + bottom) / 2.0);
    svg.element(&format!(
        r##"<text x="{lx:.2}" y="{ly:.2}" font-size="12" text-anchor="middle" fill="#222" transform="rotate(-90 {lx:.2} {ly:.2})">{}</text>"##,
        escape(&panel.y.label)
    ));
    if hidden > 0 {
        svg.text((right, bottom + 34.0), 10.0, Anchor::End, &format!("{hidden} points off the axes"));
    }
}

type Place<'a> = &'a dyn Fn(f64) -> Option<f64>;

fn draw_level(
    svg: &mut Svg,
    level: &Level,
    (left, top, right, bottom): (f64, f64, f64, f64),
    (px, py): (Place<'_>, Place<'_>),
) {
    let style = r##"fill="none" stroke="#555" stroke-width="1.2" stroke-dasharray="5 4""##;
    match level {
        Level::X(value, label) => {
            let Some(x) = px(*value).filter(|x| (left..=right).contains(x)) else { return };
            svg.polyline(&[(x, top), (x, bottom)], style);
            let (tx, ty) = (x - 4.0, bottom - 6.0);
            svg.element(&format!(
                r##"<text x="{tx:.2}" y="{ty:.2}" font-size="10.5" fill="#555" transform="rotate(-90 {tx:.2} {ty:.2})">{}</text>"##,
                escape(label)
            ));
        }
        Level::Y(value, label) => {
            let Some(y) = py(*value).filter(|y| (top..=bottom).contains(y)) else { return };
            svg.polyline(&[(left, y), (right, y)], style);
            svg.text((right - 4.0, y - 4.0), 10.5, Anchor::End, label);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::style::integrator_style;
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        let mut series = Series::new("verlet", integrator_style("verlet"), points);
        series.unstable_at.push(0.5);
        Panel {
            title: "skin".into(),
            x: Axis::log("time"),
            y: Axis::log("error"),
            series: vec![series],
            levels: vec![Level::X(1.0, "real time".into()), Level::Y(0.05, "5 % of the force".into())],
        }
    }

    #[test]
    fn levels_crosses_and_the_legend_are_drawn() {
        let svg = panels_svg("t", &[panel(vec![(0.1, 0.2), (1.0, 0.02)])], 3);
        for text in ["real time", "5 % of the force", "verlet (× unstable)"] {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn points_without_a_place_are_counted_and_no_number_is_broken() {
        let svg = panels_svg("t", &[panel(vec![(0.1, 0.0), (1.0, f64::NAN), (1.0, 0.1)])], 1);
        assert!(svg.contains("2 points off the axes") && !svg.contains("NaN") && !svg.contains("inf"));
    }
}
