//! Options for pictures, in the window and without a screen.

use crate::camera::FixedView;
use crate::colour::ColourBy;
use crate::render::{Background, Look, Quality, Stereo};
use std::path::PathBuf;

/// Options of `viewer-client --headless`.
#[derive(Clone, Debug, clap::Args)]
pub struct HeadlessArgs {
    /// One picture into this file.
    #[arg(long, value_name = "FILE", group = "picture")]
    pub(super) png: Option<PathBuf>,
    /// A sequence of pictures into this folder: until the server or the recording ends.
    #[arg(long, value_name = "DIR", group = "picture")]
    pub(super) frames: Option<PathBuf>,
    /// Draws so many pictures and says how long they took.
    #[arg(long, value_name = "N", group = "picture", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) bench: Option<u32>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// When: seconds from the beginning of the recording, or from now.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(super) at: Option<f64>,
    /// Pictures a second of a sequence.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(super) fps: u32,
    /// What the tissue is coloured by.
    #[arg(long, value_enum, default_value = "tissue")]
    colour: ColourBy,
    /// Where one looks from.
    #[arg(long, value_enum, default_value = "surgeon")]
    view: FixedView,
    /// Nearer by this factor.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor)]
    pub(super) zoom: f32,
    /// What is behind the tissue.
    #[arg(long, value_enum, default_value = "room")]
    background: Background,
    /// How much work a picture may take; a single picture gets all of it.
    #[arg(long, value_enum, default_value = "auto")]
    quality: Quality,
    /// The panels over the picture.
    #[arg(long)]
    pub(super) overlays: bool,
    /// One picture for each eye, side by side.
    #[arg(long)]
    stereo: bool,
}

impl HeadlessArgs {
    /// How the pictures are to look.
    #[must_use]
    pub fn look(&self) -> Look {
        Look {
            colour: self.colour,
            background: self.background,
            quality: self.quality,
            stereo: if self.stereo { Stereo::SideBySide } else { Stereo::Off },
        }
    }

    /// Where one looks from.
    #[must_use]
    pub fn view(&self) -> FixedView {
        self.view
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| SIDES.contains(side)) => Ok(sides),
        Some(_) => Err(format!("a side is outside {} to {} pixels", SIDES.start(), SIDES.end())),
        None => Err(format!("{text:?} is no size; write it as 1280x720")),
    }
}

fn factor(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (0.01..=100.0).contains(&number) => Ok(number),
        _ => Err(format!("{text:?} is no factor from 0.01 to 100")),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=1.0e6).contains(&number) => Ok(number),
        _ => Err(format!("{text:?} is no number of seconds from 0 to 1000000")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_two_sides_within_bounds() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "640x", "x480", "640x480x3", "8x8", "1280x90000", "-1x20"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert!(seconds("nan").is_err() && seconds("-1").is_err() && seconds("2.5") == Ok(2.5));
    }
}
