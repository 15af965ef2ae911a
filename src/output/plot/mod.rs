//! Line plots as SVG, for print and screen. Colours follow the light or dark mode of the reader.
//!
//! The colours suit colour-blind readers, and dashes or marks distinguish lines without colours.
//! The picture is 860 pixels wide; its height grows with the legend.

mod layout;
#[cfg(feature = "png")]
mod png;
mod svg;
mod text;
mod ticks;

use layout::Layout;

/// A plot: lines over two axes, with a legend below.
#[derive(Clone, Debug)]
pub struct LinePlot {
    /// The title above the plot
    pub title: String,
    /// The horizontal axis
    pub x: Axis,
    /// The vertical axis
    pub y: Axis,
    /// The lines, the first behind the others
    pub lines: Vec<Line>,
    /// A horizontal line through the whole width
    pub level: Option<Level>,
    /// Vertical lines through the whole height
    pub boundaries: Vec<Boundary>,
}

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The title: a quantity with its unit
    pub title: String,
    /// The map from values to positions
    pub scale: Scale,
}

/// A map from values to positions on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long
    Linear,
    /// Equal ratios are equally long; values that are not positive are left out
    Logarithmic,
}

/// A line of a plot.
#[derive(Clone, Debug)]
pub struct Line {
    /// The name in the legend
    pub name: String,
    /// The points of the line, in order
    pub points: Vec<(f64, f64)>,
    /// Half the height of the error band at each point; `None` without a band
    pub bars: Option<Vec<f64>>,
    /// Further points of the line's family: small marks that no line joins
    pub beside: Vec<(f64, f64)>,
    /// Colour, dashes and marks
    pub style: LineStyle,
}

/// Colour, dashes and marks of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineStyle {
    /// A line without marks
    Dashed {
        /// The number of the colour
        colour: usize,
        /// The number of the dash pattern; 0 is solid
        dash: usize,
    },
    /// A line with a mark at each point; the number selects colour and mark
    Marked(usize),
    /// A broad grey line without marks
    Background,
}

/// A level of the vertical axis.
#[derive(Clone, Debug)]
pub struct Level {
    /// The value on the vertical axis
    pub value: f64,
    /// The name in the legend
    pub name: String,
}

/// A position on the horizontal axis, such as the start of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// The value on the horizontal axis
    pub at: f64,
    /// The name beside the line
    pub name: String,
}

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

/// Largest number of drawn points per line; more would not be visible.
const MAX_POINTS: usize = 2000;

/// Indices of the drawn points of a line: the lowest and the highest point of each stretch, and both
/// ends of the line.
fn thinned(points: &[(f64, f64)]) -> Vec<usize> {
    if points.len() <= MAX_POINTS {
        return (0..points.len()).collect();
    }
    let stretch = points.len().div_ceil(MAX_POINTS / 2);
    let mut kept = vec![0];
    for first in (0..points.len()).step_by(stretch) {
        let all = first..points.len().min(first + stretch);
        let by_height = |a: &usize, b: &usize| points[*a].1.total_cmp(&points[*b].1);
        kept.extend(all.clone().min_by(by_height));
        kept.extend(all.max_by(by_height));
    }
    kept.push(points.len() - 1);
    kept.sort_unstable();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests;
