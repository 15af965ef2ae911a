//! Where outputs lie on beams: at nodes of a mesh, or between them, where elements of its order only come near.

use crate::deck::Deck;
use crate::scene::{Scene, Spot};

/// How far a node may lie from where it is looked for, in elements.
const AT_NODE: f64 = 1e-6;

/// The places of columns on beams, for those that name one.
pub struct Places(Vec<Option<Spot>>);

impl Places {
    /// Those of the columns of a scene.
    pub fn of(deck: &Deck, scene: &Scene, columns: &[String]) -> Self {
        let spot = |column: &String| {
            // Behind a space stands at which row it is looked at.
            let (place, _) = column.split(' ').next()?.rsplit_once('.')?;
            scene.mesh.spot(deck, place)
        };
        Self(columns.iter().map(spot).collect())
    }

    /// Of how many elements, of an order, those of a piece of a beam must be a multiple for the outputs on it to stay nodes that are nodes of
    /// the deck's mesh; one where that is more than `most`.
    pub fn unit(&self, (beam, piece): (usize, usize), order: usize, outputs: &[usize], most: usize) -> usize {
        let counts = |k: &usize| outputs.is_empty() || outputs.contains(k);
        let here = |spot: &&Spot| spot.is_node && (spot.beam, spot.piece) == (beam, piece);
        let all = || self.0.iter().enumerate().filter(|(k, _)| counts(k)).filter_map(|(_, spot)| spot.as_ref());
        let kept: Vec<f64> = all().filter(here).map(|spot| spot.along).collect();
        (1..=most).find(|&count| kept.iter().all(|&along| is_node(along, count * order))).unwrap_or(1)
    }

    /// For each column whether it lies between nodes of a mesh, whose beams have these orders.
    pub fn between(&self, elements: &[Vec<usize>], orders: &[usize]) -> Vec<bool> {
        let lies_between = |spot: &Spot| {
            let count = elements.get(spot.beam).and_then(|pieces| pieces.get(spot.piece));
            count.zip(orders.get(spot.beam)).is_some_and(|(count, order)| !is_node(spot.along, count * order))
        };
        self.0.iter().map(|spot| spot.as_ref().is_some_and(lies_between)).collect()
    }
}

/// Whether there is a node so far along a piece of so many equal parts.
fn is_node(along: f64, parts: usize) -> bool {
    let x = along * parts as f64;
    (x - x.round()).abs() < AT_NODE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_a_mesh_stay_nodes_of_its_multiples() {
        let spot = |along, is_node| Some(Spot { beam: 0, piece: 1, along, is_node });
        let places = Places(vec![None, spot(0.5, true), spot(1.0 / 3.0, true), spot(0.37, false)]);
        let unit = |order, outputs: &[usize], most| places.unit((0, 1), order, outputs, most);
        assert_eq!((unit(1, &[], 10), unit(2, &[], 10), unit(3, &[], 10)), (6, 3, 2));
        assert_eq!((unit(1, &[1], 10), unit(1, &[], 5), places.unit((0, 0), 1, &[], 10)), (2, 1, 1));
        assert_eq!(places.between(&[vec![1, 4]], &[3]), [false, false, false, true]);
        assert_eq!(places.between(&[vec![1, 3]], &[1]), [false, true, false, true]);
    }
}
