//! Plots as SVG, for print and screen: colours that colour-blind people tell apart, and a mark of its own for each line.

use kuva::prelude::*;

/// Colours that differ in hue and lightness (Okabe and Ito).
pub(super) const COLOURS: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];

/// Marks, of which neighbours differ.
const MARKS: [MarkerShape; 6] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::Diamond,
    MarkerShape::Cross,
    MarkerShape::Plus,
];

/// A plot of lines, each through its points.
pub struct LinePlots {
    /// Above it
    pub title: String,
    /// Below the horizontal axis
    pub x: String,
    /// Beside the vertical axis
    pub y: String,
    /// The lines
    pub lines: Vec<NamedLine>,
    /// A level of the vertical axis, and what it means
    pub level: Option<(f64, String)>,
}

/// A line of a plot.
pub struct NamedLine {
    /// In the legend
    pub name: String,
    /// Its points, in order
    pub points: Vec<(f64, f64)>,
    /// Points that belong to it and lie beside it: small marks without a line
    pub beside: Vec<(f64, f64)>,
    /// Drawn broad and grey, behind the others
    pub background: bool,
}

impl LinePlots {
    /// Both axes logarithmic; what is not positive is left out. The text of an SVG file.
    pub fn to_log_log_svg(&self) -> String {
        let positive = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite()).collect()
        };
        let mut plots: Vec<Plot> = Vec::new();
        let (behind, before): (Vec<_>, Vec<_>) = self.lines.iter().partition(|line| line.background);
        for line in behind {
            let drawn = kuva::plot::LinePlot::new().with_data(positive(&line.points)).with_color("#BBBBBB");
            plots.push(drawn.with_stroke_width(7.0).with_legend(line.name.as_str()).into());
        }
        for (k, line) in before.into_iter().enumerate() {
            let (colour, mark) = (COLOURS[k % COLOURS.len()], MARKS[k % MARKS.len()]);
            let (points, beside) = (positive(&line.points), positive(&line.beside));
            let marks =
                |points: Vec<(f64, f64)>| ScatterPlot::new().with_data(points).with_color(colour).with_marker(mark);
            if !beside.is_empty() {
                plots.push(marks(beside).with_size(2.0).with_marker_opacity(0.5).into());
            }
            if !points.is_empty() {
                plots.push(LinePlot::new().with_data(points.clone()).with_color(colour).with_stroke_width(1.5).into());
                plots.push(marks(points).with_size(4.0).with_legend(line.name.as_str()).into());
            }
        }
        let layout = Layout::auto_from_plots(&plots);
        let level = self.level.iter().filter(|(level, _)| *level > 0.0);
        let layout = level.fold(layout, |layout, (level, name)| with_level(layout, *level, name));
        let layout = with_room_for_marks(layout)
            .with_log_scale()
            .with_title(self.title.as_str())
            .with_x_label(self.x.as_str())
            .with_y_label(self.y.as_str())
            .with_x_tick_format(decades())
            .with_y_tick_format(decades())
            .with_width(760.0)
            .with_height(480.0);
        render_to_svg(plots, layout)
    }
}

/// Axes end at powers of ten: this is for marks that lie next to one.
const ROOM: f64 = 1.3;

fn with_room_for_marks(mut layout: Layout) -> Layout {
    for range in [&mut layout.data_x_range, &mut layout.data_y_range] {
        *range = range.map(|(from, to)| (from / ROOM, to * ROOM));
    }
    layout
}

/// A dashed line across, where it does not make the plot much higher.
fn with_level(mut layout: Layout, level: f64, name: &str) -> Layout {
    const FAR_BELOW: f64 = 0.03;
    let Some((from, to)) = layout.data_y_range.filter(|(from, _)| level > FAR_BELOW * from) else { return layout };
    layout.data_y_range = Some((from.min(level), to.max(level)));
    layout.with_reference_line(ReferenceLine::horizontal(level).with_color("#555555").with_label(name))
}

/// 0.002, 0.5, 20, 1e-6.
fn decades() -> TickFormat {
    TickFormat::Custom(std::sync::Arc::new(|value: f64| {
        // Ticks are round numbers, but for round-off.
        let value: f64 = format!("{value:.3e}").parse().unwrap_or(value);
        if (1e-3..1e4).contains(&value) { format!("{value}") } else { format!("{value:e}") }
    }))
}
