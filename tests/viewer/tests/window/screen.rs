//! A display of its own (Xvfb) with a synthetic mouse and keyboard (xdotool), and a viewer on it whose events are read.

use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A running server that ends with the test.
pub(crate) struct Server(Child);

impl Server {
    pub(crate) fn start(program: &Path, runtime: &Path, arguments: &[&Path]) -> Self {
        let child = Command::new(program)
            .args(arguments)
            .env("XDG_RUNTIME_DIR", runtime)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        Self(child.expect("the server starts"))
    }

    /// Its children of this subcommand, by `/proc`.
    pub(crate) fn child(&self, subcommand: &str) -> Option<u32> {
        let id = self.0.id();
        let list = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children")).ok()?;
        let named = |id: &u32| {
            let line = std::fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
            line.split(|byte| *byte == 0).nth(1) == Some(subcommand.as_bytes())
        };
        list.split_whitespace().filter_map(|id| id.parse().ok()).find(named)
    }

    /// Asks it to end, as Ctrl-C does, and waits.
    pub(crate) fn stop(mut self) -> Option<i32> {
        signal("TERM", self.0.id());
        self.0.wait().expect("it is ours").code()
    }
}

/// Sends a signal to one process.
pub(crate) fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args(["-s", name]).arg(id.to_string()).status();
    assert!(sent.expect("kill runs").success(), "no {name} for {id}");
}

impl Drop for Server {
    fn drop(&mut self) {
        let _gone = self.0.kill().and_then(|()| self.0.wait());
    }
}

/// A program that has not answered by then hangs.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

/// A display that nobody looks at.
pub(crate) struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts a display with a free number; `None` with a printed notice where the programs for it are missing.
    pub(crate) fn start() -> Option<Self> {
        for program in ["Xvfb", "xdotool"] {
            let known = Command::new(program).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
            if known.is_err() {
                println!("skipped: {program} is not installed (apt install xvfb xdotool)");
                return None;
            }
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut line = String::new();
        let out = server.stdout.take().expect("it is piped");
        BufReader::new(out).read_line(&mut line).expect("Xvfb tells its number");
        Some(Self { server, display: format!(":{}", line.trim()) })
    }

    /// Dies, as an X server that crashes or is killed.
    pub(crate) fn die(&mut self) {
        self.server.kill().and_then(|()| self.server.wait()).expect("it is ours");
    }

    pub(crate) fn display(&self) -> &str {
        &self.display
    }

    /// Mouse and keys; what cannot be done is a failure.
    pub(crate) fn xdo(&self, arguments: &[&str]) -> String {
        let done =
            Command::new("xdotool").args(arguments).env("DISPLAY", &self.display).output().expect("xdotool runs");
        assert!(done.status.success(), "xdotool {arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8_lossy(&done.stdout).trim().to_owned()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _gone = self.server.kill().and_then(|()| self.server.wait());
    }
}

/// A viewer with a window.
pub(crate) struct Viewer {
    child: Child,
    events: Receiver<Value>,
    seen: Vec<Value>,
    /// What it said last of the servo and of its camera.
    pub(crate) servo: Value,
    pub(crate) camera: Value,
}

impl Viewer {
    /// Starts it on a display, in the run directory of a server.
    pub(crate) fn start(screen: &Screen, runtime: &Path, out: &Path, [width, height]: [u32; 2]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_viewer-of-tests"))
            .args(["--tell", "--size", &format!("{width}x{height}"), "--quality", "fast", "--out"])
            .arg(out)
            .env("DISPLAY", screen.display())
            .env("XDG_RUNTIME_DIR", runtime)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the viewer starts");
        let lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let event = serde_json::from_str(&line).unwrap_or_else(|e| panic!("{line}: {e}"));
                if sender.send(event).is_err() {
                    return;
                }
            }
        });
        Self { child, events, seen: Vec::new(), servo: Value::Null, camera: Value::Null }
    }

    /// The next event of this name; those before it are passed over.
    pub(crate) fn expect(&mut self, name: &str) -> Value {
        match self.next(name) {
            Some(event) => event,
            None => {
                let said = self.stderr();
                panic!("no {name} came after {:?}; {said}", self.seen)
            }
        }
    }

    /// The same, `None` when the viewer ends or says nothing any more.
    pub(crate) fn next(&mut self, name: &str) -> Option<Value> {
        loop {
            let event = self.events.recv_timeout(LIMIT).ok()?;
            self.seen.push(event.clone());
            match event["event"].as_str() {
                Some("servo") => self.servo = event.clone(),
                Some("camera") => self.camera = event.clone(),
                _ => {}
            }
            if event["event"] == name {
                return Some(event);
            }
        }
    }

    /// Waits for the end; gives the exit code and what was said on standard error.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let status = self.child.wait().expect("it is ours");
        (status.code(), self.stderr())
    }

    fn stderr(&mut self) -> String {
        let _killed = self.child.kill();
        let mut text = String::new();
        if let Some(mut stream) = self.child.stderr.take() {
            let _read = stream.read_to_string(&mut text);
        }
        text
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _gone = self.child.kill().and_then(|()| self.child.wait());
    }
}
