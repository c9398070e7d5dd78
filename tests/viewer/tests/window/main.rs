//! The window under a synthetic mouse and keyboard: orbit, pick a sample point, suture one stitch with the mouse as the hand,
//! screenshot, restore, quit; the other scenes; a server in trouble, and a display that dies. A real server with `--device pointer`, a
//! real window on a display that nobody looks at.
//!
//! The test sees what a person sees: it takes the scene from shared memory and the camera from the viewer's own words, and
//! points at pixels. Skipped with a notice where Xvfb, xdotool or a graphics adapter is missing.

mod person;
mod scenes;
mod screen;
mod trouble;

use person::{Eyes, PATIENT, Person, Session, Sight};
use screen::Screen;
use serde_json::Value;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Size of most windows.
const SIZE: [u32; 2] = [640, 480];
/// The hand pulls a gap closed with more than this, newtons.
const FELT_N: f64 = 0.05;
/// How often the curve of the node in hand is asked for.
const MOST_LOOKS: u32 = 100;
/// Step of the pull from picture to picture, pixels.
const PULL_PX: f64 = 4.0;

/// One live server at a time: two at real-time priority on two processors would disturb each other.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[test]
fn a_person_with_a_mouse_orbits_picks_sutures_restores_and_quits() {
    let _alone = alone();
    let Some(screen) = Screen::start() else { return };
    let mut session = Session::start(&[], &["--device", "pointer", "--scene", "skin", "--duration", "600"], PATIENT);
    let Some(mut person) = session.sit_down(&screen, SIZE) else { return };
    let eyes = &mut session.eyes;
    person.orbit();

    // A sample point where the first left suture point is, and its curve in a file.
    let sight = person.look_from_above();
    let picked = person.pick(&sight, eyes.point(0));
    person.key("k");
    let saved = person.viewer.expect("saved");
    let csv = std::fs::read_to_string(saved["file"].as_str().expect("a path")).expect("the file that was told");
    assert!(csv.starts_with("# node ") && csv.contains("\nnode,time_s,deformation_m"), "{csv}");

    suture(&mut person, eyes, &sight, &picked);

    // Restore: answered, and the stitch is gone.
    person.order("r", "restore", ": done");
    eyes.until("no stitch", |view, _| view.report.as_ref().filter(|r| r.row_count == 0).map(|_| ()));
    person.quit();
    assert_eq!(session.server.stop(), Some(0));
}

/// Largest force of the hand in the saved curve of a node, and the curve.
fn felt(person: &mut Person<'_>, node: &Value) -> (f64, String) {
    person.key("k");
    let saved = person.viewer.expect("saved");
    let csv = std::fs::read_to_string(saved["file"].as_str().expect("a path")).expect("the file that was told");
    let name = node.to_string();
    let own = csv.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|row| row[0] == name);
    let felt = own.map(|row| row[5].parse::<f64>().expect("a number")).fold(0.0, f64::max);
    (felt, csv)
}

/// One stitch of the first pair with the mouse, straight from above.
fn suture(person: &mut Person<'_>, eyes: &mut Eyes, sight: &Sight, picked: &Value) {
    person.key("m");
    assert_eq!(person.viewer.expect("hand")["mode"], "hand");
    let left = eyes.point(0);
    // The pointer is there already, and one that does not move says nothing.
    person.go(sight.pixel([0.0; 3]));
    person.go(sight.pixel(left));
    eyes.stylus_at(left);
    person.button("mousedown");
    eyes.stage(1);
    person.button("mouseup");
    eyes.stage(2);
    let right = eyes.point(1);
    person.go(sight.pixel(right));
    eyes.stylus_at(right);
    person.button("mousedown");
    eyes.stage(3);
    // Across the wound and on, until a release will tie.
    let (from, towards) = (sight.pixel(right), sight.pixel(left));
    let length = (towards[0] - from[0]).hypot(towards[1] - from[1]);
    let along = [(towards[0] - from[0]) / length, (towards[1] - from[1]) / length];
    let mut way = 0.0;
    loop {
        way += PULL_PX;
        let to = [from[0] + way * along[0], from[1] + way * along[1]];
        let inside = to[0] > 4.0 && to[1] > 4.0 && to[0] < sight.size[0] - 4.0 && to[1] < sight.size[1] - 4.0;
        assert!(inside, "the pull has left the window and the gap is still open");
        person.go(to);
        let now = eyes.until("two newer ports", {
            let mut first = None;
            move |_, port| {
                let port = port?;
                let seen = *first.get_or_insert(port.header.sequence);
                (port.header.sequence > seen + 8).then_some(*port)
            }
        });
        if now.gap_m < 0.97 * now.closed_gap_m {
            break;
        }
    }
    // Held there until the viewer has measured it, however slowly it draws.
    for looks in 0.. {
        let (felt, curve) = felt(person, picked);
        if felt > FELT_N {
            break;
        }
        assert!(looks < MOST_LOOKS, "the curve of sutured node {picked} knows no force of the hand:\n{curve}");
        std::thread::sleep(Duration::from_millis(100));
    }
    person.button("mouseup");
    eyes.until("a stitch", |view, _| view.report.as_ref().filter(|r| r.row_count == 1).map(|_| ()));
    person.key("m");
    assert_eq!(person.viewer.expect("hand")["mode"], "idle");
}
