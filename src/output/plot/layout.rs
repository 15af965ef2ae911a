//! Positions and drawing of the parts of a plot.

use super::line_plot::{Level, Line, LinePlot, LineStyle, Scale};
use super::svg::{Anchor, BACKGROUND, Colour, GRID, INK, LINES, MUTED, PAPER, Stroke, Svg, Text, Theme};
use super::text::{Block, cut, width};
use super::ticks::Ticks;
use std::fmt::Write;

// Lengths are in pixels.

const WIDTH: f64 = 860.0;
/// Height of pictures with a small legend.
const HEIGHT: f64 = 480.0;
/// Least height of the area between the axes.
const LEAST_AREA: f64 = 260.0;
/// Free margin at each edge of the picture.
const EDGE: f64 = 14.0;
/// Distance between parts.
const GAP: f64 = 8.0;
const TITLE_SIZES: [f64; 2] = [17.0, 13.0];
const AXIS_SIZES: [f64; 2] = [13.0, 11.0];
const TICK_SIZE: f64 = 12.0;
const LEGEND_SIZE: f64 = 12.0;
const TICK_LENGTH: f64 = 5.0;
const MINOR_TICK_LENGTH: f64 = 3.0;
/// Height of a row of the legend.
const LEGEND_ROW: f64 = 19.0;
/// Length of the sample line of an entry in the legend.
const SAMPLE: f64 = 30.0;
/// Largest number of labels on the vertical axis.
const MAX_LABELS_UP: usize = 9;
/// Largest number of labels on the horizontal axis.
const MAX_LABELS_ACROSS: usize = 10;

/// Free space above and below the lines on a linear axis, relative to their range.
const MARGIN: f64 = 0.04;
/// Free space below and above the marks on a logarithmic axis, as a factor.
const MARGIN_FACTOR: f64 = 1.3;
/// Smallest ratio of a drawn level to the lowest value; a lower level would squeeze the lines.
const LEAST_LEVEL: f64 = 0.03;
/// Largest part of the lines' range by which error bands extend it.
const MAX_BAND: f64 = 0.6;
/// Smallest range relative to the values; smaller ones are round-off and drawn as constants.
const LEAST_RANGE: f64 = 1e-12;
/// Larger values are drawn as this one, so that differences stay finite.
const LARGEST: f64 = 1e300;
/// Smaller values count as zero.
const SMALLEST: f64 = 1e-290;

/// Largest number of drawn points per line; more would not be visible.
pub const MAX_POINTS: usize = 2000;

/// Dash patterns of lines; the first is solid.
const DASHES: [&str; 4] = ["", "8 4", "2 3", "9 3 2 3"];
const LINE_WIDTH: f64 = 1.6;
const BACKGROUND_WIDTH: f64 = 7.0;
const BAND_OPACITY: f64 = 0.2;
/// Half the size of a mark on a line.
const MARK: f64 = 4.0;
/// Half the size of a mark beside a line.
const SMALL_MARK: f64 = 2.2;
const FRAME: Stroke = Stroke::solid(MUTED, 1.0);
const BOUNDARY: Stroke = Stroke { colour: MUTED, width: 1.0, dashes: "4 4" };
const LEVEL: Stroke = Stroke { colour: MUTED, width: 1.5, dashes: "7 4" };

/// The map from the values of an axis to pixels.
struct Ruler {
    scale: Scale,
    low: f64,
    high: f64,
    start: f64,
    end: f64,
    ticks: Ticks,
}

impl Ruler {
    /// A ruler for a range of values; its ends in pixels are set later.
    fn new(scale: Scale, (low, high): (f64, f64), max_labels: usize) -> Self {
        Self { scale, low, high, start: 0.0, end: 1.0, ticks: Ticks::new(scale, low, high, max_labels) }
    }

