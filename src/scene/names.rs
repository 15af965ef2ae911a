//! From names in the deck to nodes and places of the mesh.

use super::mesh::{Mesh, MeshBeam};
use crate::deck::{Deck, Diagnostic, InterpolationWord, PointRef, Spanned, nearest, one_of};
use beamsim_core::model::beam_element::shape_at;
use beamsim_core::probe::Place;
use beamsim_core::tensor::{Mat3, Vec3};

/// The node or place of a name.
#[derive(Clone, Debug)]
pub enum Found {
    /// A node of the mesh, and where it was named on a beam: beam and fraction of its length
    Node(usize, Option<(usize, f64)>),
    /// A place within an element: beam and fraction of its length
    Between(usize, f64),
}

/// The place of a named point.
pub fn point(deck: &Deck, name: &str) -> Option<Vec3> {
    deck.points.named(name).map(|(_, x)| Vec3(*x))
}

/// The coordinates of a point that the deck gives by its name or its coordinates.
pub fn place(deck: &Deck, point: &Spanned<PointRef>) -> Result<Vec3, Diagnostic> {
    match &point.value {
        PointRef::Coordinates(x) => Ok(Vec3(*x)),
        PointRef::Name(name) => self::point(deck, name).ok_or_else(|| {
            let name = Spanned { value: name.clone(), span: point.span.clone() };
            unknown("point", &name, points(deck))
        }),
    }
}

/// The names of all points.
pub fn points(deck: &Deck) -> impl Iterator<Item = &str> {
    deck.points.names()
}

/// Names with which a misspelt one is compared, at most.
const MOST_COMPARED: usize = 2000;

/// Names that a message lists, at most.
const MOST_NAMES: usize = 12;

/// "there is no section `x`", with what was probably meant.
pub fn unknown<'a>(kind: &str, name: &Spanned<String>, known: impl Iterator<Item = &'a str>) -> Diagnostic {
    let known: Vec<&str> = known.collect();
    let mut diagnostic = Diagnostic::error(format!("there is no {kind} `{}`", name.value), name.span.clone());
    diagnostic.unknown = Some(name.value.clone());
    match nearest(&name.value, known.iter().copied().take(MOST_COMPARED)) {
        Some(meant) => diagnostic.help(format!("did you mean `{meant}`?")),
        None if known.is_empty() => diagnostic.help(format!("the deck defines no {kind}")),
        None if known.len() <= MOST_NAMES => diagnostic.help(format!("choose {}", one_of(known))),
        None => {
            let first = known[..MOST_NAMES].iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            let more = known.len() - MOST_NAMES;
            diagnostic.help(format!("the deck has {first} and {more} more"))
        }
    }
}

/// "there is no beam `x`"; `None` where the deck has it: then it could not be meshed, which is told already.
pub fn unknown_beam(deck: &Deck, name: &Spanned<String>) -> Option<Diagnostic> {
    let is_known = deck.beams.number(&name.value).is_some();
    (!is_known).then(|| unknown("beam", name, deck.beams.names()))
}

/// A named place on a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// The number of the beam
    pub(crate) beam: usize,
    /// The piece of its centre line
    pub(crate) piece: usize,
    /// The part of the elements of that piece that lie before it, from 0 to 1
    pub(crate) along: f64,
    /// True if it is a node
    pub(crate) is_node: bool,
    /// The number of elements of the piece, where their lengths differ
    pub(crate) graded: Option<usize>,
}

impl Mesh {
    /// The place of a name on a beam; `None` for other names.
    pub fn spot(&self, deck: &Deck, name: &str) -> Option<Spot> {
        let name = Spanned { value: name.to_string(), span: 0..0 };
        let (beam, fraction, is_node) = match self.find(deck, &name).ok()? {
            Found::Node(_, on) => on.map(|(beam, fraction)| (beam, fraction, true))?,
            Found::Between(beam, fraction) => (beam, fraction, false),
        };
        let (piece, along) = self.beams[beam].along(fraction);
        let graded = self.beams[beam].graded_count(piece);
        Some(Spot { beam, piece, along, is_node, graded })
    }

