//! Tests of the hand-file reader: every layout, every fault with its place, cuts and random bytes.

use super::csv::{HandFileKind, HandSide, read_bytes, read_path, write_scene};
use super::{HandRecording, gripper};
use proptest::prelude::*;
use sim_core::vector::Vec3;
use std::path::Path;

const SCENE: &str = "TIME_S,X_M,Y_M,Z_M,BUTTONS\n0.0,0.01,0.02,0.03,0\n0.1,0.02,0.02,0.03,1\n";

fn fault(text: &[u8]) -> String {
    let fault = read_bytes("hand.csv", text, HandSide::Right).expect_err("this file is bad");
    assert_eq!(fault.exit_code(), 65);
    fault.to_string()
}

fn jigsaws(rows: &[(f64, f64)]) -> String {
    let mut text = String::from("TIME_S");
    for side in ["LEFT", "RIGHT"] {
        for column in ["POS_X", "POS_Y", "POS_Z", "GRIPPER_ANGLE"] {
            text += &format!(",MASTER_{side}_{column}");
        }
    }
    for (time_s, angle) in rows {
        text += &format!("\n{time_s},1,2,3,0.5,4,5,6,{angle}");
    }
    text
}

#[test]
fn each_layout_is_known_by_its_header() {
    let scene = read_bytes("hand.csv", SCENE.as_bytes(), HandSide::Left).expect("good");
    assert_eq!(scene.kind, HandFileKind::Scene);
    assert_eq!(scene.recording.positions_m[1], Vec3::new(0.02, 0.02, 0.03));
    assert_eq!(scene.recording.buttons, [0, 1]);

    let touch = read_bytes("t", b"Z_MM,TIME_S,Y_MM,X_MM,JOINT1_RAD\n3,0,2,1,x\n", HandSide::Left).expect("good");
    assert_eq!(touch.kind, HandFileKind::Touch);
    assert!((touch.recording.positions_m[0] - Vec3::new(1e-3, 2e-3, 3e-3)).amax() < 1e-18);

    let text = jigsaws(&[(0.0, 0.3), (0.1, 0.3), (0.2, -1.4), (0.3, -1.4), (0.4, 0.3)]);
    let right = read_bytes("j", text.as_bytes(), HandSide::Right).expect("good");
    assert_eq!(right.kind, HandFileKind::Jigsaws);
    assert_eq!(right.recording.positions_m[0], Vec3::new(4.0, 5.0, 6.0));
    assert_eq!(right.recording.buttons, [0, 0, 1, 1, 0], "closing the gripper is button 1");
    let left = read_bytes("j", text.as_bytes(), HandSide::Left).expect("good").recording;
    assert_eq!((left.positions_m[0], left.grips().count()), (Vec3::new(1.0, 2.0, 3.0), 0));
}

#[test]
fn a_byte_order_mark_windows_lines_and_blank_lines_do_no_harm() {
    let text = format!("\u{feff}{}", SCENE.replace('\n', "\r\n\r\n"));
    let read = read_bytes("hand.csv", text.as_bytes(), HandSide::Right).expect("good");
    assert_eq!(read, read_bytes("hand.csv", SCENE.as_bytes(), HandSide::Right).expect("good"));
}

#[test]
fn faults_name_the_place_and_the_remedy() {
    let row = |row: &str| fault(format!("{SCENE}\n{row}\n").as_bytes());
    assert!(row("0.2,0,nan,0,0").starts_with("hand.csv:5:7: Y_M \"nan\" is not a finite number; "));
    assert!(row("0.2,0,0,1e999,0").starts_with("hand.csv:5:9: Z_M \"1e999\" is not a finite number; "));
    assert!(row("0.2,0,0,here,0").starts_with("hand.csv:5:9: Z_M \"here\" is not a number; "));
    assert!(row("0.2,0,0,11,0").starts_with("hand.csv:5:9: Z_M \"11\" is beyond ±10; "));
    assert!(row("0.1,0,0,0,0").starts_with("hand.csv:5:1: the time does not increase; "));
    assert!(row("0.2,0,0,0,-1").starts_with("hand.csv:5:11: BUTTONS \"-1\" is not a button mask"));
    assert!(row("0.2,0,0").starts_with("hand.csv:5:7: the row has 3 fields but the header has 5; "));
    assert!(row("0.2,0,0,0,0,0").contains("the row has 6 fields"));
    assert!(fault(b"").starts_with("hand.csv:1:1: the header is that of no known hand file; "));
    assert!(fault(b"a,b,c\n1,2,3\n").starts_with("hand.csv:1:1: the header is that of no known hand file; "));
    assert!(fault(b"TIME_S,X_M,Y_M,Z_M\n0,0,0,0\n").contains("no column BUTTONS"));
    assert!(fault(b"X_MM,Y_MM,Z_MM\n0,0,0\n").contains("no column TIME_S"));
    assert!(fault(b"TIME_S,X_M,Y_M,Z_M,BUTTONS\n").contains("no samples"));
    assert!(fault(b"TIME_S,X_M\n0,0\n1,\xff\n").starts_with("hand.csv:3:3: these bytes are not UTF-8"));
}

