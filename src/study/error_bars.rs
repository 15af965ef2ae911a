//! Error bars: the history of a run is compared with those of two others, one with half its
//! elements and one with half its step.
//!
//! The bar of a row is the largest estimate so far, up to the next row that all histories have: an
//! error does not vanish where two histories cross, and a growing error shows in them late. See
//! [`super::accuracy`] for the estimate.

use super::StudyError;
use super::accuracy::{divisor_in_time, divisors_in_space, left_by_newton};
use super::cost::{Companion, Family, Mesher, Original, Pace, Patience, Sampler, Variant, dynamic_stages, trial};
use super::outcome::{Outcome, Presence, StageClock};
use crate::deck::{Beam, Deck, Diagnostic, Path, PointRef, Spanned, StageBody};
use crate::output::{SavedBars, SavedCompanion, SideColumns};
use crate::scene::Scene;
use beamsim_core::run::Failure;
use beamsim_core::tensor::Vec3;
use beamsim_core::threads;
use std::thread::{self, ScopedJoinHandle};

/// The step tolerance of a companion with adaptive steps, over that of the run.
const LOOSER: f64 = 10.0;

/// Bars over estimates: factors of safety as in the grid convergence index (Roache, Annu. Rev.
/// Fluid Mech. 29, 1997, DOI 10.1146/annurev.fluid.29.1.123, three grids), chosen on random motions
/// with a twentieth of a period as their step, so that nearly all errors are inside. A finer run
/// shows the error itself, a coarser one only what it would be for smooth solutions.
const SAFETY_FINER: f64 = 1.5;
const SAFETY_COARSER: f64 = 2.5;

/// Straight pieces may stand for a curve if the angle between neighbours, in radians, is between
/// these bounds.
const SMALLEST_BEND: f64 = 1e-6;
const LARGEST_BEND: f64 = 0.55;

/// A run with another mesh or step.
struct CompanionRun {
    outcome: Outcome,
    /// For each column: a difference over this is an error
    divisors: Vec<f64>,
    /// The row that was compared last
    next: usize,
}

/// Errors of a history, row by row.
pub struct ErrorBars {
    sampler: Sampler,
    companions: Vec<CompanionRun>,
    /// The largest estimates so far, for each companion and column
    largest: Vec<Vec<f64>>,
    /// The largest value so far of each column's kind
    values: Vec<f64>,
    /// The relative error from the tolerance of Newton's method
    tolerance: f64,
}

/// A variant from which errors are estimated.
struct Comparison {
    variant: Variant,
    /// For each column: a difference over this is an error bar
    divisors: Vec<f64>,
}

/// Runs the companions of a deck, whose text is `text`, in parallel. `interrupted` gives the signal
/// that was caught.
pub fn error_bars(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    interrupted: &(dyn Fn() -> Option<i32> + Sync),
) -> Result<ErrorBars, StudyError> {
    refuse_paths(deck)?;
    let original = Original { text, deck };
    let sampler = Sampler::of_rows(deck, scene, Vec::new(), Pace::Timeless);
    let sources = companions(original, &sampler);
    let run = |source: Vec<Comparison>| {
        first_that_finishes(source, &|variant| {
            trial::simulate(deck, &variant.changes(original), &sampler, Patience::LONG, interrupted)
        })
    };
    let runs: Vec<Result<CompanionRun, Failure>> = thread::scope(|scope| {
        let started: Vec<_> = sources.into_iter().map(|source| threads::beside(scope, || run(source))).collect();
        let broken = |why: String| Err(Failure::Limit(format!("no error bars: {why}")));
        let join = |thread: ScopedJoinHandle<_>| {
            thread.join().unwrap_or(broken("a run stopped with an internal error".into()))
        };
        started.into_iter().map(|thread| thread.map_or_else(|error| broken(error.to_string()), join)).collect()
    });
    let companions = runs.into_iter().collect::<Result<Vec<_>, _>>()?;
    let columns = scene.probes.iter().map(|probe| probe.names.len()).sum();
    let tolerance = left_by_newton(deck);
    let largest = vec![vec![0.0; columns]; companions.len()];
    Ok(ErrorBars { sampler, largest, values: vec![0.0; columns], tolerance, companions })
}