    /// Looks a name up: a point, `beam@start`, `beam@end`, `beam@0.25`, `beam:3`.
    pub fn find(&self, deck: &Deck, name: &Spanned<String>) -> Result<Found, Diagnostic> {
        if let Some((beam, rest)) = name.value.split_once('@') {
            return self.find_fraction(deck, name, beam, rest);
        }
        if let Some((beam, rest)) = name.value.split_once(':') {
            return self.find_number(deck, name, beam, rest);
        }
        if let Some(&node) = self.points.get(&name.value) {
            return Ok(Found::Node(node, None));
        }
        match point(deck, &name.value) {
            Some(place) => Err(self.no_node(name, place)),
            None => Err(unknown("node", name, points(deck))
                .help_if_none("a node is a named point, or on a beam `name@start`, `name@end`, `name@0.25`, `name:3`")),
        }
    }

    /// Looks a node up: places within elements are refused.
    pub fn find_node(&self, deck: &Deck, name: &Spanned<String>) -> Result<(usize, Option<(usize, f64)>), Diagnostic> {
        match self.find(deck, name)? {
            Found::Node(node, on) => Ok((node, on)),
            Found::Between(beam, fraction) => {
                let beam = &self.beams[beam];
                let message =
                    format!("`{}` lies inside an element of beam `{}`, but a node is needed", name.value, beam.name);
                Err(Diagnostic::error(message, name.span.clone()).help(propose(beam, fraction)))
            }
        }
    }

    fn beam(&self, deck: &Deck, name: &Spanned<String>, beam: &str) -> Result<usize, Diagnostic> {
        self.beams.number(beam).ok_or_else(|| {
            let name = Spanned { value: beam.to_string(), span: name.span.clone() };
            let mut diagnostic = unknown("beam", &name, deck.beams.names());
            if deck.beams.number(beam).is_some() {
                // It could not be meshed, which is told already.
                diagnostic.unknown = None;
            }
            diagnostic
        })
    }

    fn find_fraction(&self, deck: &Deck, name: &Spanned<String>, beam: &str, rest: &str) -> Result<Found, Diagnostic> {
        let number = self.beam(deck, name, beam)?;
        let fraction = match rest {
            "start" => 0.0,
            "end" => 1.0,
            text => match text.parse::<f64>() {
                Ok(fraction) if (0.0..=1.0).contains(&fraction) => fraction,
                _ => {
                    let message = format!("`{rest}` is not a place on beam `{beam}`");
                    let help = "write start, end, or a fraction of the length from 0 to 1 after @";
                    return Err(Diagnostic::error(message, name.span.clone()).help(help));
                }
            },
        };
        Ok(self.at_fraction(number, fraction))
    }

    /// The node of a beam at a fraction of its length, or the place between two.
    fn at_fraction(&self, number: usize, fraction: f64) -> Found {
        let beam = &self.beams[number];
        let at_node = beam.fractions.iter().position(|f| (f - fraction).abs() < 1e-9);
        match at_node {
            Some(k) => Found::Node(beam.nodes[k], Some((number, beam.fractions[k]))),
            None => Found::Between(number, fraction),
        }
    }

    fn find_number(&self, deck: &Deck, name: &Spanned<String>, beam: &str, rest: &str) -> Result<Found, Diagnostic> {
        let number = self.beam(deck, name, beam)?;
        let mesh_beam = &self.beams[number];
        let numbered = mesh_beam.numbered.as_ref().unwrap_or(&mesh_beam.fractions);
        match rest.parse::<usize>().ok().filter(|&k| k < numbered.len()) {
            Some(k) if mesh_beam.numbered.is_some() => Ok(self.at_fraction(number, numbered[k])),
            Some(k) => Ok(Found::Node(mesh_beam.nodes[k], Some((number, mesh_beam.fractions[k])))),
            None => {
                let last = numbered.len() - 1;
                let message = format!("beam `{beam}` has no node `{rest}`: its nodes are 0 to {last}");
                Err(Diagnostic::error(message, name.span.clone()))
            }
        }
    }

    /// A point that is no node: perhaps it lies on a beam, and a finer mesh would put one there.
    fn no_node(&self, name: &Spanned<String>, place: Vec3) -> Diagnostic {
        let message = format!("the point `{}` is not a node of the mesh", name.value);
        let diagnostic = Diagnostic::error(message, name.span.clone());
        let on = self.beams.iter().find_map(|beam| beam.line.find(place).map(|fraction| (beam, fraction)));
        match on {
            Some((beam, fraction)) => diagnostic.help(format!(
                "it lies on beam `{0}`, at `{0}@{fraction}`; {1}, or name the point in `through`",
                beam.name,
                propose(beam, fraction)
            )),
            None => diagnostic.help("no beam passes through it and no body is attached to it"),
        }
    }

