//! Estimates of errors from differences between runs.

use crate::deck::{Accuracy, Deck};
use crate::study::cost::{Sampler, Samples};

/// The order of the error over the step that estimates count on.
const ORDER_IN_TIME: f64 = 1.5;

/// And over the width of elements of an order.
pub fn order_in_space(order: usize) -> f64 {
    order as f64 + 0.5
}

/// The lowest order that is believed.
const LEAST_ORDER: f64 = 0.5;

/// What Newton's method leaves of its tolerance, about: its last iteration does better than it must.
const LEFT_BY_NEWTON: f64 = 1e-2;

/// What Newton's method leaves of all outputs, over the largest value of their kind.
pub fn left_by_newton(deck: &Deck) -> f64 {
    LEFT_BY_NEWTON * largest_tolerance(deck)
}

pub fn largest_tolerance(deck: &Deck) -> f64 {
    deck.stages.iter().map(|stage| stage.tolerance).fold(0.0, f64::max)
}

/// By what the difference to a run with other elements is divided to be the error: `ratio` is that of the widths of the other elements and
/// the own.
pub fn divisor_in_space(ratio: f64, order: usize) -> f64 {
    (ratio.powf(order_in_space(order)) - 1.0).abs()
}

/// And to a run with other steps.
pub fn divisor_in_time(ratio: f64) -> f64 {
    (ratio.powf(ORDER_IN_TIME) - 1.0).abs()
}

/// What the error comes from.
#[derive(Clone, Copy)]
pub enum Source {
    /// The mesh, of elements of an order
    Mesh(usize),
    /// The steps
    Steps,
}

impl Source {
    fn assumed_order(self) -> f64 {
        match self {
            Self::Mesh(order) => order_in_space(order),
            Self::Steps => ORDER_IN_TIME,
        }
    }
}

/// The part of the error of a run that comes from its mesh, or its steps.
#[derive(Clone)]
pub struct Share {
    /// The largest of all outputs, over what is wanted of it; infinite where nothing is known
    pub largest: f64,
    /// Of each output
    pub columns: Vec<f64>,
    /// How many times as large it is for the coarser run that it is known from
    pub growth: f64,
}

impl Share {
    /// Nothing.
    pub fn none(columns: usize) -> Self {
        Self { largest: 0.0, columns: vec![0.0; columns], growth: 1.0 }
    }

    /// Nothing is known.
    pub fn unknown(columns: usize) -> Self {
        Self { largest: f64::INFINITY, ..Self::none(columns) }
    }

    /// That of the coarser run.
    pub fn of_coarser(&self) -> Self {
        let columns = self.columns.iter().map(|error| error * self.growth).collect();
        Self { largest: self.largest * self.growth, columns, growth: 1.0 }
    }
}

/// How an error falls from round to round.
#[derive(Default)]
pub struct Fall {
    /// Of the round before
    before: Option<Difference>,
    /// The order that was seen, if it was lower than the assumed one
    pub low_order: Option<f64>,
}

/// How far a run is from a coarser one.
#[derive(Clone, Copy)]
struct Difference {
    /// Of an element or a step of the run
    width: f64,
    /// And of the coarser one, over that
    ratio: f64,
    /// Over what is wanted
    size: f64,
}

impl Difference {
    /// Of an error that is the width to the power of an order.
    fn of_order(&self, order: f64) -> f64 {
        self.width.powf(order) * (self.ratio.powf(order) - 1.0)
    }
}

impl Fall {
    /// The share of the error of a run of a `width` that a coarser one tells, whose width is `ratio` times that.
    pub fn share(
        &mut self,
        source: Source,
        (width, ratio): (f64, f64),
        (own, coarser): (&Samples, &Samples),
        (sampler, wanted): (&Sampler, &Accuracy),
    ) -> Share {
        let differences = sampler.differences(coarser, own, &sampler.scales(own));
        let size = largest(sampler, wanted, &differences);
        let growth = ratio.powf(self.order(source.assumed_order(), Difference { width, ratio, size }));
        let columns = differences.iter().map(|difference| difference / (growth - 1.0)).collect();
        Share { largest: size / (growth - 1.0), columns, growth }
    }

    /// The order that an error falls with: the assumed one, or that from round to round where it is lower. Waves with fronts, for one, have a
    /// low one.
    fn order(&mut self, assumed: f64, now: Difference) -> f64 {
        match self.before {
            // Nothing new is seen of the same width.
            Some(before) if before.width == now.width => {}
            Some(before) if before.width > now.width => self.low_order = low_order(assumed, before, now),
            Some(before) => self.low_order = low_order(assumed, now, before),
            None => {}
        }
        self.before = Some(now);
        self.low_order.unwrap_or(assumed)
    }
}

/// The order from a difference of a coarse run and of a fine one, if it is lower than that which is assumed: the two need not have the same
/// ratio, so it is sought by halves.
fn low_order(assumed: f64, coarse: Difference, fine: Difference) -> Option<f64> {
    let too_high = |order| coarse.of_order(order) * fine.size > fine.of_order(order) * coarse.size;
    let halve = |(low, high): (f64, f64), _| match 0.5 * (low + high) {
        middle if too_high(middle) => (low, middle),
        middle => (middle, high),
    };
    too_high(assumed).then(|| (0..20).fold((LEAST_ORDER, assumed), halve).0)
}

/// The largest over what is wanted; infinite where nothing can be compared: columns that are always zero cannot.
fn largest(sampler: &Sampler, wanted: &Accuracy, differences: &[f64]) -> f64 {
    let over = |&k: &usize| differences[k] / wanted.of(&sampler.columns[k]);
    let largest = sampler.outputs.iter().map(over).fold(f64::NAN, f64::max);
    if largest.is_nan() { f64::INFINITY } else { largest }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a fall makes of errors of an order on meshes of these widths, each compared with one of `ratio` times the width.
    fn orders(assumed: f64, order: f64, meshes: &[(f64, f64)]) -> Vec<f64> {
        let mut fall = Fall::default();
        let seen = |&(width, ratio): &(f64, f64)| {
            let size = Difference { width, ratio, size: 0.0 }.of_order(order);
            fall.order(assumed, Difference { width, ratio, size })
        };
        meshes.iter().map(seen).collect()
    }

    #[test]
    fn the_assumed_order_is_believed_unless_a_lower_one_is_seen() {
        // Companions are not always twice as wide, and a search goes back to wider elements too.
        let meshes = [(1.0 / 3.0, 1.5), (0.25, 2.0), (0.2, 5.0 / 3.0), (0.5, 2.0), (0.5, 2.0), (0.125, 2.0)];
        assert_eq!(orders(3.5, 4.0, &meshes), [3.5; 6]);
        for order in orders(2.5, 1.0, &meshes)[1..].iter() {
            assert!((order - 1.0).abs() < 1e-5, "{order}");
        }
        assert!(orders(2.5, 0.1, &meshes)[1..].iter().all(|&order| (order - LEAST_ORDER).abs() < 1e-5));
    }
}
