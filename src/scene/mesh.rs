//! From centre lines to nodes and elements.

use super::names;
use super::path::{self, CentreLine, Cover};
use super::section::{self, SectionCourse};
use crate::deck::{self, ByName, Deck, Diagnostic, Division, JointParts, Named, PointRef, Spanned, StationsWord};
use beamsim_core::model::Names;
use beamsim_core::model::beam_element::{ElementGeometry, PlacedNode, Rule, Station, shape_at};
use beamsim_core::system::Node;
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::HashMap;
use std::ops::Range;

/// An element and the beam that it belongs to.
#[derive(Clone, Copy)]
pub struct BeamElement<'m> {
    /// Its number in the scene
    pub(crate) number: usize,
    /// Its beam
    pub(super) beam: &'m MeshBeam,
    /// Indices of its nodes
    pub(super) nodes: &'m [usize],
    /// The mesh
    pub(super) mesh: &'m Mesh,
}

impl BeamElement<'_> {
    fn station(&self, part: &Part, xi: f64, gauss_weight: f64) -> Station {
        let &Part { piece, cover, .. } = part;
        let line = &self.beam.line;
        let (shape, slope) = shape_at(self.nodes.len(), xi);
        let (tangent, jacobian) = line.pieces[piece].slope(|| self.between(&slope), cover);
        let t = cover.place(xi);
        let fraction = line.fraction(piece, t);
        Station {
            slope: slope.map(|d| d / jacobian),
            shape,
            weight: gauss_weight * jacobian,
            fraction,
            axes: line.axes(piece, tangent, fraction),
            along: t,
        }
    }

    /// The piece of the centre line on which it lies.
    pub fn piece(&self) -> usize {
        self.beam.part_of_line(self.number).piece
    }

    /// Its integration points for internal forces: the fraction of the piece, and the section axes
    /// as columns.
    pub fn inner_points(&self) -> Vec<(f64, Mat3)> {
        self.stations(Rule::Inner).iter().map(|station| (station.along, station.axes)).collect()
    }

    /// The section axes of the exact curve at an integration point.
    pub fn exact_axes(&self, station: &Station) -> Mat3 {
        let Part { piece, .. } = self.beam.part_of_line(self.number);
        let line = &self.beam.line;
        line.axes(piece, line.pieces[piece].tangent(station.along), station.fraction)
    }
}

impl ElementGeometry for BeamElement<'_> {
    fn number(&self) -> usize {
        self.number
    }

    fn count(&self) -> usize {
        self.nodes.len()
    }

    fn node(&self, i: usize) -> PlacedNode {
        self.mesh.nodes[self.nodes[i]]
    }

    fn arms<const N: usize>(&self) -> [Vec3; N] {
        let Part { piece, cover, .. } = self.beam.part_of_line(self.number);
        self.beam.line.pieces[piece].arms(std::array::from_fn(|i| self.node(i).place), cover)
    }

    fn rounding(&self) -> f64 {
        let Part { piece, cover, .. } = self.beam.part_of_line(self.number);
        let chord = self.node(self.count() - 1).place - self.node(0).place;
        self.beam.line.pieces[piece].rounding(chord, cover)
    }

    fn stations(&self, rule: Rule) -> Vec<Station> {
        let part = self.beam.part_of_line(self.number);
        rule.points(self.nodes.len()).iter().map(|&(xi, weight)| self.station(&part, xi, weight)).collect()
    }
}

/// A beam as meshed.
#[derive(Clone, Debug)]
pub struct MeshBeam {
    /// Its name
    pub name: String,
    /// Its nodes from start to end
    pub nodes: Vec<usize>,
    /// The fraction of the length of each node
    pub(crate) fractions: Vec<f64>,
    /// The fraction of the length that each number means, where numbers do not count the nodes
    pub(super) numbered: Option<Vec<f64>>,
    /// The numbers of its elements
    pub(crate) elements: Range<usize>,
    /// First element of each piece of its centre line, counted from that of the beam, and at last
    /// their number
    piece_starts: Vec<usize>,
    /// The elements of each piece
    divisions: Vec<Division>,
    /// Nodes of an element, less one
    pub(crate) order: usize,
    /// Interpolation of rotations
    pub(super) interpolation: deck::InterpolationWord,
    /// Strain without stress
    pub(super) free_strain: Option<deck::FreeStrain>,
    /// Its centre line
    pub(crate) line: CentreLine,
    /// Its section along the way
    pub(crate) section: SectionCourse,
}

