//! `doctor` and `devices` as programs: one JSON document, the keys that scripts rely on, exit codes, the virtual library.
//!
//! What the machine under test is like is not asserted: rights, kernel and clock are its own. The checks themselves are tested
//! on made-up machines, beside their code.

use crate::alone;
use crate::rig::LIMIT;
use serde_json::Value;
use suture_tests::processes::{Ended, Sandbox, binary, virtual_omni};

/// Nothing failed, not available, a right is missing: the codes that a machine's state may give.
const OF_THE_MACHINE: [i32; 3] = [0, 69, 77];

fn run(arguments: &[&str], environment: &[(&str, &str)]) -> Ended {
    let sandbox = Sandbox::new();
    let started = sandbox.start_with(&binary("haptic-server"), arguments, environment);
    started.wait(LIMIT).unwrap_or_else(|message| panic!("{message}"))
}

fn row<'a>(document: &'a Value, name: &str) -> &'a Value {
    let rows = document["checks"].as_array().expect("rows");
    rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no row {name} in {document}"))
}

#[test]
fn the_virtual_library_is_well_and_a_missing_one_is_named_with_its_remedy() {
    let _one_device = alone();
    let library = virtual_omni();
    let ended = run(&["doctor", "--json", "--openhaptics-library", library.to_str().expect("a plain name")], &[]);
    assert!(OF_THE_MACHINE.contains(&ended.code.unwrap_or(-1)), "{ended:?}");
    let document = ended.json().unwrap_or_else(|message| panic!("{message}"));
    assert_eq!(row(&document, "openhaptics_library")["status"], "ok");
    for name in [
        "kernel",
        "rtprio_limit",
        "memlock_limit",
        "real_time_trial",
        "real_time_throttle",
        "governor",
        "c_states",
        "shared_memory",
        "stale_runs",
        "locale",
        "openhaptics_config",
        "gpu",
    ] {
        assert!(
            ["ok", "warn", "fail"].contains(&row(&document, name)["status"].as_str().unwrap_or_default()),
            "{name}"
        );
    }
    assert!(document["grade"].is_string());

    let ended = run(&["doctor", "--json", "--openhaptics-library", "no/such/libHD.so"], &[]);
    assert!(ended.code.is_some_and(|code| code == 69 || code == 77), "{ended:?}");
    let document = ended.json().unwrap_or_else(|message| panic!("{message}"));
    let missing = row(&document, "openhaptics_library");
    assert_eq!((&missing["status"], &document["grade"]), (&Value::from("fail"), &Value::from("unfit")));
    assert!(missing["remedy"].as_str().is_some_and(|r| r.contains("--openhaptics-library")), "{missing}");
}

#[test]
fn a_decimal_comma_is_warned_of_in_one_line() {
    let ended = run(&["doctor"], &[("LC_ALL", "de_DE.UTF-8")]);
    let lines: Vec<&str> = ended.stdout.lines().collect();
    assert!(lines.iter().any(|l| l.starts_with("warn  locale") && l.contains("LC_ALL=C")), "{lines:#?}");
    let (last, rows) = lines.split_last().expect("lines");
    assert!(last.starts_with("grade: "), "{last}");
    assert!(rows.iter().all(|l| ["ok  ", "warn", "fail"].contains(&&l[..4])), "{rows:#?}");
}

#[test]
fn the_devices_are_listed_without_opening_any() {
    let ended = run(&["devices", "--json"], &[]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let document = ended.json().unwrap_or_else(|message| panic!("{message}"));
    assert!(document["attached"].is_array());
    assert_eq!(document["without_hardware"][0], "simulated");
}
