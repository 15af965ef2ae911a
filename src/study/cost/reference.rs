//! What errors are measured against: the finest run of all, extrapolated in time, with its own uncertainty.

use super::grid::{Family, Grid, Mesher, Pace, Point};
use super::sample::{Sampler, Samples};
use super::trial::Trial;
use crate::deck::InterpolationWord;

/// The finest mesh of the reference over that of the study, in nodes.
const FINER: f64 = 2.0;

/// Differences between two runs, one of twice the width or step, are this times the error of the finer one at least: a second order is
/// taken for sure, though more is usual.
const SURE: f64 = 3.0;

/// Halved steps bring differences down to a quarter; where they do so within these bounds, what is left is extrapolated.
const FALLS: [f64; 2] = [3.3, 4.8];

/// What errors are measured against.
pub struct Reference {
    /// The numbers
    pub samples: Samples,
    /// How uncertain they are, like an error
    pub uncertainty: f64,
    /// What it is made of
    pub made: String,
}

/// Errors below this times the uncertainty of the reference cannot be told apart.
const TOLD: f64 = 2.0;

impl Reference {
    /// The smallest error that can be told.
    pub fn least_told(&self) -> f64 {
        TOLD * self.uncertainty
    }
}

/// The runs that a reference is made of, the finest mesh first, and of each mesh the coarsest pace.
pub fn points(mesher: &Mesher, grid: &Grid) -> Vec<Point> {
    let bent = !mesher.deck.beams.is_empty();
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
        (coarse, ratio) if ratio > 1.0 => (elements, coarse),
        (finer, _) => (finer, elements),
    };
    let point = |elements: &Vec<_>, pace| Point::new(family.clone(), elements.clone(), pace);
    let coarse = bent.then(|| point(&coarse, paces[0]));
    paces.iter().map(|&pace| point(&fine, pace)).chain(coarse).collect()
}

/// The reference from the runs of [`points`]; `Err` with the status of one that failed.
pub fn establish(sampler: &Sampler, points: &[Point], trials: &[Trial]) -> Result<Reference, String> {
    if let Some(failed) = trials.iter().find(|trial| !trial.finished()) {
        return Err(failed.status.clone());
    }
    let samples = |k: usize| &trials[k].samples;
    let scales = sampler.scales(samples(0));
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, &scales);
    let coarse = points.iter().position(|point| point.elements != points[0].elements);
    // Of meshes of which one is not twice as fine all over, less is sure.
    let halved = coarse.is_none_or(|k| points[0].count() >= 2 * points[k].count());
    let sure = if halved { SURE } else { 1.0 };
    let in_space = coarse.map_or(0.0, |k| distance(samples(0), samples(k)) / sure);
    let last = coarse.unwrap_or(points.len()) - 1;
    let (found, in_time, how) = match (points[0].pace, last) {
        (Pace::Steps(_), 2) => in_time(sampler, [samples(0), samples(1), samples(2)], &scales),
        (Pace::Adapts(_), 2) => (samples(2).clone(), distance(samples(1), samples(2)), ""),
        _ => (samples(0).clone(), 0.0, ""),
    };
    let finest = &points[last];
    let parts = [
        finest.family.order.map(|order| format!("{} elements of order {order}", finest.count())),
        match finest.pace {
            Pace::Timeless => None,
            Pace::Steps(factor) => Some(format!("steps of {factor} times the deck's{how}")),
            Pace::Adapts(tolerance) => Some(format!("steps to a tolerance of {tolerance:.0e}")),
        },
    ];
    let made = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
    Ok(Reference { samples: found, uncertainty: in_space + in_time, made })
}

/// Three runs whose steps are halved: the limit that a second order leads to, where they show one, its uncertainty, and what was done.
fn in_time(sampler: &Sampler, runs: [&Samples; 3], scales: &[f64]) -> (Samples, f64, &'static str) {
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, scales);
    let [first, second] = [distance(runs[0], runs[1]), distance(runs[1], runs[2])];
    let ratio = first / second;
    if !(FALLS[0]..=FALLS[1]).contains(&ratio) {
        return (runs[2].clone(), second, "");
    }
    let third = 1.0 / 3.0;
    let [before, found] =
        [sampler.extrapolated(runs[1], runs[0], third), sampler.extrapolated(runs[2], runs[1], third)];
    let uncertainty = distance(&before, &found) / SURE;
    (found, uncertainty, ", extrapolated")
}
