//! Estimates of errors from differences between runs.

use crate::deck::{Accuracy, Deck};
use crate::study::cost::{Sampler, Samples};
use crate::study::scale::mesh_error;
use beamsim_core::effect::ForceJump;
use beamsim_core::probe::MeshError;

/// The order of the error over the step that is assumed, of any scheme: vibrations that steps do not
/// resolve err by second order.
const ASSUMED_TIME_ORDER: f64 = 1.5;

/// The order of the error over the step where something jumps within steps, of any scheme.
pub fn jump_order(jump: ForceJump) -> f64 {
    match jump {
        ForceJump::Slope => 2.0,
        ForceJump::Force => 1.0,
    }
}

/// Orders of the error over a width.
#[derive(Clone, Copy, Debug)]
pub struct Orders {
    /// The order that estimates assume
    pub(super) assumed: f64,
    /// The order for smooth solutions, at nodes
    pub(super) smooth: f64,
}

/// Kinds of columns by the order of their error over the width of elements.
#[derive(Clone, Copy, PartialEq)]
enum Falls {
    /// Motions of nodes, and other columns that are not resultants
    Places,
    /// Resultants, strains and stresses: they depend on slopes
    Slopes,
}

impl Falls {
    const ALL: [Self; 2] = [Self::Places, Self::Slopes];

    fn of(column: &str) -> Self {
        match mesh_error(column) {
            MeshError::Slopes => Self::Slopes,
            MeshError::Nodes | MeshError::Unspecified | MeshError::Jumps => Self::Places,
        }
    }

    /// The orders for elements of an order.
    fn in_space(self, order: usize) -> Orders {
        let order = order as f64;
        match self {
            Self::Places => Orders { assumed: order + 0.5, smooth: 2.0 * order },
            // Elements of two nodes gain an order by balance, where they can.
            Self::Slopes => Orders { assumed: (order - 0.5).max(1.0), smooth: order.max(2.0) },
        }
    }
}

/// The lowest order that estimates use.
const LEAST_ORDER: f64 = 0.5;

/// The usual error of Newton's method over its tolerance: the last iteration reaches less than the
/// tolerance, but with a kept tangent not much less.
const LEFT_BY_NEWTON: f64 = 0.2;

/// The error of Newton's method in all outputs, relative to the largest value of their kind.
pub fn left_by_newton(deck: &Deck) -> f64 {
    LEFT_BY_NEWTON * largest_tolerance(deck)
}

/// The largest tolerance of Newton's method in all stages.
pub fn largest_tolerance(deck: &Deck) -> f64 {
    deck.stages.iter().map(|stage| stage.tolerance).fold(0.0, f64::max)
}

/// For each column: the difference to a run with other elements over this is the error. `ratio` is
/// the width of the other elements over that of the own ones. Columns that lie `between` nodes may
/// be at or near nodes of the other mesh.
pub fn divisors_in_space(ratio: f64, order: usize, columns: &[String], between: &[bool]) -> Vec<f64> {
    let divisor = |(column, &between): (&String, &bool)| {
        if between { ratio.min(1.0) } else { (ratio.powf(Falls::of(column).in_space(order).assumed) - 1.0).abs() }
    };
    columns.iter().zip(between).map(divisor).collect()
}

/// The difference to a run with other steps over this is the error.
pub fn divisor_in_time(ratio: f64) -> f64 {
    (ratio.powf(ASSUMED_TIME_ORDER) - 1.0).abs()
}

/// A source of errors.
#[derive(Clone, Copy)]
pub enum Source {
    /// The mesh, of elements of an order
    Mesh(usize),
    /// The steps, of a scheme of an order
    Steps(f64),
    /// Steps within which something jumps, as where cables become taut
    StepsWithJumps(ForceJump),
}

impl Source {
    /// The orders of the error over the width of elements, or the step.
    fn orders(self, falls: Falls) -> Orders {
        match self {
            Self::Mesh(order) => falls.in_space(order),
            Self::Steps(order) => Orders { assumed: ASSUMED_TIME_ORDER, smooth: order },
            Self::StepsWithJumps(jump) => Orders { assumed: jump_order(jump), smooth: jump_order(jump) },
        }
    }

    /// True if the sign and the size of an error depend on where within a step something happens: two
    /// runs may agree by chance.
    fn is_random(self) -> bool {
        match self {
            Self::StepsWithJumps(_) => true,
            Self::Mesh(_) | Self::Steps(_) => false,
        }
    }
}

