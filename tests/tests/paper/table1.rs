//! Table 1: the data form of the suture control strategy, column by column.

use sim_core::vector::Vec3;
use sim_core::wound::ledger::{DISTANCE_FLOOR_M, LEDGER_CAPACITY, Ledger};

#[test]
fn table1_has_original_and_current_positions_and_distances_of_each_stitch() {
    let (left, right) = (Vec3::new(0.001, 0.002, 0.0), Vec3::new(0.004, 0.006, 0.0));
    let mut ledger = Ledger::default();
    let row = ledger.record(3, left, right, 0.009).expect("room");
    let (left_now, right_now) = (Vec3::new(0.001, 0.002, 0.001), Vec3::new(0.007, 0.010, 0.001));
    ledger.measure(row, left_now, right_now);
    let row = ledger.rows()[row];
    assert_eq!((row.pair, row.left_original_m, row.right_original_m), (3, left, right));
    assert_eq!((row.left_current_m, row.right_current_m), (left_now, right_now));
    // 3-4-5 and 6-8-10 triangles, millimetres.
    assert!((row.original_distance_m - 0.005).abs() < 1e-15 && (row.current_distance_m - 0.010).abs() < 1e-15);
    assert!((row.relative_error - 1.0).abs() < 1e-12);
    assert_eq!(row.open_distance_m, 0.009, "the open wound is a column of its own, not D_o");
}

#[test]
fn table1_error_of_a_closed_stitch_is_finite() {
    let mut ledger = Ledger::default();
    let row = ledger.record(0, Vec3::zeros(), Vec3::zeros(), 0.005).expect("room");
    ledger.measure(row, Vec3::zeros(), Vec3::new(1e-4, 0.0, 0.0));
    assert!((ledger.rows()[row].relative_error - 1e-4 / DISTANCE_FLOOR_M).abs() < 1e-15);
}

#[test]
fn table1_keeps_every_stitch_in_the_order_of_tying_up_to_its_capacity() {
    let mut ledger = Ledger::default();
    for pair in 0..LEDGER_CAPACITY as u32 {
        assert_eq!(ledger.record(pair, Vec3::zeros(), Vec3::x(), 2.0), Ok(pair as usize));
    }
    assert!(ledger.record(0, Vec3::zeros(), Vec3::x(), 2.0).is_err());
    assert!(ledger.rows().iter().enumerate().all(|(i, row)| row.pair as usize == i));
}
