//! Eyes of the virtual hand: the newest tissue port of the server that runs, read as any viewer would read it.
//!
//! A thread of its own attaches to the run whenever there is one and keeps the newest view in a cell. The hand then
//! sutures by eye, as the server's synthetic hand does, although it lives behind the device's interface.
//! Deliberately absent: anything that the server would have to offer for it.

use crossbeam::atomic::AtomicCell;
use haptic_server::device::HandView;
use protocol::ports::{PortNode, TissuePortSubscriber};
use protocol::run::{Environment, RunRoot};
use std::sync::Arc;
use std::time::Duration;

/// Time between two looks.
const LOOK_PERIOD: Duration = Duration::from_millis(2);
/// Time between two attempts to find a server.
const SEARCH_PERIOD: Duration = Duration::from_millis(50);

/// What the hand sees now.
pub(crate) struct Eyes {
    seen: Arc<AtomicCell<HandView>>,
}

impl Eyes {
    /// Open: a thread looks for a server and then at its tissue.
    pub(crate) fn open() -> Self {
        let seen = Arc::new(AtomicCell::new(HandView::unseen()));
        let cell = Arc::downgrade(&seen);
        std::thread::spawn(move || {
            while cell.strong_count() > 0 {
                // A server that is not there yet, or a port that it has not opened yet, is looked for again.
                let _not_yet = look(&cell);
                std::thread::sleep(SEARCH_PERIOD);
            }
        });
        Self { seen }
    }

    /// The newest view.
    pub(crate) fn view(&self) -> HandView {
        self.seen.load()
    }
}

/// Looks until something breaks.
fn look(cell: &std::sync::Weak<AtomicCell<HandView>>) -> Option<()> {
    let run = RunRoot::open(&Environment::of_process()).ok()?.attach().ok()?;
    let node = PortNode::join(&run, "virtual-hand").ok()?;
    let mut ports = TissuePortSubscriber::open(&node).ok()?;
    loop {
        let seen = cell.upgrade()?;
        if let Some(port) = ports.newest().ok()? {
            seen.store(HandView::from(&port));
        }
        drop(seen);
        std::thread::sleep(LOOK_PERIOD);
    }
}
