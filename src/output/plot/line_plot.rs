//! The contents of a line plot.

/// A plot: lines over two axes, with a legend below.
#[derive(Clone, Debug)]
pub struct LinePlot {
    /// The title above the plot
    pub(crate) title: String,
    /// The horizontal axis
    pub(crate) x: Axis,
    /// The vertical axis
    pub(crate) y: Axis,
    /// The lines, the first behind the others
    pub(crate) lines: Vec<Line>,
    /// A horizontal line through the whole width
    pub(crate) level: Option<Level>,
    /// Vertical lines through the whole height
    pub(crate) boundaries: Vec<Boundary>,
}

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The title: a quantity with its unit
    pub(crate) title: String,
    /// The map from values to positions
    pub(crate) scale: Scale,
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
    pub(crate) name: String,
    /// The points of the line, in order
    pub(crate) points: Vec<(f64, f64)>,
    /// Half the height of the error band at each point; `None` without a band
    pub(crate) bars: Option<Vec<f64>>,
    /// Further points of the line's family: small marks that no line joins
    pub(crate) beside: Vec<(f64, f64)>,
    /// Colour, dashes and marks
    pub(crate) style: LineStyle,
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
    pub(crate) value: f64,
    /// The name in the legend
    pub(crate) name: String,
}

/// A position on the horizontal axis, such as the start of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// The value on the horizontal axis
    pub(crate) at: f64,
    /// The name beside the line
    pub(crate) name: String,
}
