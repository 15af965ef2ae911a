//! Error bars: the history of a run beside those of two coarser ones, of half its elements and of twice its step.
//!
//! What is told at a row is the largest estimate so far, and up to the next row that all have: an error does not vanish where two histories
//! cross, and one that begins to grow shows in them late. See [`super::accuracy`] for the estimate.

use super::accuracy::{divisor_in_time, divisors_in_space, left_by_newton};
use super::cost::{Family, Mesher, Pace, Patience, Point, Refusal, Sampler, dynamic_stages, trial};
use super::outcome::{Outcome, Presence};
use crate::deck::{Deck, Diagnostic, StageBody};
use crate::drive::Failure;
use crate::output::Beside;
use crate::scene::Scene;
use crate::threads;
use std::thread::{self, ScopedJoinHandle};

/// The step tolerance of a companion whose steps adapt, over that of the run.
const LOOSER: f64 = 10.0;

/// Bars over estimates: a factor of safety as in the grid convergence index (Roache, Annu. Rev. Fluid Mech. 29, 1997, DOI
/// 10.1146/annurev.fluid.29.1.123, three grids); that the assumed orders are low adds to it.
const SAFETY: f64 = 1.25;

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

/// Runs the companions of a deck, whose text is `text`, beside each other. `interrupted` tells of signals.
pub fn error_bars(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    interrupted: &(dyn Fn() -> Option<i32> + Sync),
) -> Result<ErrorBars, Refusal> {
    refuse_paths(deck).map_err(Refusal::Deck)?;
    let sampler = Sampler::of_rows(deck, scene, Vec::new(), Pace::Timeless);
    let variants = companions(text, deck, &sampler);
    let run = |point: &Point| trial::simulate(text, &point.settings(deck, text), &sampler, Patience::LONG, interrupted);
    let outcomes: Vec<Result<Outcome, String>> = thread::scope(|scope| {
        let started: Vec<_> = variants.iter().map(|(point, _)| threads::beside(scope, || run(point))).collect();
        let join = |thread: ScopedJoinHandle<_>| thread.join().unwrap_or(Err("it broke off".into()));
        started.into_iter().map(|thread| thread.map_or_else(|error| Err(error.to_string()), join)).collect()
    });
    let mut found = Vec::new();
    for ((_, divisors), outcome) in variants.into_iter().zip(outcomes) {
        let trouble =
            |why: String| Refusal::Failure(Failure::Limit(format!("no error bars: a coarser run failed, {why}")));
        let outcome = outcome.map_err(trouble)?;
        match &outcome.ended {
            Err(failure @ (Failure::Interrupted { .. } | Failure::Singular { .. })) => {
                return Err(Refusal::Failure(failure.clone()));
            }
            Err(failure) => return Err(trouble(format!("{}: {failure}", failure.name()))),
            Ok(()) => found.push(Companion { outcome, divisors, next: 0 }),
        }
    }
    let columns = scene.probes.iter().map(|probe| probe.names.len()).sum();
    let tolerance = left_by_newton(deck);
    let largest = vec![vec![0.0; columns]; found.len()];
    Ok(ErrorBars { sampler, largest, values: vec![0.0; columns], tolerance, companions: found })
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
    for (point, divisors) in companions(text, deck, &sampler) {
        let outcome = trial::simulate(text, &point.settings(deck, text), &sampler, Patience::LONG, interrupted)
            .map_err(Failure::Limit)?;
        outcome.ended?;
        for (((error, a), b), divisor) in errors.iter_mut().zip(came).zip(&outcome.expected).zip(&divisors) {
            *error += SAFETY * (a - b).abs() / divisor;
        }
    }
    Ok(errors)
}

/// The variants that errors are told from, with the divisors of differences to them.
fn companions(text: &str, deck: &Deck, sampler: &Sampler) -> Vec<(Point, Vec<f64>)> {
    let mesher = Mesher { text, deck, sampler, interpolation: None };
    let own: Vec<Vec<usize>> = deck.beams.iter().map(|beam| beam.elements.value.clone()).collect();
    let mut found = Vec::new();
    let all = |divisor| vec![divisor; sampler.columns.len()];
    if let Some(order) = deck.beams.iter().map(|beam| beam.order).min() {
        let (other, ratio) = mesher.companion(None, &own);
        let divisors = divisors_in_space(ratio, order, &sampler.columns);
        found.push((Point::new(Family::default(), other, Pace::Timeless), divisors));
    }
    let adapts = |(_, body)| if let StageBody::Dynamic { step_tolerance, .. } = body { step_tolerance } else { None };
    if let Some(tolerance) = dynamic_stages(deck).find_map(adapts) {
        found.push((Point::new(Family::default(), own, Pace::Adapts(LOOSER * tolerance)), all(1.0)));
    } else if dynamic_stages(deck).next().is_some() {
        // Where an interval leaves no longer step, a shorter one tells.
        let with = |factor| Point::new(Family::default(), own.clone(), Pace::Steps(factor));
        let step = |point: &Point| point.step(deck).unwrap_or(1.0);
        let ratio = |point: &Point| step(point) / step(&with(1.0));
        // An interval may have cut the deck's own.
        let cut = dynamic_stages(deck).find_map(|(_, body)| match body {
            StageBody::Dynamic { step: wanted, .. } => Some(step(&with(1.0)) / wanted),
            _ => None,
        });
        let other = [2.0, 0.5 * cut.unwrap_or(1.0)].map(with).into_iter().find(|other| ratio(other) != 1.0);
        found.extend(other.map(|other| (other.clone(), all(divisor_in_time(ratio(&other))))));
    }
    found
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
            self.sampler.take_nearest_rotations(0, &mut nearest, row);
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
        let estimate = |k: usize| SAFETY * self.largest.iter().map(|of_companion| of_companion[k]).sum::<f64>();
        (0..self.values.len()).map(|k| estimate(k) + self.tolerance * self.values[k]).collect()
    }
}