    fn pixel(&self, value: f64) -> f64 {
        let value = value.clamp(-LARGEST, LARGEST);
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value.max(SMALLEST) / self.low).ln() / (self.high / self.low).ln(),
        };
        self.start + share * (self.end - self.start)
    }

    /// The width of the widest label in pixels.
    fn label_width(&self) -> f64 {
        self.ticks.labelled.iter().fold(0.0, |widest: f64, tick| widest.max(width(&tick.text, TICK_SIZE)))
    }
}

/// Neighbouring boundaries that share a name.
struct BoundaryGroup<'a> {
    /// The wanted left end of the name, in pixels
    at: f64,
    names: Vec<&'a str>,
    /// The left end of the name, in pixels
    start: f64,
    /// The right end of the name, in pixels
    end: f64,
}

impl<'a> BoundaryGroup<'a> {
    /// A group whose name is moved to the left if it would leave the axis.
    fn new(at: f64, names: Vec<&'a str>, axis: &Ruler) -> Self {
        let mut group = Self { at, names, start: at, end: at };
        let length = width(&group.name(), TICK_SIZE);
        group.start = at.min(axis.end - length).max(axis.start);
        group.end = group.start + length;
        group
    }

    /// The names of up to two boundaries, else the first and the last.
    fn name(&self) -> String {
        match &self.names[..] {
            [first, _, .., last] => format!("{first} … {last}"),
            few => few.join(", "),
        }
    }
}

/// An entry of the legend. The entry of the level has no line.
struct Entry<'a> {
    line: Option<&'a Line>,
    name: String,
    x: f64,
    row: usize,
}

/// A plot with the positions of all its parts.
pub struct Layout<'a> {
    plot: &'a LinePlot,
    level: Option<&'a Level>,
    height: f64,
    title: Block,
    x_title: Block,
    y_title: Block,
    x: Ruler,
    y: Ruler,
    legend: Vec<Entry<'a>>,
    legend_top: f64,
}

impl<'a> Layout<'a> {
    /// Finds the positions of all parts of a plot.
    pub fn new(plot: &'a LinePlot) -> Self {
        let y_range = range_of_lines(plot);
        let level = plot.level.as_ref().filter(|level| is_level_shown(level, y_range, plot.y.scale));
        let y_range = level.map_or(y_range, |level| (y_range.0.min(level.value), y_range.1.max(level.value)));
        let mut y = Ruler::new(plot.y.scale, with_margin(plot.y.scale, y_range), MAX_LABELS_UP);

        let title = Block::fit(&plot.title, &TITLE_SIZES, 3, WIDTH - 2.0 * EDGE);
        let y_title = Block::fit(&plot.y.title, &AXIS_SIZES, 2, LEAST_AREA);
        let left = EDGE + part_height(&y_title) + y.label_width() + TICK_LENGTH + 4.0;
        let mut x = across(plot, WIDTH - EDGE - left);
        let last_label = x.ticks.labelled.last().map_or(0.0, |tick| 0.5 * width(&tick.text, TICK_SIZE));
        (x.start, x.end) = (left, WIDTH - EDGE.max(last_label + 4.0));

        let x_title = Block::fit(&plot.x.title, &AXIS_SIZES, 2, x.end - x.start);
        let legend = legend(plot, level);
        let rows = legend.last().map_or(0, |entry| entry.row + 1);
        let above = EDGE + part_height(&title);
        let labels = TICK_LENGTH + 1.4 * TICK_SIZE;
        let below = labels + part_height(&x_title) + LEGEND_ROW * rows as f64 + EDGE;
        let height = HEIGHT.max(above + LEAST_AREA + below).ceil();
        (y.start, y.end) = (height - below, above);
        let legend_top = height - EDGE - LEGEND_ROW * rows as f64;
        Self { plot, level, height, title, x_title, y_title, x, y, legend, legend_top }
    }

    /// The text of the file.
    pub fn draw(&self, theme: Theme) -> String {
        let mut svg = Svg::new(WIDTH, self.height, &self.plot.title, theme);
        svg.rectangle(0.0, 0.0, WIDTH, self.height, PAPER);
        self.draw_grid(&mut svg);
        svg.begin_clip(self.x.start, self.y.end, self.x.end - self.x.start, self.y.start - self.y.end);
        self.draw_bands(&mut svg);
        self.draw_across(&mut svg);
        self.draw_lines(&mut svg);
        svg.end_clip();
        self.draw_boundary_names(&mut svg);
        self.draw_axes(&mut svg);
        self.draw_titles(&mut svg);
        self.draw_legend(&mut svg);
        svg.finish()
    }

