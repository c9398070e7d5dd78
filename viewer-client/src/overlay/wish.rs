//! What a person asks for, by a key or by a button of a panel: one closed list for both.

use crate::camera::FixedView;
use crate::orders::Order;

/// One wish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// A command to the session.
    Order(Order),
    /// Suture control off, on, paper, off.
    CycleControl,
    /// All tissue in the picture.
    FrameAll,
    /// A fixed view.
    Fixed(FixedView),
    /// Hold the picture still, or let it go on; the server does not notice.
    Pause,
    /// The picture as a file.
    Screenshot,
    /// The next colouring of the tissue.
    NextColour,
    /// One picture or two side by side.
    Stereo,
    /// Dark room or paper behind the tissue.
    Background,
    /// The list of keys.
    Help,
    /// All panels, only the most needed, none.
    Panels,
    /// Curves of the sample points as a file.
    SaveSamples,
    /// No sample points.
    ClearSamples,
    /// The mouse becomes the hand, or is a mouse again.
    Hand,
    /// Something about the recording that is played.
    Play(PlayWish),
    /// The end.
    Quit,
}

/// Something about the recording that is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlayWish {
    /// Play or pause.
    Toggle,
    /// One picture back.
    Back,
    /// One picture on.
    Forward,
    /// Half as fast.
    Slower,
    /// Twice as fast.
    Faster,
    /// To this time, seconds from the start.
    Seek(f64),
}
