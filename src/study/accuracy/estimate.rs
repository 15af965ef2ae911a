//! Estimates of errors from differences between runs.

use crate::deck::{Accuracy, Deck};
use crate::study::cost::{Sampler, Samples};
use crate::study::scale::mesh_error;
use beamsim_core::probe::MeshError;

/// The order of the error over the step that estimates count on, and that of smooth motions.
const ORDER_IN_TIME: f64 = 1.5;
const SMOOTH_IN_TIME: f64 = 2.0;

/// What a column tells of, as far as its error falls with the width of elements.
#[derive(Clone, Copy, PartialEq)]
enum Falls {
    /// Where nodes are, and what follows from it
    Places,
    /// Resultants: they follow slopes, and fall with one order less
    Slopes,
}

impl Falls {
    const ALL: [Self; 2] = [Self::Places, Self::Slopes];

    fn of(column: &str) -> Self {
        match mesh_error(column) {
            MeshError::Slopes => Self::Slopes,
            MeshError::Nodes | MeshError::Unspecified => Self::Places,
        }
    }

    /// The order over the width of elements of an order that is assumed, and that at nodes of smooth scenes.
    fn in_space(self, order: usize) -> (f64, f64) {
        let order = order as f64;
        match self {
            Self::Places => (order + 0.5, 2.0 * order),
            Self::Slopes => (order - 0.5, order),
        }
    }
}

/// The lowest order that is believed.
const LEAST_ORDER: f64 = 0.5;

/// What Newton's method leaves of its tolerance, about: its last iteration does better than it must, though with a kept tangent not by much.
const LEFT_BY_NEWTON: f64 = 0.2;

/// What Newton's method leaves of all outputs, over the largest value of their kind.
pub fn left_by_newton(deck: &Deck) -> f64 {
    LEFT_BY_NEWTON * largest_tolerance(deck)
}

pub fn largest_tolerance(deck: &Deck) -> f64 {
    deck.stages.iter().map(|stage| stage.tolerance).fold(0.0, f64::max)
}