/// The part of the error of a run that comes from its mesh, or its steps.
#[derive(Clone)]
pub struct ErrorShare {
    /// The largest ratio of the error of an output to the wanted error; infinite where it is
    /// unknown
    pub(super) largest: f64,
    /// The error of each output
    pub(super) columns: Vec<f64>,
    /// `largest` for the coarser run of the comparison
    largest_of_coarser: f64,
    /// `columns` for the coarser run of the comparison
    columns_of_coarser: Vec<f64>,
}

impl ErrorShare {
    /// No error.
    pub fn none(columns: usize) -> Self {
        let zero = vec![0.0; columns];
        Self { largest: 0.0, columns: zero.clone(), largest_of_coarser: 0.0, columns_of_coarser: zero }
    }

    /// An unknown error.
    pub fn unknown(columns: usize) -> Self {
        Self { largest: f64::INFINITY, largest_of_coarser: f64::INFINITY, ..Self::none(columns) }
    }

    /// Raises the share of a mesh that does not resolve bending so that it is not enough: such meshes
    /// hardly differ from each other. The next one should have more than twice the elements.
    pub fn raise_unresolved(&mut self, order: usize) {
        let least = 2.0_f64.powf(order as f64 + 1.0);
        for (largest, columns) in
            [(&mut self.largest, &mut self.columns), (&mut self.largest_of_coarser, &mut self.columns_of_coarser)]
        {
            if *largest < least {
                let factor = least / *largest;
                columns.iter_mut().filter(|_| factor.is_finite()).for_each(|column| *column *= factor);
                *largest = least;
            }
        }
    }

    /// The error of the coarser run of the comparison.
    pub fn of_coarser(&self) -> Self {
        Self { largest: self.largest_of_coarser, columns: self.columns_of_coarser.clone(), ..self.clone() }
    }
}

/// The decrease of errors from round to round.
#[derive(Default)]
pub struct Fall {
    /// The decrease for each kind of columns
    traces: [Trace; 2],
    /// The number of the kind with the largest error
    leading: usize,
}

/// The decrease of the largest error of one kind of columns.
#[derive(Default)]
struct Trace {
    /// The difference in the round before
    before: Option<Difference>,
    /// The order that was observed from round to round
    seen: Option<f64>,
    /// The observed order, if it is lower than the assumed one
    low: Option<f64>,
}

/// The difference between a run and a coarser one.
#[derive(Clone, Copy)]
struct Difference {
    /// The width of the elements, or the step, of the run
    width: f64,
    /// The width of the coarser run over that
    ratio: f64,
    /// The largest ratio of the difference of a column to the wanted error
    size: f64,
}

impl Difference {
    /// The difference that an error of an order would give, but for a factor.
    fn of_order(&self, order: f64) -> f64 {
        self.width.powf(order) * (self.ratio.powf(order) - 1.0)
    }
}

impl Fall {
    /// The observed order of the largest error, if it is lower than the assumed one.
    pub fn low_order(&self) -> Option<f64> {
        self.traces[self.leading].low
    }

    /// The orders of the largest error for elements of an order, to plan the next mesh; the assumed
    /// order is half way to that of smooth scenes.
    pub fn planned_orders(&self, order: usize) -> Orders {
        let Orders { assumed, smooth } = Falls::ALL[self.leading].in_space(order);
        Orders { assumed: 0.5 * (assumed + smooth), smooth }
    }

    /// The error of a run, estimated from its difference to a coarser run.
    pub fn share(&mut self, source: Source, pair: &Pair, outputs: &Outputs) -> ErrorShare {
        let Pair { own, coarser, width, ratio } = *pair;
        let Outputs { sampler, between, .. } = *outputs;
        let mut differences = sampler.differences(coarser, own, &sampler.scales(own));
        let mut of_coarser = differences.clone();
        let falls: Vec<Falls> = sampler.columns.iter().map(|column| Falls::of(column)).collect();
        let mut largest = [f64::NAN; 2];
        let mut coarser = f64::NAN;
        // The difference of an interpolated value to a node of the other mesh may be its whole
        // error.
        let interpolated = outputs.largest_of(&differences, |k| between[k]);
        for k in (0..falls.len()).filter(|&k| between[k]) {
            of_coarser[k] = 2.0 * differences[k];
        }
        for (number, one) in Falls::ALL.into_iter().enumerate() {
            let is_of = |k: usize| falls[k] == one && !between[k];
            let seen = outputs.largest_of(&differences, is_of);
            if seen.is_nan() {
                continue;
            }
            let orders = source.orders(one);
            let now = Difference { width, ratio, size: seen };
            let expected = self.traces[number].expected(orders.smooth, now).filter(|_| source.is_random());
            let size = expected.map_or(seen, |expected| seen.max(expected));
            let by_chance = if seen > 0.0 { size / seen } else { 1.0 };
            let growth = ratio.powf(self.traces[number].order(orders, Difference { size, ..now }));
            for k in (0..falls.len()).filter(|&k| is_of(k)) {
                differences[k] *= by_chance / (growth - 1.0);
                of_coarser[k] = differences[k] * growth;
            }
            largest[number] = size / (growth - 1.0);
            coarser = coarser.max(largest[number] * growth);
        }
        let rank = |value: f64| if value.is_nan() { -1.0 } else { value };
        self.leading = usize::from(rank(largest[1]) > rank(largest[0]));
        let known = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
        ErrorShare {
            largest: known(largest[0].max(largest[1]).max(interpolated)),
            columns: differences,
            largest_of_coarser: known(coarser.max(2.0 * interpolated)),
            columns_of_coarser: of_coarser,
        }
    }
}

