//! Sends the hand's wish 125 times a second, however slowly pictures are drawn.
//!
//! A thread of its own, since its port must stay in the thread that opened it. It sends the newest wish as long as the window
//! says something at least once a second: a window that hangs must not leave a hand on the tissue. Dropping the
//! handle gives the hand back and ends the thread. Of several viewers that send the server lets one be the hand and says in
//! `servo_state` which; a viewer that finds another one there asks for nothing, or stops asking ([`of_another`]).

use crate::pointer::Pointer;
use protocol::pointer_hand::{GIVES_BACK, PointerHand};
use protocol::ports::{MAX_HAND_SENDERS, PointerHandPublisher, PortError, PortNode};
use protocol::run::RunDir;
use protocol::servo_state::ServoState;
use protocol::wire::Field;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// From wish to wish on the wire.
const PERIOD: Duration = Duration::from_millis(8);
/// A window that says nothing for this long has no hand.
const SILENCE: Duration = Duration::from_secs(1);

/// Messages that tell buttons before others are told, and that the last word is said in.
const REPEATS: u32 = 2;
/// Changes of buttons that may wait; no hand clicks so fast for so long.
const MOST_WAITING: usize = 32;

/// The process that is the hand, if that is somebody else.
#[must_use]
pub fn of_another(servo: &ServoState) -> Option<u32> {
    (![0, std::process::id()].contains(&servo.hand_sender)).then_some(servo.hand_sender)
}

/// The mouse as the hand: each act is said at once.
#[derive(Debug)]
pub struct MouseHand {
    thread: HandThread,
    pointer: Pointer,
}

impl MouseHand {
    /// Becomes the hand of this run, where the stylus is.
    ///
    /// # Errors
    /// As [`HandThread::start`].
    pub fn start(run: &RunDir, stylus_m: [f64; 3]) -> Result<Self, String> {
        let hand = Self { thread: HandThread::start(run)?, pointer: Pointer::at(stylus_m) };
        // A button counts at the server once it has been seen up.
        hand.say();
        Ok(hand)
    }

    /// Does this with the pointer and says it.
    pub fn act(&mut self, act: impl FnOnce(&mut Pointer)) {
        act(&mut self.pointer);
        self.say();
    }

