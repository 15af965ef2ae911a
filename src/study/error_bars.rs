//! Error bars: the history of a run beside those of two others, one of half its elements and one of half its step.
//!
//! What is told at a row is the largest estimate so far, and up to the next row that all have: an error does not vanish where two histories
//! cross, and one that begins to grow shows in them late. See [`super::accuracy`] for the estimate.

use super::accuracy::{divisor_in_time, divisors_in_space, left_by_newton};
use super::cost::{Family, Mesher, Pace, Patience, Point, Refusal, Sampler, dynamic_stages, trial};
use super::outcome::{Outcome, Presence};
use crate::deck::{Deck, Diagnostic, Path, PointRef, Spanned, StageBody};
use crate::output::Beside;
use crate::scene::Scene;
use beamsim_core::run::Failure;
use beamsim_core::tensor::Vec3;
use beamsim_core::threads;
use std::thread::{self, ScopedJoinHandle};

/// The step tolerance of a companion whose steps adapt, over that of the run.
const LOOSER: f64 = 10.0;

/// Bars over estimates: factors of safety as in the grid convergence index (Roache, Annu. Rev. Fluid Mech. 29, 1997, DOI
/// 10.1146/annurev.fluid.29.1.123, three grids), chosen on random motions with a twentieth of a period as their step, so that nearly all
/// errors are inside. A finer run tells the error itself, a coarser one only what it would be if all were smooth.
const SAFETY_FINER: f64 = 1.5;
const SAFETY_COARSER: f64 = 2.5;

/// Pieces of a straight line that stand for a curve turn by less than this from one to the next, in radians.
const BEND: f64 = 0.55;
/// And by more than this.
const STRAIGHT: f64 = 1e-6;

/// A run beside the one that is told about.
struct Companion {
    outcome: Outcome,
    /// By what differences of columns are divided to be errors of the run
    divisors: Vec<f64>,
    /// The first row that was not compared yet
    next: usize,
}

/// Errors of a history, row by row.
pub struct ErrorBars {
    sampler: Sampler,
    companions: Vec<Companion>,
    /// Of each column, the largest estimate of each companion so far
    largest: Vec<Vec<f64>>,
    /// Of each column, the largest value of its kind so far
    values: Vec<f64>,
    /// What Newton's method leaves of them
    tolerance: f64,
}

/// A variant that errors are told from, with what differences of columns to it are divided by to be bars.
type Beneath = (Point, Vec<f64>);

/// Runs the companions of a deck, whose text is `text`, beside each other. `interrupted` tells of signals.
pub fn error_bars(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    interrupted: &(dyn Fn() -> Option<i32> + Sync),
) -> Result<ErrorBars, Refusal> {
    refuse_paths(deck).map_err(Refusal::Deck)?;
    let sampler = Sampler::of_rows(deck, scene, Vec::new(), Pace::Timeless);
    let sources = companions(text, deck, &sampler);
    let run = |source: Vec<Beneath>| {
        first_that_ends(source, &|point| {
            trial::simulate(text, &point.settings(deck, text), &sampler, Patience::LONG, interrupted)
        })
    };
    let outcomes: Vec<Result<(Outcome, Vec<f64>), Failure>> = thread::scope(|scope| {
        let started: Vec<_> = sources.into_iter().map(|source| threads::beside(scope, || run(source))).collect();
        let broken = |why: String| Err(Failure::Limit(format!("no error bars: {why}")));
        let join = |thread: ScopedJoinHandle<_>| thread.join().unwrap_or(broken("a run broke off".into()));
        started.into_iter().map(|thread| thread.map_or_else(|error| broken(error.to_string()), join)).collect()
    });
    let mut found = Vec::new();
    for outcome in outcomes {
        let (outcome, divisors) = outcome.map_err(Refusal::Failure)?;
        found.push(Companion { outcome, divisors, next: 0 });
    }
    let columns = scene.probes.iter().map(|probe| probe.names.len()).sum();
    let tolerance = left_by_newton(deck);
    let largest = vec![vec![0.0; columns]; found.len()];
    Ok(ErrorBars { sampler, largest, values: vec![0.0; columns], tolerance, companions: found })
}

