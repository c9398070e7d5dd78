//! A map of classes over two parameters, with curves drawn in: stability over step and mass, with its closed form.
//!
//! Cells are centred on their values; a logarithmic axis needs values in geometric progression to fill its cells.

use super::axis::{Axis, Fitted, Scale};
use super::panel::Series;
use haptic_server::report::svg::{Anchor, Svg, escape};

/// One class of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct MapClass {
    /// Name in the legend.
    pub name: String,
    /// Fill colour, `#rrggbb`.
    pub colour: &'static str,
}

/// A map.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Values along x, ascending.
    pub x_values: Vec<f64>,
    /// Values along y, ascending.
    pub y_values: Vec<f64>,
    /// Class of each cell, row by row, the lowest y first: `cells[row * x_values.len() + column]`.
    pub cells: Vec<usize>,
    /// The classes.
    pub classes: Vec<MapClass>,
    /// Curves drawn over the cells.
    pub curves: Vec<Series>,
}

const PLOT: (f64, f64) = (420.0, 320.0);
const LEFT: f64 = 70.0;
const TOP: f64 = 40.0;
const RIGHT: f64 = 20.0;
const LEGEND_ROW: f64 = 20.0;

/// Draws maps side by side, `columns` in a row.
#[must_use]
pub fn heat_map_svg(title: &str, maps: &[HeatMap], columns: usize) -> String {
    let columns = columns.clamp(1, maps.len().max(1));
    let rows = maps.len().div_ceil(columns);
    let legend_rows = maps.iter().map(|m| m.classes.len() + m.curves.len()).max().unwrap_or(0).div_ceil(2);
    let cell = (LEFT + PLOT.0 + RIGHT, TOP + PLOT.1 + 52.0 + LEGEND_ROW * legend_rows as f64);
    let mut svg = Svg::new(cell.0 * columns as f64, 30.0 + cell.1 * rows as f64);
    svg.text((cell.0 * columns as f64 / 2.0, 21.0), 15.0, Anchor::Middle, title);
    for (i, map) in maps.iter().enumerate() {
        let at = (cell.0 * (i % columns) as f64 + LEFT, 30.0 + cell.1 * (i / columns) as f64 + TOP);
        draw_map(&mut svg, at, map);
    }
    svg.finish()
}

/// Edges of the cells, half-way between neighbours on the axis' scale.
fn edges(values: &[f64], scale: Scale) -> Vec<f64> {
    let to = |v: f64| if scale == Scale::Log { v.max(f64::MIN_POSITIVE).ln() } else { v };
    let from = |v: f64| if scale == Scale::Log { v.exp() } else { v };
    let n = values.len();
    if n < 2 {
        return values.iter().flat_map(|v| [v * 0.9, v * 1.1]).collect();
    }
    let at = |i: usize| to(values[i]);
    let mut edges = vec![from(1.5 * at(0) - 0.5 * at(1))];
    edges.extend((1..n).map(|i| from(0.5 * (at(i - 1) + at(i)))));
    edges.push(from(1.5 * at(n - 1) - 0.5 * at(n - 2)));
    edges
}