    fn draw_grid(&self, svg: &mut Svg) {
        let mut grid = String::new();
        for tick in &self.x.ticks.labelled {
            push_vertical(&mut grid, self.x.pixel(tick.value), self.y.start, self.y.end);
        }
        for tick in &self.y.ticks.labelled {
            push_horizontal(&mut grid, self.y.pixel(tick.value), self.x.start, self.x.end);
        }
        svg.path(&grid, Stroke::solid(GRID, 1.0));
    }

    fn draw_bands(&self, svg: &mut Svg) {
        for line in &self.plot.lines {
            let Some(bars) = &line.bars else { continue };
            let kept = thinned(&line.points);
            let edge = |k: usize, side: f64| (line.points[k].0, line.points[k].1 + side * bars[k]);
            let upper = kept.iter().map(|&k| edge(k, 1.0));
            let lower = kept.iter().rev().map(|&k| edge(k, -1.0));
            let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
            let data = format!("{}Z", self.path_data(&outline));
            svg.filled_path(&data, colour_of(line.style), BAND_OPACITY);
        }
    }

    /// Draws the level and the boundaries.
    fn draw_across(&self, svg: &mut Svg) {
        let mut boundaries = String::new();
        for boundary in &self.plot.boundaries {
            push_vertical(&mut boundaries, self.x.pixel(boundary.at), self.y.start, self.y.end);
        }
        svg.path(&boundaries, BOUNDARY);
        if let Some(level) = self.level {
            let mut data = String::new();
            push_horizontal(&mut data, self.y.pixel(level.value), self.x.start, self.x.end);
            svg.path(&data, LEVEL);
        }
    }

    fn draw_lines(&self, svg: &mut Svg) {
        for line in &self.plot.lines {
            let colour = colour_of(line.style);
            let points = self.drawn(&line.points);
            let kept: Vec<(f64, f64)> = thinned(&points).into_iter().map(|k| points[k]).collect();
            if let [only] = points[..] {
                // A line through a single point would be invisible.
                let at = (self.x.pixel(only.0), self.y.pixel(only.1));
                svg.filled_path(&mark_data(0, at, MARK), colour, 1.0);
            } else if !points.is_empty() {
                svg.path(&self.path_data(&kept), stroke_of(line.style));
            }
            if let LineStyle::Marked(mark) = line.style {
                svg.filled_path(&self.marks(&self.drawn(&line.beside), mark, SMALL_MARK), colour, 0.5);
                svg.filled_path(&self.marks(&points, mark, MARK), colour, 1.0);
            }
        }
    }

    /// The points that the axes can show.
    fn drawn(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let is_drawn = |(x, y): &(f64, f64)| is_shown(*x, self.x.scale) && is_shown(*y, self.y.scale);
        points.iter().copied().filter(is_drawn).collect()
    }

    fn path_data(&self, points: &[(f64, f64)]) -> String {
        let mut data = String::new();
        for (k, &(x, y)) in points.iter().enumerate() {
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(data, "{command}{:.2} {:.2}", self.x.pixel(x), self.y.pixel(y));
        }
        data
    }

    fn marks(&self, points: &[(f64, f64)], mark: usize, size: f64) -> String {
        points.iter().map(|&(x, y)| mark_data(mark, (self.x.pixel(x), self.y.pixel(y)), size)).collect()
    }

    /// Draws names at the top, to the right of their lines. Boundaries that are too close for names
    /// of their own share one.
    fn draw_boundary_names(&self, svg: &mut Svg) {
        for group in self.boundary_groups() {
            svg.text(Text {
                anchor: Anchor::Start,
                class: "boundary",
                ..small(&group.name(), group.start, self.y.end + 13.0)
            });
        }
    }

