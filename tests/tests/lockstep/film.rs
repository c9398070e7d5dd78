//! What lockstep records, and that it hands it to the viewer beside it.
//!
//! A stand-in takes the viewer's place, so that no picture is drawn and no graphics crate compiled here.

use crate::LIMIT;
use protocol::servo_state::ServoState;
use protocol::trace::{TraceItem, TraceReader};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use suture_tests::processes::{Ended, Sandbox, binary};

fn lockstep(sandbox: &Sandbox, program: &Path, arguments: &[&str]) -> Ended {
    let all: Vec<&str> = ["lockstep", "--json", "--duration", "1.5"].iter().chain(arguments).copied().collect();
    sandbox.start(program, &all).wait(LIMIT).expect("lockstep ends")
}

fn recorded(sandbox: &Sandbox, name: &str) -> PathBuf {
    let file = sandbox.folder().join(name);
    let ended =
        lockstep(sandbox, &binary("haptic-server"), &["--record", file.to_str().expect("plain"), "--scene", "vessel"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let summary = ended.json().expect("one JSON document");
    assert_eq!(summary["recording"]["ticks"], summary["ticks"], "{summary}");
    assert_eq!(
        (summary["recording"]["lost_ticks"].as_u64(), summary["recording"]["refused"].as_u64()),
        (Some(0), Some(0))
    );
    file
}

#[test]
fn a_recording_holds_every_tick_and_thirty_views_a_second_and_is_the_same_again() {
    let sandbox = Sandbox::new();
    let (first, second) = (recorded(&sandbox, "a.mcap"), recorded(&sandbox, "b.mcap"));
    assert!(std::fs::read(&first).expect("there") == std::fs::read(&second).expect("there"), "equal runs, other bytes");
    let mut reader = TraceReader::open(BufReader::new(File::open(&first).expect("there"))).expect("MCAP");
    let mut states: Vec<ServoState> = Vec::new();
    let (mut frames, mut reports, mut outline_nodes) = (0_usize, 0, None);
    while let Some((_, item)) = reader.next_item().expect("a sound message") {
        match item {
            TraceItem::ServoState(state) => states.push(*state),
            TraceItem::Outline(header, _) => {
                assert!(outline_nodes.replace(header.node_count).is_none(), "one scene, one outline");
            }
            TraceItem::Tissue(header, nodes) => {
                assert_eq!((Some(header.node_count), nodes.len()), (outline_nodes, header.node_count as usize));
                frames += 1;
            }
            TraceItem::WoundReport(_) => reports += 1,
            TraceItem::Hand(_) => {}
        }
    }
    assert!(states.windows(2).all(|pair| pair[1].ticks == pair[0].ticks + 1) && states.len() >= 1_500);
    // One at the start and one per thirtieth of a second; the run ends with a ramp of the force.
    let expected = 1 + states.len() * 30 / 1_000;
    assert!(frames == reports && frames.abs_diff(expected) <= 1, "{frames} frames, {reports} reports, {expected}");
}

#[test]
fn frames_are_drawn_by_the_viewer_beside_the_server_from_a_recording_that_then_goes() {
    let sandbox = Sandbox::new();
    let folder = sandbox.folder().join("pictures");
    let said = sandbox.folder().join("said");
    let script = format!("echo \"$*\" > {0}; wc -c < \"$3\" >> {0}; echo noise", said.display());
    let server = sandbox.server_beside(Some(&script));
    let frames = folder.to_str().expect("plain");
    let ended = lockstep(&sandbox, &server, &["--frames", frames, "--fps", "50", "--size", "320x200"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    ended.json().expect("the viewer's words are not among the server's");
    let said = std::fs::read_to_string(said).expect("the stand-in was called");
    let (call, size) = said.split_once('\n').expect("two lines");
    let words: Vec<&str> = call.split(' ').collect();
    let [headless, replay, recording, rest @ ..] = &words[..] else { panic!("{call}") };
    assert_eq!((*headless, *replay), ("--headless", "--replay"));
    assert_eq!(rest, ["--frames", frames, "--fps", "50", "--size", "320x200"]);
    assert!(size.trim().parse::<u64>().is_ok_and(|bytes| bytes > 100_000), "{size} bytes");
    assert!(!Path::new(recording).exists(), "{recording} is left behind");
    assert_eq!(std::fs::read_dir(&folder).expect("made").count(), 0);
}

#[test]
fn without_a_viewer_or_with_one_that_cannot_draw_it_ends_with_69() {
    let sandbox = Sandbox::new();
    let frames = sandbox.folder().join("pictures");
    let asked = ["--frames", frames.to_str().expect("plain")];
    let ended = lockstep(&sandbox, &sandbox.server_beside(None), &asked);
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(69), ""));
    assert!(
        ended.stderr.contains("viewer-client is not there") && ended.stderr.contains("cargo build"),
        "{}",
        ended.stderr
    );
    let script = "echo 'viewer-client: no adapter; install one' >&2; exit 69";
    let ended = lockstep(&sandbox, &sandbox.server_beside(Some(script)), &asked);
    assert_eq!((ended.code, ended.stderr.lines().last()), (Some(69), Some("viewer-client: no adapter; install one")));
}
