//! The programs live: processes that die, stop, or are started twice, and the latency harness end to end.
//!
//! Figures of time are not asserted: a loaded machine is no fault of the code. What is asserted are states, counts and exit codes.

mod child;
mod commands;
mod paired;
mod pointer;
mod pull;
mod resume;
mod viewers;
mod watch;

use rustix::process::{Signal, kill_process};
use serde_json::Value;
use std::fmt::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use suture_tests::processes::{Ended, Program, Sandbox, binary, is_gone_within, wait_for};
use watch::Watch;

/// Patience with a loaded machine.
const LIMIT: Duration = Duration::from_secs(120);
/// More ports than a solver makes before it can be killed, and than pass between two reports.
const STEPS: u64 = 100;
const SOLVER: &str = "deformation-solver";

/// One live server at a time: two at real-time priority on two processors would disturb each other.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Servo constants of these runs: a virtual machine that stands still for tenths of a second is not what they are about,
/// so that the fault by missed ticks waits for a whole second (the realtime tests have it at its own limit).
const PATIENT_SERVO: &str = "[rhythm]\nmissed_fault_ticks = 1000\n";

fn run(sandbox: &Sandbox, arguments: &[&str]) -> Program {
    let servo = sandbox.folder().join("servo.toml");
    std::fs::write(&servo, PATIENT_SERVO).expect("a sandbox is writable");
    let servo = servo.to_str().expect("a plain name");
    let all: Vec<&str> = ["run", "--json", "--servo", servo].iter().chain(arguments).copied().collect();
    sandbox.start(&binary("haptic-server"), &all)
}

fn ended(program: Program) -> Ended {
    program.wait(LIMIT).unwrap_or_else(|message| panic!("{message}"))
}

fn summary(ended: &Ended) -> Value {
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    ended.json().unwrap_or_else(|message| panic!("{message}"))
}

/// What the server says when the machine stood still for too long; no fault of the code.
const STOOD_STILL: &str = "missed too many ticks";

fn stood_still(summary: &Value) -> bool {
    summary["faults"].to_string().contains(STOOD_STILL)
}

fn assert_no_fault(summary: &Value) {
    let faults = summary["faults"].as_array().expect("a list");
    assert!(faults.iter().all(|f| f.as_str().is_some_and(|f| f.contains(STOOD_STILL))), "{summary}");
}

/// The solver of a running server, once it is there.
fn solver_of(server: &Program) -> rustix::process::Pid {
    wait_for(LIMIT, || server.children(SOLVER).first().copied())
        .unwrap_or_else(|| panic!("no solver was started: {}", server.stderr()))
}

#[test]
fn without_options_it_runs_ends_by_itself_and_sums_up() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let summary = summary(&ended(run(&sandbox, &["--duration", "4"])));
    let count = |key: &str| summary[key].as_u64().unwrap_or_else(|| panic!("{key} in {summary}"));
    assert!(count("ticks") + count("missed") >= 3990, "{summary}");
    assert!(count("solver_steps") > 0, "{summary}");
    assert_eq!((summary["scene"].as_str(), summary["device"].as_str()), (Some("skin"), Some("simulated")));
    for key in ["wake_ns", "compute_ns", "port_age_ns"] {
        let at = |part: &str| summary[key][part].as_u64().unwrap_or_else(|| panic!("{key}.{part} in {summary}"));
        assert!(at("p50") <= at("max"), "{key} in {summary}");
    }
}

#[test]
fn a_second_server_is_refused_and_names_the_first() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let first = run(&sandbox, &["--duration", "60"]);
    solver_of(&first);
    let second = ended(run(&sandbox, &["--duration", "1"]));
    assert_eq!(second.code, Some(75), "{}", second.stderr);
    assert!(second.stderr.contains(&first.id().to_string()), "{} does not name {}", second.stderr, first.id());
    first.signal(Signal::TERM);
    summary(&ended(first));
}

#[test]
fn both_stop_signals_end_with_zero_and_a_summary() {
    let _alone = alone();
    for signal in [Signal::TERM, Signal::INT] {
        let sandbox = Sandbox::new();
        let server = run(&sandbox, &["--duration", "60"]);
        solver_of(&server);
        server.signal(signal);
        let summary = summary(&ended(server));
        assert_no_fault(&summary);
    }
}

#[test]
fn a_killed_solver_is_started_again_and_the_servo_goes_on() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "600"]);
    let first = solver_of(&server);
    kill_process(first, Signal::KILL).expect("the solver is there");
    // Whatever the first one was doing: it may have left half a service behind that costs the next one a try.
    let at_work = Watch::attach(&sandbox).until(LIMIT, |state| state.port_sequence > STEPS);
    assert!(at_work.is_some(), "no second solver at work: {}", server.stderr());
    server.signal(Signal::TERM);
    let summary = summary(&ended(server));
    assert!(summary["solver_restarts"].as_u64().is_some_and(|n| n > 0), "{summary}");
    assert!(summary["solver_steps"].as_u64().is_some_and(|n| n > 0), "{summary}");
    assert!(summary["realtime_factor"].is_null() && summary["degraded"] == true, "{summary}");
    assert_no_fault(&summary);
}

#[test]
fn a_killed_server_leaves_nothing_that_hinders_the_next() {
    killed_beside_a_solver(|_, _| ());
}

#[test]
fn a_killed_server_takes_a_stopped_solver_with_it() {
    killed_beside_a_solver(|sandbox, solver| {
        // A solver whose ports arrive has long been tied to its server.
        let heard = Watch::attach(sandbox).until(LIMIT, |state| state.port_sequence > 0);
        assert!(heard.is_some(), "no port ever arrived");
        kill_process(solver, Signal::STOP).expect("the solver is there");
    });
}

/// Kills a server after something was done to its solver; nothing is left of either.
fn killed_beside_a_solver(prepare: impl Fn(&Sandbox, rustix::process::Pid)) {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let server = run(&sandbox, &["--duration", "60"]);
    let solver = solver_of(&server);
    prepare(&sandbox, solver);
    server.signal(Signal::KILL);
    assert_eq!(ended(server).code, None);
    assert!(is_gone_within(LIMIT, solver), "the solver outlives its server");
    summary(&ended(run(&sandbox, &["--duration", "1"])));
}

#[test]
fn latency_harness_reports_every_key_for_a_trace() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let trace = sandbox.folder().join("circle.csv");
    let mut text = String::from("TIME_S,X_MM,Y_MM,Z_MM\n");
    for i in 0..200 {
        let t = f64::from(i) * 0.01;
        writeln!(text, "{t},{},{},0.0", 20.0 * t.cos(), 20.0 * t.sin()).expect("a string takes text");
    }
    std::fs::write(&trace, text).expect("writable");
    let trace = trace.to_str().expect("a plain name");
    let harness = sandbox.start(&binary("latency-harness"), &[trace, "--duration", "4", "--json"]);
    let report = summary(&ended(harness));
    assert_eq!(report["trace"], trace);
    for key in ["wake_ns", "tick_ns", "sample_to_force_ns", "port_age_ns", "baseline_wake_ns"] {
        assert!(report[key]["p999"].is_u64(), "{key} in {report}");
    }
    assert!(
        report["ticks"].as_u64().is_some_and(|n| n > 0) && report["baseline_ticks"].as_u64().is_some_and(|n| n > 0)
    );
    assert!(["unfit", "fair", "good", "excellent"].contains(&report["grade"].as_str().unwrap_or_default()));
    assert!(report["degraded"].is_boolean());
}
