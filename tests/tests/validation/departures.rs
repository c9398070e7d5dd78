//! Paper against sound mode: each departure against a closed form or a balance.

use sim_core::scene::presets;
use sim_core::tissue::regulation::ProjectedVelocity;
use suture_tests::accuracy::deviations::{
    Rig, ftl_sweeps, hold_at_rate, ratchet_m, spring_law_forces_n, stable_steps_s, wound_distances_m,
};

#[test]
fn algorithm1_with_a_carried_radius_ratchets_to_the_whole_excess() {
    let (excess, beta) = (0.01, 0.8);
    for (n, radius) in ratchet_m(excess, beta, 12).into_iter().enumerate() {
        let closed_form = excess * (1.0 - (1.0_f64 - beta).powi(n as i32 + 1));
        assert!((radius - closed_form).abs() < 1e-15, "call {n}: {radius}");
    }
}

#[test]
fn relaxation_per_step_stiffens_with_the_rate_and_converted_once_it_does_not() {
    let rig = Rig::skin();
    let held = |rate, mode| hold_at_rate(&rig, rate, mode).expect("stable");
    let (slow, fast) =
        (held(200.0, rig.paper(ProjectedVelocity::Corrected)), held(1000.0, rig.paper(ProjectedVelocity::Corrected)));
    assert!(fast.force_n > 1.2 * slow.force_n && fast.excess_m < 0.6 * slow.excess_m, "{slow:?} {fast:?}");
    let (calm, swift) = (held(200.0, rig.compliant()), held(1000.0, rig.compliant()));
    assert!((swift.force_n / calm.force_n - 1.0).abs() < 1e-6, "{calm:?} {swift:?}");
    // Only with the reaction of the attachments does the hand balance what the rim holds.
    assert!((calm.force_n / calm.rim_n - 1.0).abs() < 1e-3 && calm.springs_n < 0.8 * calm.rim_n, "{calm:?}");
    let literal = held(1000.0, rig.paper(ProjectedVelocity::Literal));
    assert!(literal.speed_m_per_s > 0.05 && fast.speed_m_per_s < 1e-6, "{literal:?} {fast:?}");
}

#[test]
fn readings_of_points_line_and_table_differ_as_stated() {
    for row in [presets::SKIN, presets::LIVER, presets::VESSEL] {
        let [bilateral, tension] = spring_law_forces_n(row);
        assert!((tension / bilateral - row.beta).abs() < 1e-12, "every spring of the edge node is in tension");
    }
    let [open, closed] = wound_distances_m().expect("the skin preset loads");
    assert!(open > 1.5 * closed);
    let [explicit, implicit] = stable_steps_s().expect("the skin preset loads");
    assert!(explicit < 1e-5 && implicit > 1e-3, "{explicit} {implicit}");
    assert!(ftl_sweeps(0.5) < 10 && ftl_sweeps(0.99) > 500);
}
