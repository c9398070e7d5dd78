//! The window under a synthetic mouse and keyboard: orbit, pick a sample point, suture one stitch with the mouse as the hand,
//! screenshot, restore, quit. A real server with `--device pointer`, a real window on a display that nobody looks at.
//!
//! The test sees what a person sees: it takes the scene from shared memory and the camera from the viewer's own words, and
//! points at pixels. Skipped with a notice where Xvfb, xdotool or a graphics adapter is missing.

mod screen;

use nalgebra::{Matrix4, Point3};
use protocol::ports::{PortNode, TissuePortSubscriber};
use protocol::run::{Environment, RunDir, RunRoot};
use protocol::tissue_port::TissuePort;
use screen::{LIMIT, Screen, Server, Viewer};
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};
use suture_tests::processes::binary;
use viewer_client::feed::{Feed, View};
use viewer_client::gpu::{Picture, png};

/// The stylus is where the mouse wants it, within this much, metres: a capture takes it from 4 mm.
const ARRIVED_M: f64 = 2.0e-3;
/// A picked node lies this near the place that was pointed at, metres: half a pixel and half an edge of the mesh.
const PICKED_M: f32 = 2.5e-3;
/// An orbit changes at least this share of the picture's pixels.
const CHANGED: f64 = 0.05;
/// The hand pulls a gap closed with more than this, newtons.
const FELT_N: f64 = 0.05;
/// Step of the pull from picture to picture, pixels.
const PULL_PX: f64 = 4.0;

/// What a person sees of the run: views and the newest tissue port.
struct Eyes {
    feed: Feed,
    ports: TissuePortSubscriber,
    port: Option<TissuePort>,
    // Last, so that it outlives its ports.
    _node: PortNode,
}

impl Eyes {
    fn open(run: &RunDir) -> Self {
        let node = PortNode::join(run, "window-test").expect("anybody may join");
        let ports = TissuePortSubscriber::open(&node).expect("anybody may look");
        Self { feed: Feed::join(run).expect("anybody may look"), ports, port: None, _node: node }
    }

    /// Looks until something is to be seen; the limit is for a run that hangs.
    fn until<T>(&mut self, what: &str, mut see: impl FnMut(&View, Option<&TissuePort>) -> Option<T>) -> T {
        // Wall clock: only the limit for a hung run.
        let start = Instant::now();
        while start.elapsed() < LIMIT {
            self.port = self.ports.newest().ok().flatten().or(self.port);
            let view = self.feed.look().expect("shared memory");
            if let Some(seen) = see(view, self.port.as_ref()) {
                return seen;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("{what}: not seen");
    }

    fn stage(&mut self, stage: u32) {
        self.until(&format!("stage {stage}"), |view, _| view.report.as_ref().filter(|r| r.stage == stage).map(|_| ()));
    }

    /// Waits until the stylus has come to a place.
    fn stylus_at(&mut self, place: [f32; 3]) {
        self.until(&format!("the stylus at {place:?}"), |view, _| {
            let at = view.servo.as_ref()?.devices[0].position_m;
            let away = (0..3).map(|k| (at[k] - f64::from(place[k])).powi(2)).sum::<f64>().sqrt();
            (away < ARRIVED_M).then_some(())
        });
    }

    /// A suture point of the first pair.
    fn point(&mut self, side: usize) -> [f32; 3] {
        self.until("a suture point", |view, _| {
            let node = *view.outline_of_frame()?.pairs.get(side)?;
            view.frame.elements.get(node as usize).map(|n| n.position_m)
        })
    }
}

/// The camera as the viewer tells it.
struct Sight {
    scene_to_clip: Matrix4<f32>,
    size: [f64; 2],
}

impl Sight {
    fn of(event: &Value) -> Self {
        let numbers = |key: &str| -> Vec<f64> {
            event[key].as_array().expect("a list").iter().map(|n| n.as_f64().expect("a number")).collect()
        };
        let matrix: Vec<f32> = numbers("scene_to_clip").iter().map(|n| *n as f32).collect();
        let size = numbers("size");
        Self { scene_to_clip: Matrix4::from_column_slice(&matrix), size: [size[0], size[1]] }
    }

    /// The pixel of a point of the scene.
    fn pixel(&self, at_m: [f32; 3]) -> [f64; 2] {
        let clip = self.scene_to_clip * Point3::from(at_m).to_homogeneous();
        let (x, y) = (f64::from(clip.x / clip.w), f64::from(clip.y / clip.w));
        [(0.5 + 0.5 * x) * self.size[0], (0.5 - 0.5 * y) * self.size[1]]
    }
}

/// A person with mouse and keyboard at the window.
struct Person<'s> {
    screen: &'s Screen,
    viewer: Viewer,
    window: String,
}

impl Person<'_> {
    fn key(&self, name: &str) {
        self.screen.xdo(&["key", name]);
    }

    fn go(&self, [x, y]: [f64; 2]) {
        let (x, y) = (x.round().to_string(), y.round().to_string());
        self.screen.xdo(&["mousemove", "--window", &self.window, &x, &y]);
    }

    fn button(&self, act: &str) {
        self.screen.xdo(&[act, "1"]);
    }