impl Named for MeshBeam {
    fn name(&self) -> &str {
        &self.name
    }
}

impl MeshBeam {
    /// Indices of the nodes of an element.
    pub fn nodes_of(&self, element: usize) -> &[usize] {
        let first = self.order * (element - self.elements.start);
        &self.nodes[first..=first + self.order]
    }

    /// The piece of the centre line at a fraction of the length, and the part of its elements
    /// before that.
    pub fn along(&self, fraction: f64) -> (usize, f64) {
        let (element, xi) = self.element_at(fraction);
        let Part { piece, number, .. } = self.part_of_line(element);
        (piece, self.divisions[piece].along(number, 0.5 * (xi + 1.0)))
    }

    /// The part of the centre line on which an element lies.
    fn part_of_line(&self, element: usize) -> Part {
        let number = element - self.elements.start;
        let piece = self.piece_starts.partition_point(|&start| start <= number) - 1;
        let number = number - self.piece_starts[piece];
        let division = &self.divisions[piece];
        let cover = match division {
            Division::Equal(count) => Cover::Equal { number, count: *count },
            Division::Graded { .. } | Division::At(_) => {
                Cover::Between { start: division.end(number), end: division.end(number + 1) }
            }
        };
        Part { piece, number, cover }
    }

    /// The lengths of the shortest and the longest element, where those of a piece differ.
    pub fn graded_lengths(&self) -> Option<[f64; 2]> {
        (0..self.divisions.len()).find(|&piece| self.graded_count(piece).is_some())?;
        let ends: Vec<f64> = self.fractions.iter().step_by(self.order).copied().collect();
        let lengths = ends.windows(2).map(|pair| (pair[1] - pair[0]) * self.line.length);
        Some(lengths.fold([f64::INFINITY, 0.0], |[least, most], one| [least.min(one), most.max(one)]))
    }

    /// The number of elements of a piece, where their lengths differ.
    pub fn graded_count(&self, piece: usize) -> Option<usize> {
        match &self.divisions[piece] {
            Division::Equal(_) => None,
            division @ (Division::Graded { .. } | Division::At(_)) => Some(division.count()),
        }
    }
}

/// The part of a centre line on which an element lies.
struct Part {
    piece: usize,
    /// The number of the element in its piece, from 0
    number: usize,
    cover: Cover,
}

/// All nodes, beams and elements.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The nodes
    pub nodes: Vec<PlacedNode>,
    /// The beams
    pub beams: ByName<MeshBeam>,
    /// The number of elements, beam after beam
    pub element_count: usize,
    /// The node of each named point that is one: the first-named beam's where a joint parts it
    pub points: HashMap<String, usize>,
    /// The node of a point for beams that a joint parted there
    pub(crate) parted: HashMap<(String, String), usize>,
    /// Names of nodes: those of their points, or beam and number
    pub(super) names: Names,
    slots: u32,
}

impl Mesh {
    /// Meshes all beams of the deck, and makes nodes of the points of bodies. What is wrong goes to
    /// `diagnostics`.
    pub fn new(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let mut mesh = Self::default();
        mesh.part_joints(deck, diagnostics);
        match count_nodes(deck) {
            Ok(count) => mesh.nodes.reserve_exact(count),
            Err(diagnostic) => {
                diagnostics.push(diagnostic);
                return mesh;
            }
        }
        for beam in &deck.beams {
            let planned = mesh.plan(beam, deck);
            match planned {
                Ok((line, section)) => mesh.add_beam(deck, beam, line, section, diagnostics),
                Err(diagnostic) => diagnostics.push(diagnostic),
            }
        }
        for body in &deck.bodies {
            mesh.add_body_point(&body.at, deck, diagnostics);
        }
        mesh.refuse_joints_off_nodes(deck, diagnostics);
        mesh
    }

    /// The number of slots.
    pub fn slots(&self) -> usize {
        self.slots as usize
    }

    /// The name of a node.
    pub fn name_of(&self, node: usize) -> String {
        self.names.of(self.nodes[node].node.p)
    }

