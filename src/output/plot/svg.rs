//! The text of an SVG file. Light colours are attributes of the elements, which every program shows.
//! Dark colours are in a style sheet for programs that know the reader's mode.

use super::super::ownership::GENERATOR;
use std::fmt::Write;

/// The colours of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Theme {
    /// The light or dark mode of the reader
    OfReader,
    /// Light colours for all readers
    #[cfg_attr(not(feature = "png"), expect(dead_code, reason = "for pictures in pixels"))]
    Light,
}

/// A colour in light and in dark mode.
#[derive(Clone, Copy, Debug)]
pub struct Colour {
    /// The class in the style sheet
    class: &'static str,
    light: &'static str,
    dark: &'static str,
}

const fn colour(class: &'static str, light: &'static str, dark: &'static str) -> Colour {
    Colour { class, light, dark }
}

/// The background of the picture.
pub const PAPER: Colour = colour("paper", "#FFFFFF", "#15191F");
/// Titles and names.
pub const INK: Colour = colour("ink", "#1A1A1A", "#E8EAED");
/// Tick labels, frame and boundaries.
pub const MUTED: Colour = colour("muted", "#555555", "#A9B1BA");
/// Grid lines at labelled ticks.
pub const GRID: Colour = colour("grid", "#DDDDDD", "#333B45");
/// Broad lines behind the other lines.
pub const BACKGROUND: Colour = colour("back", "#BBBBBB", "#596470");
/// Colours of lines, which differ in hue and lightness (Okabe and Ito 2008; lighter in dark mode, for
/// the same contrast).
pub const LINES: [Colour; 7] = [
    colour("c0", "#0072B2", "#4BA8E0"),
    colour("c1", "#D55E00", "#F08A3C"),
    colour("c2", "#009E73", "#2FC79B"),
    colour("c3", "#CC79A7", "#E29CC3"),
    colour("c4", "#E69F00", "#F2BC42"),
    colour("c5", "#56B4E9", "#9AD3F5"),
    colour("c6", "#000000", "#FFFFFF"),
];
const OTHERS: [Colour; 5] = [PAPER, INK, MUTED, GRID, BACKGROUND];

/// Colour, width and dashes of a drawn line.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    /// The colour
    pub(super) colour: Colour,
    /// The width in pixels
    pub(super) width: f64,
    /// Lengths of dashes and gaps in pixels; empty for a solid line
    pub(super) dashes: &'static str,
}

impl Stroke {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashes: "" }
    }
}

/// The point of a text that is at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A text and its position.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    /// The characters
    pub(super) text: &'a str,
    /// Position of the base line in pixels: to the right, and down
    pub(super) at: (f64, f64),
    /// The font size in pixels
    pub(super) size: f64,
    /// The colour
    pub(super) colour: Colour,
    /// The point of the text at the position
    pub(super) anchor: Anchor,
    /// True if the text reads upward
    pub(super) upward: bool,
    /// The class of the element, for programs that read the picture
    pub(super) class: &'static str,
}

/// An SVG file that is being written.
pub struct Svg {
    out: String,
}

impl Svg {
    /// An empty picture of a size in pixels; the title is for screen readers.
    pub fn new(width: f64, height: f64, title: &str, theme: Theme) -> Self {
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"'Noto Sans', 'Segoe UI', Helvetica, Arial, 'Liberation Sans', sans-serif\" role=\"img\">\n"
        );
        let _ = writeln!(out, "<!-- {GENERATOR} -->");
        let _ = writeln!(out, "<title>{}</title>", escaped(title));
        if theme == Theme::OfReader {
            out.push_str("<style>@media (prefers-color-scheme: dark) {\n");
            for Colour { class, dark, .. } in OTHERS.iter().chain(&LINES) {
                let _ = writeln!(out, ".f-{class} {{ fill: {dark}; }} .s-{class} {{ stroke: {dark}; }}");
            }
            out.push_str("}</style>\n");
        }
        Self { out }
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, x: f64, y: f64, width: f64, height: f64, fill: Colour) {
        let Colour { class, light, .. } = fill;
        let place = format!("x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"");
        let _ = writeln!(self.out, "<rect class=\"f-{class}\" {place} fill=\"{light}\"/>");
    }

    /// A line along path data.
    pub fn path(&mut self, data: &str, stroke: Stroke) {
        if data.is_empty() {
            return;
        }
        let Stroke { colour: Colour { class, light, .. }, width, dashes } = stroke;
        let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
        let edge = format!("stroke=\"{light}\" stroke-width=\"{width}\"{dashes} stroke-linejoin=\"round\"");
        let _ = writeln!(self.out, "<path class=\"s-{class}\" d=\"{data}\" fill=\"none\" {edge}/>");
    }

    /// A filled shape with path data as its outline.
    pub fn filled_path(&mut self, data: &str, colour: Colour, opacity: f64) {
        if data.is_empty() {
            return;
        }
        let Colour { class, light, .. } = colour;
        let _ = writeln!(
            self.out,
            "<path class=\"f-{class}\" d=\"{data}\" fill=\"{light}\" fill-opacity=\"{opacity}\" stroke=\"none\"/>"
        );
    }

    /// A text.
    pub fn text(&mut self, text: Text) {
        let Text { text, at: (x, y), size, colour: Colour { class: colour, light, .. }, anchor, upward, class } = text;
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let turned = if upward { format!(" transform=\"rotate(-90 {x:.1} {y:.1})\"") } else { String::new() };
        let place = format!("x=\"{x:.1}\" y=\"{y:.1}\"{turned} font-size=\"{size}\" text-anchor=\"{anchor}\"");
        let _ =
            writeln!(self.out, "<text class=\"{class} f-{colour}\" {place} fill=\"{light}\">{}</text>", escaped(text));
    }

    /// Starts clipping at the edges of a rectangle, until [`Self::end_clip`].
    pub fn begin_clip(&mut self, x: f64, y: f64, width: f64, height: f64) {
        let place = format!("x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"");
        let _ = writeln!(self.out, "<clipPath id=\"area\"><rect {place}/></clipPath>\n<g clip-path=\"url(#area)\">");
    }

    /// Ends the clipping that [`Self::begin_clip`] started.
    pub fn end_clip(&mut self) {
        self.out.push_str("</g>\n");
    }

    /// The text of the file.
    pub fn finish(mut self) -> String {
        self.out.push_str("</svg>\n");
        self.out
    }
}

fn escaped(text: &str) -> String {
    let is_allowed = |c: &char| !c.is_control();
    let text: String = text.chars().filter(is_allowed).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
