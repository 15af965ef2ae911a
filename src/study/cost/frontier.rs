//! The runs that no other run beats, and what limits each.

use super::crew::Crew;
use super::grid::{Pace, Point};
use super::sample::Samples;
use super::{Refusal, Run};

/// The factor of Newton's tolerance with which its share in an error is found.
const TIGHTER: f64 = 1e-2;

/// What the error of a run comes from most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// The number of elements, or their order
    Mesh,
    /// The step, or its tolerance
    Step,
    /// The tolerance of Newton's method
    Newton,
}

impl Knob {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Step => "step",
            Self::Newton => "tolerance",
        }
    }
}

/// The error of a run as far as the reference can tell; infinite where the run cannot be compared.
fn error_of(run: &Run, least_told: f64) -> f64 {
    if run.error.is_nan() { f64::INFINITY } else { run.error.max(least_told) }
}

/// The numbers of runs that are at most `near` times as slow as the fastest one of at least their accuracy.
pub(super) fn near(runs: &[Run], least_told: f64, near: f64) -> Vec<usize> {
    let known = |k: &usize| error_of(&runs[*k], least_told).is_finite();
    let time = |k: usize| runs[k].timing.seconds.cpu;
    let mut order: Vec<usize> = (0..runs.len()).filter(known).collect();
    order.sort_by(|&a, &b| error_of(&runs[a], least_told).total_cmp(&error_of(&runs[b], least_told)));
    let mut best = f64::INFINITY;
    let mut chosen = Vec::new();
    for group in order.chunk_by(|&a, &b| error_of(&runs[a], least_told) == error_of(&runs[b], least_told)) {
        best = group.iter().map(|&k| time(k)).fold(best, f64::min);
        chosen.extend(group.iter().copied().filter(|&k| time(k) <= near * best));
    }
    chosen.sort_unstable();
    chosen
}

/// Marks the runs that no other run beats in both error and time; of equal ones the first.
pub(super) fn mark(runs: &mut [Run], least_told: f64) {
    let key = |run: &Run| (error_of(run, least_told), run.timing.seconds.cpu);
    for k in 0..runs.len() {
        let (error, time) = key(&runs[k]);
        let beaten = |(j, other): (usize, &Run)| {
            let (e, t) = key(other);
            j != k && e <= error && t <= time && (e < error || t < time || j < k)
        };
        runs[k].frontier = error.is_finite() && !runs.iter().enumerate().any(beaten);
    }
}

/// Finds for each run of the frontier what its error comes from: the difference to its neighbours on the grid tells the share of mesh and
/// step, another run that of Newton's method.
pub(super) fn find_limits(
    runs: &mut [Run],
    crew: &mut Crew,
    distance: &dyn Fn(&Samples, &Samples) -> f64,
) -> Result<(), Refusal> {
    let chosen: Vec<usize> = (0..runs.len()).filter(|&k| runs[k].frontier).collect();
    let tighter: Vec<Point> = chosen.iter().map(|&k| Point { newton: TIGHTER, ..runs[k].point.clone() }).collect();
    crew.expect(tighter.len());
    let trials = crew.run(&tighter)?;
    for (&k, trial) in chosen.iter().zip(trials) {
        let Some(samples) = runs[k].samples() else { continue };
        let shares = [
            (
                Knob::Mesh,
                share(
                    runs,
                    k,
                    distance,
                    |a, b| a.pace == b.pace,
                    Point::width,
                    |p| p.family.order.map_or(1.0, |n| 2.0 * n as f64),
                ),
            ),
            (
                Knob::Step,
                share(
                    runs,
                    k,
                    distance,
                    |a, b| a.elements == b.elements,
                    pace,
                    |p| if matches!(p.pace, Pace::Steps(_)) { 2.0 } else { 1.0 },
                ),
            ),
            (Knob::Newton, trial.filter(|t| t.finished()).map(|tighter| distance(samples, &tighter.samples))),
        ];
        let known = shares.into_iter().filter_map(|(knob, share)| Some((knob, share.filter(|s| *s > 0.0)?)));
        runs[k].limit = known.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(knob, _)| knob);
    }
    Ok(())
}

/// About the part of an error that comes from one knob: the difference to the next finer run, or, where there is none, that to the next
/// coarser one, brought down by the order of the knob.
fn share(
    runs: &[Run],
    k: usize,
    distance: &dyn Fn(&Samples, &Samples) -> f64,
    along: impl Fn(&Point, &Point) -> bool,
    width: impl Fn(&Point) -> f64,
    order: impl Fn(&Point) -> f64,
) -> Option<f64> {
    let own = &runs[k];
    let row = runs
        .iter()
        .filter(|run| run.point.family == own.point.family && along(&run.point, &own.point) && run.samples().is_some());
    let ratio = |run: &Run| width(&run.point) / width(&own.point);
    let (mut finer, mut coarser): (Option<&Run>, Option<&Run>) = (None, None);
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
            let power = ratio(coarser).powf(order(&own.point));
            Some(distance(samples, coarser.samples()?) / (power - 1.0))
        }
        (None, None) => None,
    }
}

/// How coarse the pace of a variant is.
fn pace(point: &Point) -> f64 {
    match point.pace {
        Pace::Timeless => 1.0,
        Pace::Steps(factor) => factor,
        Pace::Adapts(tolerance) => tolerance,
    }
}
