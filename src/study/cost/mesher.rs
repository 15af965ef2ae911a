//! Meshes on which a deck can run: every load, support and output finds its node.

use super::placement::Placement;
use super::places::Piece;
use super::sample::Sampler;
use super::trial;
use super::variant::{Family, Original, Pace, Variant};
use crate::deck::{Beam, InterpolationWord};
use std::sync::Arc;

/// The largest divisor of the deck's numbers of elements that is tried for a coarser mesh, and the
/// number of multiples for a finer one.
const MOST_PARTS: usize = 8;

/// A mesh that another one is compared with.
pub struct Companion {
    /// Elements of each piece of each beam
    pub(crate) elements: Vec<Vec<usize>>,
    /// The width of its elements over that of the other mesh, at least; below 1 for a finer mesh
    pub(crate) ratio: f64,
}

/// Finds meshes of a deck with nodes where something acts.
pub struct Mesher<'a> {
    /// The deck
    pub(crate) original: Original<'a>,
    /// The outputs that are compared
    pub(crate) sampler: &'a Sampler,
    /// The interpolation of all beams; `None` for those of the deck
    pub(crate) interpolation: Option<InterpolationWord>,
    /// True if outputs at nodes of the deck's mesh must be at nodes of other meshes, too
    pub(crate) keeps_places: bool,
    /// The places of the elements; `None` for the shape of the deck's mesh
    pub(crate) placement: Option<Arc<Placement>>,
}

impl Mesher<'_> {
    /// Elements of each piece of each beam for a factor times the nodes of the deck. Where a load,
    /// support or output would lose its node, a divisor or a multiple of the deck's elements is
    /// taken instead.
    pub fn elements(&self, order: Option<usize>, factor: f64) -> Vec<Vec<usize>> {
        let ratio = |beam: &Beam| (beam.order as f64 / order.unwrap_or(beam.order) as f64) * factor;
        if let Some(placement) = &self.placement {
            let of_beam = |beam: &Beam| ratio(beam) * element_count(beam) as f64;
            return placement.counts(self.original.deck.beams.iter().map(of_beam).sum());
        }
        let each = |count: &dyn Fn(&Beam, usize) -> usize| -> Vec<Vec<usize>> {
            let of_beam =
                |beam: &Beam| beam.elements.value.iter().map(|division| count(beam, division.count())).collect();
            self.original.deck.beams.iter().map(of_beam).collect()
        };
        let rounded = each(&|beam, n| (n as f64 * ratio(beam)).round().max(1.0) as usize);
        let rounded = self.by_units(order, &rounded, |count, unit| ((count + unit / 2) / unit).max(1) * unit);
        if self.makes_sense(order, &rounded) {
            return rounded;
        }
        let parts = (2..=MOST_PARTS).rev().filter(|q| {
            let whole = |beam: &Beam| {
                *q as f64 * ratio(beam) <= 1.0 && beam.elements.value.iter().all(|division| division.count() % q == 0)
            };
            self.original.deck.beams.iter().all(whole)
        });
        let parts = parts.map(|q| each(&|_, n| n / q));
        let multiples = (0..MOST_PARTS).map(|more| each(&|beam, n| n * (ratio(beam).ceil() as usize + more)));
        parts.chain(multiples).find(|elements| self.makes_sense(order, elements)).unwrap_or(rounded)
    }

    /// A mesh to compare another with: it has half the elements of each piece, or twice as many
    /// where some piece has only one.
    pub fn companion(&self, order: Option<usize>, elements: &[Vec<usize>]) -> Companion {
        let each = |change: &dyn Fn(usize) -> usize| -> Vec<Vec<usize>> {
            elements.iter().map(|beam| beam.iter().map(|&count| change(count)).collect()).collect()
        };
        let coarse = self.by_units(order, elements, |count, unit| match count % unit {
            0 => (count / unit).div_ceil(2) * unit,
            _ => count.div_ceil(2),
        });
        let pairs = elements.iter().flatten().zip(coarse.iter().flatten());
        let ratio = pairs.map(|(&fine, &coarse)| fine as f64 / coarse as f64).fold(2.0, f64::min);
        if ratio > 1.0 && self.makes_sense(order, &coarse) {
            return Companion { elements: coarse, ratio };
        }
        Companion { elements: each(&|count| count.saturating_mul(2)), ratio: 0.5 }
    }

    /// Changes the numbers of elements; `change` takes a number and the unit that the new one must
    /// be a multiple of.
    fn by_units(
        &self,
        order: Option<usize>,
        elements: &[Vec<usize>],
        change: impl Fn(usize, usize) -> usize,
    ) -> Vec<Vec<usize>> {
        let orders = self.orders(order);
        let of_piece = |beam: usize, piece: usize, count: usize| {
            let Sampler { places, outputs, .. } = self.sampler;
            let unit = if let Some(placement) = &self.placement {
                placement.unit(beam, piece)
            } else {
                let outputs = self.keeps_places.then_some(&outputs[..]);
                places.unit(Piece { beam, number: piece }, orders[beam], outputs, 2 * count)
            };
            change(count, unit)
        };
        let of_beam = |(beam, counts): (usize, &Vec<usize>)| {
            counts.iter().enumerate().map(|(piece, &count)| of_piece(beam, piece, count)).collect()
        };
        elements.iter().enumerate().map(of_beam).collect()
    }

    /// The orders of all beams.
    fn orders(&self, order: Option<usize>) -> Vec<usize> {
        self.original.deck.beams.iter().map(|beam| order.unwrap_or(beam.order)).collect()
    }

    /// For each column: true if it lies between nodes of a mesh.
    pub fn between(&self, order: Option<usize>, elements: &[Vec<usize>]) -> Vec<bool> {
        // Placed elements have other inner nodes than equal ones.
        let orders = if self.placement.is_some() { self.orders(Some(1)) } else { self.orders(order) };
        self.sampler.places.between(elements, &orders)
    }

    /// True if the deck can run with these elements of an order.
    pub fn makes_sense(&self, order: Option<usize>, elements: &[Vec<usize>]) -> bool {
        let family = Family { order, interpolation: self.interpolation, ..Family::default() };
        let placement = self.placement.clone();
        let variant = Variant { placement, ..Variant::new(family, elements.to_vec(), Pace::Timeless) };
        trial::makes_sense(self.original, &variant, self.sampler)
    }
}

/// The number of elements of a beam in the deck.
fn element_count(beam: &Beam) -> usize {
    (0..beam.pieces()).map(|piece| beam.elements_of(piece).count()).sum()
}
