//! The automatic choice of the integrator against everything else that was measured.
//!
//! At the error that the chosen setting has, what would the cheapest other setting have cost? Between its measured points each
//! integrator's curve is taken as straight on logarithmic axes. An error below what the references agree to counts as that.
//! The bar is a factor 1.5, for position and for force. A step of an explicit integrator costs
//! the same at any length: its least measured cost per step counts for all its points, which takes out most of the scatter of
//! a busy machine.

use super::cases::{Case, SAMPLE_S};
use super::section::{Progress, Row, Section};
use super::tissue_run::time;
use super::truth::Truth;
use super::work_precision::{Point, point};
use crate::reference::Difference;
use serde_json::json;
use sim_core::tissue::choice::{ChoiceParams, choose};
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::newton::NewtonParams;

/// Factor in cost, at equal error, within which the choice counts as good.
const BAR: f64 = 1.5;

/// What the choice is for a case, measured.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    pub(super) point: Point,
    substeps: u32,
    words: String,
}

/// Chooses for a case and measures the choice as the ladders are measured; `None` when stopped or refused.
pub(super) fn measure(case: &Case, truth: &Truth, progress: &Progress<'_>) -> Option<Chosen> {
    let (newton, params) = (NewtonParams::default(), ChoiceParams::default());
    let choice = choose(&case.network, &case.start_m, case.period_s, &newton, &params);
    let per_sample = (SAMPLE_S / case.period_s).round() as usize * choice.substeps as usize;
    let cost = time(case, choice.integrator, per_sample, progress.stop).ok()??;
    let point = point(case, truth, &(choice.integrator, per_sample, Ok(cost)), progress)?;
    Some(Chosen { point, substeps: choice.substeps, words: choice.to_string() })
}

/// Cost and error of the stable points of an integrator, finer steps last.
fn curve(points: &[&Point], integrator: Integrator, pick: fn(&Difference) -> f64) -> Vec<(f64, f64, f64)> {
    let mine = points.iter().filter(|p| p.integrator == integrator && !p.unstable());
    let implicit = integrator == Integrator::Bdf2;
    let per_step = |p: &Point| Some(p.cpu_per_sim()? * p.dt_s);
    let least = mine.clone().filter_map(|p| per_step(p)).fold(f64::INFINITY, f64::min);
    let place = |p: &&Point| {
        let cost = if implicit { p.cpu_per_sim()? } else { least / p.dt_s };
        Some((p.dt_s, cost, pick(p.off.as_ref()?)))
    };
    let mut places: Vec<_> = mine.filter_map(place).collect();
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    places
}

/// Least cost at which a curve has this error, with the step: on a point, or between two.
fn cost_at(curve: &[(f64, f64, f64)], error: f64) -> Option<(f64, f64)> {
    let good_enough = curve.iter().filter(|p| p.2 <= error).map(|p| (p.1, p.0));
    let between = curve.windows(2).filter_map(|w| {
        let ((_, cheap, rough), (dt, dear, fine)) = (w[0], w[1]);
        if !(fine < error && error < rough) {
            return None;
        }
        let share = (rough / error).ln() / (rough / fine).ln();
        Some((cheap * (dear / cheap).powf(share), dt))
    });
    good_enough.chain(between).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// One row per case; `floor` is the error from which on its references tell one.
pub(super) fn row(case: &Case, chosen: &Chosen, points: &[Point], floor: f64) -> Row {
    let all: Vec<&Point> = points.iter().chain([&chosen.point]).collect();
    let front = |pick: fn(&Difference) -> f64| {
        let own = curve(&all, chosen.point.integrator, pick);
        let (_, cost, error) = own.into_iter().find(|p| p.0 == chosen.point.dt_s)?;
        let best = Integrator::ALL.into_iter().filter_map(|integrator| {
            let (cost, dt_s) = cost_at(&curve(&all, integrator, pick), error.max(floor))?;
            Some((cost, integrator, dt_s))
        });
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((cost / best.0, best.1, best.2))
    };
    let (position, force) = (front(|d| d.position), front(|d| d.force));
    let pass = [position, force].into_iter().all(|front| front.is_some_and(|(ratio, _, _)| ratio <= BAR));
    let off = chosen.point.off;
    vec![
        ("scene", json!(case.scene)),
        ("case", json!(case.regime.name())),
        ("integrator", json!(chosen.point.integrator.name())),
        ("substeps", json!(chosen.substeps)),
        ("chosen_dt_s", json!(chosen.point.dt_s)),
        ("position_error", json!(off.map(|d| d.position))),
        ("force_error", json!(off.map(|d| d.force))),
        ("cpu_per_sim", json!(chosen.point.cpu_per_sim())),
        ("cost_over_front_position", json!(position.map(|p| p.0))),
        ("front_integrator_position", json!(position.map(|p| p.1.name()))),
        ("front_dt_s_position", json!(position.map(|p| p.2))),
        ("cost_over_front_force", json!(force.map(|p| p.0))),
        ("front_integrator_force", json!(force.map(|p| p.1.name()))),
        ("front_dt_s_force", json!(force.map(|p| p.2))),
        ("pass", json!(pass)),
        ("reason", json!(chosen.words)),
    ]
}

/// The section.
pub(super) fn section(rows: Vec<Row>) -> Section {
    Section {
        key: "choice",
        title: "Is the automatic choice a good one?".into(),
        words: vec![
            "At load the solver chooses an integrator and its sub-steps from the stability number and a counted cost. Here the \
             choice stands beside everything that was measured on the same case: cost_over_front is its cost over that of the \
             cheapest setting with the same error (interpolated between measured steps). Up to 1.5, for position and for force, counts as \
             good; the columns beside name what would have been cheaper. An error below the difference of the two references \
             counts as that difference."
                .into(),
        ],
        figures: vec![],
        rows,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cost_at_an_error_is_read_off_the_curve() {
        // Order 1: halving the error doubles the cost.
        let curve = [(4e-3, 1.0, 0.04), (2e-3, 2.0, 0.02), (1e-3, 4.0, 0.01)];
        let cost = |error| cost_at(&curve, error).map(|c| c.0);
        assert_eq!(cost(0.02), Some(2.0));
        assert!((cost(0.03).unwrap() - 4.0 / 3.0).abs() < 1e-12);
        assert_eq!((cost(0.5), cost(0.001)), (Some(1.0), None));
    }
}
