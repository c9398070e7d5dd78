//! Refinement: a patch converges, a node does not, drag per area keeps its time. Curves of Figs. 6 and 7.

use sim_core::scene::presets;
use suture_tests::accuracy::curves::rig::{Model, Pace, Pull, pull, specimen};
use suture_tests::accuracy::refinement::{
    Drag, kelvin_slope, node_stiffness, observed_order, patch_stiffness, rayleigh_time_s, relaxation_time_s,
};

#[test]
fn a_patch_converges_and_a_node_softens_by_the_logarithm() {
    let patch = [32, 64, 128].map(|cells| patch_stiffness(cells).expect("it rests"));
    let order = observed_order(patch);
    // The corners of a rigid square hold the order below two.
    assert!((1.0..2.0).contains(&order), "order {order}: {patch:?}");
    assert!((patch[2] / patch[1] - 1.0).abs() < 0.01, "{patch:?}");
    let node = [16, 32, 64].map(|cells| node_stiffness(cells).expect("it rests"));
    for pair in node.windows(2) {
        let slope = (1.0 / pair[1] - 1.0 / pair[0]) / 2.0_f64.ln();
        assert!((slope / kelvin_slope() - 1.0).abs() < 0.01, "{slope} against Kelvin's {}", kelvin_slope());
    }
}

#[test]
fn drag_per_node_takes_four_times_as_long_on_half_the_spacing() {
    let time = |cells, drag| relaxation_time_s(cells, drag).expect("stable");
    let ratio = time(32, Drag::PerNode) / time(16, Drag::PerNode);
    assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
    let ratio = time(32, Drag::PerArea) / time(16, Drag::PerArea);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    // Rayleigh's quotient of any shape is a bound from below on the slowest time, and this shape is nearly the mode.
    let (measured, bound) = (time(32, Drag::PerNode), rayleigh_time_s(32, Drag::PerNode));
    assert!(measured >= bound && measured < 1.1 * bound, "{measured} s, bound {bound} s");
}

#[test]
fn fig7_force_rises_as_the_wound_closes_under_every_model() {
    let config = presets::skin();
    let mut last = Vec::new();
    for model in Model::ALL {
        let specimen = specimen(&config, model).expect("the skin preset loads");
        let curve = pull(&specimen, model, Pull::Together, Pace { levels: 3, periods: 80 }).expect("stable");
        assert!(
            curve.windows(2).all(|w| w[1].force_n > w[0].force_n && w[1].distance_m < w[0].distance_m),
            "{model:?} {curve:?}"
        );
        let end = curve.last().expect("levels");
        assert!((end.distance_m - specimen.contact_m).abs() < 1e-6, "{model:?} ends where the edges touch");
        last.push(end.force_n);
    }
    // Attachments carry part of the pull past the springs, hard ones more than relaxed ones.
    assert!(last[1] < last[0] && last[0] < last[2], "plain {} relaxed {} hard {}", last[1], last[0], last[2]);
}
