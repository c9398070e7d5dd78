//! The accuracy report as others use it: keys, files that need nothing else, an orderly end, comparison with a stored one.
//!
//! Runs the binary on a network of six nodes and the cheapest parts; figures are not judged here.

use serde_json::{Value, json};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// What is left of the way after 0.4 s of creep with a time constant below 25 ms.
const AT_REST: f64 = 1e-5;

fn report(folder: &Path, arguments: &[&str]) -> Output {
    let run = Command::new(env!("CARGO_BIN_EXE_accuracy-report")).current_dir(folder).args(arguments).output();
    run.expect("the binary was built with this test")
}

/// Six nodes in a row, the ends pinned, one pulled along the row: after 0.4 s at rest, so that the answer is known.
fn write_network(folder: &Path) {
    let at = |i: usize| json!([2e-3 * i as f64, 0.0, 0.0]);
    let positions: Vec<Value> = (0..6).map(at).collect();
    // A pull along the row: the middle spring shares of a chain of five springs of 100 N/m, node 2 of 5.
    let pull_n = 0.01;
    let (left, right) = (100.0 / 2.0, 100.0 / 3.0);
    let shift = pull_n / (left + right);
    let ends: Vec<Value> = (0..6)
        .map(|i| {
            let share = if i <= 2 { i as f64 / 2.0 } else { (5 - i) as f64 / 3.0 };
            json!([2e-3 * i as f64 + shift * share, 0.0, 0.0])
        })
        .collect();
    let network = json!({
        "format": "spring-network/1", "units": "SI", "node_mass_kg": 1e-3, "stiffness_n_per_m": 100.0,
        "drag_n_s_per_m": 1.0, "time_step_s": 1e-3, "end_s": 0.4, "positions_m": positions, "pinned": [0, 5],
        "springs": (0..5).map(|i| json!([i, i + 1])).collect::<Vec<_>>(), "rest_lengths_m": vec![2e-3; 5],
        "loads": [{ "node": 2, "force_n": [pull_n, 0.0, 0.0] }],
        "reference": { "method": "statics of a chain", "positions_at_end_m": ends }
    });
    std::fs::write(folder.join("chain.json"), network.to_string()).expect("the folder is there");
}

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON document on stdout and nothing else")
}

#[test]
fn a_network_from_a_file_has_its_keys_and_a_page_that_needs_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    write_network(folder.path());
    let output =
        report(folder.path(), &["--quick", "--only", "network", "--network", "chain.json", "--out", "o", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let document = json_of(&output);
    assert_eq!(document["report"]["complete"], true);
    let rows = document["network"].as_array().expect("rows");
    let keys = [
        "file",
        "integrator",
        "precision",
        "path",
        "dt_s",
        "displacement_error",
        "ns_per_spring_step",
        "cpu_per_sim",
        "unstable",
    ];
    assert!(rows.iter().all(|row| keys.iter().all(|key| row.get(key).is_some())), "{rows:#?}");
    // The chain has come to rest: what an explicit run ends in is the statics, at any stable step.
    let explicit = ["semi_implicit", "verlet", "paper_explicit", "runge_kutta_reference"];
    let at_rest = rows.iter().filter(|r| explicit.iter().any(|name| r["integrator"] == *name));
    let errors: Vec<f64> = at_rest.filter_map(|r| r["displacement_error"].as_f64()).collect();
    assert!(errors.len() > 10 && errors.iter().all(|e| *e < AT_REST), "{errors:?}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("o").join(name)).expect(name);
    let page = read("report.html");
    for outside in ["<script", "<link", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert_eq!(page.matches("http").count(), page.matches("http://www.w3.org/2000/svg").count());
    assert_eq!(read("network.csv").lines().count(), rows.len() + 1);
    let stored: Value = serde_json::from_str(&read("report.json")).expect("JSON");
    assert_eq!(stored["network"], document["network"]);
}

#[test]
fn a_stored_report_names_what_got_worse() {
    let folder = tempfile::tempdir().expect("a folder");
    write_network(folder.path());
    let run = |more: &[&str]| {
        let first = ["--quick", "--only", "network", "--network", "chain.json", "--json"];
        report(folder.path(), &[&first, more].concat())
    };
    let mut stored = json_of(&run(&[]));
    // Costs of a busy machine scatter; what is compared here are errors.
    for row in stored["network"].as_array_mut().expect("rows") {
        for cost in ["cpu_per_sim", "ns_per_spring_step"] {
            row[cost] = Value::Null;
        }
    }
    let keep = |value: &Value| std::fs::write(folder.path().join("old.json"), value.to_string()).expect("written");
    keep(&stored);
    let same = run(&["--baseline", "old.json"]);
    assert_eq!((same.status.code(), json_of(&same)["worse"].clone()), (Some(0), json!([])));
    let row =
        stored["network"].as_array().expect("rows").iter().position(|r| r["unstable"] == true).expect("a refused step");
    stored["network"][row]["unstable"] = json!(false);
    keep(&stored);
    let worse = run(&["--baseline", "old.json"]);
    assert_eq!(worse.status.code(), Some(1));
    assert_eq!(json_of(&worse)["worse"][0]["column"], "unstable");
}

#[test]
fn malformed_files_and_unknown_parts_end_with_their_code() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("bad.json"), "{\"format\": \"spring-network/1\", \"positions_m\": 7}")
        .expect("written");
    std::fs::write(folder.path().join("bad.toml"), "name = \"x\"\n[tissue]\nspacing = 1\n").expect("written");
    for (arguments, code, word) in [
        (&["--network", "bad.json"][..], 65, "bad.json"),
        (&["--network", "none.json"], 66, "none.json"),
        (&["--baseline", "bad.json"], 65, "report.json"),
        (&["--only", "weather"], 64, "work_precision"),
        (&["--scene", "kidney"], 64, "kidney"),
        (&["--scene", "bad.toml"], 65, "bad.toml:2:1"),
        (&["--scene", "none.toml"], 66, "none.toml"),
    ] {
        let output = report(folder.path(), arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{words}");
        assert!(words.contains(word) && output.stdout.is_empty(), "{words}");
    }
}

#[test]
fn an_interrupt_leaves_a_partial_report_that_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let child = Command::new(env!("CARGO_BIN_EXE_accuracy-report"))
        .current_dir(folder.path())
        .args(["--scene", "vessel", "--only", "work_precision", "--only", "rates", "--out", "o", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    // The references of the whole vessel take minutes: this falls into them, however slow the machine is.
    std::thread::sleep(Duration::from_secs(2));
    let id = rustix::process::Pid::from_raw(child.id() as i32).expect("a process");
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it still runs");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130));
    let document = json_of(&output);
    assert_eq!(document["report"]["complete"], false);
    assert_eq!(document["report"]["stopped_in"], "reference_agreement");
    assert_eq!(document["report"]["not_measured"], json!(["rates"]));
    let page = std::fs::read_to_string(folder.path().join("o/report.html")).expect("the page");
    assert!(page.contains("Partial report") && page.ends_with("</html>\n"));
}
