//! Strains and stresses along beams in a run, and how fast they vary.
//!
//! For elements of order p, each place has a density
//!
//! ```text
//! rho = d^p strain/ds^p . d^p stress/ds^p
//! ```
//!
//! the largest of some rows, with the arc length s. The derivatives are divided differences of
//! values at Gauss points, where strains are most accurate.

use super::built::BuiltDeck;
use crate::deck::{Beam, Deck, Division};
use crate::scene::{Mesh, MeshBeam, Scene};
use beamsim_core::run::Snapshot;
use beamsim_core::sorting::sort_numbers;
use beamsim_core::tensor::Mat3;

/// Tolerance for the place of an element end, in elements.
pub const AT_END: f64 = 1e-6;

/// The largest number of equal elements that is looked for, with ends at all kept places.
const MOST_UNITS: usize = 1000;

/// Rows that are looked at before some are left out, and from then on for each doubling of the rows.
const ROWS: [usize; 2] = [32, 16];

/// The densities of all pieces of all beams.
#[derive(Clone)]
pub struct StrainRecord {
    /// The pieces of each beam
    pub(super) beams: Vec<Vec<Piece>>,
    /// The number of rows
    rows: usize,
}

/// A piece of a beam, between places where the solution may have kinks.
#[derive(Clone)]
pub struct Piece {
    /// Its length
    pub(super) length: f64,
    /// The number of its elements
    pub(super) count: usize,
    /// The order of its elements
    pub(super) order: usize,
    /// Places inside at which an element must end, as fractions
    pub(super) kept: Vec<f64>,
    /// The smallest number of equal elements that end at the kept places
    pub(super) unit: usize,
    /// Its parts between the kept places
    pub(super) segments: Vec<Segment>,
}

/// A part of a piece within which the solution is smooth. Places are fractions of the piece.
#[derive(Clone)]
pub struct Segment {
    /// Where it begins
    pub(super) start: f64,
    /// Where it ends
    pub(super) end: f64,
    /// Its integration points in order
    pub(super) points: Vec<Point>,
    /// The largest rho so far in each window of neighbouring points
    pub(super) densities: Vec<f64>,
}

/// An integration point.
#[derive(Clone)]
pub struct Point {
    /// Its element in the scene
    pub(super) element: usize,
    /// Its number in the element
    pub(super) number: usize,
    /// Fraction of the piece
    pub(super) place: f64,
    /// Section axes as columns
    pub(super) axes: Mat3,
}

/// Strains, then stress resultants, in section axes.
pub type Values = [f64; 12];

impl StrainRecord {
    /// An empty record of a scene; `None` where its elements are placed already, or cannot end at all
    /// places that must be kept.
    pub fn of(BuiltDeck { deck, scene }: &BuiltDeck) -> Option<Self> {
        let is_equal = |own: &Division| matches!(own, Division::Equal(_));
        if !deck.beams.iter().flat_map(|beam| &beam.elements.value).all(is_equal) {
            return None;
        }
        Some(Self { beams: pieces(deck, scene)?, rows: 0 })
    }

    /// Takes a row of a run of the scene. Of many rows some are left out, since a look takes about as
    /// long as an iteration.
    pub fn row(&mut self, scene: &Scene, at: &Snapshot) {
        let number = self.rows;
        self.rows += 1;
        let [all, of_doubling] = ROWS;
        if number >= all && !number.is_multiple_of(1 << (number / of_doubling).ilog2()) {
            return;
        }
        let stresses = |element| scene.stresses(element, at);
        let values: Vec<Vec<[[f64; 3]; 4]>> = (0..scene.mesh.element_count).map(stresses).collect();
        for piece in self.beams.iter_mut().flatten() {
            piece.segments.iter_mut().for_each(|segment| segment.look(&values, piece.order, piece.length));
        }
    }
}

/// The pieces of all beams; `None` where elements cannot end at all places that must be kept.
fn pieces(deck: &Deck, scene: &Scene) -> Option<Vec<Vec<Piece>>> {
    let mesh = &scene.mesh;
    let mut beams = Vec::new();
    for (number, (beam, own)) in mesh.beams.iter().zip(&deck.beams).enumerate() {
        let mut kept = kept_places(scene, deck, number);
        // A kink of the section is kept where an element ends there already.
        let ends_there = |&(piece, t): &(usize, f64)| is_end(t, own.elements_of(piece).count());
        kept.extend(station_places(own, beam).into_iter().filter(ends_there));
        let piece = |k: usize| {
            let inside = |&&(piece, t): &&(usize, f64)| piece == k && t > AT_END && t < 1.0 - AT_END;
            let mut kept: Vec<f64> = kept.iter().filter(inside).map(|&(_, t)| t).collect();
            sort_numbers(&mut kept);
            kept.dedup_by(|a, b| (*a - *b).abs() < AT_END);
            let unit = (1..=MOST_UNITS).find(|&unit| kept.iter().all(|&t| is_end(t, unit)))?;
            let length = beam.line.pieces[k].length;
            let count = own.elements_of(k).count();
            let segments = segments(mesh, beam, k, &kept);
            Some(Piece { length, count, order: beam.order, kept, unit, segments })
        };
        beams.push((0..own.pieces()).map(piece).collect::<Option<Vec<Piece>>>()?);
    }
    Some(beams)
}