    /// Boundaries from left to right, in groups whose names do not overlap.
    fn boundary_groups(&self) -> Vec<BoundaryGroup<'_>> {
        let mut groups: Vec<BoundaryGroup> = Vec::new();
        for boundary in &self.plot.boundaries {
            let at = self.x.pixel(boundary.at) + 4.0;
            groups.push(BoundaryGroup::new(at, vec![&boundary.name], &self.x));
            while let [.., before, last] = &groups[..]
                && before.end + 6.0 > last.start
            {
                let mut names = before.names.clone();
                names.extend(last.names.iter().filter(|name| !before.names.contains(name)));
                let joined = BoundaryGroup::new(before.at, names, &self.x);
                groups.truncate(groups.len() - 2);
                groups.push(joined);
            }
        }
        groups
    }

    fn draw_axes(&self, svg: &mut Svg) {
        let Self { x, y, .. } = self;
        let mut frame = format!("M{:.1} {:.1}V{:.1}H{:.1}", x.start, y.end, y.start, x.end);
        for &value in &x.ticks.minor {
            push_vertical(&mut frame, x.pixel(value), y.start, y.start - MINOR_TICK_LENGTH);
        }
        for &value in &y.ticks.minor {
            push_horizontal(&mut frame, y.pixel(value), x.start, x.start + MINOR_TICK_LENGTH);
        }
        for tick in &x.ticks.labelled {
            let at = x.pixel(tick.value);
            push_vertical(&mut frame, at, y.start, y.start + TICK_LENGTH);
            let below = y.start + TICK_LENGTH + TICK_SIZE + 1.0;
            svg.text(Text { anchor: Anchor::Middle, class: "x-tick", ..small(&tick.text, at, below) });
        }
        for tick in &y.ticks.labelled {
            let at = y.pixel(tick.value);
            push_horizontal(&mut frame, at, x.start, x.start - TICK_LENGTH);
            let left = x.start - TICK_LENGTH - 3.0;
            svg.text(Text { anchor: Anchor::End, class: "y-tick", ..small(&tick.text, left, at + 0.36 * TICK_SIZE) });
        }
        svg.path(&frame, FRAME);
    }

    fn draw_titles(&self, svg: &mut Svg) {
        let middle = 0.5 * (self.x.start + self.x.end);
        let x_top = self.legend_top - part_height(&self.x_title);
        draw_block(svg, &self.title, "title", (0.5 * WIDTH, EDGE));
        draw_block(svg, &self.x_title, "x-title", (middle, x_top));
        for (k, line) in self.y_title.lines.iter().enumerate() {
            let size = self.y_title.size;
            let at = (EDGE + size + k as f64 * self.y_title.line_height(), 0.5 * (self.y.start + self.y.end));
            svg.text(Text {
                text: line,
                at,
                size,
                colour: INK,
                anchor: Anchor::Middle,
                upward: true,
                class: "y-title",
            });
        }
    }

    fn draw_legend(&self, svg: &mut Svg) {
        for entry in &self.legend {
            let y = self.legend_top + (entry.row as f64 + 0.5) * LEGEND_ROW;
            let mut sample = String::new();
            push_horizontal(&mut sample, y, entry.x, entry.x + SAMPLE);
            match entry.line {
                None => svg.path(&sample, LEVEL),
                Some(line) => {
                    svg.path(&sample, stroke_of(line.style));
                    if let LineStyle::Marked(mark) = line.style {
                        let data = mark_data(mark, (entry.x + 0.5 * SAMPLE, y), MARK);
                        svg.filled_path(&data, colour_of(line.style), 1.0);
                    }
                }
            }
            let at = (entry.x + SAMPLE + 6.0, y + 0.36 * LEGEND_SIZE);
            let text = Text { size: LEGEND_SIZE, colour: INK, class: "legend", ..small(&entry.name, at.0, at.1) };
            svg.text(text);
        }
    }
}