/// Runs the variants of one source of errors until one comes to its end.
fn first_that_ends(
    variants: Vec<Beneath>,
    run: &dyn Fn(&Point) -> Result<Outcome, String>,
) -> Result<(Outcome, Vec<f64>), Failure> {
    let mut why = String::new();
    for (point, divisors) in variants {
        match run(&point) {
            Ok(outcome) => match &outcome.ended {
                Ok(()) => return Ok((outcome, divisors)),
                // No other mesh or step mends these.
                Err(failure @ (Failure::Interrupted { .. } | Failure::Singular { .. })) => return Err(failure.clone()),
                Err(failure) => why = format!("{}: {failure}", failure.name()),
            },
            Err(refused) => why = refused,
        }
    }
    Err(Failure::Limit(format!("no error bars: a run with another mesh or step failed, {why}")))
}

/// Errors of what a deck expects, whatever its values, from the same companions; `came` is what came of the run.
pub fn of_expected(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    came: &[f64],
    interrupted: &dyn Fn() -> Option<i32>,
) -> Result<Vec<f64>, Failure> {
    let (sampler, _) = Sampler::of_expectations(deck, scene);
    let mut errors: Vec<f64> = came.iter().map(|value| left_by_newton(deck) * value.abs()).collect();
    for source in companions(text, deck, &sampler) {
        let run =
            |point: &Point| trial::simulate(text, &point.settings(deck, text), &sampler, Patience::LONG, interrupted);
        let (outcome, divisors) = first_that_ends(source, &run)?;
        for (((error, a), b), divisor) in errors.iter_mut().zip(came).zip(&outcome.expected).zip(&divisors) {
            *error += (a - b).abs() / divisor;
        }
    }
    Ok(errors)
}

/// The variants that errors are told from, for mesh and steps; of each the one that tells most, and others for where it fails.
fn companions(text: &str, deck: &Deck, sampler: &Sampler) -> Vec<Vec<Beneath>> {
    let mesher = Mesher { text, deck, sampler, interpolation: None, keeps_places: true };
    let own: Vec<Vec<usize>> = deck.beams.iter().map(|beam| beam.elements.value.clone()).collect();
    let safety = |ratio: f64| if ratio < 1.0 { SAFETY_FINER } else { SAFETY_COARSER };
    let mut found = Vec::new();
    if let Some(order) = deck.beams.iter().map(|beam| beam.order).min() {
        let between = mesher.between(None, &own);
        let with = |(other, ratio): (Vec<Vec<usize>>, f64)| {
            let divisors = divisors_in_space(ratio, order, &sampler.columns, &between);
            let divisors = divisors.into_iter().map(|divisor| divisor / safety(ratio)).collect();
            (Point::new(Family::default(), other, Pace::Timeless), divisors)
        };
        let first = mesher.companion(None, &own);
        let finer =
            (first.1 > 1.0).then(|| (own.iter().map(|beam| beam.iter().map(|n| 2 * n).collect()).collect(), 0.5));
        found.push(std::iter::once(first).chain(finer).map(with).collect());
    }
    let all = |divisor| vec![divisor; sampler.columns.len()];
    let adapts = |(_, body)| if let StageBody::Dynamic { step_tolerance, .. } = body { step_tolerance } else { None };
    if let Some(tolerance) = dynamic_stages(deck).find_map(adapts) {
        let point = Point::new(Family::default(), own, Pace::Adapts(LOOSER * tolerance));
        found.push(vec![(point, all(1.0 / SAFETY_FINER))]);
    } else if dynamic_stages(deck).next().is_some() {
        let with = |factor| Point::new(Family::default(), own.clone(), Pace::Steps(factor));
        let step = |point: &Point| point.step(deck).unwrap_or(1.0);
        let ratio = |point: &Point| step(point) / step(&with(1.0));
        // An interval may have cut the deck's own.
        let cut = dynamic_stages(deck).find_map(|(_, body)| match body {
            StageBody::Dynamic { step: wanted, .. } => Some(step(&with(1.0)) / wanted),
            _ => None,
        });
        let others = [0.5 * cut.unwrap_or(1.0), 2.0].map(with).into_iter().filter(|other| ratio(other) != 1.0);
        let divisor = |ratio: f64| divisor_in_time(ratio) / safety(ratio);
        found.push(others.map(|other| (other.clone(), all(divisor(ratio(&other))))).collect());
    }
    found
}

