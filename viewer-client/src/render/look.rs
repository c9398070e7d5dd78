//! How a picture is to look.

use crate::colour::ColourBy;

/// One picture, or one for each eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stereo {
    /// One picture.
    #[default]
    Off,
    /// The left eye's picture in the left half, the right eye's in the right half.
    SideBySide,
}

/// What is behind the tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Background {
    /// Cloth under a lamp in a dark room.
    #[default]
    Room,
    /// Near white.
    Print,
}

/// How much work a picture may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Quality {
    /// Full on a graphics card, fast on a processor.
    #[default]
    Auto,
    /// Four samples a pixel, soft shadows, every detail.
    Full,
    /// What a processor can draw in time.
    Fast,
}

/// How a picture is to look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// What the tissue is coloured by.
    pub colour: ColourBy,
    /// One picture or two.
    pub stereo: Stereo,
    /// What is behind the tissue.
    pub background: Background,
    /// How much work a picture may take.
    pub quality: Quality,
}