/// Indices of the drawn points of a line: the lowest and the highest point of each stretch, and both
/// ends of the line.
pub fn thinned(points: &[(f64, f64)]) -> Vec<usize> {
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

/// A text in the size and colour of tick labels.
fn small(text: &str, x: f64, y: f64) -> Text<'_> {
    Text { text, at: (x, y), size: TICK_SIZE, colour: MUTED, anchor: Anchor::Start, upward: false, class: "" }
}

fn draw_block(svg: &mut Svg, block: &Block, class: &'static str, (x, top): (f64, f64)) {
    for (k, line) in block.lines.iter().enumerate() {
        let at = (x, top + block.size + k as f64 * block.line_height());
        let Block { size, .. } = *block;
        svg.text(Text { text: line, at, size, colour: INK, anchor: Anchor::Middle, upward: false, class });
    }
}

/// The height of a title with the gap beside it.
fn part_height(block: &Block) -> f64 {
    if block.lines.is_empty() { 0.0 } else { block.height() + GAP }
}

/// The horizontal axis, with as many labels as fit its length in pixels.
fn across(plot: &LinePlot, length: f64) -> Ruler {
    let values = || plot.lines.iter().flat_map(|line| line.points.iter().chain(&line.beside)).map(|point| point.0);
    let range = still_widened(range(values(), plot.x.scale));
    let range = match plot.x.scale {
        Scale::Linear => range,
        Scale::Logarithmic => with_margin(plot.x.scale, range),
    };
    let mut max_labels = MAX_LABELS_ACROSS;
    loop {
        let ruler = Ruler::new(plot.x.scale, range, max_labels);
        let needed = 1.25 * ruler.label_width() * ruler.ticks.labelled.len() as f64;
        if needed <= length || max_labels == 2 {
            return ruler;
        }
        max_labels -= 1;
    }
}

/// The entries of the legend in rows; names that are wider than a row are cut.
fn legend<'a>(plot: &'a LinePlot, level: Option<&'a Level>) -> Vec<Entry<'a>> {
    let lines = plot.lines.iter().map(|line| (Some(line), &line.name));
    let level = level.map(|level| (None, &level.name));
    let room = WIDTH - 2.0 * EDGE - SAMPLE - 6.0;
    let mut entries: Vec<Entry> = Vec::new();
    let mut x = EDGE;
    let mut row = 0;
    for (line, name) in lines.chain(level) {
        let name = cut(name, LEGEND_SIZE, room);
        let needed = SAMPLE + 6.0 + width(&name, LEGEND_SIZE);
        if x > EDGE && x + needed > WIDTH - EDGE {
            x = EDGE;
            row += 1;
        }
        entries.push(Entry { line, name, x, row });
        x += needed + 2.0 * GAP;
    }
    entries
}

fn colour_of(style: LineStyle) -> Colour {
    match style {
        LineStyle::Dashed { colour, .. } => LINES[colour % LINES.len()],
        LineStyle::Marked(mark) => LINES[mark % LINES.len()],
        LineStyle::Background => BACKGROUND,
    }
}

fn stroke_of(style: LineStyle) -> Stroke {
    let colour = colour_of(style);
    match style {
        LineStyle::Dashed { dash, .. } => Stroke { colour, width: LINE_WIDTH, dashes: DASHES[dash % DASHES.len()] },
        LineStyle::Marked(_) => Stroke::solid(colour, LINE_WIDTH),
        LineStyle::Background => Stroke::solid(colour, BACKGROUND_WIDTH),
    }
}

