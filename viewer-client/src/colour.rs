//! What the tissue is coloured by, and the scale that turns a value into a colour.
//!
//! The scale is viridis (van der Walt and Smith 2015; readable in grey and with colour-blind eyes) at nine stops with
//! straight lines between; the shader reads the same stops. The legend's end follows the largest value: up at once,
//! down slowly, so that the colours do not flicker.

use crate::feed::View;
use protocol::scene_frame::{AWAKE, FrameNode};

/// Stops of the scale, sRGB.
pub const STOPS: [[f32; 3]; 9] = [
    [0.267, 0.005, 0.329],
    [0.279, 0.175, 0.483],
    [0.230, 0.322, 0.546],
    [0.173, 0.449, 0.558],
    [0.128, 0.567, 0.551],
    [0.157, 0.684, 0.502],
    [0.369, 0.789, 0.383],
    [0.678, 0.864, 0.190],
    [0.993, 0.906, 0.144],
];
/// Share of the way down that the legend's end goes with each frame.
const DESCENT: f32 = 0.02;

/// What the tissue is coloured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ColourBy {
    /// Its own look.
    #[default]
    Tissue,
    /// Largest strain of a spring at the node.
    Strain,
    /// Largest force of a spring at the node.
    Force,
    /// Reaction of the Long Range Attachments.
    Attachment,
    /// Whether the solver steps the node.
    Awake,
}

impl ColourBy {
    /// All, in the order of a menu.
    pub const ALL: [Self; 5] = [Self::Tissue, Self::Strain, Self::Force, Self::Attachment, Self::Awake];

    /// Name for a person.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tissue => "tissue",
            Self::Strain => "strain",
            Self::Force => "spring force",
            Self::Attachment => "attachment force",
            Self::Awake => "awake",
        }
    }

    /// Unit of the legend.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Strain => "%",
            Self::Force | Self::Attachment => "N",
            Self::Tissue | Self::Awake => "",
        }
    }

    /// Number in the shader.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Value of a node in the legend's unit.
    #[must_use]
    pub fn value(self, node: &FrameNode) -> f32 {
        match self {
            Self::Tissue => 0.0,
            Self::Strain => 100.0 * node.strain,
            Self::Force => node.spring_force_n,
            Self::Attachment => node.attachment_force_n,
            Self::Awake => f32::from(u8::from(node.flags & AWAKE != 0)),
        }
    }

    /// Smallest legend: what is less is noise of the solver.
    fn least(self) -> f32 {
        match self {
            Self::Tissue | Self::Awake => 1.0,
            Self::Strain => 2.0,
            Self::Force | Self::Attachment => 0.02,
        }
    }
}

/// Colour of a value between 0 and 1, sRGB; values outside get the ends.
#[must_use]
pub fn ramp(value: f32) -> [f32; 3] {
    let last = STOPS.len() - 1;
    let place = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) * last as f32 };
    let below = (place as usize).min(last - 1);
    let share = place - below as f32;
    std::array::from_fn(|c| STOPS[below][c] + share * (STOPS[below + 1][c] - STOPS[below][c]))
}

/// What the colours mean now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legend {
    /// What is shown.
    pub colour: ColourBy,
    /// Value of the last colour; the first is 0.
    pub end: f32,
}

/// Follows the largest value of the frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scale {
    shown: Option<Legend>,
}

impl Scale {
    /// Takes in a frame.
    pub fn follow(&mut self, colour: ColourBy, view: &View) {
        if colour == ColourBy::Tissue {
            self.shown = None;
            return;
        }
        let nodes = &view.frame.elements;
        let largest = nodes.iter().map(|n| colour.value(n)).fold(colour.least(), f32::max);
        let end = match self.shown {
            Some(before) if before.colour == colour => largest.max(before.end + DESCENT * (largest - before.end)),
            _ => largest,
        };
        self.shown = Some(Legend { colour, end });
    }

    /// What is shown; nothing for the tissue's own look.
    pub fn legend(&self) -> Option<Legend> {
        self.shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::wire::Field;

    fn view(strain: f32) -> View {
        let mut view = View::default();
        view.frame.elements = vec![FrameNode { strain, ..FrameNode::EMPTY }; 10];
        view
    }

    #[test]
    fn the_ramp_runs_through_its_stops_and_gets_brighter() {
        for (i, stop) in STOPS.iter().enumerate() {
            let colour = ramp(i as f32 / 8.0);
            assert!(colour.iter().zip(stop).all(|(a, b)| (a - b).abs() < 1e-6), "{i}");
        }
        let grey = |t: f32| ramp(t).iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| c * w).sum::<f32>();
        assert!((0..100).all(|i| grey(i as f32 / 100.0) < grey((i + 1) as f32 / 100.0)));
        assert_eq!((ramp(f32::NAN), ramp(9.0)), (STOPS[0], STOPS[8]));
    }

    #[test]
    fn the_legend_rises_at_once_and_falls_slowly() {
        let mut scale = Scale::default();
        scale.follow(ColourBy::Strain, &view(0.1));
        scale.follow(ColourBy::Strain, &view(0.5));
        assert_eq!(scale.legend(), Some(Legend { colour: ColourBy::Strain, end: 50.0 }));
        scale.follow(ColourBy::Strain, &view(0.1));
        let end = scale.legend().map_or(0.0, |l| l.end);
        assert!(end < 50.0 && end > 49.0, "{end}");
        scale.follow(ColourBy::Force, &view(0.1));
        assert_eq!(scale.legend().map(|l| l.end), Some(0.02));
        scale.follow(ColourBy::Tissue, &view(0.1));
        assert_eq!(scale.legend(), None);
    }
}
