//! Eyes of the virtual hand: the newest view, as a helper process tells it line by line (`sight.rs`).
//!
//! The helper is `virtual-omni-eyes`, named by `VIRTUAL_OMNI_EYES`; without it the hand sees nothing and waits.
//! A thread reads its lines into a cell; the helper ends when nobody reads any more.

use crate::sight::from_line;
use crossbeam::atomic::AtomicCell;
use haptic_server::device::HandView;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

/// What the hand sees now.
pub(crate) struct Eyes {
    seen: Arc<AtomicCell<HandView>>,
}

impl Eyes {
    /// Through this helper, if there is one.
    pub(crate) fn open(helper: Option<&Path>) -> Self {
        let seen = Arc::new(AtomicCell::new(HandView::unseen()));
        let started = helper.map(|path| Command::new(path).stdin(Stdio::null()).stdout(Stdio::piped()).spawn());
        match started {
            Some(Ok(mut child)) => {
                let cell = Arc::downgrade(&seen);
                std::thread::spawn(move || {
                    let lines = child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).lines());
                    for line in lines.map_while(Result::ok) {
                        let Some(seen) = cell.upgrade() else { break };
                        if let Some(view) = from_line(&line) {
                            seen.store(view);
                        }
                    }
                    // Its pipe is closed now: it ends by itself.
                    let _ended = child.wait();
                });
            }
            Some(Err(error)) => tell(&format!("its eyes cannot be started: {error}")),
            None => tell("VIRTUAL_OMNI_EYES names no helper: the hand is blind"),
        }
        Self { seen }
    }

    /// The newest view.
    pub(crate) fn view(&self) -> HandView {
        self.seen.load()
    }
}

fn tell(what: &str) {
    // Nothing can be done when stderr is gone.
    let _ = writeln!(std::io::stderr(), "virtual device: {what}");
}