    /// The place of a name, for looking at.
    pub fn place(&self, found: &Found) -> Place {
        match *found {
            Found::Node(node, on) => {
                let node = &self.nodes[node];
                Place { nodes: vec![(node.node, node.place, 1.0)], frame: self.frame(found, on), relative: false }
            }
            Found::Between(beam, fraction) => {
                let (element, xi) = self.beams[beam].element_at(fraction);
                let nodes = self.beams[beam].nodes_of(element);
                let (shape, _) = shape_at(nodes.len(), xi);
                let parts =
                    nodes.iter().zip(shape).map(|(&n, weight)| (self.nodes[n].node, self.nodes[n].place, weight));
                let relative = self.beams[beam].interpolation == InterpolationWord::Relative;
                Place { nodes: parts.collect(), frame: self.beams[beam].frame(fraction), relative }
            }
        }
    }

    /// The section axes at a name: of the beam it was named on, else of the first beam there, else
    /// the global ones.
    fn frame(&self, found: &Found, on: Option<(usize, f64)>) -> Mat3 {
        let on = on.or_else(|| self.beams_at(found).into_iter().next());
        on.map_or(Mat3::IDENTITY, |(beam, fraction)| self.beams[beam].frame(fraction))
    }

    /// The beams that meet at a name, with the fraction of their length.
    pub fn beams_at(&self, found: &Found) -> Vec<(usize, f64)> {
        match *found {
            Found::Between(beam, fraction) => vec![(beam, fraction)],
            Found::Node(_, Some(on)) => vec![on],
            Found::Node(node, None) => {
                let there = |(number, beam): (usize, &MeshBeam)| {
                    beam.nodes.iter().position(|&n| n == node).map(|k| (number, beam.fractions[k]))
                };
                self.beams.iter().enumerate().filter_map(there).collect()
            }
        }
    }
}

impl MeshBeam {
    /// The element at a fraction of the length, and xi in it.
    pub fn element_at(&self, fraction: f64) -> (usize, f64) {
        let count = self.elements.len();
        let ends = |k: usize| (self.fractions[k * self.order], self.fractions[(k + 1) * self.order]);
        let element = (0..count).find(|&k| fraction <= ends(k).1).unwrap_or(count - 1);
        let (start, end) = ends(element);
        (self.elements.start + element, 2.0 * (fraction - start) / (end - start) - 1.0)
    }

    /// The section axes of the exact curve at a fraction of the length; at a corner those of the piece before it.
    pub fn frame(&self, fraction: f64) -> Mat3 {
        let (piece, t) = self.line.locate(fraction);
        self.line.axes(piece, self.line.pieces[piece].tangent(t), fraction)
    }

    /// The section axes of the exact curve at a fraction of the length; at a corner those of the piece behind it.
    pub fn frame_behind(&self, fraction: f64) -> Mat3 {
        let (piece, t) = self.line.locate(fraction);
        match self.line.pieces.get(piece + 1).filter(|_| t > 1.0 - 1e-9) {
            Some(next) => self.line.axes(piece + 1, next.tangent(0.0), fraction),
            None => self.frame(fraction),
        }
    }
}

/// Advice: the number of elements that puts a node at a fraction of the length.
pub fn propose(beam: &MeshBeam, fraction: f64) -> String {
    let (piece, t) = beam.line.locate(fraction);
    if beam.graded_count(piece).is_some() {
        return format!("let an element end there: at {t:.9} of piece {} in the list of `elements`", piece + 1);
    }
    let whole = |n: &usize| {
        let place = t * (n * beam.order) as f64;
        (place - place.round()).abs() < 1e-9
    };
    let now = beam.elements.len();
    match (now.max(1)..=10_000).find(whole) {
        Some(n) if beam.line.pieces.len() == 1 => format!("`elements = {n}` gives a node there"),
        Some(n) => format!("{n} `elements` on piece {} give a node there", piece + 1),
        None => "no element count gives a node there".into(),
    }
}

impl Diagnostic {
    /// Help, where there is none yet.
    fn help_if_none(self, help: &str) -> Self {
        if self.help.is_some() { self } else { self.help(help) }
    }
}