    /// Says again where the hand is; at every look.
    pub fn say(&self) {
        self.thread.say(HandWish { position_m: self.pointer.target_m(), buttons: self.pointer.buttons() });
    }
}

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
    /// A sentence: too many viewers ask for the hand, or the port cannot be opened.
    pub fn start(run: &RunDir) -> Result<Self, String> {
        let (wishes, incoming) = channel();
        let (opened, answer) = channel();
        let path = run.path().to_owned();
        let thread = std::thread::Builder::new()
            .name("hand".to_owned())
            .spawn(move || {
                let port = RunDir::open(&path).map_err(|e| e.to_string()).and_then(|run| open(&run));
                match port {
                    Ok((node, mut publisher)) => {
                        if opened.send(Ok(())).is_ok() {
                            send_until_dropped(|wish| send(&mut publisher, wish), &incoming);
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
        Err(PortError::Full { .. }) => Err(format!(
            "{MAX_HAND_SENDERS} viewers ask for the hand already; close one of them, or one that is stopped"
        )),
        Err(error) => Err(error.to_string()),
    }
}

fn send(publisher: &mut PointerHandPublisher, HandWish { position_m, buttons }: HandWish) {
    let mut message = PointerHand { position_m, buttons, sender: std::process::id(), ..PointerHand::EMPTY };
    // The next one follows in 8 ms; a server that has gone is told by the missing servo state.
    let _ = publisher.send(&mut message);
}

/// Wishes that are not told yet: one for each change of buttons, the newest place with the newest buttons.
#[derive(Debug, Default)]
struct Waiting {
    wishes: VecDeque<HandWish>,
    /// How often the first of them was told.
    told: u32,
}

impl Waiting {
    fn add(&mut self, wish: HandWish) {
        let is_full = self.wishes.len() >= MOST_WAITING;
        match self.wishes.back_mut() {
            Some(last) if last.buttons == wish.buttons || is_full => *last = wish,
            _ => self.wishes.push_back(wish),
        }
    }

    /// What is to be told now.
    fn next(&mut self) -> Option<HandWish> {
        if self.wishes.len() > 1 && self.told >= REPEATS {
            self.wishes.pop_front();
            self.told = 0;
        }
        let wish = *self.wishes.front()?;
        self.told = self.told.saturating_add(1);
        Some(wish)
    }
}

fn send_until_dropped(mut send: impl FnMut(HandWish), incoming: &Receiver<HandWish>) {
    let mut waiting = Waiting::default();
    let mut said = Instant::now();
    let mut next = Instant::now();
    loop {
        match incoming.recv_timeout(next.saturating_duration_since(Instant::now())) {
            Ok(wish) => {
                waiting.add(wish);
                said = Instant::now();
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => next = (next + PERIOD).max(Instant::now()),
        }
        if let Some(wish) = waiting.next().filter(|_| said.elapsed() < SILENCE) {
            send(wish);
        }
    }
    if let Some(last) = waiting.wishes.back() {
        for _ in 0..REPEATS {
            send(HandWish { buttons: GIVES_BACK, ..*last });
            // The port must live until the server has taken it.
            std::thread::sleep(PERIOD);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pointer::{Button, Press};

    fn wish(x_m: f64, buttons: u32) -> HandWish {
        HandWish { position_m: [x_m, 0.0, 0.0], buttons }
    }

    #[test]
    fn a_short_click_is_told_before_its_release() {
        let mut waiting = Waiting::default();
        assert_eq!(waiting.next(), None);
        for said in [wish(0.0, 0), wish(0.1, 0), wish(0.2, 1), wish(0.3, 1), wish(0.3, 0), wish(0.4, 1), wish(0.5, 0)] {
            waiting.add(said);
        }
        let told: Vec<_> = std::iter::from_fn(|| waiting.next()).take(12).collect();
        let expected = [wish(0.1, 0), wish(0.3, 1), wish(0.3, 0), wish(0.4, 1), wish(0.5, 0), wish(0.5, 0)];
        assert_eq!(told, expected.map(|wish| [wish; 2]).concat());
        for n in 0..10 * MOST_WAITING as u32 {
            waiting.add(wish(0.0, n % 2));
        }
        assert!(waiting.wishes.len() <= MOST_WAITING);
    }

    #[test]
    fn every_press_and_release_is_said_when_it_comes() {
        let (wishes, said) = channel();
        let thread = HandThread { wishes: Some(wishes), thread: None };
        let mut hand = MouseHand { thread, pointer: Pointer::at([0.0; 3]) };
        for press in [Press::Down, Press::Up] {
            hand.act(|pointer| pointer.press(Button::Front, press));
        }
        assert_eq!(said.try_iter().map(|wish| wish.buttons).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn the_last_word_gives_the_hand_back_at_the_present_place() {
        let (wishes, incoming) = channel();
        wishes.send(wish(0.2, 1)).expect("it listens");
        drop(wishes);
        let mut told = Vec::new();
        send_until_dropped(|wish| told.push(wish), &incoming);
        assert_eq!(told.last(), Some(&wish(0.2, GIVES_BACK)));
    }

    #[test]
    fn the_hand_of_another_is_neither_nobodys_nor_ones_own() {
        let held_by = |hand_sender| ServoState { hand_sender, ..ServoState::EMPTY };
        assert_eq!(of_another(&held_by(0)), None);
        assert_eq!(of_another(&held_by(std::process::id())), None);
        assert_eq!(of_another(&held_by(std::process::id() + 1)), Some(std::process::id() + 1));
    }
}
