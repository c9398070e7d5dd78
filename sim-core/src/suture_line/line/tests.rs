//! Tests of the suture line: slack and taut, tension, feeding through the path, cutting.

use super::*;
use proptest::prelude::*;

/// 0.3 m of line in 30 links, EA = 60 N.
fn line() -> SutureLine {
    let params = SutureLineParams::new(0.3, 60.0, 30).expect("usable");
    SutureLine::new(params, Vec3::zeros(), Vec3::y())
}

fn lengths(points: &[Vec3]) -> impl Iterator<Item = f64> + '_ {
    points.windows(2).map(|w| (w[1] - w[0]).norm())
}

#[test]
fn slack_line_hangs_in_exact_links_without_tension() {
    let mut line = line();
    let anchor = Vec3::new(0.01, 0.0, 0.0);
    let step = line.step(&[anchor], FreeEnd::Held(Vec3::new(0.01, 0.15, 0.0)));
    assert_eq!((step.shape, step.tension_n), (LineShape::Slack, 0.0));
    assert!((step.extension_ratio - 0.5).abs() < 1e-12);
    for _ in 0..50 {
        line.step(&[anchor], FreeEnd::Held(Vec3::new(0.01, 0.15, 0.0)));
    }
    assert!(lengths(line.polyline()).all(|l| (l - 0.01).abs() < MEETING_TOLERANCE_M / 30.0 + 1e-15));
}

#[test]
fn taut_line_is_straight_and_its_tension_is_continuous() {
    let mut line = line();
    let mut last = 0.0;
    for i in 0..=400 {
        let reach = 0.29 + 0.00005 * f64::from(i);
        let step = line.step(&[Vec3::zeros()], FreeEnd::Held(Vec3::new(0.0, 0.0, reach)));
        let expected = 60.0 / 0.3 * (reach - 0.3_f64).max(0.0);
        assert!((step.tension_n - expected).abs() < 1e-12);
        assert!((step.tension_n - last).abs() <= 200.0 * 0.00005 + 1e-12);
        assert_eq!(step.shape == LineShape::Straight, reach / 0.3 >= 0.98);
        if step.shape == LineShape::Straight {
            assert!((lengths(line.polyline()).sum::<f64>() - reach).abs() < 1e-12);
        }
        last = step.tension_n;
    }
    assert!(last > 1.9);
}

#[test]
fn path_through_suture_points_uses_up_the_line() {
    let mut line = line();
    let path = [Vec3::zeros(), Vec3::new(0.05, 0.0, 0.0), Vec3::new(0.05, 0.05, 0.0)];
    line.step(&path, FreeEnd::Loose);
    let points = line.polyline();
    assert_eq!(&points[..3], &path);
    assert_eq!(points.len(), 3 + 30);
    // 0.3 m in all: 0.1 m in the path, 0.2 m free.
    assert!((lengths(points).sum::<f64>() - 0.3).abs() < 1e-12);
    assert!(lengths(&points[2..]).all(|l| (l - 0.2 / 30.0).abs() < 1e-15));
}

#[test]
fn gripped_line_is_taut_at_the_gripped_length() {
    let mut line = line();
    let hand_m = Vec3::new(0.0, 0.0, 0.041);
    let step = line.step(&[Vec3::zeros()], FreeEnd::Gripped { hand_m, free_length_m: 0.04 });
    assert_eq!(step.shape, LineShape::Straight);
    assert!((step.tension_n - 60.0 / 0.04 * 0.001).abs() < 1e-9);
}

#[test]
fn the_hand_draws_a_line_that_is_not_fixed_anywhere() {
    let mut line = line();
    let hand = Vec3::new(0.1, 0.3, 0.0);
    let step = line.step(&[], FreeEnd::Held(hand));
    assert_eq!((step.shape, step.tension_n), (LineShape::Slack, 0.0));
    assert_eq!(line.polyline().last(), Some(&hand));
    assert!(lengths(line.polyline()).all(|l| (l - 0.01).abs() < 1e-15));
    let before = line.clone();
    line.step(&[], FreeEnd::Loose);
    assert_eq!(line, before);
}

#[test]
fn cut_drops_the_tension_and_keeps_both_halves() {
    let mut line = line();
    let (anchor, hand) = (Vec3::zeros(), Vec3::new(0.0, 0.0, 0.31));
    assert!(line.step(&[anchor], FreeEnd::Held(hand)).tension_n > 1.0);
    line.cut(0.4);
    let step = line.step(&[anchor], FreeEnd::Held(hand));
    assert_eq!((step.shape, step.tension_n), (LineShape::Cut, 0.0));
    let (near, far) = line.pieces();
    assert_eq!((near.len(), far.len()), (13, 18));
    assert_eq!((near.first(), far.last()), (Some(&anchor), Some(&hand)));
    assert!(lengths(near).chain(lengths(far)).all(|l| (l - 0.01).abs() < 1e-15));
    // The hand takes its half along; the other half stays where it lies.
    let rest = near.to_vec();
    line.step(&[anchor], FreeEnd::Held(Vec3::new(0.2, 0.0, 0.4)));
    let (near, far) = line.pieces();
    assert!(near.iter().zip(&rest).all(|(a, b)| (a - b).norm() < 1e-14));
    assert!((far[0].z - 0.31).abs() < 0.2 && lengths(far).all(|l| (l - 0.01).abs() < 1e-15));
    line.restart(Vec3::zeros(), Vec3::x());
    assert_eq!(line.pieces().1.len(), 0);
}

#[test]
fn unusable_lines_are_refused() {
    for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(SutureLineParams::new(length, 1.0, 3), Err(SutureLineError::Length { .. })));
    }
    assert!(matches!(SutureLineParams::new(0.1, f64::NAN, 3), Err(SutureLineError::Stiffness { .. })));
    for links in [0, MAX_LINKS + 1, usize::MAX] {
        assert!(matches!(SutureLineParams::new(0.1, 1.0, links), Err(SutureLineError::Links { .. })));
    }
}

proptest! {
    #[test]
    fn no_path_and_no_hand_make_it_overflow_or_nan(
        path in prop::collection::vec(prop::array::uniform3(-0.3..0.3_f64), 0..100),
        hand in prop::array::uniform3(-0.5..0.5_f64), free in -1.0..1.0_f64, cut in -1.0..2.0_f64,
    ) {
        let path: Vec<Vec3> = path.into_iter().map(Vec3::from).collect();
        let hand_m = Vec3::from(hand);
        let mut line = line();
        let memory = line.points.capacity();
        for end in [FreeEnd::Held(hand_m), FreeEnd::Gripped { hand_m, free_length_m: free }, FreeEnd::Loose] {
            let step = line.step(&path, end);
            prop_assert!(step.tension_n >= 0.0 && step.tension_n.is_finite());
            prop_assert!(line.polyline().iter().all(|p| p.iter().all(|x| x.is_finite())));
            prop_assert_eq!(line.points.capacity(), memory);
        }
        line.cut(cut);
        line.step(&path, FreeEnd::Held(hand_m));
        let (near, far) = line.pieces();
        prop_assert!(!near.is_empty() && !far.is_empty());
    }
}
