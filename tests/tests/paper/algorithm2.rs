//! Algorithm 2: the suture control strategy over the rows of Table 1, as printed and in its sound reading.

use sim_core::vector::Vec3;
use sim_core::wound::control::{ControlMode, ControlParams, WoundControl};
use sim_core::wound::ledger::Ledger;

/// Pairs of suture points at the end of stitching: left and right, metres.
const TIED: [(Vec3, Vec3); 3] = [
    (Vec3::new(-0.002, 0.0, 0.0), Vec3::new(0.002, 0.0, 0.0)),
    (Vec3::new(-0.0025, 0.006, 0.0), Vec3::new(0.002, 0.006, 0.0)),
    (Vec3::new(-0.002, 0.012, 0.0005), Vec3::new(0.0025, 0.012, 0.0)),
];

/// Rounding of a distance of millimetres.
const ROUNDING_M: f64 = 1e-15;

/// A ledger of three stitches whose points have since moved apart by `stretch` times their distance.
fn ledger(stretch: [f64; 3]) -> Ledger {
    let mut ledger = Ledger::default();
    for (pair, (left, right)) in TIED.iter().enumerate() {
        ledger.record(pair as u32, *left, *right, 0.008).expect("there is room for three");
    }
    for (row, ((left, right), factor)) in TIED.iter().zip(stretch).enumerate() {
        let (middle, half) = ((left + right) / 2.0, (right - left) * (factor / 2.0));
        ledger.measure(row, middle - half, middle + half);
    }
    ledger
}

#[test]
fn algorithm2_as_printed_restores_the_distance_of_every_stitch_beyond_ten_percent() {
    let mut ledger = ledger([1.5, 1.08, 0.7]);
    let before: Vec<_> = ledger.rows().to_vec();
    let mut control = WoundControl::new(ControlMode::Paper, ControlParams::default());
    let outcome = control.supervise(&mut ledger, 0.005, &[]);
    let mut corrections = outcome.corrections.to_vec();
    corrections.sort_by_key(|c| c.row);
    assert_eq!(corrections.iter().map(|c| c.row).collect::<Vec<_>>(), [0, 2], "8 % is inside the band");
    for correction in corrections {
        let row = before[correction.row];
        let (left, right) = (row.left_current_m + correction.left_m, row.right_current_m + correction.right_m);
        // D_c ← |p_cl − p_cr| is D_o again, the middle has not moved, the line has not turned.
        assert!(((right - left).norm() - row.original_distance_m).abs() < ROUNDING_M, "row {}", correction.row);
        assert!((correction.left_m + correction.right_m).norm() < ROUNDING_M, "equal split");
        assert!((right - left).cross(&(row.right_current_m - row.left_current_m)).norm() < ROUNDING_M * 1e-2);
    }
    assert_eq!(ledger.rows()[1], before[1], "the stitch inside the band is left alone");
    assert!(ledger.worst_error() <= 0.1, "{}", ledger.worst_error());
}

#[test]
fn algorithm2_soundly_holds_what_has_opened_and_pushes_nothing_apart() {
    let dt = 0.005;
    let mut ledger = ledger([1.5, 1.08, 0.7]);
    let params = ControlParams::default();
    let mut control = WoundControl::new(ControlMode::Sound, params);
    let first = control.supervise(&mut ledger, dt, &[]).targets.to_vec();
    assert_eq!(first.iter().map(|t| t.row).collect::<Vec<_>>(), [0], "only the one that opened beyond 10 %");
    assert!((first[0].target_m - 0.006).abs() < ROUNDING_M, "begins without force, at the present distance");
    let mut last = first[0].target_m;
    for _ in 0..200 {
        let target = control.supervise(&mut ledger, dt, &[0.3]).targets[0].target_m;
        assert!(target <= last && last - target <= params.closing_speed_m_per_s * dt + ROUNDING_M);
        last = target;
    }
    assert_eq!(last, 0.004, "it sinks to D_o and no further");
}

#[test]
fn algorithm2_off_does_nothing() {
    let mut ledger = ledger([2.0, 2.0, 2.0]);
    let before = ledger.clone();
    let mut control = WoundControl::new(ControlMode::Off, ControlParams::default());
    let outcome = control.supervise(&mut ledger, 0.005, &[]);
    assert!(outcome.targets.is_empty() && outcome.corrections.is_empty());
    assert_eq!(ledger, before);
}
