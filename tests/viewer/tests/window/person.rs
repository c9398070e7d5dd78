//! A person at the window: eyes that see the run through shared memory, and a hand on mouse and keys that finds its pixels by the
//! camera which the viewer tells.

use crate::screen::{LIMIT, Screen, Server, Viewer};
use nalgebra::{Matrix4, Point3};
use protocol::ports::{PortNode, TissuePortSubscriber};
use protocol::run::{Environment, RunDir, RunRoot};
use protocol::tissue_port::TissuePort;
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};
use suture_tests::processes::binary;
use tempfile::TempDir;
use viewer_client::feed::{Feed, View};
use viewer_client::gpu::{Picture, png};

/// The stylus is where the mouse wants it, within this much, metres: a capture takes it from 4 mm.
const ARRIVED_M: f64 = 2.0e-3;
/// A picked node lies this near the place that was pointed at, metres: half a pixel and half an edge of the mesh.
const PICKED_M: f32 = 2.5e-3;
/// An orbit changes at least this share of the picture's pixels.
const CHANGED: f64 = 0.05;

/// What a person sees of the run: views and the newest tissue port.
pub(crate) struct Eyes {
    feed: Feed,
    ports: TissuePortSubscriber,
    port: Option<TissuePort>,
    // Last, so that it outlives its ports.
    _node: PortNode,
}

impl Eyes {
    pub(crate) fn open(run: &RunDir) -> Self {
        let node = PortNode::join(run, "window-test").expect("anybody may join");
        let ports = TissuePortSubscriber::open(&node).expect("anybody may look");
        Self { feed: Feed::join(run).expect("anybody may look"), ports, port: None, _node: node }
    }

    /// Looks until something is to be seen; the limit is for a run that hangs.
    pub(crate) fn until<T>(&mut self, what: &str, mut see: impl FnMut(&View, Option<&TissuePort>) -> Option<T>) -> T {
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

    pub(crate) fn stage(&mut self, stage: u32) {
        self.until(&format!("stage {stage}"), |view, _| view.report.as_ref().filter(|r| r.stage == stage).map(|_| ()));
    }

    /// Waits until the stylus has come to a place.
    pub(crate) fn stylus_at(&mut self, place: [f32; 3]) {
        self.until(&format!("the stylus at {place:?}"), |view, _| {
            let at = view.servo.as_ref()?.devices[0].position_m;
            let away = (0..3).map(|k| (at[k] - f64::from(place[k])).powi(2)).sum::<f64>().sqrt();
            (away < ARRIVED_M).then_some(())
        });
    }

    /// A suture point of the first pair.
    pub(crate) fn point(&mut self, side: usize) -> [f32; 3] {
        self.until("a suture point", |view, _| {
            let node = *view.outline_of_frame()?.pairs.get(side)?;
            view.frame.elements.get(node as usize).map(|n| n.position_m)
        })
    }
}

/// The camera as the viewer tells it.
pub(crate) struct Sight {
    scene_to_clip: Matrix4<f32>,
    pub(crate) size: [f64; 2],
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
    pub(crate) fn pixel(&self, at_m: [f32; 3]) -> [f64; 2] {
        let clip = self.scene_to_clip * Point3::from(at_m).to_homogeneous();
        let (x, y) = (f64::from(clip.x / clip.w), f64::from(clip.y / clip.w));
        [(0.5 + 0.5 * x) * self.size[0], (0.5 - 0.5 * y) * self.size[1]]
    }
}

/// A person with mouse and keyboard at the window.
pub(crate) struct Person<'s> {
    screen: &'s Screen,
    pub(crate) viewer: Viewer,
    window: String,
    size: [f64; 2],
}

impl Person<'_> {
    pub(crate) fn key(&self, name: &str) {
        self.screen.xdo(&["key", name]);
    }

    pub(crate) fn go(&self, [x, y]: [f64; 2]) {
        let (x, y) = (x.round().to_string(), y.round().to_string());
        self.screen.xdo(&["mousemove", "--window", &self.window, &x, &y]);
    }

    pub(crate) fn button(&self, act: &str) {
        self.screen.xdo(&[act, "1"]);
    }

    /// Straight down on all of the tissue.
    pub(crate) fn look_from_above(&mut self) -> Sight {
        self.key("7");
        self.viewer.expect("camera");
        self.key("f");
        Sight::of(&self.viewer.expect("camera"))
    }

    pub(crate) fn screenshot(&mut self) -> Picture {
        self.key("p");
        let event = self.viewer.expect("saved");
        let file = event["file"].as_str().expect("a path");
        png::decode(&std::fs::read(file).expect("the file that was told")).expect("a picture")
    }
}

/// Share of pixels that differ visibly.
pub(crate) fn changed(a: &Picture, b: &Picture) -> f64 {
    assert_eq!(a.size, b.size);
    let differ = |(p, q): &(&[u8], &[u8])| p.iter().zip(*q).any(|(p, q)| p.abs_diff(*q) > 24);
    let count = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).filter(differ).count();
    count as f64 / (a.rgba.len() / 4) as f64
}

