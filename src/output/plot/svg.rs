//! The text of an SVG file. Light colours stand on the elements themselves, so that every program shows them; dark ones in a style sheet, which
//! programs that know the reader's choice put in their place.

use std::fmt::Write;

/// Which colours a picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Theme {
    /// Light, or dark where the reader's system is
    OfReader,
    /// Light everywhere
    #[cfg_attr(not(feature = "png"), expect(dead_code, reason = "for pictures in pixels"))]
    Light,
}

/// A colour, light and dark.
#[derive(Clone, Copy, Debug)]
pub struct Colour {
    /// Its class in the style sheet
    class: &'static str,
    light: &'static str,
    dark: &'static str,
}

const fn colour(class: &'static str, light: &'static str, dark: &'static str) -> Colour {
    Colour { class, light, dark }
}

/// Behind everything.
pub const PAPER: Colour = colour("paper", "#FFFFFF", "#15191F");
/// Titles and names.
pub const INK: Colour = colour("ink", "#1A1A1A", "#E8EAED");
/// Numbers, frame and boundaries.
pub const MUTED: Colour = colour("muted", "#555555", "#A9B1BA");
/// Lines at labelled ticks.
pub const GRID: Colour = colour("grid", "#DDDDDD", "#333B45");
/// Lines behind the others.
pub const BACKGROUND: Colour = colour("back", "#BBBBBB", "#596470");
/// Of lines; they differ in hue and lightness (Okabe and Ito 2008; dark ones are lifted to be as legible).
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

/// How the edge of a shape is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    /// The colour
    pub colour: Colour,
    /// In pixels
    pub width: f64,
    /// Lengths of dashes and gaps in pixels; empty for a solid line
    pub dashes: &'static str,
}

impl Stroke {
    /// A solid one.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashes: "" }
    }
}

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A text and its place.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    /// What it says
    pub text: &'a str,
    /// Across and down to the base line, in pixels
    pub at: (f64, f64),
    /// The size of the font
    pub size: f64,
    /// The colour
    pub colour: Colour,
    /// The point at the place
    pub anchor: Anchor,
    /// Whether it reads upward
    pub upward: bool,
    /// In the style sheet and for programs that read the picture
    pub class: &'static str,
}

/// A picture in the making.
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

    /// The edge along path data.
    pub fn path(&mut self, data: &str, stroke: Stroke) {
        if data.is_empty() {
            return;
        }
        let Stroke { colour: Colour { class, light, .. }, width, dashes } = stroke;
        let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
        let edge = format!("stroke=\"{light}\" stroke-width=\"{width}\"{dashes} stroke-linejoin=\"round\"");
        let _ = writeln!(self.out, "<path class=\"s-{class}\" d=\"{data}\" fill=\"none\" {edge}/>");
    }

    /// The inside of path data.
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

    /// Whatever follows is cut at the edges of a rectangle, until [`Self::end_clip`].
    pub fn begin_clip(&mut self, x: f64, y: f64, width: f64, height: f64) {
        let place = format!("x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"");
        let _ = writeln!(self.out, "<clipPath id=\"area\"><rect {place}/></clipPath>\n<g clip-path=\"url(#area)\">");
    }

    /// Ends what [`Self::begin_clip`] began.
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
