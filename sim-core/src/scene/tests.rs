//! The scenes as a whole: they load, stand still until touched, take a stitch, and come back on restore.

mod rest;

use super::build::SceneError;
use super::presets;
use super::procedure::{Procedure, ProcedureStanding, SceneSource, SessionRequest};
use super::step::{ResumeError, Scene, ServoInput};
use super::stitching::TiedStitch;
use super::suturing::{HandInput, Stage};
use crate::tissue::handle::MAX_HANDLES;
use crate::tissue::settle::SettleEnd;
use crate::vector::Vec3;
use crate::wound::control::ControlMode;
use crate::wound::ledger::LedgerRow;

/// A tissue at rest may move by rounding and by the residual of settling: 1 µN on 160 N/m is 6 nm.
const AT_REST_M: f64 = 1e-7;

fn hand(position_m: Vec3, press_count: u32, release_count: u32) -> ServoInput {
    ServoInput {
        second: None,
        hand: HandInput { position_m, press_count, release_count },
        port_epoch: u32::MAX,
        handles_m: [None; MAX_HANDLES],
    }
}

/// A kinematic hand: the servo of this test puts the suture points where it likes.
fn drive(scene: &mut Scene, mut input: ServoInput, handles: [Option<Vec3>; 2], steps: u32) {
    for _ in 0..steps {
        input.port_epoch = scene.grips().epoch();
        input.handles_m[..2].copy_from_slice(&handles);
        scene.step(Some(&input));
    }
}

/// Sutures pair 0 with the points moved to `closed_m` of each other.
fn one_stitch(scene: &mut Scene) {
    let start = scene.places()[0];
    scene.step(Some(&hand(start.left_m, 0, 0)));
    drive(scene, hand(start.left_m, 1, 0), [Some(start.left_m), None], 2);
    drive(scene, hand(start.left_m, 1, 1), [None; 2], 2);
    let open = scene.places()[0];
    let input = hand(open.right_m, 2, 1);
    drive(scene, input, [Some(open.right_m), Some(open.left_m)], 1);
    let across = (open.right_m - open.left_m).normalize();
    let middle = 0.5 * (open.right_m + open.left_m);
    let half = 0.5 * (open.closed_m - 2e-4);
    drive(scene, input, [Some(middle + across * half), Some(middle - across * half)], 100);
    drive(scene, hand(open.right_m, 2, 2), [None; 2], 1);
}

#[test]
fn presets_load_settle_and_stand_still() {
    for config in [presets::skin(), presets::liver(), presets::vessel()] {
        let mut scene = Scene::new(&config, None).unwrap();
        assert_eq!(scene.settling().end, SettleEnd::Converged, "{}: {:?}", config.name, scene.settling());
        let before = scene.solver().state().position_m.clone();
        for _ in 0..100 {
            scene.step(None);
        }
        let moved = scene.solver().state().position_m.iter().zip(&before).map(|(a, b)| (a - b).norm());
        let most = moved.fold(0.0, f64::max);
        assert!(most < AT_REST_M, "{} moved by {most} m", config.name);
        assert_eq!(scene.suturing().stage(), Stage::Idle);
        assert!(scene.grips().iter().next().is_none());
    }
}

#[test]
fn a_stitch_is_tied_and_written_into_the_ledger() {
    for config in [presets::skin(), presets::liver(), presets::vessel()] {
        let mut scene = Scene::new(&config, None).unwrap();
        let open = scene.places()[0].distance_m();
        one_stitch(&mut scene);
        let rows = scene.ledger_rows();
        assert_eq!(rows.len(), 1, "{}: stage {:?}", config.name, scene.suturing().stage());
        assert!((rows[0].open_distance_m - open).abs() < AT_REST_M);
        assert!(rows[0].original_distance_m < open, "{}", config.name);
        drive(&mut scene, hand(Vec3::new(0.0, 0.0, 0.05), 2, 2), [None; 2], 200);
        let row = &scene.ledger_rows()[0];
        assert!(row.relative_error <= 0.10, "{}: ER {}", config.name, row.relative_error);
    }
}

/// What another solver can know of a scene's stitches.
fn left_behind(scene: &Scene) -> Vec<TiedStitch> {
    let of = |row: &LedgerRow| TiedStitch {
        pair: row.pair as usize,
        left_original_m: row.left_original_m,
        right_original_m: row.right_original_m,
        rest_length_m: row.rest_length_m,
        slipped_m: row.slipped_m,
        history: row.history,
    };
    scene.ledger_rows().iter().map(of).collect()
}