    /// Straight down on all of the tissue.
    fn look_from_above(&mut self) -> Sight {
        self.key("7");
        self.viewer.expect("camera");
        self.key("f");
        Sight::of(&self.viewer.expect("camera"))
    }

    fn screenshot(&mut self) -> Picture {
        self.key("p");
        let event = self.viewer.expect("saved");
        let file = event["file"].as_str().expect("a path");
        png::decode(&std::fs::read(file).expect("the file that was told")).expect("a picture")
    }
}

/// Share of pixels that differ visibly.
fn changed(a: &Picture, b: &Picture) -> f64 {
    assert_eq!(a.size, b.size);
    let differ = |(p, q): &(&[u8], &[u8])| p.iter().zip(*q).any(|(p, q)| p.abs_diff(*q) > 24);
    let count = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).filter(differ).count();
    count as f64 / (a.rgba.len() / 4) as f64
}

fn attach(sandbox: &Path) -> RunDir {
    let environment = Environment { xdg_runtime_dir: Some(sandbox.to_owned()), ..Environment::of_process() };
    // Wall clock: only the limit for a hung server.
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        if let Ok(run) = RunRoot::open(&environment).and_then(|root| root.attach()) {
            return run;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("the server did not start");
}

#[test]
fn a_person_with_a_mouse_orbits_picks_sutures_restores_and_quits() {
    let Some(screen) = Screen::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["run", "--device", "pointer", "--scene", "skin", "--duration", "600"];
    let server = Server::start(&binary("haptic-server"), folder.path(), &arguments);
    let mut eyes = Eyes::open(&attach(folder.path()));
    eyes.point(0);
    let mut at_window = Viewer::start(&screen, folder.path(), folder.path());
    if at_window.next("started").is_none() {
        let (code, said) = at_window.end();
        assert!(code == Some(69) && said.contains("graphics adapter"), "{code:?}: {said}");
        println!("skipped: {said}");
        return;
    }
    at_window.expect("camera");
    let window = screen.xdo(&["search", "--sync", "--name", "Suture surgery"]);
    screen.xdo(&["windowfocus", "--sync", &window]);
    let mut person = Person { screen: &screen, viewer: at_window, window };

    // Orbit: the picture changes.
    let before = person.screenshot();
    person.go([320.0, 240.0]);
    person.button("mousedown");
    for x in [340.0, 380.0, 420.0] {
        person.go([x, 270.0]);
    }
    person.button("mouseup");
    let share = changed(&before, &person.screenshot());
    assert!(share > CHANGED, "only {share} of the picture changed");

    // A sample point where the first left suture point is, and its curve in a file.
    let sight = person.look_from_above();
    let left = eyes.point(0);
    person.go(sight.pixel(left));
    screen.xdo(&["keydown", "ctrl", "click", "1", "keyup", "ctrl"]);
    let picked = person.viewer.expect("picked");
    let at: Vec<f32> =
        picked["at_m"].as_array().expect("a list").iter().map(|n| n.as_f64().unwrap_or(1.0) as f32).collect();
    let away = ((at[0] - left[0]).powi(2) + (at[1] - left[1]).powi(2)).sqrt();
    assert!(away < PICKED_M, "picked {at:?}, pointed at {left:?}");
    person.key("k");
    let saved = person.viewer.expect("saved");
    let csv = std::fs::read_to_string(saved["file"].as_str().expect("a path")).expect("the file that was told");
    assert!(csv.starts_with("# node ") && csv.contains("\nnode,time_s,deformation_m"), "{csv}");

    suture(&mut person, &mut eyes, &sight);
    assert!(felt(&mut person, &picked["node"]) > FELT_N, "the curve of a sutured point knows no force of the hand");

    // Restore: answered, and the stitch is gone.
    person.key("r");
    loop {
        let notice = person.viewer.expect("notice");
        let text = notice["text"].as_str().expect("a sentence");
        if text.starts_with("restore") {
            assert_eq!(text, "restore: done");
            break;
        }
    }
    eyes.until("no stitch", |view, _| view.report.as_ref().filter(|r| r.row_count == 0).map(|_| ()));

    person.key("q");
    person.viewer.expect("quit");
    let Person { viewer, .. } = person;
    assert_eq!(viewer.end().0, Some(0));
    assert_eq!(server.stop(), Some(0));
}

/// Largest force of the hand in the saved curve of a node.
fn felt(person: &mut Person<'_>, node: &Value) -> f64 {
    person.key("k");
    let saved = person.viewer.expect("saved");
    let csv = std::fs::read_to_string(saved["file"].as_str().expect("a path")).expect("the file that was told");
    let name = node.to_string();
    let own = csv.lines().map(|line| line.split(',').collect::<Vec<_>>()).filter(|row| row[0] == name);
    own.map(|row| row[5].parse::<f64>().expect("a number")).fold(0.0, f64::max)
}

/// One stitch of the first pair with the mouse, straight from above.
fn suture(person: &mut Person<'_>, eyes: &mut Eyes, sight: &Sight) {
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
    person.button("mouseup");
    eyes.until("a stitch", |view, _| view.report.as_ref().filter(|r| r.row_count == 1).map(|_| ()));
    person.key("m");
    assert_eq!(person.viewer.expect("hand")["mode"], "idle");
}
