//! How a series looks: colour, marker, dash. Okabe and Ito's palette, a marker shape per series.
//!
//! Integrators keep their look through the whole report, whatever else is drawn beside them.

use haptic_server::report::svg::Svg;

/// Shape of the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Disc,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// ▼
    TriangleDown,
    /// ○
    Ring,
    /// ×, for runs that were unstable.
    Cross,
    /// No points, a line only.
    None,
}

/// Look of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Colour, `#rrggbb`.
    pub colour: &'static str,
    /// Points.
    pub marker: Marker,
    /// Dash pattern of the line, empty for a whole line.
    pub dash: &'static str,
}

const STYLES: [Style; 8] = [
    Style { colour: "#0072b2", marker: Marker::Disc, dash: "" },
    Style { colour: "#d55e00", marker: Marker::Square, dash: "" },
    Style { colour: "#009e73", marker: Marker::Triangle, dash: "" },
    Style { colour: "#cc79a7", marker: Marker::Diamond, dash: "" },
    Style { colour: "#e69f00", marker: Marker::TriangleDown, dash: "" },
    Style { colour: "#56b4e9", marker: Marker::Ring, dash: "" },
    Style { colour: "#000000", marker: Marker::Disc, dash: "6 3" },
    Style { colour: "#7a6f00", marker: Marker::Square, dash: "2 2" },
];

/// The n-th of the eight looks, counted round.
#[must_use]
pub fn nth_style(n: usize) -> Style {
    STYLES[n % STYLES.len()]
}

/// Look of an integrator by its printed name; unknown names get one of the two last looks.
#[must_use]
pub fn integrator_style(name: &str) -> Style {
    let known = ["semi_implicit", "verlet", "bdf2", "xpbd", "paper_explicit", "implicit_euler"];
    let unknown = 6 + name.len() % 2;
    nth_style(known.iter().position(|k| *k == name).unwrap_or(unknown))
}

/// Half the size of a marker, pixels.
pub(super) const MARKER: f64 = 4.0;

/// Draws one marker.
pub(super) fn draw_marker(svg: &mut Svg, (x, y): (f64, f64), marker: Marker, colour: &str) {
    let r = MARKER;
    let fill = format!(r#"fill="{colour}""#);
    match marker {
        Marker::Disc => svg.dot((x, y), r * 0.85, colour),
        Marker::Square => {
            let s = r * 0.8;
            svg.polygon(&[(x - s, y - s), (x + s, y - s), (x + s, y + s), (x - s, y + s)], &fill);
        }
        Marker::Triangle => svg.polygon(&[(x, y - r), (x + r, y + 0.8 * r), (x - r, y + 0.8 * r)], &fill),
        Marker::TriangleDown => svg.polygon(&[(x, y + r), (x + r, y - 0.8 * r), (x - r, y - 0.8 * r)], &fill),
        Marker::Diamond => svg.polygon(&[(x, y - r), (x + r, y), (x, y + r), (x - r, y)], &fill),
        Marker::Ring => svg.element(&format!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{:.2}" fill="white" stroke="{colour}" stroke-width="1.6"/>"#,
            r * 0.85
        )),
        Marker::Cross => {
            svg.line((x - r, y - r), (x + r, y + r), colour, 1.8);
            svg.line((x - r, y + r), (x + r, y - r), colour, 1.8);
        }
        Marker::None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_differ_pairwise() {
        for (i, a) in STYLES.iter().enumerate() {
            for b in &STYLES[..i] {
                assert_ne!(a.colour, b.colour);
                assert!(a.marker != b.marker || a.dash != b.dash);
            }
        }
    }
}
