//! The other scenes of the procedure in the window, and its beginning anew: each is looked at, turned, picked and photographed; a
//! window is opened on the last.

use crate::person::{Eyes, PATIENT, Session};
use crate::screen::Screen;
use crate::{SIZE, alone};

/// Kinds of scene on the wire.
const SKIN: u32 = 0;
const LIVER: u32 = 1;
const VESSEL: u32 = 2;

/// Waits until the scene is that of a kind, complete; gives its generation.
fn scene(eyes: &mut Eyes, kind: u32) -> u32 {
    eyes.until(&format!("a scene of kind {kind}"), |view, _| {
        let complete = view.outline_of_frame().is_some() && view.outline.header.scene_kind == kind;
        let report = view.report.as_ref().filter(|r| complete && r.scene_kind == kind)?;
        Some(report.scene_generation).filter(|generation| *generation == view.frame.header.scene_generation)
    })
}

#[test]
fn liver_and_vessel_are_seen_turned_and_picked_and_the_procedure_begins_anew() {
    let _alone = alone();
    let Some(screen) = Screen::start() else { return };
    let arguments = ["--device", "pointer", "--procedure", "liver-surgery", "--duration", "600"];
    let mut session = Session::start(&[], &arguments, PATIENT);
    let Some(mut person) = session.sit_down(&screen, SIZE) else { return };
    scene(&mut session.eyes, SKIN);
    person.go_to("n", "next scene");
    scene(&mut session.eyes, LIVER);
    person.orbit();
    let sight = person.look_from_above();
    person.pick(&sight, session.eyes.point(0));
    person.go_to("n", "next scene");
    let last = scene(&mut session.eyes, VESSEL);
    person.quit();

    // Opened on the vessel.
    let Some(mut person) = session.sit_down(&screen, SIZE) else { return };
    person.orbit();
    let sight = person.look_from_above();
    person.pick(&sight, session.eyes.point(0));
    person.order("n", "next scene", ": refused");
    person.go_to("shift+r", "start");
    assert!(scene(&mut session.eyes, SKIN) > last, "the first scene is a new one");
    person.orbit();
    person.quit();
    assert_eq!(session.server.stop(), Some(0));
}