/// By what differences of columns to a run with other elements are divided to be errors: `ratio` is that of the widths of the other
/// elements and the own; columns that lie `between` nodes may be nodes there, or nearer to one.
pub fn divisors_in_space(ratio: f64, order: usize, columns: &[String], between: &[bool]) -> Vec<f64> {
    let divisor = |(column, &between): (&String, &bool)| {
        if between { ratio.min(1.0) } else { (ratio.powf(Falls::of(column).in_space(order).0) - 1.0).abs() }
    };
    columns.iter().zip(between).map(divisor).collect()
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
    /// The order that is assumed, and that at nodes of smooth scenes.
    fn orders(self, falls: Falls) -> (f64, f64) {
        match self {
            Self::Mesh(order) => falls.in_space(order),
            Self::Steps => (ORDER_IN_TIME, SMOOTH_IN_TIME),
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
    /// The same of the coarser run that it is known from
    coarser: (f64, Vec<f64>),
}

impl Share {
    /// Nothing.
    pub fn none(columns: usize) -> Self {
        Self { largest: 0.0, columns: vec![0.0; columns], coarser: (0.0, vec![0.0; columns]) }
    }

    /// Nothing is known.
    pub fn unknown(columns: usize) -> Self {
        let none = Self::none(columns);
        Self { largest: f64::INFINITY, coarser: (f64::INFINITY, none.coarser.1), ..none }
    }

    /// That of the coarser run.
    pub fn of_coarser(&self) -> Self {
        let (largest, columns) = self.coarser.clone();
        Self { largest, columns, coarser: self.coarser.clone() }
    }
}

/// How an error falls from round to round.
#[derive(Default)]
pub struct Fall {
    /// By what columns tell of
    traces: [Trace; 2],
    /// Which of them has the largest error
    leading: usize,
}

/// How the largest error of some columns falls.
#[derive(Default)]
struct Trace {
    /// Of the round before
    before: Option<Difference>,
    /// The order that was seen from round to round
    seen: Option<f64>,
    /// That, if it was lower than the assumed one
    low: Option<f64>,
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
    /// The order that was seen of the largest error, if it was lower than the assumed one.
    pub fn low_order(&self) -> Option<f64> {
        self.traces[self.leading].low
    }

    /// Half way from the order that estimates of the largest error count on to that of smooth scenes, for elements of an order; and that.
    pub fn planned_orders(&self, order: usize) -> (f64, f64) {
        let (assumed, smooth) = Falls::ALL[self.leading].in_space(order);
        (0.5 * (assumed + smooth), smooth)
    }

    /// The share of the error of a run of a `width` that a coarser one tells, whose width is `ratio` times that.
    pub fn share(
        &mut self,
        source: Source,
        (width, ratio): (f64, f64),
        (own, coarser): (&Samples, &Samples),
        (sampler, wanted, between): (&Sampler, &Accuracy, &[bool]),
    ) -> Share {
        let mut differences = sampler.differences(coarser, own, &sampler.scales(own));
        let mut of_coarser = differences.clone();
        let falls: Vec<Falls> = sampler.columns.iter().map(|column| Falls::of(column)).collect();
        let mut largest = [f64::NAN; 2];
        let mut coarser = f64::NAN;
        // What is interpolated may differ by its error from a node of the other mesh.
        let interpolated = largest_of(sampler, wanted, &differences, |k| between[k]);
        for k in (0..falls.len()).filter(|&k| between[k]) {
            of_coarser[k] = 2.0 * differences[k];
        }
        for (number, one) in Falls::ALL.into_iter().enumerate() {
            let is_of = |k: usize| falls[k] == one && !between[k];
            let size = largest_of(sampler, wanted, &differences, is_of);
            if size.is_nan() {
                continue;
            }
            let growth = ratio.powf(self.traces[number].order(source.orders(one), Difference { width, ratio, size }));
            for k in (0..falls.len()).filter(|&k| is_of(k)) {
                differences[k] /= growth - 1.0;
                of_coarser[k] = differences[k] * growth;
            }
            largest[number] = size / (growth - 1.0);
            coarser = coarser.max(largest[number] * growth);
        }
        let rank = |value: f64| if value.is_nan() { -1.0 } else { value };
        self.leading = usize::from(rank(largest[1]) > rank(largest[0]));
        let known = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        Share {
            largest: known(largest[0].max(largest[1]).max(interpolated)),
            columns: differences,
            coarser: (known(coarser.max(2.0 * interpolated)), of_coarser),
        }
    }
}

impl Trace {
    /// The order that an error is taken to fall with: the assumed one, or what was seen from round to round where that is lower, as it is
    /// for waves with fronts; half way to it where it is higher.
    fn order(&mut self, (assumed, smooth): (f64, f64), now: Difference) -> f64 {
        match self.before {
            // Nothing new is seen of the same width.
            Some(before) if before.width == now.width => {}
            Some(before) if before.width > now.width => self.seen = Some(seen_order(smooth, before, now)),
            Some(before) => self.seen = Some(seen_order(smooth, now, before)),
            None => {}
        }
        self.before = Some(now);
        self.low = self.seen.filter(|&seen| seen < assumed);
        self.low.unwrap_or(0.5 * (assumed + self.seen.unwrap_or(assumed)))
    }
}

/// The order that explains a difference of a coarse run and one of a fine run, not above that of smooth scenes: the two need not have the
/// same ratio, so it is sought by halves.
fn seen_order(smooth: f64, coarse: Difference, fine: Difference) -> f64 {
    let too_high = |order| coarse.of_order(order) * fine.size > fine.of_order(order) * coarse.size;
    let halve = |(low, high): (f64, f64), _| match 0.5 * (low + high) {
        middle if too_high(middle) => (low, middle),
        middle => (middle, high),
    };
    if too_high(smooth) { (0..20).fold((LEAST_ORDER, smooth), halve).0 } else { smooth }
}

/// The largest of some columns over what is wanted; NaN where nothing can be compared: columns that are always zero cannot.
fn largest_of(sampler: &Sampler, wanted: &Accuracy, differences: &[f64], of: impl Fn(usize) -> bool) -> f64 {
    let over = |&k: &usize| differences[k] / wanted.of(&sampler.columns[k]);
    sampler.outputs.iter().filter(|&&k| of(k)).map(over).fold(f64::NAN, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a fall makes of errors of an order on meshes of these widths, each compared with one of `ratio` times the width.
    fn orders(believed: (f64, f64), order: f64, meshes: &[(f64, f64)]) -> Vec<f64> {
        let mut fall = Trace::default();
        let seen = |&(width, ratio): &(f64, f64)| {
            let size = Difference { width, ratio, size: 0.0 }.of_order(order);
            fall.order(believed, Difference { width, ratio, size })
        };
        meshes.iter().map(seen).collect()
    }

    #[test]
    fn a_lower_order_is_believed_and_a_higher_one_half() {
        // Companions are not always twice as wide, and a search goes back to wider elements too.
        let meshes = [(1.0 / 3.0, 1.5), (0.25, 2.0), (0.2, 5.0 / 3.0), (0.5, 2.0), (0.5, 2.0), (0.125, 2.0)];
        let near = |order: f64, of: f64| (order - of).abs() < 1e-5;
        for (order, believed) in [(0.1, LEAST_ORDER), (1.0, 1.0), (2.5, 2.5), (3.0, 2.75), (4.0, 3.25), (7.0, 3.25)] {
            let all = orders((2.5, 4.0), order, &meshes);
            assert!(all[0] == 2.5 && all[1..].iter().all(|&seen| near(seen, believed)), "{order}: {all:?}");
        }
    }
}
