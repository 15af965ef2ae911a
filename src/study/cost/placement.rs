//! Elements placed by the needs of a scene: short ones where the solution varies fast.

use crate::deck::Division;

/// The places of element ends are rounded to this part of a piece, so that settings are short.
const ROUNDED_TO: f64 = 1e-5;
/// Places are not rounded where elements are shorter than so many roundings.
const LEAST_ROUNDINGS: f64 = 100.0;

/// The elements of a scene, piece by piece of each beam, for any number of elements.
#[derive(Debug, PartialEq)]
pub struct Placement {
    /// The pieces of each beam
    pub(crate) beams: Vec<Vec<PlacedPiece>>,
}

/// The elements of a piece, for any number of them.
#[derive(Debug, PartialEq)]
pub struct PlacedPiece {
    /// Its part of all elements of the scene
    pub(crate) share: f64,
    /// The shape of its elements, as many small parts
    pub(crate) shape: Division,
    /// Places inside the piece at which an element must end
    pub(crate) kept: Vec<f64>,
    /// The number of elements is a multiple of this, so that elements end at the kept places.
    pub(crate) unit: usize,
}

impl Placement {
    /// The numbers of elements of all pieces for about this number in the whole scene.
    pub fn counts(&self, all: f64) -> Vec<Vec<usize>> {
        let of_piece = |piece: &PlacedPiece| {
            let units = (piece.share * all / piece.unit as f64).round().max(1.0);
            units as usize * piece.unit
        };
        self.beams.iter().map(|pieces| pieces.iter().map(of_piece).collect()).collect()
    }

    /// The number that the elements of a piece must be a multiple of.
    pub fn unit(&self, beam: usize, piece: usize) -> usize {
        self.beams[beam][piece].unit
    }

    /// The elements of a piece.
    pub fn division(&self, beam: usize, piece: usize, count: usize) -> Division {
        self.beams[beam][piece].division(count)
    }
}

impl PlacedPiece {
    fn division(&self, count: usize) -> Division {
        if count == 1 {
            return Division::Equal(1);
        }
        let exact = self.shape.with_count(count);
        let shortest = (0..count).map(|k| exact.end(k + 1) - exact.end(k)).fold(1.0, f64::min);
        if shortest < LEAST_ROUNDINGS * ROUNDED_TO {
            return exact;
        }
        // A decimal number divided by a power of ten is the nearest one to that decimal number.
        let rounded = |place: f64| (place / ROUNDED_TO).round() / (1.0 / ROUNDED_TO).round();
        let is_kept = |place: f64| self.kept.iter().any(|kept| (kept - place).abs() < 1e-12);
        let place = |k: usize| if is_kept(exact.end(k)) { exact.end(k) } else { rounded(exact.end(k)) };
        Division::At((1..count).map(place).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placed_elements_are_divided_where_elements_end() {
        let shape = Division::At(vec![0.1, 1.0 / 3.0, 0.55, 0.7, 0.9]);
        let piece = PlacedPiece { share: 0.75, shape, kept: vec![1.0 / 3.0], unit: 3 };
        let other = PlacedPiece { share: 0.25, shape: Division::Equal(8), kept: Vec::new(), unit: 1 };
        let placement = Placement { beams: vec![vec![piece, other]] };
        assert_eq!(placement.counts(8.0), [[6, 2]]);
        assert_eq!(placement.counts(0.1), [[3, 1]]);
        assert_eq!(placement.division(0, 0, 3), Division::At(vec![1.0 / 3.0, 0.7]));
        let fine = placement.division(0, 0, 12);
        assert_eq!((fine.end(1), fine.end(2), fine.end(4)), (0.05, 0.1, 1.0 / 3.0));
        assert_eq!(placement.division(0, 1, 1), Division::Equal(1));
    }
}
