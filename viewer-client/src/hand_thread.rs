//! Sends the hand's wish 125 times a second, however slowly pictures are drawn.
//!
//! A thread of its own, since its port must stay in the thread that opened it. It sends the newest wish as long as the window
//! says something at least once a second: a window that hangs must not leave a hand on the tissue. Dropping the
//! handle ends the thread, and with it the hand.

use protocol::pointer_hand::PointerHand;
use protocol::ports::{PointerHandPublisher, PortError, PortNode};
use protocol::run::RunDir;
use protocol::wire::Field;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// From wish to wish on the wire.
const PERIOD: Duration = Duration::from_millis(8);
/// A window that says nothing for this long has no hand.
const SILENCE: Duration = Duration::from_secs(1);

/// What the window says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandWish {
    /// Where the stylus is to go, metres.
    pub position_m: [f64; 3],
    /// Buttons as bits.
    pub buttons: u32,
}

/// The sending thread.
#[derive(Debug)]
pub struct HandThread {
    /// `None` only while it is being dropped.
    wishes: Option<Sender<HandWish>>,
    thread: Option<JoinHandle<()>>,
}

impl HandThread {
    /// Becomes the hand of this run.
    ///
    /// # Errors
    /// A sentence: another viewer is the hand, or the port cannot be opened.
    pub fn start(run: &RunDir) -> Result<Self, String> {
        let (wishes, incoming) = channel();
        let (opened, answer) = channel();
        let path = run.path().to_owned();
        let thread = std::thread::Builder::new()
            .name("hand".to_owned())
            .spawn(move || {
                let port = RunDir::open(&path).map_err(|e| e.to_string()).and_then(|run| open(&run));
                match port {
                    Ok((node, publisher)) => {
                        if opened.send(Ok(())).is_ok() {
                            send_until_dropped(publisher, &incoming);
                        }
                        drop(node);
                    }
                    Err(sentence) => drop(opened.send(Err(sentence))),
                }
            })
            .map_err(|e| format!("the mouse cannot be the hand: no thread can be started ({e})"))?;
        answer.recv().unwrap_or_else(|_| Err("the mouse cannot be the hand: its thread ended".to_owned()))?;
        Ok(Self { wishes: Some(wishes), thread: Some(thread) })
    }

    /// The newest wish; say it at every look, changed or not.
    pub fn say(&self, wish: HandWish) {
        if let Some(wishes) = &self.wishes {
            // The thread outlives this handle.
            let _ = wishes.send(wish);
        }
    }
}

impl Drop for HandThread {
    fn drop(&mut self) {
        self.wishes = None;
        if let Some(thread) = self.thread.take() {
            // A panic in there was told on stderr.
            let _ = thread.join();
        }
    }
}

fn open(run: &RunDir) -> Result<(PortNode, PointerHandPublisher), String> {
    let node = PortNode::join(run, "viewer-hand").map_err(|e| e.to_string())?;
    match PointerHandPublisher::open(&node) {
        Ok(publisher) => Ok((node, publisher)),
        Err(PortError::Full { .. }) => {
            Err("another viewer is the hand; let it give the hand back first (M)".to_owned())
        }
        Err(error) => Err(error.to_string()),
    }
}

fn send_until_dropped(mut publisher: PointerHandPublisher, incoming: &Receiver<HandWish>) {
    let mut newest: Option<(HandWish, Instant)> = None;
    let mut next = Instant::now();
    loop {
        match incoming.recv_timeout(next.saturating_duration_since(Instant::now())) {
            Ok(wish) => {
                newest = Some((wish, Instant::now()));
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => next = (next + PERIOD).max(Instant::now()),
        }
        if let Some((wish, _)) = newest.filter(|(_, said)| said.elapsed() < SILENCE) {
            let HandWish { position_m, buttons } = wish;
            let mut message = PointerHand { position_m, buttons, sender: std::process::id(), ..PointerHand::EMPTY };
            // The next one follows in 8 ms; a server that has gone is told by the missing servo state.
            let _ = publisher.send(&mut message);
        }
    }
}
