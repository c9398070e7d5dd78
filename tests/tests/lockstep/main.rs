//! The programs in lockstep: equal runs give equal bytes, every promised file is there, stitches are tied and stay tied.
//!
//! Simulated seconds only; no test here depends on how fast the machine is.

mod film;

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;
use suture_tests::processes::{Ended, Sandbox, binary};

/// Patience with a loaded machine.
const LIMIT: Duration = Duration::from_secs(600);

/// The files that `--out` promises.
const FILES: [&str; 5] = ["force.svg", "ledger.csv", "radar.svg", "summary.json", "ticks.csv"];

fn lockstep(sandbox: &Sandbox, arguments: &[&str], out: &Path) -> Ended {
    let mut all = vec!["lockstep", "--json", "--out"];
    let out = out.to_str().expect("a sandbox has a plain name");
    all.push(out);
    all.extend(arguments);
    let ended = sandbox.start(&binary("haptic-server"), &all).wait(LIMIT).expect("lockstep ends");
    assert_eq!(ended.code, Some(0), "{all:?}: {}", ended.stderr);
    ended
}

/// Files of a folder by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("lockstep made its folder");
    let read = |entry: std::io::Result<std::fs::DirEntry>| {
        let entry = entry.expect("readable");
        (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).expect("readable"))
    };
    entries.map(read).collect()
}

/// A summary without the one figure that depends on the machine.
fn without_speed(bytes: &[u8]) -> Value {
    let mut summary: Value = serde_json::from_slice(bytes).expect("JSON");
    summary.as_object_mut().expect("an object").remove("realtime_factor");
    summary
}

#[test]
fn equal_runs_give_equal_bytes_in_every_scene() {
    for scene in ["skin", "liver", "vessel"] {
        let sandbox = Sandbox::new();
        let run = |name: &str| {
            let out = sandbox.folder().join(name);
            lockstep(&sandbox, &["--scene", scene, "--duration", "1.5"], &out);
            files(&out)
        };
        let (mut first, mut second) = (run("a"), run("b"));
        let names: Vec<&str> = first.keys().map(String::as_str).collect();
        assert_eq!(names, FILES, "{scene}");
        let summaries = [&mut first, &mut second].map(|f| without_speed(&f.remove("summary.json").expect("there")));
        assert_eq!(summaries[0], summaries[1], "{scene}");
        for (name, bytes) in &first {
            assert!(second[name] == *bytes, "{scene}: {name} differs between two equal runs");
        }
    }
}

#[test]
fn outputs_agree_with_the_summary() {
    let sandbox = Sandbox::new();
    let out = sandbox.folder().join("out");
    let ended = lockstep(&sandbox, &["--duration", "2"], &out);
    let shown = ended.json().expect("one JSON document");
    let files = files(&out);
    assert_eq!(
        without_speed(&files["summary.json"]),
        without_speed(ended.stdout.as_bytes()),
        "file and standard output"
    );
    let ticks = files["ticks.csv"].iter().filter(|b| **b == b'\n').count() as u64 - 1;
    assert_eq!(Some(ticks), shown["ticks"].as_u64());
    let rows = files["ledger.csv"].iter().filter(|b| **b == b'\n').count() as u64 - 1;
    assert_eq!(Some(rows), shown["stitches"].as_u64());
    assert_eq!(shown["missed"], 0, "a virtual clock misses nothing");
}

#[test]
fn synthetic_hand_sutures_the_skin_and_the_control_keeps_it_closed() {
    let sandbox = Sandbox::new();
    let ended = lockstep(&sandbox, &["--scene", "skin", "--control", "on"], &sandbox.folder().join("on"));
    let summary = ended.json().expect("one JSON document");
    assert_eq!(summary["stitches"], 4, "{summary}");
    assert!(summary["er_max"].as_f64().is_some_and(|er| er <= 0.10), "{summary}");
    assert_eq!(summary["faults"], Value::Array(Vec::new()), "{summary}");
}

#[test]
fn algorithm2_without_control_the_same_pulls_open_a_stitch() {
    let sandbox = Sandbox::new();
    let worst = |control: &str| {
        let out = sandbox.folder().join(control);
        lockstep(&sandbox, &["--scene", "skin", "--control", control], &out);
        let summary: Value =
            serde_json::from_slice(&files(&out)["summary.json"]).expect("lockstep writes a JSON summary");
        assert_eq!(summary["stitches"], 4, "{control}");
        summary["er_max"].as_f64().expect("a number")
    };
    let (on, off) = (worst("on"), worst("off"));
    assert!(on <= 0.10 && off > 0.10, "worst ER: on {on}, off {off}");
}

#[test]
fn a_solver_as_fast_as_the_servo_still_gives_force() {
    let sandbox = Sandbox::new();
    let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md")).expect("README");
    let scene = readme.split("```toml").nth(1).and_then(|t| t.split("```").next()).expect("the scene file");
    let path = sandbox.folder().join("fast.toml");
    std::fs::write(&path, scene.replace("rate_hz = 200.0", "rate_hz = 1000.0")).expect("written");
    let out = sandbox.folder().join("fast");
    lockstep(&sandbox, &["--scene", path.to_str().expect("plain"), "--duration", "4"], &out);
    let summary: Value = serde_json::from_slice(&files(&out)["summary.json"]).expect("JSON");
    assert!(summary["peak_force_n"].as_f64().expect("a number") > 0.05, "{summary}");
}

#[test]
fn unusable_input_ends_with_its_code_and_its_place() {
    let sandbox = Sandbox::new();
    let bad = sandbox.folder().join("bad.csv");
    std::fs::write(&bad, "TIME_S,X_MM,Y_MM,Z_MM\n0.0,1.0,2.0,3.0\n0.01,1.0,two,3.0\n").expect("writable");
    let missing = sandbox.folder().join("none.csv");
    for (hand, code, part) in [(&bad, 65, "bad.csv:3"), (&missing, 66, "none.csv")] {
        let hand = hand.to_str().expect("a plain name");
        let arguments = ["lockstep", "--hand", hand, "--duration", "1"];
        let ended = sandbox.start(&binary("haptic-server"), &arguments).wait(LIMIT).expect("it ends");
        assert_eq!(ended.code, Some(code), "{}", ended.stderr);
        assert!(ended.stderr.contains(part), "{} does not name {part}", ended.stderr);
        assert!(ended.stdout.is_empty(), "an error leaves standard output empty");
    }
}