#[test]
fn stitches_that_another_solver_tied_hold_the_wound_as_they_did() {
    /// The stitch itself is stiff: a hundredth of the 0.4 mm that a later pull may open it by, and more.
    const SAME_DISTANCE_M: f64 = 1e-5;
    /// The wound as a whole is soft and both are still on their way to rest, the liver by 0.1 mm along its normal.
    const SAME_PLACE_M: f64 = 2e-4;
    for config in [presets::skin(), presets::liver(), presets::vessel()] {
        let mut scene = Scene::new(&config, None).unwrap();
        one_stitch(&mut scene);
        let away = |presses| hand(Vec3::new(0.0, 0.0, 0.05), presses, presses);
        drive(&mut scene, away(2), [None; 2], 300);
        let mut next = Scene::new(&config, None).unwrap();
        next.resume(&left_behind(&scene)).unwrap();
        let mut apart_m = SAME_PLACE_M;
        for steps in [0, 200] {
            drive(&mut next, away(0), [None; 2], steps);
            drive(&mut scene, away(2), [None; 2], steps);
            let (old, new) = (scene.ledger_rows()[0], next.ledger_rows()[0]);
            assert_eq!(new.original_distance_m, old.original_distance_m);
            assert_eq!((new.slipped_m, new.history), (old.slipped_m, old.history), "{}", config.name);
            assert!((new.open_distance_m - old.open_distance_m).abs() < AT_REST_M);
            let change_m = (new.current_distance_m - old.current_distance_m).abs();
            assert!(change_m < SAME_DISTANCE_M, "{}: {change_m} m after {steps} steps", config.name);
            let [left, right] = [new.left_current_m - old.left_current_m, new.right_current_m - old.right_current_m];
            let moved_m = left.norm() + right.norm();
            assert!(moved_m < apart_m, "{}: {moved_m} m apart after {steps} steps", config.name);
            apart_m = moved_m;
        }
        assert_eq!((next.suturing().stitches(), next.suturing().points_taken()), (1, 2));
        assert_eq!(next.suturing().stage(), Stage::Idle);
    }
}

#[test]
fn a_standing_of_another_procedure_is_refused_and_changes_nothing() {
    let source = || SceneSource { config: presets::skin(), mesh: None };
    let mut procedure = Procedure::new(&[source(), source()]).unwrap();
    let mut scene = Scene::new(&presets::skin(), None).unwrap();
    one_stitch(&mut scene);
    let stitch = left_behind(&scene)[0];
    let standing = |scene, stitches: &[(usize, TiedStitch)]| ProcedureStanding {
        scene,
        generation: 40,
        control: Some(ControlMode::Off),
        stitches: stitches.to_vec(),
    };
    let count = procedure.scene().places().len();
    let odd = TiedStitch { rest_length_m: f64::NAN, ..stitch };
    for (bad, expected) in [
        (standing(2, &[]), ResumeError::Scene { scene: 2, count: 2 }),
        (standing(0, &[(9, stitch)]), ResumeError::Scene { scene: 9, count: 2 }),
        (standing(0, &[(0, stitch), (1, TiedStitch { pair: 99, ..stitch })]), ResumeError::Pair { pair: 99, count }),
        (standing(1, &[(1, stitch), (1, stitch)]), ResumeError::Twice { pair: 0 }),
        (standing(1, &[(1, odd)]), ResumeError::Number { pair: 0 }),
    ] {
        assert_eq!(procedure.resume(&bad), Err(expected));
        assert_eq!((procedure.progress(), procedure.generation(), procedure.rows().count()), ((0, 2), 1, 0));
    }
    procedure.resume(&standing(1, &[(0, stitch), (1, stitch)])).unwrap();
    assert_eq!((procedure.progress(), procedure.generation(), procedure.rows().count()), ((1, 2), 40, 2));
    assert_eq!(procedure.scene().control_mode(), Some(ControlMode::Off));
    procedure.request(SessionRequest::Restore).unwrap();
    assert_eq!((procedure.generation(), procedure.rows().count()), (41, 1));
    procedure.request(SessionRequest::Start).unwrap();
    assert_eq!((procedure.progress(), procedure.generation(), procedure.rows().count()), ((0, 2), 42, 0));
    assert_eq!(procedure.scene().control_mode(), Some(ControlMode::Off), "what was chosen stays");
}

#[test]
fn restore_brings_back_the_start_to_the_bit() {
    let mut scene = Scene::new(&presets::skin(), None).unwrap();
    let before = scene.solver().state().clone();
    one_stitch(&mut scene);
    assert_ne!(scene.solver().state(), &before);
    scene.restore();
    assert_eq!(scene.solver().state(), &before);
    assert_eq!((scene.suturing().stage(), scene.ledger_rows().len()), (Stage::Idle, 0));
}

#[test]
fn a_procedure_goes_forth_and_back_and_refuses_what_is_not_there() {
    let sources = [presets::skin(), presets::vessel()].map(|config| SceneSource { config, mesh: None });
    let mut procedure = Procedure::new(&sources).unwrap();
    assert!(procedure.request(SessionRequest::Previous).is_err());
    assert!(procedure.request(SessionRequest::Tie).is_err());
    procedure.request(SessionRequest::Next).unwrap();
    assert_eq!((procedure.progress(), procedure.scene().kind_code()), ((1, 2), 2));
    assert!(procedure.request(SessionRequest::Next).is_err());
    procedure.request(SessionRequest::Previous).unwrap();
    assert_eq!((procedure.progress(), procedure.generation()), ((0, 2), 3));
    assert_eq!(Procedure::new(&[]).unwrap_err(), SceneError::NoScene);
}

