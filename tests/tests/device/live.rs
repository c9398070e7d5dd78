//! The whole program on the virtual device, live: `run --device openhaptics`, the vendor's scheduler as the clock.
//!
//! The hand sits behind the device's interface and sutures by eye. What the servo commanded stands in the recording, what
//! arrived in the virtual device's own log; frame by frame they must be the same within half a step of the motors' DACs. The
//! device begins uncalibrated in its inkwell.

use crate::alone;
use crate::rig::LIMIT;
use protocol::servo_state::ServoState;
use protocol::trace::{TraceItem, TraceReader};
use serde_json::Value;
use sim_core::vector::Vec3;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use suture_tests::processes::{Ended, Sandbox, binary, virtual_omni};
use virtual_omni::TORQUE_STEP_NM;

/// Runs in which the machine stood still for 20 ticks are repeated, this often.
const ATTEMPTS: usize = 4;
/// Rounding of a force that was printed and read again.
const ROUNDING_N: f64 = 1e-9;
/// What the hand may have been given at the end, joules: half of a coupling of 400 N/m at 3.3 N, which it may lend.
const LENT_J: f64 = 3.3 * 3.3 / (2.0 * 400.0);

/// One row of the device's log.
struct Row {
    asked_n: Vec3,
    arrived_n: Vec3,
    torque_error_nm: Vec3,
    position_mm: Vec3,
}

fn rows(file: &Path) -> Vec<Row> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(file).expect("the device wrote its log");
    let row = |record: csv::StringRecord| {
        let triple = |at: usize| Vec3::from_fn(|i, _| record[at + i].parse::<f64>().expect("a number"));
        Row { asked_n: triple(2), arrived_n: triple(5), torque_error_nm: triple(8), position_mm: triple(11) }
    };
    reader.records().map(|record| row(record.expect("a row"))).collect()
}

fn states(file: &Path) -> Vec<ServoState> {
    let mut reader = TraceReader::open(BufReader::new(File::open(file).expect("recorded"))).expect("MCAP");
    let mut states = Vec::new();
    while let Some((_, item)) = reader.next_item().expect("a sound message") {
        if let TraceItem::ServoState(state) = item {
            states.push(*state);
        }
    }
    states
}

/// One run.
fn run(sandbox: &Sandbox, arguments: &[&str], environment: &[(&str, &str)]) -> Ended {
    let library = virtual_omni();
    let library = library.to_str().expect("a plain name");
    let mut all = vec!["run", "--json", "--device", "openhaptics", "--openhaptics-library", library, "--allow-no-rt"];
    all.extend(arguments);
    let eyes = binary("virtual-omni-eyes");
    let mut environment = environment.to_vec();
    environment.push(("VIRTUAL_OMNI_EYES", eyes.to_str().expect("a plain name")));
    let program = sandbox.start_with(&binary("haptic-server"), &all, &environment);
    program.wait(LIMIT * 3).unwrap_or_else(|message| panic!("{message}"))
}

/// The force of the scene on the device's axes.
fn device_force(state: &ServoState) -> Vec3 {
    let [x, y, z] = state.devices[0].force_n;
    Vec3::new(x, z, -y)
}

/// Runs a scene, and again when the machine stood still; then compares frame by frame.
fn sutured(scene: &str, seconds: &str) {
    for _ in 0..ATTEMPTS {
        let sandbox = Sandbox::new();
        let (log, file) = (sandbox.folder().join("frames.csv"), sandbox.folder().join("run.mcap"));
        let environment =
            [("VIRTUAL_OMNI_HAND", "synthetic"), ("VIRTUAL_OMNI_LOG", log.to_str().expect("a plain name"))];
        let record = file.to_str().expect("a plain name");
        let ended = run(&sandbox, &["--scene", scene, "--duration", seconds, "--record", record], &environment);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let summary: Value = ended.json().unwrap_or_else(|message| panic!("{message}"));
        let faults = summary["faults"].as_array().expect("a list");
        if faults.iter().any(|f| f.as_str().is_some_and(stood_still)) {
            println!("the machine stood still: {faults:?}; again");
            continue;
        }
        assert!(faults.is_empty(), "{summary}\n{}", ended.stderr);
        assert_eq!((summary["device"].as_str(), summary["hand"].as_str()), (Some("openhaptics"), Some("operator")));
        println!("{summary}");
        compare(&rows(&log), &states(&file), &summary);
        return;
    }
    println!("not shown: the machine stood still in {ATTEMPTS} runs out of {ATTEMPTS}; lower its load");
}