#[test]
fn a_missing_file_is_no_input_and_a_folder_too() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let missing = read_path(&dir.path().join("none.csv"), HandSide::Right).expect_err("missing");
    assert_eq!(missing.exit_code(), 66);
    assert!(missing.to_string().contains("does not exist"));
    assert_eq!(read_path(dir.path(), HandSide::Right).expect_err("a folder").exit_code(), 66);
    let file = dir.path().join("hand.csv");
    std::fs::write(&file, SCENE).expect("written");
    assert_eq!(read_path(&file, HandSide::Right).expect("good").recording.times_s, [0.0, 0.1]);
}

#[test]
fn a_file_cut_at_any_byte_is_read_or_refused_with_a_place() {
    for text in [SCENE.to_owned(), jigsaws(&[(0.0, 0.3), (0.1, -1.4)]), "TIME_S,X_MM,Y_MM,Z_MM\n0,1,2,3\n".into()] {
        for cut in 0..text.len() {
            match read_bytes("hand.csv", &text.as_bytes()[..cut], HandSide::Right) {
                Ok(file) => assert_eq!(file.recording.check(), Ok(())),
                Err(fault) => assert!(fault.to_string().starts_with("hand.csv:"), "{fault}"),
            }
        }
    }
}

#[test]
fn recorded_surgeons_are_read() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/traces/");
    let expected = [("Suturing_B001", 5635, 11, 12), ("Suturing_C002", 3267, 8, 8), ("Suturing_E003", 2605, 5, 5)];
    for (name, rows, right_grips, left_grips) in expected {
        let path = format!("{folder}{name}.csv");
        if !Path::new(&path).exists() {
            println!("skipped: {path} is missing");
            continue;
        }
        for (side, grips) in [(HandSide::Right, right_grips), (HandSide::Left, left_grips)] {
            let file = read_path(Path::new(&path), side).expect("a good recording");
            assert_eq!(file.kind, HandFileKind::Jigsaws);
            assert_eq!(file.recording.check(), Ok(()));
            assert_eq!(file.recording.times_s.len(), rows);
            let found = file.recording.grips().count();
            assert!(found.abs_diff(grips) <= 1, "{name} {side:?}: {found} grips, another program found {grips}");
            assert_eq!(gripper::edges(&file.recording.buttons).len().div_ceil(2), found);
        }
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_bytes("hand.csv", &bytes, HandSide::Left);
        let with_header = [b"TIME_S,X_M,Y_M,Z_M,BUTTONS\n", &bytes[..]].concat();
        if let Ok(file) = read_bytes("hand.csv", &with_header, HandSide::Left) {
            prop_assert_eq!(file.recording.check(), Ok(()));
        }
    }

    #[test]
    fn csv_like_text_never_panics(text in "[0-9eE.,\"\n\r+-]{0,200}") {
        let with_header = format!("TIME_S,X_M,Y_M,Z_M,BUTTONS\n{text}");
        if let Err(fault) = read_bytes("hand.csv", with_header.as_bytes(), HandSide::Left) {
            prop_assert!(fault.to_string().starts_with("hand.csv:"));
        }
    }

    #[test]
    fn what_is_written_is_read_back_bit_by_bit(
        steps in prop::collection::vec((1e-4..0.1, -1.0..1.0, -1.0..1.0, -1.0..1.0, 0_u32..4), 1..50)
    ) {
        let mut recording = HandRecording::default();
        let mut time_s = 0.0;
        for (dt, x, y, z, buttons) in steps {
            time_s += dt;
            recording.times_s.push(time_s);
            recording.positions_m.push(Vec3::new(x, y, z));
            recording.buttons.push(buttons);
        }
        let mut text = Vec::new();
        write_scene(&recording, &mut text).expect("memory does not fail");
        prop_assert_eq!(read_bytes("hand.csv", &text, HandSide::Left).expect("good").recording, recording);
    }
}