/// Runs the variants of one source of errors until one finishes.
fn first_that_finishes(
    comparisons: Vec<Comparison>,
    run: &dyn Fn(&Variant) -> Result<Outcome, StudyError>,
) -> Result<CompanionRun, Failure> {
    let mut why = String::new();
    for Comparison { variant, divisors } in comparisons {
        match run(&variant) {
            Ok(outcome) => match &outcome.ended {
                Ok(()) => return Ok(CompanionRun { outcome, divisors, next: 0 }),
                // These fail with every mesh and step.
                Err(failure @ (Failure::Interrupted { .. } | Failure::Singular { .. })) => return Err(failure.clone()),
                Err(failure) => why = format!("{}: {failure}", failure.name()),
            },
            Err(error) => why = error.to_string(),
        }
    }
    Err(Failure::Limit(format!("no error bars: a comparison run with another mesh or step failed: {why}")))
}

/// Estimated errors of the expectations of a deck; `came` holds their values in the run.
pub fn of_expected(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    came: &[f64],
    interrupted: &dyn Fn() -> Option<i32>,
) -> Result<Vec<f64>, Failure> {
    let (sampler, _) = Sampler::of_expectations(deck, scene);
    let mut errors: Vec<f64> = came.iter().map(|value| left_by_newton(deck) * value.abs()).collect();
    let original = Original { text, deck };
    for source in companions(original, &sampler) {
        let run = |variant: &Variant| {
            trial::simulate(deck, &variant.changes(original), &sampler, Patience::LONG, interrupted)
        };
        let CompanionRun { outcome, divisors, .. } = first_that_finishes(source, &run)?;
        for (((error, a), b), divisor) in errors.iter_mut().zip(came).zip(&outcome.expected).zip(&divisors) {
            *error += (a - b).abs() / divisor;
        }
    }
    Ok(errors)
}

/// The variants from which errors are estimated, for mesh and steps: for each the most informative
/// one, and others in case it fails.
fn companions(original: Original, sampler: &Sampler) -> Vec<Vec<Comparison>> {
    let deck = original.deck;
    let mesher = Mesher { original, sampler, interpolation: None, keeps_places: true, placement: None };
    let own: Vec<Vec<usize>> = deck.beams.iter().map(Beam::element_counts).collect();
    let safety = |ratio: f64| if ratio < 1.0 { SAFETY_FINER } else { SAFETY_COARSER };
    let mut found = Vec::new();
    if let Some(order) = deck.beams.iter().map(|beam| beam.order).min() {
        let between = mesher.between(None, &own);
        let with = |Companion { elements, ratio }: Companion| {
            let divisors = divisors_in_space(ratio, order, &sampler.columns, &between);
            let divisors = divisors.into_iter().map(|divisor| divisor / safety(ratio)).collect();
            Comparison { variant: Variant::new(Family::default(), elements, Pace::Timeless), divisors }
        };
        let first = mesher.companion(None, &own);
        let finer = (first.ratio > 1.0).then(|| Companion {
            elements: own.iter().map(|beam| beam.iter().map(|n| 2 * n).collect()).collect(),
            ratio: 0.5,
        });
        found.push(std::iter::once(first).chain(finer).map(with).collect());
    }
    let all = |divisor| vec![divisor; sampler.columns.len()];
    let adapts = |(_, body)| if let StageBody::Dynamic { step_tolerance, .. } = body { step_tolerance } else { None };
    if let Some(tolerance) = dynamic_stages(deck).find_map(adapts) {
        let variant = Variant::new(Family::default(), own, Pace::Adapts(LOOSER * tolerance));
        found.push(vec![Comparison { variant, divisors: all(1.0 / SAFETY_FINER) }]);
    } else if dynamic_stages(deck).next().is_some() {
        let with = |factor| Variant::new(Family::default(), own.clone(), Pace::Steps(factor));
        let step = |variant: &Variant| variant.step(deck).unwrap_or(1.0);
        let ratio = |variant: &Variant| step(variant) / step(&with(1.0));
        // The step of the deck may be reduced to a whole part of an interval.
        let cut = dynamic_stages(deck).find_map(|(_, body)| {
            let StageBody::Dynamic { step: wanted, .. } = body else { return None };
            Some(step(&with(1.0)) / wanted)
        });
        let others = [0.5 * cut.unwrap_or(1.0), 2.0].map(with).into_iter().filter(|other| ratio(other) != 1.0);
        let divisor = |ratio: f64| divisor_in_time(ratio) / safety(ratio);
        let compared = |variant: Variant| Comparison { divisors: all(divisor(ratio(&variant))), variant };
        found.push(others.map(compared).collect());
    }
    found
}