/// What the server says when the machine stood still; no fault of the code.
fn stood_still(fault: &str) -> bool {
    fault.contains("missed too many ticks") || fault.contains("has not called for")
}

#[test]
fn what_the_servo_commands_arrives_and_the_hand_is_given_no_energy() {
    let _alone = alone();
    sutured("skin", "8");
}

#[test]
#[ignore = "three minutes of real time"]
fn three_scenes_for_a_minute_each() {
    let _alone = alone();
    for scene in ["skin", "liver", "vessel"] {
        sutured(scene, "60");
    }
}

#[test]
fn an_unplugged_device_is_told_and_the_run_ends_in_order() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let environment = [("VIRTUAL_OMNI_HAND", "synthetic"), ("VIRTUAL_OMNI_FAULTS", "1.5:unplug;2.5:replug")];
    let ended = run(&sandbox, &["--duration", "8"], &environment);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let summary: Value = ended.json().unwrap_or_else(|message| panic!("{message}"));
    let faults = summary["faults"].to_string();
    assert!(faults.contains("0x0302 (internal -28)") && faults.contains("check its cable"), "{summary}");
    assert!(faults.contains("the haptic device is gone"), "{summary}");
    assert_eq!(summary["state"], "fault", "never active again by itself");
    assert!(ended.stderr.contains("is open again; re-arm"), "{}", ended.stderr);
}

fn compare(rows: &[Row], states: &[ServoState], summary: &Value) {
    let active = states.iter().position(|s| s.mode == 4).expect("the servo became active");
    let (mut compared, mut worst_n, mut worst_steps, mut peak_n) = (0_u64, 0.0_f64, 0.0_f64, 0.0_f64);
    for state in &states[active..] {
        // One frame per tick, in order: the tick's number is its frame.
        let Some(row) = rows.get(state.header.sequence as usize - 1) else { continue };
        worst_n = worst_n.max((row.asked_n - device_force(state)).norm());
        worst_steps = worst_steps.max(row.torque_error_nm.amax() / TORQUE_STEP_NM);
        peak_n = peak_n.max(row.arrived_n.norm());
        compared += 1;
    }
    let given_j: f64 =
        rows.windows(2).map(|pair| pair[0].arrived_n.dot(&(pair[1].position_mm - pair[0].position_mm)) * 1e-3).sum();
    println!(
        "{compared} ticks: asked − commanded at most {worst_n:e} N, arrived within {worst_steps:.3} DAC steps, peak {peak_n:.2} N, \
         net energy to the hand {given_j:.4} J by the device, {} J by the servo",
        summary["net_energy_to_hand_j"]
    );
    assert!(compared > 1_000, "only {compared} active ticks: {summary}");
    assert!(worst_n < ROUNDING_N, "{worst_n} N between command and device");
    assert!(worst_steps <= 0.5 + 1e-6, "{worst_steps} DAC steps");
    assert!(peak_n > 0.1, "the hand never pulled");
    assert!(given_j < LENT_J, "{given_j} J");
}

#[test]
fn a_library_that_is_not_there_and_a_stiffness_that_is_too_high_are_refused() {
    let _alone = alone();
    let sandbox = Sandbox::new();
    let missing = ["run", "--device", "openhaptics", "--openhaptics-library", "no/such/libHD.so", "--duration", "1"];
    let ended = sandbox.start(&binary("haptic-server"), &missing).wait(LIMIT).unwrap_or_else(|m| panic!("{m}"));
    assert_eq!(ended.code, Some(69), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("no/such/libHD.so") && ended.stderr.contains("--openhaptics-library"),
        "{}",
        ended.stderr
    );
    let servo = sandbox.folder().join("stiff.toml");
    std::fs::write(&servo, "[coupling]\nstiffness_n_per_m = 640.0\n").expect("writable");
    let ended = run(&sandbox, &["--duration", "1", "--servo", servo.to_str().expect("a plain name")], &[]);
    assert_eq!(ended.code, Some(78), "{}", ended.stderr);
    assert!(ended.stderr.contains("640 N/m") && ended.stderr.contains("500 N/m"), "{}", ended.stderr);
}
