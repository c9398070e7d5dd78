//! Trouble on either side of the window: a servo without rights that faults is shown, stays usable and is re-armed; a display that dies
//! takes its own viewer along and nobody else.

use crate::person::{PATIENT, Session};
use crate::screen::{LIMIT, Screen, signal};
use crate::{SIZE, alone};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use viewer_client::gpu::Picture;

/// `servo_state` mode: full force.
const ACTIVE: u32 = 4;
/// A window in which every panel has room.
const ROOMY: [u32; 2] = [960, 600];
/// Missed ticks that are a fault, and how long the servo is stopped: longer, and shorter than its supervisor's patience.
const FAULT_TICKS: u32 = 200;
const STOPPED: Duration = Duration::from_millis(700);
/// Ticks that the servo goes on for after the display has died.
const ON: u64 = 1_000;
/// Pixels of the banner's dark red at least: it is some 460 by 70.
const BANNER: usize = 10_000;

/// Starts a program without the right to real-time scheduling, as far as the user can give it away.
const WITHOUT_RIGHTS: &str = "if setpriv --bounding-set=-sys_nice true 2>/dev/null; \
    then exec prlimit --rtprio=0:0 setpriv --bounding-set=-sys_nice \"$@\"; else exec prlimit --rtprio=0:0 \"$@\"; fi";

/// Pixels of the colour that is behind an alarm.
fn banner(picture: &Picture) -> usize {
    let is_red = |p: &&[u8]| p[0].abs_diff(70) < 12 && p[1].abs_diff(16) < 12 && p[2].abs_diff(16) < 12;
    picture.rgba.chunks_exact(4).filter(is_red).count()
}

#[test]
fn a_servo_without_rights_and_in_a_fault_is_shown_and_the_window_stays_usable() {
    let _alone = alone();
    let Some(screen) = Screen::start() else { return };
    let before = ["sh", "-c", WITHOUT_RIGHTS, "sh"];
    let mut session = Session::start(&before, &["--device", "pointer", "--duration", "600"], FAULT_TICKS);
    let Some(mut person) = session.sit_down(&screen, ROOMY) else { return };
    person.servo_is("active");
    assert_eq!(person.viewer.servo["is_degraded"], true, "{}", person.viewer.servo);
    assert!(banner(&person.screenshot()) < BANNER, "an alarm without a fault");

    let servo = session.server.child("servo").expect("a servo process");
    signal("STOP", servo);
    std::thread::sleep(STOPPED);
    signal("CONT", servo);
    person.servo_is("fault");
    assert!(
        person.viewer.servo["fault"].as_str().is_some_and(|said| said.contains("missed too many ticks")),
        "{}",
        person.viewer.servo
    );
    // The panel library measures a new panel in one layout and shows it in the next.
    wait(|| banner(&person.screenshot()) > BANNER, "no alarm is seen");
    person.orbit();
    let sight = person.look_from_above();
    person.pick(&sight, session.eyes.point(0));
    person.order("a", "re-arm", ": done");
    person.servo_is("active");
    wait(|| banner(&person.screenshot()) < BANNER, "the alarm stays");
    person.quit();
    assert_eq!(session.server.stop(), Some(0));
}

/// Pictures in a folder.
fn pictures(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

#[test]
fn a_display_that_dies_takes_its_viewer_along_and_nobody_else() {
    let _alone = alone();
    let Some(mut screen) = Screen::start() else { return };
    let mut session = Session::start(&[], &["--device", "pointer", "--duration", "600"], PATIENT);
    let Some(mut person) = session.sit_down(&screen, SIZE) else { return };
    // The worst moment: the mouse is the hand.
    person.key("m");
    assert_eq!(person.viewer.expect("hand")["mode"], "hand");
    let folder = session.folder.path().join("pictures");
    let mut second = Command::new(env!("CARGO_BIN_EXE_viewer-of-tests"))
        .args(["--headless", "--size", "64x48", "--quality", "fast", "--fps", "5", "--run-dir"])
        .arg(session.run.path())
        .arg("--frames")
        .arg(&folder)
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the viewer starts");
    wait(|| pictures(&folder) > 2, "no picture of the second viewer");
    let before = session.eyes.until("an active servo", |view, _| view.servo.filter(|s| s.mode == ACTIVE));

    let first = person.leave();
    screen.die();
    let (code, said) = first.end();
    println!("the viewer of the dead display ended with {code:?}: {}", said.trim());
    assert!(code.is_some_and(|code| code != 0), "{code:?}: {said}");
    let drawn = pictures(&folder);
    session.eyes.until("an active servo that goes on", |view, port| {
        let goes_on = |ticks: u64, ports: u64| ticks > before.ticks + ON && ports > before.port_sequence;
        let servo = view.servo.filter(|s| s.mode == ACTIVE && port.is_some())?;
        goes_on(servo.ticks, servo.port_sequence).then_some(())
    });
    wait(|| pictures(&folder) > drawn + 3, "the second viewer draws no more");
    assert!(second.try_wait().expect("it is ours").is_none(), "the second viewer has ended");
    // Nobody is the hand any more: another window may be.
    let Some(screen) = Screen::start() else { return };
    let Some(mut person) = session.sit_down(&screen, SIZE) else { return };
    person.key("m");
    assert_eq!(person.viewer.expect("hand")["mode"], "hand");
    person.quit();
    second.kill().and_then(|()| second.wait()).expect("it is ours");
    assert_eq!(session.server.stop(), Some(0));
}

/// Waits for something that happens soon.
fn wait(mut is_so: impl FnMut() -> bool, otherwise: &str) {
    // Wall clock: only the limit for a program that hangs.
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < LIMIT, "{otherwise}");
        std::thread::sleep(Duration::from_millis(20));
    }
}
