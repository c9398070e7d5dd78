//! Deviations of the suture point, the line and Table 1, each on its own.

use crate::closed_forms::implicit_drag_step_limit_s;
use sim_core::kinematics::suture_point::{Neighbours, SpringLaw, spring_force};
use sim_core::scene::presets::{self, Table2};
use sim_core::scene::step::Scene;
use sim_core::suture_line::follow_the_leader::follow_both;
use sim_core::tissue::stability::{Tangent, lambda_max};
use sim_core::vector::Vec3;

/// Quad spacing of the wound-edge node, metres.
const QUAD_M: f64 = 0.0025;
/// Its way across the wound: half of a 2 mm approximation, metres.
const WAY_M: f64 = 0.001;
/// Links of the line.
const LINKS: usize = 40;
/// Most sweeps tried.
const MAX_SWEEPS: usize = 5000;

/// Force on a wound-edge node under both spring laws, bilateral first, newtons.
#[must_use]
pub fn spring_law_forces_n(row: Table2) -> [f64; 2] {
    let around = [(-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let position_m = around.map(|(x, y)| Vec3::new(x, y, 0.0) * QUAD_M);
    let rest_length_m = position_m.map(|x| x.norm());
    let k = row.stiffness_n_per_mm * 1e3;
    let stiffness_n_per_m = [k, k, k, 0.5 * k, 0.5 * k];
    let neighbours = Neighbours {
        position_m: &position_m,
        rest_length_m: &rest_length_m,
        stiffness_n_per_m: &stiffness_n_per_m,
        beta: row.beta,
    };
    [SpringLaw::Bilateral, SpringLaw::PaperTension]
        .map(|law| spring_force(law, Vec3::new(WAY_M, 0.0, 0.0), &neighbours).norm())
}

/// Distance of the middle suture points of the skin preset: open, and when its edges touch, metres.
#[must_use]
pub fn wound_distances_m() -> Option<[f64; 2]> {
    let scene = Scene::new(&presets::skin(), None).ok()?;
    let place = scene.places().get(scene.places().len() / 2)?;
    Some([(place.right_m - place.left_m).norm(), place.closed_m])
}

/// Longest stable step of the skin preset with explicit and with implicit drag, seconds, for its lightest node.
#[must_use]
pub fn stable_steps_s() -> Option<[f64; 2]> {
    let scene = Scene::new(&presets::skin(), None).ok()?;
    let network = scene.solver().network();
    let lambda = lambda_max(&Tangent::at(network, &scene.solver().state().position_m));
    let free = (0..network.node_count()).filter(|i| network.fixed[*i] == 0);
    let lightest = free.min_by(|a, b| network.mass_kg[*a].total_cmp(&network.mass_kg[*b]))?;
    let (mass, drag) = (network.mass_kg[lightest], network.drag_n_s_per_m[lightest]);
    // λ dt² + 2c dt = 4m.
    let explicit = ((drag * drag + 4.0 * mass * lambda).sqrt() - drag) / lambda;
    Some([explicit, implicit_drag_step_limit_s(lambda, mass, drag)])
}

/// Sweeps that Follow the Leader needs with both ends held at `ratio` of the line's length; the line starts as an arc.
#[must_use]
pub fn ftl_sweeps(ratio: f64) -> usize {
    let link_m = 1.0 / LINKS as f64;
    let arc = |i: usize| {
        let s = i as f64 / LINKS as f64;
        Vec3::new(s * ratio, 0.5 * s * (1.0 - s), 0.0)
    };
    let mut points: Vec<Vec3> = (0..=LINKS).map(arc).collect();
    let (first, last) = (points[0], points[LINKS]);
    follow_both(&mut points, first, last, link_m, 1e-6, MAX_SWEEPS).sweeps
}
