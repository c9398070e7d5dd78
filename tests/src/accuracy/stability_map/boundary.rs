//! Boundaries of the nets: bisected by runs in dt or m, and what the closed form says.

use super::motion::{NetMotion, Point};
use super::probe::{bisect, edge_width, edge_windows, grows};
use super::topology::Topology;
use crate::accuracy::section::Effort;
use crate::accuracy::side_by_side::side_by_side;
use sim_core::kinematics::integrate::{implicit_max_dt_s, implicit_min_mass_kg, literal_max_dt_s, literal_min_mass_kg};
use sim_core::tissue::integrator::Integrator;

/// One boundary.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// Net.
    pub topology: String,
    /// Integrator or form.
    pub integrator: String,
    /// What was held, in words.
    pub at: String,
    /// What was varied, with its unit.
    pub quantity: &'static str,
    /// Edge found by runs; `None` where every run ended alike.
    pub measured: Option<f64>,
    /// Edge of the closed form; `None` where there is none.
    pub formula: Option<f64>,
}

impl Boundary {
    /// Measured over formula; `None` unless both exist.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        Some(self.measured? / self.formula?)
    }
}

/// The integrators with a boundary.
pub(super) const EXPLICIT: [Integrator; 3] = [Integrator::PaperExplicit, Integrator::SemiImplicit, Integrator::Verlet];

/// Longest stable step of a net, by its closed form, seconds.
pub(super) fn longest_step_s(integrator: Integrator, lambda: f64, mass_kg: f64, drag: f64) -> f64 {
    match integrator {
        Integrator::PaperExplicit => literal_max_dt_s(lambda, mass_kg, drag),
        Integrator::Verlet => 2.0 * (mass_kg / lambda).sqrt(),
        _ => implicit_max_dt_s(lambda, mass_kg, drag),
    }
}

/// Whether a net is unstable at a point.
fn unstable(net: &Topology, point: Point, effort: Effort) -> bool {
    grows(&mut NetMotion::new(net, point), edge_windows(effort))
}

/// The longest stable step at a mass and a drag.
fn step_edge(
    net: &Topology,
    integrator: Integrator,
    (mass_kg, drag_n_s_per_m): (f64, f64),
    effort: Effort,
) -> Boundary {
    let formula = longest_step_s(integrator, net.lambda_n_per_m, mass_kg, drag_n_s_per_m);
    // A decade to either side: wide enough that the formula does not decide, narrow enough to be quick.
    let measured = bisect(formula / 10.0, formula * 10.0, edge_width(effort), |dt_s| {
        unstable(net, Point { integrator, mass_kg, drag_n_s_per_m, dt_s }, effort)
    });
    Boundary {
        topology: net.name.to_owned(),
        integrator: integrator.name().to_owned(),
        at: format!(
            "m = {} g, c = {drag_n_s_per_m} N·s/m, K = {:.2} k",
            mass_kg * 1e3,
            net.lambda_n_per_m / net.stiffness_n_per_m
        ),
        quantity: "dt (s)",
        measured,
        formula: Some(formula),
    }
}

/// Least stable node mass at a step, with Table 2's drag.
#[must_use]
pub fn edge_mass(net: &Topology, integrator: Integrator, dt_s: f64, effort: Effort) -> Boundary {
    let (lambda, drag_n_s_per_m) = (net.lambda_n_per_m, net.drag_n_s_per_m);
    let formula = match integrator {
        Integrator::PaperExplicit => literal_min_mass_kg(lambda, drag_n_s_per_m, dt_s),
        Integrator::Verlet => 0.25 * lambda * dt_s * dt_s,
        _ => implicit_min_mass_kg(lambda, drag_n_s_per_m, dt_s),
    };
    let held = |mass_kg| Point { integrator, mass_kg, drag_n_s_per_m, dt_s };
    let has_edge = formula > 0.0;
    let (low, high) = if has_edge { (formula / 10.0, formula * 10.0) } else { (1e-9, 1.0) };
    Boundary {
        topology: net.name.to_owned(),
        integrator: integrator.name().to_owned(),
        at: format!("dt = {} ms, c = {drag_n_s_per_m} N·s/m, K = {:.2} k", dt_s * 1e3, lambda / net.stiffness_n_per_m),
        quantity: "m (kg)",
        measured: bisect(low, high, edge_width(effort), |mass_kg| unstable(net, held(mass_kg), effort)),
        formula: has_edge.then_some(formula),
    }
}

/// Steps at which Table 2's least masses are known from elsewhere, seconds.
pub const TABLE_2_EDGES: [f64; 3] = [1e-3, 2e-3, 5e-3];

/// One boundary to be found.
enum Wanted {
    Step(Integrator, (f64, f64)),
    Mass(Integrator, f64),
}

/// All boundaries of a net; of a large one, the quick report has one per integrator and quantity.
#[must_use]
pub fn boundaries(net: &Topology, effort: Effort) -> Vec<Boundary> {
    let c = net.drag_n_s_per_m;
    let mut points = vec![(5.5e-5, c)];
    let mut steps = &TABLE_2_EDGES[..1];
    if effort == Effort::Full || !net.is_large() {
        points.extend([(2e-3, c), (5.5e-5, 0.05)]);
    }
    if effort == Effort::Full {
        points.extend([(1e-5, c), (1e-2, c), (1e-3, 0.1), (1e-3, 0.01)]);
        steps = &TABLE_2_EDGES;
    }
    let by_step = EXPLICIT.iter().flat_map(|i| points.iter().map(|p| Wanted::Step(*i, *p)));
    let by_mass = EXPLICIT.iter().flat_map(|i| steps.iter().map(|dt| Wanted::Mass(*i, *dt)));
    let wanted: Vec<Wanted> = by_step.chain(by_mass).collect();
    side_by_side(&wanted, |wanted| match *wanted {
        Wanted::Step(integrator, point) => step_edge(net, integrator, point, effort),
        Wanted::Mass(integrator, dt_s) => edge_mass(net, integrator, dt_s, effort),
    })
}
