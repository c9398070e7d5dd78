//! Force against deformation of the picked sample points (Zhang et al., Fig. 6).

use super::plot::{Axis, Plot};
use super::style;
use super::wish::Wish;
use crate::samples::Samples;
use egui::{RichText, Ui};

/// Height of the plot, points.
const HEIGHT: f32 = 92.0;
/// A plot shows at least this much.
const LEAST_MM: f64 = 0.5;
/// A plot shows at least this much.
const LEAST_N: f64 = 0.05;
/// Millimetres in a metre.
const MM: f64 = 1e3;

pub(super) fn show(ui: &mut Ui, samples: &Samples, wishes: &mut Vec<Wish>) {
    style::title(ui, "Over deformation (Fig. 6)", "N over mm", style::WEAK);
    ui.label(RichText::new(upright(samples)).size(style::SMALL).color(style::WEAK));
    let all = || samples.all().iter().flat_map(|s| s.curve().iter().map(move |m| [m.deformation_m * MM, s.force_n(m)]));
    let largest = |axis: usize| all().map(|point| point[axis]).fold(0.0, f64::max);
    let x = Axis::covering(Some([0.0, largest(0)]), LEAST_MM);
    let y = Axis::covering(Some([0.0, largest(1)]), LEAST_N);
    let plot = Plot::begin(ui, HEIGHT, x, y);
    plot.note(&format!("to {:.1} mm", x.high));
    for (sample, colour) in samples.all().iter().zip(style::SAMPLES) {
        plot.path(sample.curve().iter().map(|m| [m.deformation_m * MM, sample.force_n(m)]), colour);
    }
    for (index, (sample, colour)) in samples.all().iter().zip(style::SAMPLES).enumerate() {
        let name = format!("{}  node {}", index + 1, sample.node());
        let value = sample.curve().last().map_or_else(
            || "–".to_owned(),
            |m| {
                let of = if sample.is_suture_point() { "hand" } else { "largest spring" };
                format!("{:.2} mm, {of} {:.2} N", m.deformation_m * MM, sample.force_n(m))
            },
        );
        style::row(ui, &name, &value, colour);
    }
    ui.horizontal(|ui| {
        if ui.button(RichText::new("Save CSV (K)")).clicked() {
            wishes.push(Wish::SaveSamples);
        }
        if ui.button(RichText::new("Clear")).clicked() {
            wishes.push(Wish::ClearSamples);
        }
    });
}

/// Which force stands on the upright axis.
fn upright(samples: &Samples) -> &'static str {
    let points = samples.all().iter().filter(|sample| sample.is_suture_point()).count();
    match points {
        0 => "largest spring force at the node",
        all if all == samples.all().len() => "force of hand and line on the suture point",
        _ => "force of hand and line on suture points, elsewhere largest spring force at the node",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::example;

    #[test]
    fn the_axis_says_which_force_it_is() {
        let mut view = example::view();
        let mut samples = Samples::default();
        samples.pick(&view, 2);
        assert_eq!(upright(&samples), "force of hand and line on the suture point");
        view.outlines = 0;
        samples.pick(&view, 3);
        assert!(upright(&samples).contains("elsewhere largest spring force at the node"));
        samples.clear();
        samples.pick(&view, 3);
        assert_eq!(upright(&samples), "largest spring force at the node");
    }
}
