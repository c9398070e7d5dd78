//! A solver that follows a killed one: the stitches are still tied, the wound still closed, the scene a new one to its readers.

use crate::watch::Watch;
use crate::{LIMIT, SOLVER, alone, ended, run, solver_of, summary};
use haptic_server::cli::SessionAction;
use protocol::wound_report::WoundReport;
use rustix::process::{Signal, kill_process};
use suture_tests::processes::{Sandbox, binary, wait_for};

/// A tied pair is where it was, metres: the band within which the suture control leaves a closed stitch alone.
const SAME_DISTANCE_M: f64 = 2e-4;
/// A stitch that the hand still tugs at is not at rest; this long after the tie it may be let go of, seconds.
const AT_REST_S: f64 = 0.5;

/// `session ACTION`, as a person gives it.
fn order(sandbox: &Sandbox, action: SessionAction) {
    let name = clap::ValueEnum::to_possible_value(&action).expect("every action has a name").get_name().to_owned();
    let ended = sandbox.start(&binary("haptic-server"), &["session", &name]).wait(LIMIT).expect("it ends");
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}

#[test]
fn the_next_solver_ties_the_stitches_again_and_keeps_the_wound_closed() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600"]);
    let first = solver_of(&server);
    let mut watch = Watch::attach(&sandbox);
    let tied = watch.report(LIMIT, |r| r.row_count > 0).unwrap_or_else(|| panic!("no stitch: {}", server.stderr()));
    let rested = |r: &WoundReport| r.sim_time_s > tied.sim_time_s + AT_REST_S && r.row_count > 0;
    let before = watch.report(LIMIT, rested).expect("the solver goes on");
    kill_process(first, Signal::KILL).expect("the solver is there");
    let after = watch.report(LIMIT, |r| r.scene_generation > before.scene_generation);
    let after = after.unwrap_or_else(|| panic!("no second solver: {}", server.stderr()));
    // The hand may have tied one more before the kill arrived.
    assert!(after.row_count >= before.row_count, "{} stitches, {} before", after.row_count, before.row_count);
    for (old, new) in before.rows.iter().zip(&after.rows).take(before.row_count as usize) {
        assert_eq!((new.pair, new.left_original_m), (old.pair, old.left_original_m));
        let moved = (new.current_distance_m - old.current_distance_m).abs();
        assert!(moved < SAME_DISTANCE_M, "{} m apart, {} m before", new.current_distance_m, old.current_distance_m);
        assert!(new.current_distance_m < 0.8 * new.open_distance_m, "the wound is open again");
    }
    server.signal(Signal::TERM);
    let summary = summary(&ended(server));
    assert!(summary["stitches"].as_u64() >= Some(u64::from(before.row_count)), "{summary}");
    assert!(summary["solver_restarts"].as_u64().is_some_and(|n| n > 0), "{summary}");
}

#[test]
fn a_restored_scene_has_a_generation_that_no_restart_repeats() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600"]);
    let first = solver_of(&server);
    let mut watch = Watch::attach(&sandbox);
    watch.report(LIMIT, |_| true).expect("the solver reports");
    for _ in 0..3 {
        order(&sandbox, SessionAction::Restore);
    }
    let restored = watch.report(LIMIT, |r| r.scene_generation > 3).expect("three restores are three generations more");
    kill_process(first, Signal::KILL).expect("the solver is there");
    let second = wait_for(LIMIT, || server.children(SOLVER).into_iter().find(|pid| *pid != first));
    assert!(second.is_some(), "no second solver: {}", server.stderr());
    let after =
        watch.report(LIMIT, |r| r.header.time_ns > restored.header.time_ns && r.solver_steps < restored.solver_steps);
    let after = after.expect("the second solver reports");
    assert!(after.scene_generation > restored.scene_generation, "{} again", after.scene_generation);
    server.signal(Signal::TERM);
    summary(&ended(server));
}

#[test]
fn everybody_who_commands_at_once_gets_an_own_answer_with_its_reason() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    // A pointer that nobody moves: nothing changes but by command.
    let server = run(&sandbox, &["--device", "pointer", "--duration", "600"]);
    solver_of(&server);
    let mut watch = Watch::attach(&sandbox);
    assert!(watch.until(LIMIT, |s| s.port_sequence > 0).is_some(), "no port: {}", server.stderr());
    let before = watch.report(LIMIT, |_| true).expect("the solver reports").scene_generation;
    let asked = [
        ("tie", Some("no line is through both points")),
        ("start", None),
        ("next", Some("last scene")),
        ("previous", Some("first scene")),
        ("rearm", Some("no fault")),
        ("control-off", None),
        ("restore", None),
    ];
    let programs = asked.map(|(action, _)| sandbox.start(&binary("haptic-server"), &["session", action]));
    for ((action, refused), program) in asked.iter().zip(programs) {
        let ended = program.wait(LIMIT).expect("it ends");
        assert_eq!(ended.code, Some(if refused.is_some() { 75 } else { 0 }), "{action}: {}", ended.stderr);
        assert!(ended.stderr.contains(refused.unwrap_or_default()), "{action}: {}", ended.stderr);
    }
    let after = watch.report(LIMIT, |r| r.scene_generation == before + 2).expect("a start and a restore are two");
    assert_eq!(after.control, 0, "control off");
    server.signal(Signal::TERM);
    summary(&ended(server));
}
