//! The main source of error of each run of the frontier.

use super::pool::Pool;
use super::run::{CostRun, Limit};
use super::sample::Samples;
use super::variant::{Pace, Variant};
use crate::study::StudyError;

/// The factor of Newton's tolerance with which the part of the error that comes from it is
/// measured.
const TIGHTER: f64 = 1e-2;

/// Finds the main source of error of each run of the frontier: mesh and step from differences to
/// neighbours on the grid, Newton's method from another run with a smaller tolerance.
pub(super) fn find(
    runs: &mut [CostRun],
    pool: &mut Pool,
    distance: &dyn Fn(&Samples, &Samples) -> f64,
) -> Result<(), StudyError> {
    let chosen: Vec<usize> = (0..runs.len()).filter(|&k| runs[k].frontier).collect();
    let tighter: Vec<Variant> =
        chosen.iter().map(|&k| Variant { newton: TIGHTER, ..runs[k].variant.clone() }).collect();
    pool.expect(tighter.len());
    let trials = pool.run(&tighter)?;
    for (&k, trial) in chosen.iter().zip(trials) {
        let Some(samples) = runs[k].samples() else { continue };
        let of_newton = trial.filter(|trial| trial.finished()).map(|tighter| distance(samples, &tighter.samples));
        let shares = [
            (Limit::Mesh, share(runs, k, distance, &MESH)),
            (Limit::Step, share(runs, k, distance, &STEP)),
            (Limit::Newton, of_newton),
        ];
        let known = shares.into_iter().filter_map(|(limit, share)| Some((limit, share.filter(|s| *s > 0.0)?)));
        runs[k].limit = known.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(limit, _)| limit);
    }
    Ok(())
}

/// A direction of the grid of variants, along which one source of errors changes.
struct Direction {
    /// True for two variants that differ only along the direction
    is_along: fn(&Variant, &Variant) -> bool,
    /// The width that errors are a power of
    width: fn(&Variant) -> f64,
    /// The order of the error over the width
    order: fn(&Variant) -> f64,
}

const MESH: Direction = Direction {
    is_along: |a, b| a.pace == b.pace,
    width: Variant::width,
    order: |variant| variant.family.order.map_or(1.0, |order| 2.0 * order as f64),
};

const STEP: Direction = Direction {
    is_along: |a, b| a.elements == b.elements,
    width: |variant| match variant.pace {
        Pace::Timeless => 1.0,
        Pace::Steps(factor) => factor,
        Pace::Adapts(tolerance) => tolerance,
    },
    order: |variant| match variant.pace {
        Pace::Steps(_) => 2.0,
        Pace::Timeless | Pace::Adapts(_) => 1.0,
    },
};

/// An estimate of the part of an error that comes from one source: the difference to the next finer
/// run, or, where there is none, the difference to the next coarser one, reduced by the order.
fn share(
    runs: &[CostRun],
    k: usize,
    distance: &dyn Fn(&Samples, &Samples) -> f64,
    direction: &Direction,
) -> Option<f64> {
    let own = &runs[k];
    let row = runs.iter().filter(|run| {
        let is_along = (direction.is_along)(&run.variant, &own.variant);
        run.variant.family == own.variant.family && is_along && run.samples().is_some()
    });
    let ratio = |run: &CostRun| (direction.width)(&run.variant) / (direction.width)(&own.variant);
    let mut finer: Option<&CostRun> = None;
    let mut coarser: Option<&CostRun> = None;
    for run in row {
        let r = ratio(run);
        if r < 1.0 && finer.is_none_or(|best| r > ratio(best)) {
            finer = Some(run);
        } else if r > 1.0 && coarser.is_none_or(|best| r < ratio(best)) {
            coarser = Some(run);
        }
    }
    let samples = own.samples()?;
    match (finer, coarser) {
        (Some(finer), _) => Some(distance(samples, finer.samples()?)),
        (None, Some(coarser)) => {
            let power = ratio(coarser).powf((direction.order)(&own.variant));
            Some(distance(samples, coarser.samples()?) / (power - 1.0))
        }
        (None, None) => None,
    }
}
