//! The reference of errors: the finest run of all, extrapolated in time, with its uncertainty.

use super::grid::Grid;
use super::mesher::{Companion, Mesher};
use super::sample::{Sampler, Samples};
use super::trial::Trial;
use super::variant::{Family, Pace, Variant};
use crate::deck::InterpolationWord;

/// The finest mesh of the reference over that of the study, in nodes.
const FINER: f64 = 2.0;

/// The difference between two runs, one with twice the width or step, over the error of the finer
/// one: that of second order, which is the least that is assumed.
const SECOND_ORDER: f64 = 3.0;

/// Halved steps reduce differences to a quarter. Within these bounds of the ratio, the result is
/// extrapolated.
const EXTRAPOLATED_RATIOS: [f64; 2] = [3.3, 4.8];

/// The reference of errors.
pub struct Reference {
    /// The numbers that are compared
    pub samples: Samples,
    /// Their uncertainty, relative like an error
    pub uncertainty: f64,
    /// Its origin, in words
    pub made: String,
}

/// Errors below this times the uncertainty of the reference cannot be distinguished.
const RESOLVED: f64 = 2.0;

impl Reference {
    /// The smallest error that can be measured.
    pub fn resolution(&self) -> f64 {
        RESOLVED * self.uncertainty
    }
}

/// The variants that a reference is made of: on the finest mesh with every pace, the coarsest
/// first, then on a coarser mesh.
pub fn variants(mesher: &Mesher, grid: &Grid) -> Vec<Variant> {
    let bent = !mesher.original.deck.beams.is_empty();
    let family = Family {
        order: bent.then_some(3),
        interpolation: bent.then_some(InterpolationWord::Relative),
        ..Family::default()
    };
    let finest = grid.meshes.last().copied().unwrap_or(1.0);
    let paces = match grid.paces.last().copied().unwrap_or(Pace::Timeless) {
        Pace::Timeless => vec![Pace::Timeless],
        Pace::Steps(factor) => [1.0, 0.5, 0.25].map(|part| Pace::Steps(factor * part)).to_vec(),
        Pace::Adapts(tolerance) => [1.0, 0.1, 0.01].map(|part| Pace::Adapts(tolerance * part)).to_vec(),
    };
    let elements = mesher.elements(family.order, FINER * finest);
    let (fine, coarse) = match mesher.companion(family.order, &elements) {
        Companion { elements: coarse, ratio } if ratio > 1.0 => (elements, coarse),
        Companion { elements: finer, .. } => (finer, elements),
    };
    let variant = |elements: &Vec<_>, pace| Variant::new(family.clone(), elements.clone(), pace);
    let coarse = bent.then(|| variant(&coarse, paces[0]));
    paces.iter().map(|&pace| variant(&fine, pace)).chain(coarse).collect()
}

/// The reference from finished runs of [`variants`].
pub fn establish(sampler: &Sampler, variants: &[Variant], trials: &[Trial]) -> Reference {
    let samples = |k: usize| &trials[k].samples;
    let scales = sampler.scales(samples(0));
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, &scales);
    let coarse = variants.iter().position(|variant| variant.elements != variants[0].elements);
    // The factor of second order holds only for meshes of which one is twice as fine everywhere.
    let halved = coarse.is_none_or(|k| variants[0].count() >= 2 * variants[k].count());
    let divisor = if halved { SECOND_ORDER } else { 1.0 };
    let in_space = coarse.map_or(0.0, |k| distance(samples(0), samples(k)) / divisor);
    let last = coarse.unwrap_or(variants.len()) - 1;
    let in_time = match (variants[0].pace, last) {
        (Pace::Steps(_), 2) => halved_steps(sampler, [samples(0), samples(1), samples(2)], &scales),
        (Pace::Adapts(_), 2) => TimeLimit::of(samples(2), distance(samples(1), samples(2))),
        (Pace::Timeless | Pace::Steps(_) | Pace::Adapts(_), _) => TimeLimit::of(samples(0), 0.0),
    };
    let how = if in_time.is_extrapolated { ", extrapolated" } else { "" };
    let finest = &variants[last];
    let parts = [
        finest.family.order.map(|order| format!("{} elements of order {order}", finest.count())),
        match finest.pace {
            Pace::Timeless => None,
            Pace::Steps(factor) => Some(format!("steps of {factor} times the deck's{how}")),
            Pace::Adapts(tolerance) => Some(format!("steps to a tolerance of {tolerance:.0e}")),
        },
    ];
    let made = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
    Reference { samples: in_time.samples, uncertainty: in_space + in_time.uncertainty, made }
}

/// The result for ever smaller steps.
struct TimeLimit {
    samples: Samples,
    /// The uncertainty that comes from the steps, relative like an error
    uncertainty: f64,
    is_extrapolated: bool,
}

impl TimeLimit {
    fn of(samples: &Samples, uncertainty: f64) -> Self {
        Self { samples: samples.clone(), uncertainty, is_extrapolated: false }
    }
}

/// The limit from three runs with halved steps: extrapolated where their differences show a second
/// order.
fn halved_steps(sampler: &Sampler, runs: [&Samples; 3], scales: &[f64]) -> TimeLimit {
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, scales);
    let first = distance(runs[0], runs[1]);
    let second = distance(runs[1], runs[2]);
    if !(EXTRAPOLATED_RATIOS[0]..=EXTRAPOLATED_RATIOS[1]).contains(&(first / second)) {
        return TimeLimit::of(runs[2], second);
    }
    let third = 1.0 / 3.0;
    let before = sampler.extrapolated(runs[1], runs[0], third);
    let samples = sampler.extrapolated(runs[2], runs[1], third);
    let uncertainty = distance(&before, &samples) / SECOND_ORDER;
    TimeLimit { samples, uncertainty, is_extrapolated: true }
}
