//! Where views come from: a running server, or a recording that is played.
//!
//! A running server also takes orders and, with a pointer device, a hand. A recording takes neither and says so.

use crate::feed::{Feed, View};
use crate::hand_thread::{self, MouseHand};
use crate::notice::Notice;
use crate::orders::{Order, Orders};
use crate::overlay::situation::{HandMode, Link, TimeLine};
use crate::overlay::wish::PlayWish;
use crate::play::Play;
use crate::pointer::Pointer;
use crate::replay::Recording;
use protocol::ports::{PortError, monotonic_ns};
use protocol::run::RunDir;
use protocol::servo_state::FLAG_POINTER;

/// From one cleaning up after dead peers to the next, nanoseconds.
const CLEAN_UP_NS: u64 = 1_000_000_000;

/// A running server.
pub struct Live {
    feed: Feed,
    run: RunDir,
    orders: Orders,
    hand: Option<MouseHand>,
    cleaned_ns: u64,
}

/// A recording that is played.
pub struct Played {
    recording: Recording,
    play: Play,
    looked_ns: Option<u64>,
}

/// Where views come from.
pub enum Source {
    /// A running server.
    Live(Box<Live>),
    /// A recording.
    Played(Box<Played>),
}

impl Source {
    /// Joins a run.
    ///
    /// # Errors
    /// [`PortError`] when the run's services cannot be opened.
    pub fn live(run: RunDir) -> Result<Self, PortError> {
        let feed = Feed::join(&run)?;
        Ok(Self::Live(Box::new(Live { feed, run, orders: Orders::default(), hand: None, cleaned_ns: 0 })))
    }

    /// Plays a recording from its start.
    #[must_use]
    pub fn played(recording: Recording) -> Self {
        let play = Play::new(recording.duration_s());
        Self::Played(Box::new(Played { recording, play, looked_ns: None }))
    }

    /// The newest view.
    #[must_use]
    pub fn view(&self) -> &View {
        match self {
            Self::Live(live) => live.feed.view(),
            Self::Played(played) => played.recording.view(),
        }
    }

    /// Takes in what is new; a sentence when an order was answered or the connection broke.
    pub fn look(&mut self) -> Option<Notice> {
        let now_ns = monotonic_ns();
        match self {
            Self::Live(live) => live.look(now_ns),
            Self::Played(played) => {
                let passed_ns = now_ns.saturating_sub(played.looked_ns.unwrap_or(now_ns));
                played.looked_ns = Some(now_ns);
                played.play.advance(passed_ns as f64 * 1e-9);
                played.recording.seek(played.play.line().at_s);
                None
            }
        }
    }

    /// How the connection is.
    #[must_use]
    pub fn link(&self) -> Link {
        match self {
            Self::Live(live) => {
                Link::live(monotonic_ns(), live.feed.view().servo.as_ref().map(|servo| servo.header.time_ns))
            }
            Self::Played(_) => Link::Recorded,
        }
    }

    /// The time line of a recording.
    #[must_use]
    pub fn time_line(&self) -> Option<TimeLine> {
        match self {
            Self::Live(_) => None,
            Self::Played(played) => Some(played.play.line()),
        }
    }

    /// Plays, steps or winds a recording.
    pub fn play(&mut self, wish: PlayWish) {
        if let Self::Played(played) = self {
            played.play.fulfil(wish);
        }
    }

    /// Sends an order; a sentence when it did not leave.
    pub fn order(&mut self, order: Order) -> Option<Notice> {
        match self {
            Self::Live(live) => {
                let Live { feed, orders, .. } = &mut **live;
                orders.send(feed.node(), order, feed.view(), monotonic_ns())
            }
            Self::Played(_) => Some(Notice::note(format!("{}: a recording takes no orders", order.name()))),
        }
    }

    /// Whether the mouse is the hand, or could be.
    #[must_use]
    pub fn hand_mode(&self) -> HandMode {
        match self {
            Self::Live(live) if live.hand.is_some() => HandMode::Hand,
            Self::Live(live) if live.has_pointer() => HandMode::Idle,
            _ => HandMode::NoPointer,
        }
    }

    /// The mouse becomes the hand, or is a mouse again; says which, or why not.
    pub fn toggle_hand(&mut self) -> Notice {
        match self {
            Self::Live(live) => live.toggle_hand(),
            Self::Played(_) => Notice::note("a recording needs no hand"),
        }
    }

    /// Does this with the hand's pointer and says it to the server, while the mouse is the hand.
    pub fn act(&mut self, act: impl FnOnce(&mut Pointer)) {
        if let Self::Live(live) = self
            && let Some(hand) = &mut live.hand
        {
            hand.act(act);
        }
    }
}

impl Live {
    fn look(&mut self, now_ns: u64) -> Option<Notice> {
        let broken = self.feed.look().err().map(|error| Notice::bad(error.to_string()));
        if now_ns.saturating_sub(self.cleaned_ns) > CLEAN_UP_NS {
            self.feed.clean_up();
            self.cleaned_ns = now_ns;
        }
        let yielded = self.yielded();
        if let Some(hand) = &self.hand {
            hand.say();
        }
        broken.or(yielded).or_else(|| self.orders.look(self.feed.view(), now_ns))
    }

    fn has_pointer(&self) -> bool {
        self.feed.view().servo.as_ref().is_some_and(|servo| servo.flags & FLAG_POINTER != 0)
    }

    /// Asks no longer for a hand that another viewer is: it took the place of one that was stopped, or asked a moment before.
    fn yielded(&mut self) -> Option<Notice> {
        let other = hand_thread::of_another(self.feed.view().servo.as_ref()?)?;
        self.hand.take()?;
        Some(Notice::bad(format!("another viewer (process {other}) is the hand now; M asks for it again")))
    }

    fn toggle_hand(&mut self) -> Notice {
        if self.hand.take().is_some() {
            return Notice::note("the mouse is a mouse again");
        }
        if let Some(other) = self.feed.view().servo.as_ref().and_then(hand_thread::of_another) {
            return Notice::bad(format!(
                "another viewer (process {other}) is the hand; it gives the hand back with M, or by being silent for a second"
            ));
        }
        let stylus_m = match &self.feed.view().servo {
            Some(servo) if servo.flags & FLAG_POINTER != 0 => servo.devices[0].position_m,
            Some(_) => {
                return Notice::bad(
                    "the server drives another device; start it with `haptic-server run --device pointer`",
                );
            }
            None => return Notice::note("the server has not said yet what it drives; try again in a second"),
        };
        match MouseHand::start(&self.run, stylus_m) {
            Ok(hand) => {
                self.hand = Some(hand);
                Notice::good("the mouse is the hand: left button takes and releases, wheel for depth, M ends it")
            }
            Err(sentence) => Notice::bad(sentence),
        }
    }
}