    /// Adds a node with slots of its own, or one that shares the displacement of another. Its name
    /// is that of its first slot.
    fn add_node(&mut self, place: Vec3, shares: Option<usize>) -> usize {
        let mut slot = || {
            self.slots += 1;
            self.slots - 1
        };
        let u = shares.map_or_else(&mut slot, |other| self.nodes[other].node.u);
        let node = Node { u, p: slot() };
        self.nodes.push(PlacedNode { node, place });
        self.nodes.len() - 1
    }

    /// Makes the nodes of points that joints part, before any beam asks for them.
    fn part_joints(&mut self, deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
        for joint in &deck.joints {
            let JointParts::Beams { at, beams } = &joint.parts else { continue };
            let Some(place) = names::point(deck, &at.value) else {
                diagnostics.push(names::unknown("point", at, names::points(deck)));
                continue;
            };
            let known: Vec<_> = beams.iter().filter(|beam| deck.beams.number(&beam.value).is_some()).collect();
            if known.len() < beams.len() {
                for beam in beams.iter().filter(|b| !known.iter().any(|k| k.value == b.value)) {
                    diagnostics.push(names::unknown("beam", beam, deck.beams.names()));
                }
                continue;
            }
            if let Some(away) = known.iter().find(|name| !passes(deck, &name.value, &at.value)) {
                let message = format!("beam `{}` does not pass through the point `{}`", away.value, at.value);
                diagnostics.push(Diagnostic::error(message, away.span.clone()));
                continue;
            }
            let point = at.value.clone();
            let main = match self.points.get(&point) {
                Some(&main) => main,
                None => self.add_point(&point, place),
            };
            if let [_, second] = &beams[..] {
                let key = (second.value.clone(), point.clone());
                if self.parted.contains_key(&key) {
                    let message = format!("beam `{}` is already separated at `{point}` by another joint", second.value);
                    diagnostics.push(Diagnostic::error(message, second.span.clone()));
                    continue;
                }
                // The first beam may have been parted from the point before.
                let first = beams.first().and_then(|first| self.parted.get(&(first.value.clone(), point.clone())));
                let shares = joint.kind.shares_displacement().then_some(first.copied().unwrap_or(main));
                self.names.give(self.slots, &format!("{point} ({})", second.value));
                let node = self.add_node(place, shares);
                self.parted.insert(key, node);
            }
        }
    }

    /// The middle of an arc may be named without being a node.
    fn refuse_joints_off_nodes(&self, deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
        for joint in &deck.joints {
            let JointParts::Beams { at, beams } = &joint.parts else { continue };
            let Some(&main) = self.points.get(&at.value) else { continue };
            for name in beams {
                let Some(beam) = self.beams.named(&name.value) else { continue };
                let own = self.parted.get(&(name.value.clone(), at.value.clone())).unwrap_or(&main);
                if passes(deck, &name.value, &at.value) && !beam.nodes.contains(own) {
                    let message = format!("beam `{}` has no node at the point `{}`", name.value, at.value);
                    let diagnostic = Diagnostic::error(message, at.span.clone());
                    let fraction = beam.line.find(self.nodes[main].place).unwrap_or(0.5);
                    diagnostics.push(diagnostic.help(names::propose(beam, fraction)));
                }
            }
        }
    }

    fn add_point(&mut self, name: &str, place: Vec3) -> usize {
        self.names.give(self.slots, name);
        let node = self.add_node(place, None);
        self.points.insert(name.into(), node);
        node
    }

    fn add_body_point(&mut self, at: &Spanned<String>, deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
        // Other names, such as `arm@end`, are looked up when the body is composed.
        if at.value.contains(['@', ':']) || self.points.contains_key(&at.value) {
            return;
        }
        match names::point(deck, &at.value) {
            Some(place) => {
                self.add_point(&at.value, place);
            }
            None => diagnostics.push(names::unknown("point", at, names::points(deck))),
        }
    }