/// Path data of a mark with half size `h`; marks with neighbouring numbers differ in shape.
fn mark_data(number: usize, (x, y): (f64, f64), h: f64) -> String {
    let (w, s) = (0.4 * h, 0.9 * h);
    let corners: &[(f64, f64)] = match number % 6 {
        0 => return format!("M{:.2} {y:.2}a{h} {h} 0 1 0 {} 0a{h} {h} 0 1 0 {} 0Z", x - h, 2.0 * h, -2.0 * h),
        1 => &[(-s, -s), (s, -s), (s, s), (-s, s)],
        2 => &[(0.0, -h), (h, 0.8 * h), (-h, 0.8 * h)],
        3 => &[(0.0, -1.2 * h), (1.2 * h, 0.0), (0.0, 1.2 * h), (-1.2 * h, 0.0)],
        4 => &[
            (w - h, -h),
            (0.0, -w),
            (h - w, -h),
            (h, w - h),
            (w, 0.0),
            (h, h - w),
            (h - w, h),
            (0.0, w),
            (w - h, h),
            (-h, h - w),
            (-w, 0.0),
            (-h, w - h),
        ],
        _ => &[
            (-w, -h),
            (w, -h),
            (w, -w),
            (h, -w),
            (h, w),
            (w, w),
            (w, h),
            (-w, h),
            (-w, w),
            (-h, w),
            (-h, -w),
            (-w, -w),
        ],
    };
    let mut data = String::new();
    for (k, (across, down)) in corners.iter().enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{command}{:.2} {:.2}", x + across, y + down);
    }
    data.push('Z');
    data
}

fn push_vertical(data: &mut String, x: f64, from: f64, to: f64) {
    let _ = write!(data, "M{x:.2} {from:.2}V{to:.2}");
}

fn push_horizontal(data: &mut String, y: f64, from: f64, to: f64) {
    let _ = write!(data, "M{from:.2} {y:.2}H{to:.2}");
}

fn is_shown(value: f64, scale: Scale) -> bool {
    match scale {
        Scale::Linear => value.is_finite(),
        Scale::Logarithmic => value.is_finite() && value > SMALLEST,
    }
}

/// The lowest and highest of the values that an axis can show. Without such values the range is 0 to
/// 1 on a linear axis, and 1 to 1 on a logarithmic axis.
fn range(values: impl Iterator<Item = f64>, scale: Scale) -> (f64, f64) {
    let shown = values.filter(|&value| is_shown(value, scale)).map(|value| value.clamp(-LARGEST, LARGEST));
    let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low <= high {
        return (low, high);
    }
    match scale {
        Scale::Linear => (0.0, 1.0),
        Scale::Logarithmic => (1.0, 1.0),
    }
}

/// The range of the vertical axis: that of the lines, extended by error bands within [`MAX_BAND`].
fn range_of_lines(plot: &LinePlot) -> (f64, f64) {
    let scale = plot.y.scale;
    let points = plot.lines.iter().flat_map(|line| line.points.iter().chain(&line.beside));
    let (low, high) = range(points.map(|point| point.1), scale);
    let edges = plot.lines.iter().flat_map(|line| {
        let bars = line.bars.iter().flatten();
        line.points.iter().zip(bars).flat_map(|(point, bar)| [point.1 - bar, point.1 + bar])
    });
    let (lowest, highest) = range(edges.chain([low, high]), scale);
    let room = if high > low { MAX_BAND * (high - low) } else { f64::INFINITY };
    (lowest.max(low - room), highest.min(high + room))
}

/// The range, or a wider one around it if it is only round-off.
fn still_widened((low, high): (f64, f64)) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if high - low > (LEAST_RANGE * size).max(SMALLEST) {
        return (low, high);
    }
    let around = if size > SMALLEST { 0.1 * size } else { 1.0 };
    (low - around, high + around)
}

fn with_margin(scale: Scale, range: (f64, f64)) -> (f64, f64) {
    match scale {
        Scale::Linear => {
            let (low, high) = still_widened(range);
            let margin = MARGIN * (high - low);
            (low - margin, high + margin)
        }
        Scale::Logarithmic => (range.0 / MARGIN_FACTOR, range.1 * MARGIN_FACTOR),
    }
}

/// True if a level can be drawn without squeezing the lines.
fn is_level_shown(level: &Level, (low, _): (f64, f64), scale: Scale) -> bool {
    match scale {
        Scale::Linear => level.value.is_finite(),
        Scale::Logarithmic => is_shown(level.value, scale) && level.value > LEAST_LEVEL * low,
    }
}
