//! Positions of outputs on beams: at nodes of a mesh, or between them, where values are
//! interpolated; and of stations of sections, where properties have kinks.

use crate::deck::{Deck, Division};
use crate::scene::{Scene, Spot};
use crate::study::strains::{AT_END, is_end, station_places};

/// The largest number of elements of a piece without which its stations are none of their ends.
const LARGEST_UNIT: usize = 64;

/// A piece of a beam, both numbered from 0.
#[derive(Clone, Copy, PartialEq)]
pub struct Piece {
    /// The beam
    pub(super) beam: usize,
    /// The piece
    pub(super) number: usize,
}

/// The positions of columns on beams, where their names have one, and of stations.
pub struct Places {
    columns: Vec<Option<Spot>>,
    /// Stations within pieces of equal elements: the piece, and the part of its length. An error falls with its full
    /// order only where elements end there.
    stations: Vec<(Piece, f64)>,
}

impl Places {
    /// The positions of the columns of a scene.
    pub fn of(deck: &Deck, scene: &Scene, columns: &[String]) -> Self {
        let spot = |column: &String| {
            // After a space the name tells the row of an expectation.
            let (place, _) = column.split(' ').next()?.rsplit_once('.')?;
            scene.mesh.spot(deck, place)
        };
        Self { columns: columns.iter().map(spot).collect(), stations: stations(deck, scene) }
    }

    /// The smallest number of elements of an order that gives a piece of a beam nodes at all outputs that are nodes of the
    /// deck's mesh (of these columns, or of all if there are none; `None`: at no outputs), and ends of elements at its
    /// stations; its multiples do too. Where that would be more than `most` and 64, the stations do not count, and it is 1
    /// where even that would be more than `most`.
    pub fn unit(&self, piece: Piece, order: usize, outputs: Option<&[usize]>, most: usize) -> usize {
        let counts = |k: &usize| outputs.is_some_and(|outputs| outputs.is_empty() || outputs.contains(k));
        let here = |spot: &&Spot| spot.is_node && spot.beam == piece.beam && spot.piece == piece.number;
        let all = self.columns.iter().enumerate().filter(|(k, _)| counts(k)).filter_map(|(_, spot)| spot.as_ref());
        let kept: Vec<&Spot> = all.filter(here).collect();
        let stations = self.stations.iter().filter(|(other, _)| *other == piece);
        let stations: Vec<f64> = stations.map(|&(_, along)| along).collect();
        let has_nodes = |count: &usize| kept.iter().all(|spot| is_node(spot, *count, order));
        let ends_there = |count: &usize| stations.iter().all(|&along| is_end(along, *count));
        let most_with_stations = if stations.is_empty() { most } else { most.max(LARGEST_UNIT) };
        (1..=most_with_stations)
            .find(|count| has_nodes(count) && ends_there(count))
            .or_else(|| (1..=most).find(has_nodes))
            .unwrap_or(1)
    }

    /// For each column: true if it lies between nodes of a mesh whose beams have these orders.
    pub fn between(&self, elements: &[Vec<usize>], orders: &[usize]) -> Vec<bool> {
        let lies_between = |spot: &Spot| {
            let count = elements.get(spot.beam).and_then(|pieces| pieces.get(spot.piece));
            count.zip(orders.get(spot.beam)).is_some_and(|(&count, &order)| !is_node(spot, count, order))
        };
        self.columns.iter().map(|spot| spot.as_ref().is_some_and(lies_between)).collect()
    }
}

/// True if there is a node at a position when its piece has so many elements of an order. Elements
/// of different lengths have inner nodes in common only if one lies within the other.
fn is_node(spot: &Spot, count: usize, order: usize) -> bool {
    match spot.graded {
        Some(own) if !count.is_multiple_of(own) => is_end(spot.along, count),
        Some(_) | None => is_end(spot.along, count * order),
    }
}

/// The stations of all beams within pieces of equal elements.
fn stations(deck: &Deck, scene: &Scene) -> Vec<(Piece, f64)> {
    let mut found = Vec::new();
    for (beam, (own, meshed)) in deck.beams.iter().zip(&scene.mesh.beams).enumerate() {
        for (number, along) in station_places(own, meshed) {
            let is_inside = along > AT_END && along < 1.0 - AT_END;
            if is_inside && matches!(own.elements_of(number), Division::Equal(_)) {
                found.push((Piece { beam, number }, along));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_a_mesh_stay_nodes_of_its_multiples() {
        let spot = |along, is_node| Some(Spot { beam: 0, piece: 1, along, is_node, graded: None });
        let columns = vec![None, spot(0.5, true), spot(1.0 / 3.0, true), spot(0.37, false)];
        let places = Places { columns, stations: vec![(Piece { beam: 0, number: 2 }, 0.75)] };
        let unit =
            |order, outputs: &[usize], most| places.unit(Piece { beam: 0, number: 1 }, order, Some(outputs), most);
        assert_eq!((unit(1, &[], 10), unit(2, &[], 10), unit(3, &[], 10)), (6, 3, 2));
        assert_eq!(
            (unit(1, &[1], 10), unit(1, &[], 5), places.unit(Piece { beam: 0, number: 0 }, 1, Some(&[]), 10)),
            (2, 1, 1)
        );
        let at_station = |order, most| places.unit(Piece { beam: 0, number: 2 }, order, None, most);
        assert_eq!((at_station(1, 10), at_station(3, 10), at_station(1, 3)), (4, 4, 4));
        assert_eq!(places.between(&[vec![1, 4]], &[3]), [false, false, false, true]);
        assert_eq!(places.between(&[vec![1, 3]], &[1]), [false, true, false, true]);
    }

    #[test]
    fn inner_nodes_of_graded_elements_stay_only_within_divided_elements() {
        let spot = |along| Spot { beam: 0, piece: 0, along, is_node: true, graded: Some(4) };
        let end = spot(0.5);
        let inner = spot(0.375);
        assert!(is_node(&end, 2, 1) && is_node(&end, 4, 2) && !is_node(&end, 3, 1));
        assert!(is_node(&inner, 4, 2) && is_node(&inner, 8, 1) && !is_node(&inner, 2, 4));
    }
}
