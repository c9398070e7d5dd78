//! One axis: a scale, a range and its ticks. Logarithmic ranges end at whole decades, linear ones at round values.

use haptic_server::report::svg::nice_step;

/// Linear or logarithmic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths; values not above 0 cannot be shown.
    Log,
}

/// What an axis shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity with unit.
    pub label: String,
    /// Scale.
    pub scale: Scale,
    /// Ends; `None` takes them from the data.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that takes its ends from the data.
    #[must_use]
    pub fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear, range: None }
    }

    /// A logarithmic axis that takes its ends from the data.
    #[must_use]
    pub fn log(label: &str) -> Self {
        Self { label: label.to_owned(), scale: Scale::Log, range: None }
    }

    /// The same axis with given ends.
    #[must_use]
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { range: Some((low, high)), ..self }
    }
}

/// An axis with its ends decided.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) scale: Scale,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Fitted {
    /// Ends from the axis, or round ones around the values.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let scale = axis.scale;
        if let Some((low, high)) = axis.range {
            return Self { scale, low, high };
        }
        let usable = |v: &f64| v.is_finite() && (scale == Scale::Linear || *v > 0.0);
        let (low, high) =
            values.filter(usable).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = match (low <= high, scale) {
            (false, Scale::Linear) => (0.0, 1.0),
            (false, Scale::Log) => (1.0, 10.0),
            (true, Scale::Linear) => round_linear(low, high),
            (true, Scale::Log) => {
                let (l, h) = (low.log10().floor(), high.log10().ceil());
                (10.0_f64.powf(l), 10.0_f64.powf(if h > l { h } else { l + 1.0 }))
            }
        };
        Self { scale, low, high }
    }

    /// Where a value lies between the ends, 0 to 1; `None` when this scale has no place for it.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let at = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log if value > 0.0 => (value / self.low).log10() / (self.high / self.low).log10(),
            Scale::Log => return None,
        };
        at.is_finite().then_some(at)
    }

    /// Ticks with their labels.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => {
                let step = nice_step(self.high - self.low, 5.0);
                let first = (self.low / step - 1e-9).ceil() as i64;
                let last = (self.high / step + 1e-9).floor() as i64;
                (first..=last).take(40).map(|i| (i as f64 * step, linear_label(i as f64 * step, step))).collect()
            }
            Scale::Log => {
                let (first, last) = (self.low.log10().ceil() as i32, self.high.log10().floor() as i32);
                let every = ((last - first) / 6 + 1).max(1);
                let whole = (first..=last).map(|p| (10.0_f64.powi(p), decade_label(p, (p - first) % every == 0)));
                let mut ticks: Vec<_> = whole.collect();
                if last - first < 1 {
                    for factor in [1.0, 2.0, 5.0] {
                        for p in first - 1..=last {
                            let v = factor * 10.0_f64.powi(p);
                            if v >= self.low * 0.999 && v <= self.high * 1.001 && ticks.iter().all(|t| t.0 != v) {
                                ticks.push((v, short(v)));
                            }
                        }
                    }
                }
                ticks
            }
        }
    }
}

fn round_linear(low: f64, high: f64) -> (f64, f64) {
    let (low, high) = if high > low { (low, high) } else { (low - 0.5, high + 0.5) };
    let step = nice_step(high - low, 5.0);
    ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step)
}

fn linear_label(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    let clean = if value.abs() < step * 1e-6 { 0.0 } else { value };
    if (1e-6..1e5).contains(&step) { format!("{clean:.digits$}") } else { format!("{clean:.1e}") }
}

fn decade_label(power: i32, shown: bool) -> String {
    if !shown { String::new() } else { short(10.0_f64.powi(power)) }
}

fn short(value: f64) -> String {
    if (1e-3..1e4).contains(&value) { format!("{value}") } else { format!("{value:.0e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_ends_are_decades_and_ratios_are_lengths() {
        let fitted = Fitted::new(&Axis::log("x"), [3e-4, 0.02, -1.0, f64::NAN].into_iter());
        assert!((fitted.low - 1e-4).abs() < 1e-18 && (fitted.high - 0.1).abs() < 1e-15);
        let (a, b, c) = (fitted.place(1e-3), fitted.place(1e-2), fitted.place(1e-1));
        assert!((b.unwrap() - a.unwrap() - (c.unwrap() - b.unwrap())).abs() < 1e-12);
        assert_eq!(fitted.place(0.0), None);
        assert_eq!(fitted.ticks().len(), 4);
    }

    #[test]
    fn axes_without_data_or_with_one_value_have_ends() {
        for axis in [Axis::linear("x"), Axis::log("x")] {
            for values in [vec![], vec![2.0], vec![f64::INFINITY]] {
                let fitted = Fitted::new(&axis, values.into_iter());
                assert!(fitted.high > fitted.low && !fitted.ticks().is_empty());
            }
        }
    }

    #[test]
    fn linear_labels_have_the_digits_of_their_step() {
        let fitted = Fitted::new(&Axis::linear("x"), [0.0, 0.31].into_iter());
        let labels: Vec<String> = fitted.ticks().into_iter().map(|t| t.1).collect();
        assert_eq!(labels[1], "0.1");
    }
}
