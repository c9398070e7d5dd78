//! The maps as figures: (m, dt) per net and integrator, (K, c), (β, dt) and (Kvc, m), each with its closed form.

use super::attachment::{self, Follower};
use super::boundary::{EXPLICIT, longest_step_s};
use super::motion::{NetMotion, Point};
use super::probe::{Verdict, classify};
use super::servo_node::{self, HeldPoint};
use super::topology::Topology;
use crate::accuracy::plot::{Axis, HeatMap, MapClass, Marker, Series, Style, heat_map_svg};
use crate::accuracy::section::{Effort, Figure, Progress};
use crate::accuracy::side_by_side::side_by_side;
use sim_core::kinematics::integrate::KinematicsForm;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::regulation::ProjectedVelocity;

/// Look of the closed forms: a dashed line that reads on light and dark cells.
const FORMULA: Style = Style { colour: "#000000", marker: Marker::None, dash: "7 3" };

/// Values in geometric progression from `low` to `high`.
fn ladder(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| low * (high / low).powf(i as f64 / (count - 1) as f64)).collect()
}

/// From light to dark, so that they read in grey as well.
fn classes() -> Vec<MapClass> {
    [("stable", "#cfe3f2"), ("limit cycle", "#e69f00"), ("overflow", "#6b2737")]
        .map(|(name, colour)| MapClass { name: name.to_owned(), colour })
        .into()
}

