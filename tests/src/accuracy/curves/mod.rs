//! Figs. 6 and 7: force against deformation, and force against the distance of the suture points, of the three models,
//! each beside four baselines.
//!
//! Fig. 6: one suture point is led across the open wound. Fig. 7: both points are brought together until the edges touch.
//! The paper compares with recordings from a hospital and with three other systems; neither is public, and its figures have no
//! numbers. Absent therefore: any claim about which curve is closer to tissue.

mod boxes;
pub mod rig;

use super::plot::{self, Axis, Panel, Series, nth_style, panels_svg};
use super::section::{Effort, Figure, Progress, Row, Section};
use super::side_by_side::side_by_side;
use rig::{Level, Model, Pace, Pull, pull, specimen};
use serde_json::json;
use sim_core::scene::presets;

/// One curve.
struct Curve {
    scene: &'static str,
    model: Model,
    pull: Pull,
    levels: Vec<Level>,
}

/// Pulls every tissue under every model.
#[must_use]
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let pace = match effort {
        Effort::Quick => Pace { levels: 3, periods: 80 },
        Effort::Full => Pace { levels: 10, periods: 200 },
    };
    let wanted: Vec<(&'static str, Model)> =
        ["skin", "liver", "vessel"].iter().flat_map(|scene| Model::ALL.map(|model| (*scene, model))).collect();
    let found = side_by_side(&wanted, |&(scene, model)| {
        let specimen = presets::by_name(scene).filter(|_| !progress.stopped()).and_then(|c| specimen(&c, model));
        let Some(specimen) = specimen else { return Vec::new() };
        (progress.say)(&format!("{scene}, {}", model.name()));
        let pulls = [Pull::OnePoint, Pull::Together].into_iter();
        let curve = |which| Some(Curve { scene, model, pull: which, levels: pull(&specimen, model, which, pace)? });
        pulls.filter_map(curve).collect()
    });
    let curves: Vec<Curve> = found.into_iter().flatten().collect();
    Section {
        key: "curves",
        title: "Figs. 6 and 7: force, deformation and distance".to_owned(),
        words: WORDS.map(str::to_owned).to_vec(),
        figures: vec![fig6(&curves), fig7(&curves)],
        rows: curves.iter().flat_map(rows).collect(),
    }
}

const WORDS: [&str; 4] = [
    "The curves of real tissue in Figs. 6 and 7 of the paper were recorded in a hospital and are not public; the printed figures \
     have no numbers. What can be had stands beside our curves: the same springs without attachments, with hard tethers, by \
     XPBD, and a spring-box model after Choi.",
    "The spring boxes are our reading of an abstract: cubes of the tissue's spacing with springs of its k along edges and face \
     diagonals. They have no pre-strain and no attachments, and are not that group's program.",
    "The levels drawn in the skin panel of Fig. 7 are finite-element and in-vivo forces that close other wounds in their middle \
     (Čapek 2012), for the order of size only. For liver and vessel no published force against the distance of two suture points was found.",
    "As the paper says of Fig. 7, the force rises as the wound closes. Attachments raise it further: they carry part of the pull \
     past the springs, and the hand feels their reaction.",
];

fn rows(curve: &Curve) -> Vec<Row> {
    let figure = if curve.pull == Pull::OnePoint { 6 } else { 7 };
    let row = |level: &Level| {
        vec![
            ("figure", json!(figure)),
            ("scene", json!(curve.scene)),
            ("model", json!(curve.model.name())),
            ("deformation_mm", json!(level.deformation_m * 1e3)),
            ("distance_mm", json!(level.distance_m * 1e3)),
            ("force_n", json!(level.force_n)),
        ]
    };
    curve.levels.iter().map(row).collect()
}

fn panels(curves: &[Curve], which: Pull, x: &str, of: fn(&Level) -> f64) -> Vec<Panel> {
    let panel = |scene: &str| {
        let here = curves.iter().filter(|c| c.scene == scene && c.pull == which);
        let series = here.map(|c| {
            let style = Model::ALL.iter().position(|m| *m == c.model).unwrap_or(0);
            Series::new(c.model.name(), nth_style(style), c.levels.iter().map(|l| (of(l), l.force_n)).collect())
        });
        Panel {
            title: scene.to_owned(),
            x: Axis::linear(x),
            y: Axis::linear("force (N)"),
            series: series.collect(),
            levels: Vec::new(),
        }
    };
    ["skin", "liver", "vessel"].map(panel).into_iter().collect()
}

fn fig6(curves: &[Curve]) -> Figure {
    let panels = panels(curves, Pull::OnePoint, "deformation (mm)", |l| l.deformation_m * 1e3);
    Figure {
        name: "fig6_force_deformation".to_owned(),
        caption: "Fig. 6. Force on one suture point that is led across the open wound, against its way from rest."
            .to_owned(),
        svg: panels_svg("Force against deformation", &panels, 3),
    }
}

fn fig7(curves: &[Curve]) -> Figure {
    let mut panels = panels(curves, Pull::Together, "distance of the points (mm)", |l| l.distance_m * 1e3);
    if let Some(skin) = panels.first_mut() {
        skin.levels.push(plot::Level::Y(0.5, "30 × 5 mm, computed".to_owned()));
        skin.levels.push(plot::Level::Y(1.1, "36 × 5 mm, in vivo".to_owned()));
    }
    Figure {
        name: "fig7_distance_force".to_owned(),
        caption: "Fig. 7. Force on each suture point while both are brought together, against their distance; the left end is where \
                  the edges touch."
            .to_owned(),
        svg: panels_svg("Force against distance", &panels, 3),
    }
}
