//! Pictures of the report: panels of curves on linear or logarithmic axes, and maps of cells with curves drawn in.
//!
//! Built on the SVG elements of haptic-server's run reports. Colours are Okabe and Ito's, which people with the common
//! colour-vision deficiencies can tell apart; every series has a marker of its own as well, so that a print in grey still
//! reads. Nothing is left out silently: values that an axis cannot show are counted under the picture.
//! Deliberately absent: interaction, themes, anything that needs a script.

mod axis;
mod heat_map;
mod panel;
mod style;

pub use axis::{Axis, Scale};
pub use heat_map::{HeatMap, MapClass, heat_map_svg};
pub use panel::{Level, Panel, Series, panels_svg};
pub use style::{Marker, Style, integrator_style, nth_style};