#[test]
fn a_scene_without_a_stage_has_no_memory_for_it() {
    let mut config = presets::skin();
    config.attachment = None;
    config.wound.contact_stiffness_n_per_mm = None;
    config.line = None;
    config.control = None;
    let scene = Scene::new(&config, None).unwrap();
    assert!(scene.stages().attachments.is_none() && scene.stages().pairs.is_none() && scene.stages().loads.is_none());
    assert_eq!(scene.control_mode(), None);
}

#[test]
fn in_paper_mode_a_held_point_shows_its_error_in_the_ledger() {
    let mut scene = Scene::new(&presets::skin(), None).unwrap();
    one_stitch(&mut scene);
    drive(&mut scene, hand(Vec3::new(0.0, 0.0, 0.05), 2, 2), [None; 2], 50);
    assert!(scene.set_control_mode(ControlMode::Paper));
    // The tied left point is dragged away from its partner; the control moves the right one only.
    let place = scene.places()[0];
    let away = place.left_m + (place.left_m - place.right_m).normalize() * 6e-3;
    drive(&mut scene, hand(place.left_m, 3, 2), [Some(place.left_m), None], 1);
    let mut worst = 0.0_f64;
    for _ in 0..40 {
        drive(&mut scene, hand(away, 3, 2), [Some(away), None], 1);
        let (row, place) = (scene.ledger_rows()[0], scene.places()[0]);
        assert_eq!((row.left_current_m, row.right_current_m), (place.left_m, place.right_m));
        worst = worst.max(row.relative_error);
    }
    assert!(worst > 0.10, "ER {worst}");
    let history = scene.ledger_rows()[0].history;
    assert!(history.control_has_acted, "the control was at work: {history:?}");
}

#[test]
fn a_hand_that_cannot_be_is_no_hand() {
    let mut scene = Scene::new(&presets::skin(), None).unwrap();
    scene.step(Some(&hand(Vec3::zeros(), 0, 0)));
    for bad in [f64::NAN, f64::INFINITY, 1e308, 1e3] {
        scene.step(Some(&hand(Vec3::repeat(bad), 1, 0)));
        assert_eq!(scene.suturing().stage(), Stage::Idle, "{bad}");
        let line = scene.line().unwrap().polyline();
        assert!(line.iter().all(|x| x.norm() < 1.0), "{bad}: {line:?}");
    }
}

#[test]
fn a_second_hand_holds_tissue_while_the_first_sutures() {
    let mut scene = Scene::new(&presets::skin(), None).unwrap();
    let places = scene.places().to_vec();
    let second = |presses, releases| {
        Some(HandInput { position_m: places[2].right_m, press_count: presses, release_count: releases })
    };
    let with = |first: ServoInput, second| ServoInput { second, ..first };
    let away = hand(Vec3::new(0.0, 0.0, 0.05), 0, 0);
    scene.step(Some(&with(away, second(0, 0))));
    scene.step(Some(&with(away, second(1, 0))));
    let grip = *scene.grips().iter().next().expect("the point is taken");
    assert_eq!((grip.slot.0, grip.pair), (2, 2));
    let aside = places[2].right_m + Vec3::new(3e-3, 0.0, 0.0);
    let mut held = with(away, second(1, 0));
    held.handles_m[2] = Some(aside);
    drive(&mut scene, held, [None; 2], 20);
    assert!((scene.places()[2].right_m - aside).norm() < AT_REST_M);
    let pull = scene.port(&grip).expect("a port of its own").force_n;
    assert!(pull.x < -0.05, "the tissue pulls back: {pull}");
    // The first hand takes a point of its own, then the one in the second hand: it is handed over.
    held.hand = HandInput { position_m: places[0].left_m, press_count: 1, release_count: 0 };
    drive(&mut scene, held, [Some(places[0].left_m), None], 3);
    assert_eq!(scene.grips().iter().map(|g| g.slot.0).collect::<Vec<_>>(), [0, 2]);
    let point = scene.places()[2].right_m;
    scene.step(Some(&with(held, Some(HandInput { position_m: places[0].left_m, press_count: 2, release_count: 1 }))));
    assert_eq!(scene.grips().iter().map(|g| (g.slot.0, g.pair)).collect::<Vec<_>>(), [(2, 0)]);
    assert!((scene.places()[2].right_m - point).norm() > AT_REST_M, "what was let go springs back");
    // A second device that is gone holds nothing.
    scene.step(Some(&with(held, None)));
    assert_eq!(scene.grips().iter().count(), 0);
}
