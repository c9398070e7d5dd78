//! Radar chart of the ledger (Zhang et al., Fig. 8): one axis per stitch, red the original distance `D_o`,
//! blue the current distance `D_c`, dashed the band of 10 % in which Algorithm 2 does not act.

use super::svg::{Anchor, Svg, nice_step};

/// One axis of the chart.
#[derive(Clone, Debug, PartialEq)]
pub struct RadarAxis {
    /// Label at the rim.
    pub label: String,
    /// `D_o`, millimetres.
    pub original_mm: f64,
    /// `D_c`, millimetres.
    pub current_mm: f64,
}

const SIZE: f64 = 460.0;
const CENTRE: (f64, f64) = (SIZE / 2.0, SIZE / 2.0 + 12.0);
const RADIUS: f64 = 165.0;
const ORIGINAL: &str = "#c0392b";
const CURRENT: &str = "#1f5fbf";
/// Algorithm 2 acts above this relative error.
const BAND: f64 = 0.10;

/// Draws the chart; with no axes only the frame and a note.
#[must_use]
pub fn radar_svg(title: &str, axes: &[RadarAxis]) -> String {
    let mut svg = Svg::new(SIZE, SIZE + 24.0);
    svg.text((SIZE / 2.0, 20.0), 15.0, Anchor::Middle, title);
    if axes.is_empty() {
        svg.text(CENTRE, 13.0, Anchor::Middle, "no stitch was tied");
        return svg.finish();
    }
    let largest = axes.iter().map(|a| a.original_mm.max(a.current_mm)).fold(0.0, f64::max).max(1e-6);
    let step = nice_step(largest * 1.1, 4.0);
    let rim = (largest * 1.1 / step).ceil() * step;
    let at = |i: usize, mm: f64| {
        let angle = std::f64::consts::TAU * i as f64 / axes.len() as f64 - std::f64::consts::FRAC_PI_2;
        let r = RADIUS * mm / rim;
        (CENTRE.0 + r * angle.cos(), CENTRE.1 + r * angle.sin())
    };
    let ring = |value: &dyn Fn(&RadarAxis) -> f64| -> Vec<(f64, f64)> {
        axes.iter().enumerate().map(|(i, a)| at(i, value(a))).collect()
    };
    for level in 1..=(rim / step).round() as usize {
        let mm = level as f64 * step;
        svg.polygon(&ring(&|_| mm), r##"fill="none" stroke="#ddd""##);
        svg.text((CENTRE.0 + 4.0, CENTRE.1 - RADIUS * mm / rim - 2.0), 10.0, Anchor::Start, &format!("{mm} mm"));
    }
    for (i, axis) in axes.iter().enumerate() {
        svg.line(CENTRE, at(i, rim), "#ddd", 1.0);
        let label = at(i, rim * 1.12);
        svg.text((label.0, label.1 + 4.0), 11.0, Anchor::Middle, &axis.label);
    }
    for factor in [1.0 - BAND, 1.0 + BAND] {
        let style = format!(r#"fill="none" stroke="{ORIGINAL}" stroke-dasharray="2 3" stroke-opacity="0.5""#);
        svg.polygon(&ring(&|a| a.original_mm * factor), &style);
    }
    for (colour, value) in [
        (ORIGINAL, (&|a: &RadarAxis| a.original_mm) as &dyn Fn(&RadarAxis) -> f64),
        (CURRENT, &|a: &RadarAxis| a.current_mm),
    ] {
        let points = ring(value);
        svg.polygon(&points, &format!(r#"fill="{colour}" fill-opacity="0.06" stroke="{colour}" stroke-width="2""#));
        for p in points {
            svg.dot(p, 3.5, colour);
        }
    }
    legend(&mut svg);
    svg.finish()
}

fn legend(svg: &mut Svg) {
    let y = SIZE + 12.0;
    svg.dot((90.0, y - 4.0), 4.0, ORIGINAL);
    svg.text((100.0, y), 11.0, Anchor::Start, "original D_o");
    svg.dot((190.0, y - 4.0), 4.0, CURRENT);
    svg.text((200.0, y), 11.0, Anchor::Start, "current D_c");
    svg.text((285.0, y), 11.0, Anchor::Start, "dashed: D_o ± 10 %");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fig8_one_red_and_one_blue_point_per_stitch() {
        let axes: Vec<RadarAxis> =
            (0..12).map(|i| RadarAxis { label: format!("{}", i + 1), original_mm: 4.0, current_mm: 4.1 }).collect();
        let svg = radar_svg("skin", &axes);
        assert_eq!(svg.matches(&format!(r#"r="3.5" fill="{ORIGINAL}""#)).count(), 12);
        assert_eq!(svg.matches(&format!(r#"r="3.5" fill="{CURRENT}""#)).count(), 12);
    }

    #[test]
    fn an_empty_ledger_says_so() {
        assert!(radar_svg("skin", &[]).contains("no stitch was tied"));
    }
}
