//! The few SVG elements the pictures are made of. Coordinates in pixels, two decimals, so that equal runs
//! give equal bytes.

use std::fmt::Write as _;

/// A picture under construction.
#[derive(Clone, Debug)]
pub struct Svg {
    body: String,
    width: f64,
    height: f64,
}

/// Where a text is anchored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// At its first letter.
    Start,
    /// At its middle.
    Middle,
    /// At its last letter.
    End,
}

impl Svg {
    /// An empty white picture.
    #[must_use]
    pub fn new(width: f64, height: f64) -> Self {
        Self { body: String::new(), width, height }
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: &str, width: f64) {
        let _ = writeln!(
            self.body,
            r#"<line x1="{:.2}" y1="{:.2}" x2="{:.2}" y2="{:.2}" stroke="{colour}" stroke-width="{width}"/>"#,
            from.0, from.1, to.0, to.1
        );
    }

    /// A polyline with the attributes `style`.
    pub fn polyline(&mut self, points: &[(f64, f64)], style: &str) {
        let _ = writeln!(self.body, r#"<polyline points="{}" {style}/>"#, list(points));
    }

    /// A closed polygon with the attributes `style`.
    pub fn polygon(&mut self, points: &[(f64, f64)], style: &str) {
        let _ = writeln!(self.body, r#"<polygon points="{}" {style}/>"#, list(points));
    }

    /// A filled circle.
    pub fn dot(&mut self, at: (f64, f64), radius: f64, colour: &str) {
        let _ = writeln!(self.body, r#"<circle cx="{:.2}" cy="{:.2}" r="{radius}" fill="{colour}"/>"#, at.0, at.1);
    }

    /// Any other element, as written.
    pub fn element(&mut self, xml: &str) {
        let _ = writeln!(self.body, "{xml}");
    }

    /// A line of text; `<`, `>` and `&` are escaped.
    pub fn text(&mut self, at: (f64, f64), size: f64, anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.body,
            r##"<text x="{:.2}" y="{:.2}" font-size="{size}" text-anchor="{anchor}" fill="#222">{}</text>"##,
            at.0,
            at.1,
            escape(text)
        );
    }

    /// The whole `<svg>` element.
    #[must_use]
    pub fn finish(self) -> String {
        let (w, h) = (self.width, self.height);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
             font-family=\"sans-serif\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }
}

fn list(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

/// Text as it may stand between tags and in quoted attributes.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A step of 1, 2 or 5 times a power of ten that divides `span` into about `parts`.
#[must_use]
pub fn nice_step(span: f64, parts: f64) -> f64 {
    let raw = (span / parts).max(f64::MIN_POSITIVE);
    let power = 10.0_f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= raw * (1.0 - 1e-9)).unwrap_or(10.0);
    factor * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_one_two_five() {
        for (span, step) in [(10.0, 2.0), (4.0, 1.0), (0.7, 0.2), (60.0, 20.0), (21.0, 5.0)] {
            assert!((nice_step(span, 5.0) - step).abs() < 1e-12, "{span}: {}", nice_step(span, 5.0));
        }
    }

    #[test]
    fn text_is_escaped() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text((0.0, 0.0), 8.0, Anchor::Start, "a<b&c");
        assert!(svg.finish().contains("a&lt;b&amp;c"));
    }
}