    /// Centre line and section of a beam.
    fn plan(&self, beam: &deck::Beam, deck: &Deck) -> Result<(CentreLine, SectionCourse), Diagnostic> {
        let find = |name: &Spanned<String>| {
            let found = deck.sections.named(&name.value);
            found.ok_or_else(|| names::unknown("section", name, deck.sections.names()))
        };
        let section = match &beam.sections[..] {
            [] => return Err(Diagnostic::error("a beam needs a section", beam.span.clone())),
            [one] => SectionCourse::Uniform(section::matrices(find(one)?, deck)?),
            [start, end] if beam.stations.is_none() => section::taper([find(start)?, find(end)?], deck)?,
            several => {
                let pair = |pair: &[Spanned<String>]| section::taper([find(&pair[0])?, find(&pair[1])?], deck);
                let courses = several.windows(2).map(pair).collect::<Result<_, _>>()?;
                let fractions = beam.stations.as_ref().map_or(Vec::new(), |stations| stations.value.clone());
                SectionCourse::Stations { fractions, courses }
            }
        };
        let line = path::centre_line(beam, &|point| names::place(deck, point))?;
        let section = section.along(line.length, beam.stations_in).map_err(|last| {
            let span = beam.stations.as_ref().map_or(beam.span.clone(), |stations| stations.span.clone());
            let length = line.length;
            let end = match beam.stations_in {
                None => format!("1 (a fraction) or the length of the beam, {length}"),
                Some(StationsWord::Fraction) => "1, since they are fractions of the length".into(),
                Some(StationsWord::Length) => format!("the length of the beam, {length}"),
            };
            Diagnostic::error(format!("the last of the `stations` is {last}; it must be {end}"), span)
        })?;
        let section = section.placed(path::along(beam, beam.offset.as_ref()), path::along(beam, beam.turn.as_ref()));
        let pieces = line.pieces.len();
        for (key, list) in [("elements", Some(&beam.elements)), ("numbering", beam.numbering.as_ref())] {
            let Some(Spanned { value, span }) = list.filter(|l| l.value.len() != 1 && l.value.len() != pieces) else {
                continue;
            };
            let counts = value.len();
            let message = format!("`{key}` has {counts} entries, beam `{}` has {pieces} piece(s)", beam.name.value);
            return Err(Diagnostic::error(message, span.clone()));
        }
        path::refuse_coarse(beam, &line)?;
        Ok((line, section.forced(&deck.effects)))
    }

    fn add_beam(
        &mut self,
        deck: &Deck,
        beam: &deck::Beam,
        line: CentreLine,
        section: SectionCourse,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let count = |piece: usize| beam.elements_of(piece).count();
        let corners: Vec<Option<&str>> = corner_names(&beam.path);
        let between = named_between(beam, &line, &|name| names::point(deck, name));
        let first_element = self.element_count;
        let all = (0..line.pieces.len()).map(count).sum::<usize>() * beam.order + 1;
        let mut nodes = Vec::with_capacity(all);
        let mut fractions = Vec::with_capacity(all);
        for piece in 0..line.pieces.len() {
            let steps = count(piece) * beam.order;
            for step in usize::from(piece > 0)..=steps {
                let t = beam.elements_of(piece).node(step, beam.order);
                let corner = match step {
                    0 => corners[piece],
                    _ if step == steps => corners[piece + 1],
                    _ => between.filter(|&(_, at)| at == step).map(|(name, _)| name),
                };
                let place = line.pieces[piece].place(t);
                nodes.push(self.node_on_beam(&beam.name.value, corner, place, nodes.len()));
                fractions.push(line.fraction(piece, t));
            }
        }
        let mut first_node = 0;
        let mut piece_starts = vec![0];
        for piece in 0..line.pieces.len() {
            piece_starts.push(piece_starts[piece] + count(piece));
            for _ in 0..count(piece) {
                let own = &nodes[first_node..=first_node + beam.order];
                if own.iter().enumerate().any(|(i, a)| own[..i].contains(a)) {
                    let message = format!("an element of beam `{}` starts and ends at the same node", beam.name.value);
                    diagnostics
                        .push(Diagnostic::error(message, beam.elements.span.clone()).help("use more `elements`"));
                    return;
                }
                self.element_count += 1;
                first_node += beam.order;
            }
        }
        self.beams.push(MeshBeam {
            name: beam.name.value.clone(),
            nodes,
            fractions,
            numbered: beam.numbering.as_ref().map(|numbering| fractions_of(&line, &numbering.value)),
            elements: first_element..self.element_count,
            piece_starts,
            divisions: (0..line.pieces.len()).map(|piece| beam.elements_of(piece).clone()).collect(),
            order: beam.order,
            interpolation: beam.interpolation,
            free_strain: beam.free_strain.clone(),
            line,
            section,
        });
    }

