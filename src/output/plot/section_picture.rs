//! Pictures of a section: its mesh, coloured by material, with its centres, or by its warping or
//! stress.

use super::svg::{Anchor, BACKGROUND, INK, LINES, MUTED, PAPER, Stroke, Svg, Text, Theme};
use super::text;
use beamsim_core::section::Point;
use beamsim_core::section::mesh::{Element, Mesh};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Width of the drawing without margins, in pixels
const WIDTH: f64 = 700.0;

/// Height of the drawing without margins, at most, in pixels
const MAX_HEIGHT: f64 = 700.0;

/// Space around the drawing, in pixels
const MARGIN: f64 = 40.0;

/// Height of a line of the legend, in pixels
const LINE: f64 = 20.0;

/// Size of texts, in pixels
const SIZE: f64 = 13.0;

/// A picture of a section.
pub struct SectionPicture<'a> {
    /// Title
    pub(crate) title: String,
    /// Mesh
    pub(crate) mesh: &'a Mesh,
    /// Names of the materials of the regions of the mesh, by their index
    pub(crate) materials: Vec<String>,
    /// Names and places of points, in the coordinates of the mesh
    pub(crate) points: Vec<(&'static str, Point)>,
    /// Displacement of each node along axis 1 in the place of the materials
    pub(crate) warping: Option<Vec<f64>>,
    /// Stress of each element in the place of the materials
    pub(crate) stress: Option<StressShade>,
}

/// Stresses as colours.
pub struct StressShade {
    /// Stress of each element
    pub(crate) of_elements: Vec<f64>,
    /// The stress of the full colour
    pub(crate) largest: f64,
    /// Meaning of the full colour
    pub(crate) legend: String,
}

/// From the coordinates of the mesh to pixels.
struct Frame {
    low: Point,
    scale: f64,
    height: f64,
}

impl Frame {
    /// A frame that holds the mesh and all points.
    fn new(picture: &SectionPicture) -> Self {
        let extent = |axis: usize| {
            let points = picture.points.iter().map(|(_, at)| at);
            let values = picture.mesh.nodes.iter().chain(points).map(|at| at[axis]);
            [values.clone().fold(f64::MAX, f64::min), values.fold(f64::MIN, f64::max)]
        };
        let [[left, right], [bottom, top]] = [extent(0), extent(1)];
        let scale = (WIDTH / (right - left)).min(MAX_HEIGHT / (top - bottom));
        Self { low: [left, bottom], scale, height: scale * (top - bottom) }
    }

    fn at(&self, [x2, x3]: Point) -> (f64, f64) {
        (MARGIN + self.scale * (x2 - self.low[0]), 2.0 * MARGIN + self.height - self.scale * (x3 - self.low[1]))
    }

    /// A coordinate with six digits; zero where it is round-off.
    fn digits(&self, value: f64) -> f64 {
        let rounded = format!("{value:.5e}").parse().unwrap_or(value);
        if value.abs() * self.scale < 1e-6 { 0.0 } else { rounded }
    }

    fn text(&self, at: Point) -> String {
        let (x, y) = self.at(at);
        format!("{x:.1} {y:.1}")
    }
}

