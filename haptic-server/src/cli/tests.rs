//! Tests of the command line: documented lines parse, wrong ones end with 64.

use super::*;
use clap::CommandFactory;

fn server(line: &str) -> Result<ServerCli, u8> {
    parse(std::iter::once("haptic-server").chain(line.split_whitespace()).map(std::ffi::OsString::from))
}

#[test]
fn the_definition_is_consistent() {
    ServerCli::command().debug_assert();
    SolverCli::command().debug_assert();
}

#[test]
fn without_options_run_is_skin_simulated_synthetic() {
    let Ok(ServerCli { command: Command::Run(run) }) = server("run") else { panic!("run must parse") };
    assert_eq!(run.scene.scene, SceneChoice::Skin);
    assert_eq!(run.device, DeviceChoice::Simulated);
    assert_eq!(run.hand.hand, HandChoice::Synthetic);
    assert!(run.duration.is_none() && run.record.is_none() && !run.json && !run.viewer);
}

#[test]
fn the_documented_lines_parse() {
    for line in [
        "run --scene vessel --device replay:a.csv --record out.mcap --duration 60 --allow-no-rt --json --viewer",
        "run --procedure liver-surgery --hand trace.csv --hand-side left",
        "lockstep --scene my.toml --hand synthetic --duration 2.5 --control paper --out d --frames f --json",
        "lockstep --record r.mcap --frames f --fps 50 --size 640x480",
        "convert a.csv b.mcap",
        "inspect a.mcap --json",
        "scene check s.toml --json",
        "clean",
        "doctor",
        "doctor --json --latency 2.5 --load --openhaptics-library libHD.so --scene s.toml --servo t.toml",
        "devices --json",
        "completions bash",
        "session control-paper",
        "session rearm",
        "session start",
        "servo",
    ] {
        assert!(server(line).is_ok(), "{line}");
    }
}

#[test]
fn a_wrong_line_ends_with_64() {
    for line in [
        "",
        "fly",
        "run --duration 0",
        "run --duration nan",
        "run --scene skn",
        "run --scene skin --procedure liver-surgery",
        "lockstep --control maybe",
        "lockstep --frames f --size 640",
        "lockstep --frames f --fps 0",
        "lockstep --size 640x480",
        "session jump",
        "doctor --load",
        "doctor --latency 0",
        "convert only-one",
    ] {
        assert_eq!(server(line).err(), Some(exit::USAGE), "{line:?}");
    }
    assert_eq!(server("--version").err(), Some(exit::OK));
    assert_eq!(server("run --help").err(), Some(exit::OK));
}
