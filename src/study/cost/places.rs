//! Positions of outputs on beams: at nodes of a mesh, or between them, where values are
//! interpolated.

use crate::deck::Deck;
use crate::scene::{Scene, Spot};

/// Tolerance for the position of a node, in elements.
const AT_NODE: f64 = 1e-6;

/// A piece of a beam, both numbered from 0.
#[derive(Clone, Copy)]
pub struct Piece {
    /// The beam
    pub(super) beam: usize,
    /// The piece
    pub(super) number: usize,
}

/// The positions of columns on beams, where their names have one.
pub struct Places(Vec<Option<Spot>>);

impl Places {
    /// The positions of the columns of a scene.
    pub fn of(deck: &Deck, scene: &Scene, columns: &[String]) -> Self {
        let spot = |column: &String| {
            // After a space the name tells the row of an expectation.
            let (place, _) = column.split(' ').next()?.rsplit_once('.')?;
            scene.mesh.spot(deck, place)
        };
        Self(columns.iter().map(spot).collect())
    }

    /// The smallest number of elements of an order that gives a piece of a beam nodes at all
    /// outputs that are nodes of the deck's mesh; its multiples do too. 1 where it would be more
    /// than `most`.
    pub fn unit(&self, piece: Piece, order: usize, outputs: &[usize], most: usize) -> usize {
        let counts = |k: &usize| outputs.is_empty() || outputs.contains(k);
        let here = |spot: &&Spot| spot.is_node && spot.beam == piece.beam && spot.piece == piece.number;
        let all = || self.0.iter().enumerate().filter(|(k, _)| counts(k)).filter_map(|(_, spot)| spot.as_ref());
        let kept: Vec<&Spot> = all().filter(here).collect();
        (1..=most).find(|&count| kept.iter().all(|spot| is_node(spot, count, order))).unwrap_or(1)
    }

    /// For each column: true if it lies between nodes of a mesh whose beams have these orders.
    pub fn between(&self, elements: &[Vec<usize>], orders: &[usize]) -> Vec<bool> {
        let lies_between = |spot: &Spot| {
            let count = elements.get(spot.beam).and_then(|pieces| pieces.get(spot.piece));
            count.zip(orders.get(spot.beam)).is_some_and(|(&count, &order)| !is_node(spot, count, order))
        };
        self.0.iter().map(|spot| spot.as_ref().is_some_and(lies_between)).collect()
    }
}

/// True if there is a node at a position when its piece has so many elements of an order. Elements
/// of different lengths have inner nodes in common only if one lies within the other.
fn is_node(spot: &Spot, count: usize, order: usize) -> bool {
    let is_end_of_one = |parts: usize| {
        let x = spot.along * parts as f64;
        (x - x.round()).abs() < AT_NODE
    };
    match spot.graded {
        Some(own) if !count.is_multiple_of(own) => is_end_of_one(count),
        Some(_) | None => is_end_of_one(count * order),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_a_mesh_stay_nodes_of_its_multiples() {
        let spot = |along, is_node| Some(Spot { beam: 0, piece: 1, along, is_node, graded: None });
        let places = Places(vec![None, spot(0.5, true), spot(1.0 / 3.0, true), spot(0.37, false)]);
        let unit = |order, outputs: &[usize], most| places.unit(Piece { beam: 0, number: 1 }, order, outputs, most);
        assert_eq!((unit(1, &[], 10), unit(2, &[], 10), unit(3, &[], 10)), (6, 3, 2));
        assert_eq!(
            (unit(1, &[1], 10), unit(1, &[], 5), places.unit(Piece { beam: 0, number: 0 }, 1, &[], 10)),
            (2, 1, 1)
        );
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
