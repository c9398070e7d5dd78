//! Cases V1 to V6. Each test holds the figure to the rule, or to the reason for which the rule cannot be met.

use suture_tests::accuracy::validation::v1_wound_closing::{PRE_STRAIN, WOUNDS, close_all, fit, of_source, rises};
use suture_tests::accuracy::validation::v2_seven_stitches::{WOUND_M, falls, run_suture};
use suture_tests::accuracy::validation::v3_strip::pull_strip;
use suture_tests::accuracy::validation::v4_vein::{PRESSURES_PA, lame_m, thin_wall_m, widening_m};
use suture_tests::accuracy::validation::v5_capsule::{membrane_n_per_m, strain_under};
use suture_tests::accuracy::validation::v6_relaxation::held_force;

/// Coarser than the report's 2 mm.
const COARSE_M: f64 = 0.003;

#[test]
fn v1_closing_forces_keep_their_order_within_each_source() {
    let closed: Vec<_> = close_all(COARSE_M, PRE_STRAIN, 2).into_iter().flatten().collect();
    assert_eq!(closed.len(), WOUNDS.len());
    for (wound, closed) in WOUNDS.iter().zip(&closed) {
        let off = closed.size_m.iter().zip(wound.size_mm).map(|(m, mm)| (m * 1e3 - mm).abs()).fold(0.0, f64::max);
        assert!(off < 0.1, "{wound:?} came to rest as {:?}", closed.size_m);
        let last = closed.path.last().expect("steps");
        assert!(last.0.abs() < 1e-9 && closed.peak_n == last.1, "the force peaks where the edges meet");
    }
    let peaks: Vec<f64> = closed.iter().map(|c| c.peak_n).collect();
    let ratios: Vec<f64> = WOUNDS.iter().zip(&peaks).map(|(w, p)| w.published_n / p).collect();
    for source in ["finite elements", "in vivo"] {
        assert!(rises(&of_source(&peaks, source)), "{source}: {peaks:?}");
        let (_, worst) = fit(&of_source(&ratios, source));
        assert!(worst < 0.30, "{source}: one fitted k leaves {worst}");
    }
    // The two sources do not fit together; were this to change, the report's words would be wrong.
    assert!(!rises(&peaks) && peaks[0] > peaks[1], "at equal width the longer wound is softer: {peaks:?}");
}

#[test]
fn v1_closing_force_is_the_slope_of_the_stored_energy() {
    // Work along the path by trapezoids against the force at its end: F grows nearly linearly from 0, so W = ½ F·gap.
    let closed = close_all(COARSE_M, 0.0, 4).remove(0).expect("it closes");
    let work: f64 = closed.path.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[0].0 - w[1].0)).sum();
    let linear = 0.5 * closed.peak_n * closed.path[0].0;
    assert!((work / linear - 1.0).abs() < 0.05, "work {work} J, linear {linear} J");
}

#[test]
fn v2_second_stitch_loses_two_thirds_and_is_flat_after_the_fourth() {
    let run = run_suture(WOUND_M, 0.002, PRE_STRAIN).expect("it rests");
    let second = run.second_n();
    let [fall, late] = falls(&second);
    assert!(second.windows(2).all(|w| w[1] <= w[0]), "{second:?}");
    assert!((fall - 0.67).abs() <= 0.15 && late <= 0.05, "fall {fall}, after stitch 4 {late}: {second:?}");
}

#[test]
fn v3_strip_is_a_membrane_of_four_thirds_k() {
    let pulled = pull_strip(0.02).expect("it rests");
    let membrane = 0.02 / pulled.strain;
    assert!((membrane / (4.0 / 3.0 * 160.0) - 1.0).abs() < 1e-3, "{membrane} N/m");
    assert!((-pulled.across / pulled.strain - 1.0 / 3.0).abs() < 1e-3, "{pulled:?}");
}

#[test]
fn v4_one_layer_is_the_thin_wall_and_three_are_stiffer_than_lame() {
    for pressure in PRESSURES_PA {
        let one = widening_m(1, pressure).expect("it rests");
        assert!((one / thin_wall_m(pressure) - 1.0).abs() < 0.05, "{one} m");
        assert!((0.003..=0.02).contains(&(one / 0.005)), "{one} m");
        let three = widening_m(3, pressure).expect("it rests");
        let lame = lame_m(pressure, 3.0 * 4.0 / 3.0 * 270.0 / 0.0015, 1.0 / 3.0);
        assert!((0.25..0.40).contains(&(1.0 - three / lame)), "three layers {three} m, Lamé {lame} m");
    }
}

#[test]
fn v5_capsule_is_a_membrane_of_two_over_root_three_k() {
    let strain = strain_under(1e-4 * membrane_n_per_m()).expect("it rests");
    assert!((1e-4 / strain - 1.0).abs() < 0.01, "{strain}");
}

#[test]
fn v6_a_held_force_stands_once_the_drag_has_let_go() {
    let force = held_force(10.0).expect("a solver");
    let at = |seconds: f64| force[(seconds / 5e-3) as usize - 1].1;
    assert!(at(0.2) > 1.1 * at(5.0), "the drag lets go at first");
    assert!((at(10.0) / at(5.0) - 1.0).abs() < 1e-6, "{} then {}", at(5.0), at(10.0));
}
