//! Plots of lines as SVG, for print and screen: light, or dark where the reader's system is.
//!
//! Colours are told apart by colour-blind readers, and dashes or marks tell lines apart without colours. The picture is 860 pixels wide; it
//! grows in height where a long legend needs room.

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
    /// Above it
    pub title: String,
    /// The horizontal axis
    pub x: Axis,
    /// The vertical axis
    pub y: Axis,
    /// The lines, the first behind the others
    pub lines: Vec<Line>,
    /// A level of the vertical axis, drawn across
    pub level: Option<Level>,
    /// Places on the horizontal axis, drawn through the whole height
    pub boundaries: Vec<Boundary>,
}

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with its unit
    pub title: String,
    /// How values are spread over it
    pub scale: Scale,
}

/// How values are spread over an axis.
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
    /// In the legend
    pub name: String,
    /// Its points, in order
    pub points: Vec<(f64, f64)>,
    /// Half the height of a band around each point, where that is known
    pub bars: Option<Vec<f64>>,
    /// Points that belong to it and lie beside it: small marks without a line
    pub beside: Vec<(f64, f64)>,
    /// How it is drawn
    pub style: LineStyle,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineStyle {
    /// Without marks; numbers choose the colour and the dashes, where 0 is solid
    Dashed {
        /// Of the colour
        colour: usize,
        /// Of the dashes
        dash: usize,
    },
    /// With a mark at each point; a number chooses colour and mark
    Marked(usize),
    /// Broad and grey, without marks
    Background,
}

/// A level of the vertical axis.
#[derive(Clone, Debug)]
pub struct Level {
    /// Its value
    pub value: f64,
    /// In the legend
    pub name: String,
}

/// A place on the horizontal axis, such as the start of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// Its value
    pub at: f64,
    /// Beside the line
    pub name: String,
}

impl LinePlot {
    /// The text of an SVG file.
    pub fn to_svg(&self) -> String {
        Layout::new(self).draw(svg::Theme::OfReader)
    }

    /// The bytes of a PNG file in light colours, two pixels for each of the SVG.
    #[cfg(feature = "png")]
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        png::draw(&Layout::new(self).draw(svg::Theme::Light))
    }
}

/// Points of a line that are drawn, at most; an eye sees no more.
const MAX_POINTS: usize = 2000;

/// Indices of the points of a line that are drawn: of each stretch the lowest and the highest, and the ends.
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
