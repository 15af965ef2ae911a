//! Line plots as SVG, for print and screen. Colours follow the light or dark mode of the reader.
//!
//! Also pictures of sections with their meshes.
//!
//! The colours suit colour-blind readers, and dashes or marks distinguish lines without colours.
//! A plot is 860 pixels wide; its height grows with the legend.

mod layout;
mod line_plot;
#[cfg(feature = "png")]
mod png;
mod section_picture;
mod svg;
mod text;
mod ticks;

pub use line_plot::{Axis, Boundary, Level, Line, LinePlot, LineStyle, Scale};
pub use section_picture::{SectionPicture, StressShade};

use layout::Layout;

impl LinePlot {
    /// The text of an SVG file.
    pub fn to_svg(&self) -> String {
        Layout::new(self).draw(svg::Theme::OfReader)
    }

    /// The bytes of a PNG file in light colours, with two pixels per pixel of the SVG.
    #[cfg(feature = "png")]
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        png::draw(&Layout::new(self).draw(svg::Theme::Light))
    }
}

#[cfg(test)]
mod tests;