impl Trace {
    /// The size that the difference of the round before leads to expect of `now`, with errors of an
    /// order; `None` in the first round.
    fn expected(&self, order: f64, now: Difference) -> Option<f64> {
        self.before.map(|before| before.size * now.of_order(order) / before.of_order(order))
    }

    /// The order that the estimate uses: the observed one where it is lower than the assumed one,
    /// as for waves with fronts; half way to it where it is higher.
    fn order(&mut self, Orders { assumed, smooth }: Orders, now: Difference) -> f64 {
        match self.before {
            // The same width shows nothing new.
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

/// The order that explains the differences of a coarse and a fine run, at most that of smooth
/// solutions. The two differences may have different ratios, so it is found by bisection.
fn seen_order(smooth: f64, coarse: Difference, fine: Difference) -> f64 {
    let too_high = |order| coarse.of_order(order) * fine.size > fine.of_order(order) * coarse.size;
    if !too_high(smooth) {
        return smooth;
    }
    let mut low = LEAST_ORDER;
    let mut high = smooth;
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if too_high(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    low
}

/// A run and a coarser one, which is compared with it.
pub struct Pair<'a> {
    /// The numbers of the run
    pub(super) own: &'a Samples,
    /// The numbers of the coarser run
    pub(super) coarser: &'a Samples,
    /// The width of the elements, or the step, of the run
    pub(super) width: f64,
    /// The width of the coarser run over that
    pub(super) ratio: f64,
}

/// The outputs whose errors are estimated.
#[derive(Clone, Copy)]
pub struct Outputs<'a> {
    /// The compared numbers
    pub(super) sampler: &'a Sampler,
    /// The wanted errors
    pub(super) wanted: &'a Accuracy,
    /// For each column: true if it lies between nodes of the finer mesh
    pub(super) between: &'a [bool],
}

impl Outputs<'_> {
    /// The largest ratio of a difference to the wanted error among some columns; NaN where nothing
    /// can be compared, as for columns that are always zero.
    fn largest_of(&self, differences: &[f64], of: impl Fn(usize) -> bool) -> f64 {
        let over = |&k: &usize| differences[k] / self.wanted.of(&self.sampler.columns[k]);
        self.sampler.outputs.iter().filter(|&&k| of(k)).map(over).fold(f64::NAN, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The orders that a trace uses for errors of an order on meshes of these widths and ratios.
    fn orders(believed: Orders, order: f64, meshes: &[(f64, f64)]) -> Vec<f64> {
        let mut fall = Trace::default();
        let seen = |&(width, ratio): &(f64, f64)| {
            let size = Difference { width, ratio, size: 0.0 }.of_order(order);
            fall.order(believed, Difference { width, ratio, size })
        };
        meshes.iter().map(seen).collect()
    }

    #[test]
    fn a_lower_order_is_believed_and_a_higher_one_half() {
        // The ratio of widths is not always 2, and a search returns to wider elements too.
        let meshes = [(1.0 / 3.0, 1.5), (0.25, 2.0), (0.2, 5.0 / 3.0), (0.5, 2.0), (0.5, 2.0), (0.125, 2.0)];
        let near = |order: f64, of: f64| (order - of).abs() < 1e-5;
        for (order, believed) in [(0.1, LEAST_ORDER), (1.0, 1.0), (2.5, 2.5), (3.0, 2.75), (4.0, 3.25), (7.0, 3.25)] {
            let all = orders(Orders { assumed: 2.5, smooth: 4.0 }, order, &meshes);
            assert!(all[0] == 2.5 && all[1..].iter().all(|&seen| near(seen, believed)), "{order}: {all:?}");
        }
    }
}