/// What no bar tells: beams whose straight pieces may stand for a curve.
pub fn polylines(deck: &Deck) -> Vec<String> {
    let mut told = Vec::new();
    for beam in &deck.beams {
        let Path::Through(points) = &beam.path else { continue };
        let place = |point: &Spanned<PointRef>| crate::scene::place(deck, point);
        let Some(places) = points.iter().map(place).collect::<Option<Vec<Vec3>>>() else { continue };
        let ways: Vec<Vec3> = places.windows(2).map(|ends| ends[1] - ends[0]).collect();
        let angle = |pair: &[Vec3]| pair[0].cross(pair[1]).norm().atan2(pair[0].dot(pair[1]));
        let angles: Vec<f64> = ways.windows(2).map(angle).collect();
        let widest = angles.iter().fold(0.0, |widest: f64, &angle| widest.max(angle));
        if angles.len() >= 2 && (STRAIGHT..BEND).contains(&widest) {
            told.push(format!(
                "beam {}: its {} straight pieces turn by up to {:.1}° from one to the next; if they stand for a curve, no estimate contains \
                 what that changes (`arc`, or more points)",
                beam.name.value,
                ways.len(),
                widest.to_degrees()
            ));
        }
    }
    told
}

/// Rows of paths lie where increments end, and those of steps that adapt where these do: nothing that two runs share.
pub fn refuse_paths(deck: &Deck) -> Result<(), Diagnostic> {
    for stage in &deck.stages {
        let message = match stage.body {
            StageBody::Path { .. } => "error bars need rows that runs share: paths by arc length have none",
            StageBody::Dynamic { step_tolerance: Some(_), .. } if deck.output.interval.is_none() => {
                "error bars need rows that runs share: steps adapt, so name instants by [output] interval"
            }
            _ => continue,
        };
        return Err(Diagnostic::error(message, stage.span.clone()));
    }
    Ok(())
}

impl Beside for ErrorBars {
    fn names(&self, columns: &[String]) -> Vec<String> {
        columns.iter().map(|column| format!("{column}.err")).collect()
    }

    fn take(&mut self, stage: usize, clock: f64, row: &[f64]) -> bool {
        let mut known = true;
        for (companion, largest) in self.companions.iter_mut().zip(&mut self.largest) {
            let there = match companion.outcome.presence(companion.next, stage, clock) {
                Presence::Row(there) => there,
                Presence::Between => {
                    known = false;
                    continue;
                }
                Presence::Over => continue,
            };
            companion.next = there;
            let mut nearest = companion.outcome.rows[there].clone();
            self.sampler.take_nearest(0, &mut nearest, row);
            for (((largest, a), b), divisor) in largest.iter_mut().zip(&nearest).zip(row).zip(&companion.divisors) {
                let difference = (a - b).abs() / divisor;
                *largest = if difference.is_nan() { f64::INFINITY } else { largest.max(difference) };
            }
        }
        let mut with_modes = row.to_vec();
        with_modes.resize(self.sampler.columns.len(), f64::NAN);
        let kinds = self.sampler.scales(&with_modes);
        self.values.iter_mut().zip(&kinds).for_each(|(largest, value)| *largest = largest.max(*value));
        known
    }

    fn numbers(&self) -> Vec<f64> {
        let estimate = |k: usize| self.largest.iter().map(|of_companion| of_companion[k]).sum::<f64>();
        (0..self.values.len()).map(|k| estimate(k) + self.tolerance * self.values[k]).collect()
    }
}