impl SectionPicture<'_> {
    /// The text of an SVG file.
    pub fn to_svg(&self) -> String {
        let frame = Frame::new(self);
        let legend = self.legend().len() + self.points.len();
        let width = WIDTH + 2.0 * MARGIN;
        let height = frame.height + 3.0 * MARGIN + LINE * legend as f64;
        let mut svg = Svg::new(width, height, &self.title, Theme::OfReader);
        svg.rectangle(0.0, 0.0, width, height, PAPER);
        let title = text::cut(&self.title, 16.0, WIDTH);
        svg.text(label(&title, (MARGIN, MARGIN), 16.0));
        match (&self.warping, &self.stress) {
            (Some(warping), _) => self.draw_warping(warping, &frame, &mut svg),
            (None, Some(stress)) => self.draw_stress(stress, &frame, &mut svg),
            (None, None) => self.draw_materials(&frame, &mut svg),
        }
        svg.path(&self.sides(&frame), Stroke::solid(BACKGROUND, 0.3));
        let mut y = frame.height + 2.5 * MARGIN;
        for (number, name) in self.legend().iter().enumerate() {
            let square = format!("M{MARGIN:.1} {:.1}h12v12h-12z", y - 11.0);
            svg.filled_path(&square, LINES[number % LINES.len()], 0.35);
            svg.text(label(&text::cut(name, SIZE, WIDTH), (MARGIN + 22.0, y), SIZE));
            y += LINE;
        }
        for (number, (name, at)) in self.points.iter().enumerate() {
            let (x, across) = frame.at(*at);
            svg.path(&mark(number, x, across), Stroke::solid(INK, 1.6));
            svg.path(&mark(number, MARGIN + 6.0, y - 5.0), Stroke::solid(INK, 1.6));
            svg.text(label(
                &format!("{name} ({}, {})", frame.digits(at[0]), frame.digits(at[1])),
                (MARGIN + 22.0, y),
                SIZE,
            ));
            y += LINE;
        }
        svg.finish()
    }

    /// Meanings of colours.
    fn legend(&self) -> Vec<String> {
        match (&self.warping, &self.stress) {
            (Some(_), _) => {
                ["backwards (in the sense of -1)", "forwards (in the sense of +1)"].map(str::to_string).to_vec()
            }
            (None, Some(stress)) => vec![stress.legend.clone()],
            (None, None) => self.materials.clone(),
        }
    }

    fn draw_materials(&self, frame: &Frame, svg: &mut Svg) {
        for material in 0..self.materials.len() {
            let own = self.mesh.elements.iter().filter(|element| self.mesh.region(element).material == material);
            let data: String = own.map(|element| self.outline_of(element, frame)).collect();
            svg.filled_path(&data, LINES[material % LINES.len()], 0.35);
        }
    }

    /// The more an element is displaced, the stronger is its colour.
    fn draw_warping(&self, warping: &[f64], frame: &Frame, svg: &mut Svg) {
        let largest = warping.iter().fold(f64::MIN_POSITIVE, |largest, value| largest.max(value.abs()));
        for element in &self.mesh.elements {
            let nodes = element.nodes();
            let mean = nodes.iter().map(|&node| warping[node as usize]).sum::<f64>() / (nodes.len() as f64 * largest);
            let colour = LINES[if mean < 0.0 { 0 } else { 1 }];
            svg.filled_path(&self.outline_of(element, frame), colour, (100.0 * mean.abs()).round() / 100.0);
        }
    }

    /// The larger the stress of an element, the stronger is its colour.
    fn draw_stress(&self, stress: &StressShade, frame: &Frame, svg: &mut Svg) {
        for (element, value) in self.mesh.elements.iter().zip(&stress.of_elements) {
            let part = (value / stress.largest.max(f64::MIN_POSITIVE)).min(1.0);
            svg.filled_path(&self.outline_of(element, frame), LINES[0], (100.0 * part).round() / 100.0);
        }
    }

    /// An element as path data, with its curved sides.
    fn outline_of(&self, element: &Element, frame: &Frame) -> String {
        let mut data = String::new();
        for side in 0..element.kind.corners() {
            let [from, middle, to] = self.side(element, side);
            let begin = if side == 0 { format!("M{}", frame.text(from)) } else { String::new() };
            let _ = write!(data, "{begin}Q{} {}", frame.text(control(from, middle, to)), frame.text(to));
        }
        data + "z"
    }

    /// All sides of elements, each once.
    fn sides(&self, frame: &Frame) -> String {
        let mut data = String::new();
        let mut drawn = BTreeSet::new();
        for element in &self.mesh.elements {
            for side in 0..element.kind.corners() {
                let [.., middle] = element.kind.side(side);
                if drawn.insert(element.nodes[middle]) {
                    let [from, middle, to] = self.side(element, side);
                    let middle = frame.text(control(from, middle, to));
                    let _ = write!(data, "M{}Q{middle} {}", frame.text(from), frame.text(to));
                }
            }
        }
        data
    }

    /// Start, middle and end of a side.
    fn side(&self, element: &Element, side: usize) -> [Point; 3] {
        let [from, to, middle] = element.kind.side(side).map(|local| self.mesh.nodes[element.nodes[local] as usize]);
        [from, middle, to]
    }
}

/// The control point of the parabola through three points.
fn control(from: Point, middle: Point, to: Point) -> Point {
    [0, 1].map(|axis| 2.0 * middle[axis] - 0.5 * (from[axis] + to[axis]))
}

/// A mark for each centre: plus, cross, square, diamond, triangle.
fn mark(number: usize, x: f64, y: f64) -> String {
    let at = format!("M{x:.1} {y:.1}");
    match number % 5 {
        0 => format!("{at}m-7 0h14m-7 -7v14"),
        1 => format!("{at}m-5 -5l10 10m0 -10l-10 10"),
        2 => format!("{at}m-5 -5h10v10h-10z"),
        3 => format!("{at}m0 -7l7 7l-7 7l-7 -7z"),
        _ => format!("{at}m0 -7l6 11h-12z"),
    }
}

/// A text that begins at a place.
fn label(text: &str, at: (f64, f64), size: f64) -> Text<'_> {
    let colour = if size > SIZE { INK } else { MUTED };
    Text { text, at, size, colour, anchor: Anchor::Start, upward: false, class: "label" }
}