/// Messages about beams whose straight pieces may stand for a curve: no error bar contains that
/// error.
pub fn polylines(deck: &Deck) -> Vec<String> {
    let mut messages = Vec::new();
    for beam in &deck.beams {
        let Path::Through(points) = &beam.path else { continue };
        let place = |point: &Spanned<PointRef>| crate::scene::place(deck, point);
        let Some(places) = points.iter().map(place).collect::<Option<Vec<Vec3>>>() else { continue };
        let ways: Vec<Vec3> = places.windows(2).map(|ends| ends[1] - ends[0]).collect();
        let angle = |pair: &[Vec3]| pair[0].cross(pair[1]).norm().atan2(pair[0].dot(pair[1]));
        let angles: Vec<f64> = ways.windows(2).map(angle).collect();
        let widest = angles.iter().fold(0.0, |widest: f64, &angle| widest.max(angle));
        if angles.len() >= 2 && (SMALLEST_BEND..LARGEST_BEND).contains(&widest) {
            messages.push(format!(
                "beam {}: its {} straight pieces meet at angles of up to {:.1}°; if they approximate a curve, the \
                 estimated errors do not include that approximation (use `arc`, `helix` or `spline`, or more points)",
                beam.name.value,
                ways.len(),
                widest.to_degrees()
            ));
        }
    }
    messages
}

/// Refuses stages whose rows differ from run to run: paths, and adaptive steps without an output
/// interval.
pub fn refuse_paths(deck: &Deck) -> Result<(), Diagnostic> {
    for stage in &deck.stages {
        let adapts = matches!(stage.body, StageBody::Dynamic { step_tolerance: Some(_), .. });
        let message = if matches!(stage.body, StageBody::Path { .. }) {
            "error bars need runs with common rows: arc length does not give them"
        } else if adapts && deck.output.interval.is_none() {
            "error bars need runs with common rows: with adaptive steps, set [output] interval"
        } else {
            continue;
        };
        return Err(Diagnostic::error(message, stage.span.clone()));
    }
    Ok(())
}

impl ErrorBars {
    /// Error bars that go on from a checkpoint.
    pub fn resume(deck: &Deck, scene: &Scene, saved: SavedBars) -> Self {
        let SavedBars { companions, largest, values } = saved;
        let companion = |SavedCompanion { moments, rows, divisors, next }: SavedCompanion| CompanionRun {
            outcome: Outcome::of_rows(scene, moments, rows),
            divisors,
            next,
        };
        Self {
            sampler: Sampler::of_rows(deck, scene, Vec::new(), Pace::Timeless),
            companions: companions.into_iter().map(companion).collect(),
            largest,
            values,
            tolerance: left_by_newton(deck),
        }
    }
}

impl SideColumns for ErrorBars {
    fn names(&self, columns: &[String]) -> Vec<String> {
        columns.iter().map(|column| format!("{column}.err")).collect()
    }

    fn take(&mut self, stage: usize, clock: f64, row: &[f64]) -> bool {
        let mut known = true;
        for (companion, largest) in self.companions.iter_mut().zip(&mut self.largest) {
            let there = match companion.outcome.presence(companion.next, StageClock { stage, clock }) {
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

    fn save(&self) -> SavedBars {
        let companion = |CompanionRun { outcome, divisors, next }: &CompanionRun| {
            let (moments, rows) = outcome.history().map(|(at, row)| (at, row.to_vec())).unzip();
            SavedCompanion { moments, rows, divisors: divisors.clone(), next: *next }
        };
        SavedBars {
            companions: self.companions.iter().map(companion).collect(),
            largest: self.largest.clone(),
            values: self.values.clone(),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        let estimate = |k: usize| self.largest.iter().map(|of_companion| of_companion[k]).sum::<f64>();
        (0..self.values.len()).map(|k| estimate(k) + self.tolerance * self.values[k]).collect()
    }
}