fn draw_map(svg: &mut Svg, (left, top): (f64, f64), map: &HeatMap) {
    let (xs, ys) = (edges(&map.x_values, map.x.scale), edges(&map.y_values, map.y.scale));
    let ends = |edges: &[f64]| (edges.first().copied().unwrap_or(1.0), edges.last().copied().unwrap_or(10.0));
    let fit = |axis: &Axis, edges: &[f64]| {
        let (low, high) = axis.range.unwrap_or_else(|| ends(edges));
        Fitted::new(&axis.clone().between(low, high), std::iter::empty())
    };
    let (x_axis, y_axis) = (fit(&map.x, &xs), fit(&map.y, &ys));
    let (right, bottom) = (left + PLOT.0, top + PLOT.1);
    let px = |v: f64| x_axis.place(v).map(|t| (left + t * PLOT.0).clamp(left, right));
    let py = |v: f64| y_axis.place(v).map(|t| (bottom - t * PLOT.1).clamp(top, bottom));
    let columns = map.x_values.len();
    for (index, class) in map.cells.iter().enumerate().take(columns * map.y_values.len()) {
        let (row, column) = (index / columns, index % columns);
        let (Some(x0), Some(x1)) = (px(xs[column]), px(xs[column + 1])) else { continue };
        let (Some(y0), Some(y1)) = (py(ys[row]), py(ys[row + 1])) else { continue };
        let Some(class) = map.classes.get(*class) else { continue };
        svg.element(&format!(
            r#"<rect x="{x0:.2}" y="{y1:.2}" width="{:.2}" height="{:.2}" fill="{}" stroke="white" stroke-width="0.5"/>"#,
            x1 - x0,
            y0 - y1,
            class.colour
        ));
    }
    for (value, label) in x_axis.ticks() {
        let Some(x) = px(value) else { continue };
        svg.line((x, bottom), (x, bottom + 5.0), "#444", 1.0);
        svg.text((x, bottom + 18.0), 11.0, Anchor::Middle, &label);
    }
    for (value, label) in y_axis.ticks() {
        let Some(y) = py(value) else { continue };
        svg.line((left - 5.0, y), (left, y), "#444", 1.0);
        svg.text((left - 8.0, y + 4.0), 11.0, Anchor::End, &label);
    }
    for curve in &map.curves {
        let inside = |p: &&(f64, f64)| {
            let fits = |t: Option<f64>| t.is_some_and(|t| (0.0..=1.0).contains(&t));
            fits(x_axis.place(p.0)) && fits(y_axis.place(p.1))
        };
        let points: Vec<(f64, f64)> =
            curve.points.iter().filter(inside).filter_map(|p| Some((px(p.0)?, py(p.1)?))).collect();
        svg.polyline(&points, r#"fill="none" stroke="white" stroke-width="4.5""#);
        svg.polyline(&points, &curve_stroke(curve));
    }
    svg.text(((left + right) / 2.0, top - 8.0), 13.0, Anchor::Middle, &map.title);
    svg.text(((left + right) / 2.0, bottom + 36.0), 12.0, Anchor::Middle, &map.x.label);
    let (lx, ly) = (left - 54.0, (top + bottom) / 2.0);
    svg.element(&format!(
        r##"<text x="{lx:.2}" y="{ly:.2}" font-size="12" text-anchor="middle" fill="#222" transform="rotate(-90 {lx:.2} {ly:.2})">{}</text>"##,
        escape(&map.y.label)
    ));
    draw_legend(svg, (left, bottom + 56.0), map);
}

fn curve_stroke(curve: &Series) -> String {
    format!(r#"fill="none" stroke="{}" stroke-width="2" stroke-dasharray="{}""#, curve.style.colour, curve.style.dash)
}

fn draw_legend(svg: &mut Svg, (left, top): (f64, f64), map: &HeatMap) {
    let place = |i: usize| (left + 215.0 * (i % 2) as f64, top + LEGEND_ROW * (i / 2) as f64);
    for (i, class) in map.classes.iter().enumerate() {
        let (x, y) = place(i);
        svg.element(&format!(
            r##"<rect x="{x:.2}" y="{:.2}" width="14" height="12" fill="{}" stroke="#444" stroke-width="0.5"/>"##,
            y - 10.0,
            class.colour
        ));
        svg.text((x + 20.0, y), 12.0, Anchor::Start, &class.name);
    }
    for (i, curve) in map.curves.iter().enumerate() {
        let (x, y) = place(map.classes.len() + i);
        svg.polyline(&[(x, y - 4.0), (x + 16.0, y - 4.0)], &curve_stroke(curve));
        svg.text((x + 20.0, y), 12.0, Anchor::Start, &curve.name);
    }
}

#[cfg(test)]
mod tests {
    use super::super::style::nth_style;
    use super::*;

    #[test]
    fn each_cell_is_one_rectangle_of_its_class() {
        let class = |name: &str, colour| MapClass { name: name.into(), colour };
        let map = HeatMap {
            title: "sheet".into(),
            x: Axis::log("dt"),
            y: Axis::linear("m"),
            x_values: vec![1e-4, 1e-3, 1e-2],
            y_values: vec![1.0, 2.0],
            cells: vec![0, 0, 1, 0, 1, 1],
            classes: vec![class("stable", "#cfe8d5"), class("overflow", "#d55e00")],
            curves: vec![Series::new("limit", nth_style(6), vec![(1e-4, 1.0), (1e-3, 2.0)])],
        };
        let svg = heat_map_svg("t", &[map], 2);
        // Two of each class in the map and one in the legend are told apart by their stroke.
        assert_eq!(svg.matches(r##"fill="#cfe8d5" stroke="white""##).count(), 3);
        assert_eq!(svg.matches(r##"fill="#d55e00" stroke="white""##).count(), 3);
        assert!(svg.contains("limit") && !svg.contains("NaN"));
    }
}