    /// The node at a corner with a name, or a new one.
    fn node_on_beam(&mut self, beam: &str, corner: Option<&str>, place: Vec3, number: usize) -> usize {
        let Some(point) = corner else {
            self.names.count(self.slots, beam, number);
            return self.add_node(place, None);
        };
        let parted = self.parted.get(&(beam.to_string(), point.to_string())).copied();
        if let Some(node) = parted.or_else(|| self.points.get(point).copied()) {
            return node;
        }
        self.add_point(point, place)
    }

    /// The elements of a beam.
    pub fn elements_of<'m>(&'m self, beam: &'m MeshBeam) -> impl Iterator<Item = BeamElement<'m>> {
        let element = |number: usize| BeamElement { number, beam, nodes: beam.nodes_of(number), mesh: self };
        beam.elements.clone().map(element)
    }
}

/// The fractions of the length where the parts of the pieces of a line end, from start to end.
fn fractions_of(line: &CentreLine, divisions: &[Division]) -> Vec<f64> {
    let inner = (0..line.pieces.len()).flat_map(|piece| {
        let division = &divisions[piece.min(divisions.len() - 1)];
        (1..=division.count()).map(move |part| line.fraction(piece, division.end(part)))
    });
    std::iter::once(0.0).chain(inner).collect()
}

/// The names at the ends of the pieces of a path.
fn corner_names(path: &deck::Path) -> Vec<Option<&str>> {
    fn name(point: &Spanned<PointRef>) -> Option<&str> {
        match &point.value {
            PointRef::Name(name) => Some(name),
            PointRef::Coordinates(_) => None,
        }
    }
    match path {
        deck::Path::Through(points) => points.iter().map(name).collect(),
        deck::Path::Arc([start, _, end]) => vec![name(start), name(end)],
        deck::Path::Helix(helix) => vec![name(&helix.start), helix.end.as_ref().and_then(name)],
        deck::Path::Spline(spline) => spline.corners().into_iter().map(|k| name(&spline.points[k])).collect(),
    }
}

/// The named middle point of an arc and its step, where the mesh puts a node there.
fn named_between<'a>(
    beam: &'a deck::Beam,
    line: &CentreLine,
    place: &dyn Fn(&str) -> Option<Vec3>,
) -> Option<(&'a str, usize)> {
    let deck::Path::Arc([_, Spanned { value: PointRef::Name(name), .. }, _]) = &beam.path else { return None };
    let at = line.find(place(name)?)?;
    let division = beam.elements_of(0);
    let steps = division.count() * beam.order;
    let step = match division {
        Division::Equal(_) => {
            let step = at * steps as f64;
            ((step - step.round()).abs() < 1e-9).then_some(step.round() as usize)
        }
        Division::Graded { .. } | Division::At(_) => {
            (0..=steps).find(|&step| (division.node(step, beam.order) - at).abs() < 1e-9)
        }
    };
    step.map(|step| (name.as_str(), step))
}

/// True if the path of a beam names a point.
fn passes(deck: &Deck, beam: &str, point: &str) -> bool {
    deck.beams.named(beam).is_some_and(|b| {
        let is_middle = matches!(
            &b.path,
            deck::Path::Arc([_, Spanned { value: PointRef::Name(middle), .. }, _]) if middle == point
        );
        is_middle || corner_names(&b.path).contains(&Some(point))
    })
}

/// Counts nodes before any memory is taken: at most so many lie on beams.
fn count_nodes(deck: &Deck) -> Result<usize, Diagnostic> {
    let mut total = 0_usize;
    for beam in &deck.beams {
        let elements = match &beam.elements.value[..] {
            [division] => division.count().saturating_mul(beam.pieces()),
            divisions => divisions.iter().map(Division::count).sum(),
        };
        total = total.saturating_add(elements.saturating_mul(beam.order));
        if total > deck::MOST_ELEMENTS {
            let message = format!("more nodes than the limit of {}", deck::MOST_ELEMENTS);
            return Err(Diagnostic::limit(message, beam.elements.span.clone()));
        }
    }
    Ok(total + deck.beams.len())
}