/// The stations of the sections of a beam: the piece of each, and the part of its length.
pub fn station_places(own: &Beam, meshed: &MeshBeam) -> Vec<(usize, f64)> {
    let Some(stations) = &own.stations else { return Vec::new() };
    let end = stations.value.last().copied().unwrap_or(1.0);
    stations.value.iter().map(|station| meshed.line.locate(station / end)).collect()
}

/// True if a place is an end of one of `count` equal elements.
pub fn is_end(place: f64, count: usize) -> bool {
    let ends = place * count as f64;
    (ends - ends.round()).abs() < AT_END
}

/// Nodes of a beam that the deck names: pieces, and fractions of them.
fn kept_places(scene: &Scene, deck: &Deck, beam: usize) -> Vec<(usize, f64)> {
    let mesh = &scene.mesh;
    let line = &mesh.beams[beam].line;
    let mut kept = Vec::new();
    for name in scene.places_in_texts() {
        // Names of columns have the name of a node before their last point.
        let spots = [Some(name), name.rsplit_once('.').map(|(node, _)| node)];
        let spots = spots.into_iter().flatten().filter_map(|name| mesh.spot(deck, name));
        kept.extend(spots.filter(|spot| spot.beam == beam && spot.is_node).map(|spot| (spot.piece, spot.along)));
    }
    let own = &mesh.beams[beam];
    let named = |node: &usize| mesh.points.values().chain(mesh.parted.values()).any(|known| known == node);
    let inner = own.nodes.iter().zip(&own.fractions).filter(|(node, _)| named(node));
    kept.extend(inner.map(|(_, &fraction)| line.locate(fraction)));
    kept
}

/// The segments of a piece between its kept places.
fn segments(mesh: &Mesh, beam: &MeshBeam, piece: usize, kept: &[f64]) -> Vec<Segment> {
    let mut points = Vec::new();
    for element in mesh.elements_of(beam).filter(|element| element.piece() == piece) {
        let places = element.inner_points().into_iter().enumerate();
        points.extend(places.map(|(number, (place, axes))| Point { element: element.number, number, place, axes }));
    }
    let ends: Vec<f64> = [&[0.0], kept, &[1.0]].concat();
    let mut points = points.into_iter().peekable();
    let mut segments = Vec::new();
    for pair in ends.windows(2) {
        let mut own = Vec::new();
        while let Some(point) = points.next_if(|point| point.place < pair[1]) {
            own.push(point);
        }
        segments.push(Segment { start: pair[0], end: pair[1], densities: Vec::new(), points: own });
    }
    segments
}

impl Segment {
    /// Takes the strains and stresses of a row.
    fn look(&mut self, elements: &[Vec<[[f64; 3]; 4]>], order: usize, length: f64) {
        let windows = self.points.len().saturating_sub(order);
        self.densities.resize(windows, 0.0);
        let values: Vec<Values> = self.points.iter().map(|point| point.values(elements)).collect();
        for (k, density) in self.densities.iter_mut().enumerate() {
            let derivative = derivative(&self.points[k..=k + order], &values[k..=k + order], length);
            let energy = (0..6).map(|i| derivative[i] * derivative[6 + i]).sum::<f64>();
            *density = density.max(energy);
        }
    }

    /// The place of a window.
    pub fn middle(&self, window: usize, order: usize) -> f64 {
        0.5 * (self.points[window].place + self.points[window + order].place)
    }

    /// Places with their rho, from start to end; empty where nothing is known.
    pub fn profile(&self, order: usize) -> Vec<(f64, f64)> {
        let (Some(&first), Some(&last)) = (self.densities.first(), self.densities.last()) else { return Vec::new() };
        let inner = self.densities.iter().enumerate().map(|(k, &density)| (self.middle(k, order), density));
        std::iter::once((self.start, first)).chain(inner).chain(std::iter::once((self.end, last))).collect()
    }
}

impl Point {
    /// Its values in section axes.
    fn values(&self, elements: &[Vec<[[f64; 3]; 4]>]) -> Values {
        let mut values = [0.0; 12];
        let Some(own) = elements[self.element].get(self.number) else { return values };
        for (k, vector) in own.iter().enumerate() {
            for (i, value) in values[3 * k..3 * k + 3].iter_mut().enumerate() {
                let axis = self.axes.column(i).0;
                *value = (0..3).map(|j| axis[j] * vector[j]).sum();
            }
        }
        values
    }
}

/// The derivative over the arc length whose order is one less than the number of points.
pub fn derivative(points: &[Point], values: &[Values], length: f64) -> Values {
    let mut differences = values.to_vec();
    for apart in 1..points.len() {
        for k in 0..points.len() - apart {
            // The factor makes a derivative of a divided difference.
            let width = length * (points[k + apart].place - points[k].place) / apart as f64;
            for i in 0..12 {
                differences[k][i] = (differences[k + 1][i] - differences[k][i]) / width;
            }
        }
    }
    differences[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_cubics_are_exact() {
        let points: Vec<Point> = [0.1, 0.2, 0.45, 0.7]
            .into_iter()
            .map(|place| Point { element: 0, number: 0, place, axes: Mat3::IDENTITY })
            .collect();
        let values: Vec<Values> = points.iter().map(|point| [(2.0 * point.place).powi(3); 12]).collect();
        assert!((derivative(&points, &values, 2.0)[0] - 6.0).abs() < 1e-10);
    }
}