struct Grid<'a> {
    title: String,
    x: (&'a str, Vec<f64>),
    y: (&'a str, Vec<f64>),
    curve: Option<(&'a str, Vec<(f64, f64)>)>,
}

fn map(grid: Grid<'_>, verdict: impl Fn(f64, f64) -> Verdict + Sync) -> HeatMap {
    let Grid { title, x, y, curve } = grid;
    let points: Vec<(f64, f64)> = y.1.iter().flat_map(|&v| x.1.iter().map(move |&u| (u, v))).collect();
    let cells = side_by_side(&points, |&(u, v)| verdict(u, v) as usize);
    HeatMap {
        title,
        x: Axis::log(x.0),
        y: Axis::log(y.0),
        x_values: x.1,
        y_values: y.1,
        cells,
        classes: classes(),
        curves: curve.map(|(name, points)| Series::new(name, FORMULA, points)).into_iter().collect(),
    }
}

fn form(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::PaperExplicit => "K dt² + 2c dt = 4m",
        Integrator::Verlet => "K dt² = 4m",
        _ => "K dt² = 4m + 2c dt",
    }
}

/// Mass across, step up, at Table 2's drag.
fn mass_and_step(net: &Topology, integrator: Integrator, count: usize) -> HeatMap {
    let (lambda, c) = (net.lambda_n_per_m, net.drag_n_s_per_m);
    let line = ladder(1e-6, 1e-1, 100).into_iter().map(|m| (m * 1e3, longest_step_s(integrator, lambda, m, c) * 1e3));
    let grid = Grid {
        title: format!("{}: {}", net.name, integrator.name()),
        x: ("node mass (g)", ladder(1e-3, 1e2, count)),
        y: ("dt (ms)", ladder(1e-3, 1e2, count)),
        curve: Some((form(integrator), line.collect())),
    };
    map(grid, |grams, ms| {
        let point = Point { integrator, mass_kg: grams * 1e-3, drag_n_s_per_m: c, dt_s: ms * 1e-3 };
        classify(&mut NetMotion::new(net, point))
    })
}

/// Stiffness across, drag up, at 1 ms and 0.5 g.
fn stiffness_and_drag(net: &Topology, integrator: Integrator, count: usize) -> HeatMap {
    let (mass_kg, dt_s) = (5e-4, 1e-3);
    let share = net.lambda_n_per_m / net.stiffness_n_per_m;
    let edge = |k: f64| match integrator {
        Integrator::PaperExplicit => (4.0 * mass_kg - share * k * dt_s * dt_s) / (2.0 * dt_s),
        _ => (share * k * dt_s * dt_s - 4.0 * mass_kg) / (2.0 * dt_s),
    };
    let line = ladder(1e1, 1e6, 400).into_iter().map(|k| (k, edge(k))).filter(|(_, c)| *c > 0.0);
    let grid = Grid {
        title: format!("{}: {}, 0.5 g, 1 ms", net.name, integrator.name()),
        x: ("k (N/m)", ladder(1e1, 1e6, count)),
        y: ("c (N·s/m)", ladder(1e-3, 1e2, count)),
        curve: Some((form(integrator), line.collect())),
    };
    let nets: Vec<Topology> = grid.x.1.iter().map(|k| net.with_stiffness(*k)).collect();
    map(grid, |k, drag_n_s_per_m| {
        let at = nets.iter().find(|n| n.stiffness_n_per_m == k).unwrap_or(net);
        classify(&mut NetMotion::new(at, Point { integrator, mass_kg, drag_n_s_per_m, dt_s }))
    })
}

fn beta_and_step(mode: ProjectedVelocity, count: usize) -> HeatMap {
    let betas = ladder(0.05, 1.0, count);
    let line = ladder(0.05, 1.0, 60).into_iter().map(|beta| (beta, attachment::longest_step_s(beta, mode) * 1e3));
    let formula = match mode {
        ProjectedVelocity::Corrected => "β K dt² = (1+3β) m + (1+β) c dt",
        ProjectedVelocity::Literal => "β K dt² = (1+β)(2m + c dt)",
    };
    let grid = Grid {
        title: attachment::name(mode).to_owned(),
        x: ("β", betas),
        y: ("dt (ms)", ladder(1e-1, 1e2, count)),
        curve: Some((formula, line.collect())),
    };
    map(grid, |beta, ms| classify(&mut Follower::new(beta, mode, ms * 1e-3)))
}

fn coupling_and_mass(form: KinematicsForm, count: usize) -> HeatMap {
    let line = ladder(1.0, 1e6, 100).into_iter().map(|k| (k, servo_node::least_mass_kg(k) * 1e3)).collect();
    let grid = Grid {
        title: format!("servo node: {}", servo_node::name(form)),
        x: ("Kvc (N/m)", ladder(1.0, 1e6, count)),
        y: ("m (g)", ladder(1e-3, 1e3, count)),
        curve: (form == KinematicsForm::Literal).then_some(("(S+Kvc) dt² + 2(c+Bvc) dt = 4m", line)),
    };
    map(grid, |coupling, grams| classify(&mut HeldPoint::new(coupling, grams * 1e-3, form)))
}

/// All figures; a stopped run gives those that are done.
pub(super) fn figures(nets: &[Topology], effort: Effort, progress: &Progress<'_>) -> Vec<Figure> {
    let (small, large) = if effort == Effort::Full { (41, 26) } else { (21, 9) };
    let mut figures = Vec::new();
    let mut add = |name: &str, title: &str, caption: &str, maps: &dyn Fn() -> Vec<HeatMap>| {
        if progress.stopped() {
            return;
        }
        (progress.say)(&format!("stability map: {title}"));
        let maps = maps();
        let columns = maps.len().min(3);
        let svg = heat_map_svg(title, &maps, columns);
        figures.push(Figure { name: name.to_owned(), caption: caption.to_owned(), svg });
    };
    let three = |net: &Topology, count| EXPLICIT.map(|integrator| mass_and_step(net, integrator, count));
    add(
        "stability-flat",
        "Stability over node mass and step, flat nets with Table 2's drag of skin",
        "As printed (left), with implicit drag (middle), Verlet (right). Dashed: the closed form.",
        &|| nets.iter().filter(|n| !n.is_large()).flat_map(|net| three(net, small)).collect(),
    );
    add(
        "stability-volume",
        "Stability over node mass and step, liver and vessel with Table 2's drag",
        "As printed (left), with implicit drag (middle), Verlet (right). Dashed: the closed form.",
        &|| {
            nets.iter()
                .filter(|n| n.is_large() && (effort == Effort::Full || n.is_own()))
                .flat_map(|net| three(net, large))
                .collect()
        },
    );
    let shear = nets.iter().find(|n| n.name == "quad + shear");
    add(
        "stability-stiffness-drag",
        "Stability over stiffness and drag",
        "Drag ends the printed form and saves the implicit one; Verlet does not care. Dashed: the closed form.",
        &|| {
            shear.into_iter().flat_map(|net| EXPLICIT[..2].iter().map(|i| stiffness_and_drag(net, *i, small))).collect()
        },
    );
    add(
        "stability-beta",
        "Stability over relaxation β and step",
        "A follower between springs of 320 N/m and an attachment projected once per step. Dashed: Jury's test.",
        &|| [ProjectedVelocity::Corrected, ProjectedVelocity::Literal].map(|mode| beta_and_step(mode, small)).into(),
    );
    add(
        "stability-coupling",
        "Stability of the servo's suture point over Kvc and mass at 1 kHz",
        "With one implicit solve there is no limit; as printed, the mass must exceed the dashed line.",
        &|| [KinematicsForm::ImplicitDrag, KinematicsForm::Literal].map(|form| coupling_and_mass(form, small)).into(),
    );
    figures
}