impl Person<'_> {
    /// Orbits by the mouse: the picture changes.
    pub(crate) fn orbit(&mut self) {
        let [width, height] = self.size;
        let before = self.screenshot();
        self.go([0.5 * width, 0.5 * height]);
        self.button("mousedown");
        for step in [20.0, 60.0, 100.0] {
            self.go([0.5 * width + step, 0.5 * height + 30.0]);
        }
        self.button("mouseup");
        let share = changed(&before, &self.screenshot());
        assert!(share > CHANGED, "only {share} of the picture changed");
    }

    /// Picks the tissue at a place of the scene that was pointed at; gives the node.
    pub(crate) fn pick(&mut self, sight: &Sight, at_m: [f32; 3]) -> Value {
        self.go(sight.pixel(at_m));
        self.screen.xdo(&["keydown", "ctrl", "click", "1", "keyup", "ctrl"]);
        let mut picked = self.viewer.expect("picked");
        let at: Vec<f32> =
            picked["at_m"].as_array().expect("a list").iter().map(|n| n.as_f64().unwrap_or(1.0) as f32).collect();
        let away = (at[0] - at_m[0]).hypot(at[1] - at_m[1]);
        assert!(away < PICKED_M, "picked {at:?}, pointed at {at_m:?}");
        picked["node"].take()
    }

    /// Orders by a key; the answer is told and is as expected.
    pub(crate) fn order(&mut self, key: &str, name: &str, answer: &str) {
        self.key(key);
        loop {
            let notice = self.viewer.expect("notice");
            let text = notice["text"].as_str().expect("a sentence");
            if let Some(said) = text.strip_prefix(name) {
                assert!(said.starts_with(answer), "{text}");
                return;
            }
        }
    }

    /// Orders another scene by a key, and waits until the viewer has framed it.
    pub(crate) fn go_to(&mut self, key: &str, name: &str) {
        self.viewer.camera = Value::Null;
        self.order(key, name, ": done");
        if self.viewer.camera.is_null() {
            self.viewer.expect("camera");
        }
    }

    /// Waits until the viewer has said that the servo is in this state.
    pub(crate) fn servo_is(&mut self, state: &str) {
        while self.viewer.servo["state"] != state {
            self.viewer.expect("servo");
        }
    }

    /// Leaves the viewer to itself.
    pub(crate) fn leave(self) -> Viewer {
        self.viewer
    }

    /// Quits by the key.
    pub(crate) fn quit(mut self) {
        self.key("q");
        self.viewer.expect("quit");
        assert_eq!(self.viewer.end().0, Some(0));
    }
}

/// A running server in a folder of its own, with eyes on it.
pub(crate) struct Session {
    pub(crate) folder: TempDir,
    pub(crate) server: Server,
    pub(crate) run: RunDir,
    pub(crate) eyes: Eyes,
}

/// Missed ticks that are a fault in these runs: a virtual machine that stands still for tenths of a second is not what most are
/// about.
pub(crate) const PATIENT: u32 = 1_000;

impl Session {
    /// Starts a server; `before` is a program that starts it, with its arguments.
    pub(crate) fn start(before: &[&str], arguments: &[&str], missed_fault_ticks: u32) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let servo = folder.path().join("servo.toml");
        std::fs::write(&servo, format!("[rhythm]\nmissed_fault_ticks = {missed_fault_ticks}\n")).expect("writable");
        let program = binary("haptic-server");
        let words = before.iter().map(Path::new).chain([program.as_path(), Path::new("run"), Path::new("--servo")]);
        let words: Vec<&Path> = words.chain([servo.as_path()]).chain(arguments.iter().map(Path::new)).collect();
        let server = Server::start(words[0], folder.path(), &words[1..]);
        let run = attach(folder.path());
        let mut eyes = Eyes::open(&run);
        eyes.point(0);
        Self { folder, server, run, eyes }
    }

    /// Opens a window on a display; `None` with a printed notice where no adapter can draw.
    pub(crate) fn sit_down<'s>(&self, screen: &'s Screen, size: [u32; 2]) -> Option<Person<'s>> {
        let mut viewer = Viewer::start(screen, self.folder.path(), self.folder.path(), size);
        if viewer.next("started").is_none() {
            let (code, said) = viewer.end();
            assert!(code == Some(69) && said.contains("graphics adapter"), "{code:?}: {said}");
            println!("skipped: {said}");
            return None;
        }
        viewer.expect("camera");
        let window = screen.xdo(&["search", "--sync", "--name", "Suture surgery"]);
        screen.xdo(&["windowfocus", "--sync", &window]);
        Some(Person { screen, viewer, window, size: size.map(f64::from) })
    }
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
