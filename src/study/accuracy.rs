//! A wanted accuracy instead of elements and steps: the deck is run on finer meshes and with smaller steps until the estimated error of all
//! outputs is below what is wanted.
//!
//! Each round runs three variants, the last of the search so far, one with half its elements and one with twice its step. The differences
//! tell the errors of mesh and step: with a ratio r of widths and an order q,
//!
//! ```text
//! e = |U - U_coarse| / (r^q - 1)
//! ```
//!
//! where q is half an order less than smooth scenes have at the least, 2 for steps and one more than the order of elements: so estimates are
//! above errors.

use super::cost::{Crew, Family, Mesher, Options, Pace, Point, Refusal, Sampler, Samples, Trial, trial};
use crate::deck::{Accuracy, Deck, Diagnostic, InterpolationWord, StageBody};
use crate::drive::Failure;
use crate::scene::Scene;

/// From this accuracy on, cubic elements are cheaper than quadratic ones.
const CUBIC: f64 = 3e-3;

/// The order of the error over the step that estimates count on.
const ORDER_IN_TIME: f64 = 1.5;

/// And over the width of elements of an order.
fn order_in_space(order: usize) -> f64 {
    order as f64 + 0.5
}

/// The lowest order that is believed.
const LEAST_ORDER: f64 = 0.5;

/// What Newton's method leaves of its tolerance.
pub(super) const LEFT_BY_NEWTON: f64 = 1e-2;

/// By what the difference to a run with other elements is divided to be the error: `ratio` is that of the widths of the other elements and
/// the own.
pub(super) fn divisor_in_space(ratio: f64, order: usize) -> f64 {
    divisor(ratio, order_in_space(order))
}

/// And to a run with other steps.
pub(super) fn divisor_in_time(ratio: f64) -> f64 {
    divisor(ratio, ORDER_IN_TIME)
}

fn divisor(ratio: f64, order: f64) -> f64 {
    (ratio.powf(order) - 1.0).abs()
}

/// The order from two rounds, each with a width and the difference between two runs; at most that which is assumed.
fn order_seen(assumed: f64, before: (f64, f64), now: (f64, f64)) -> f64 {
    let seen = (before.1 / now.1).ln() / (before.0 / now.0).ln();
    if before.0 > now.0 && seen < assumed { seen.max(LEAST_ORDER) } else { assumed }
}

/// The first step over the deck's, at most; and how many steps a stage must have then.
const FIRST_STEP: f64 = 4.0;
const LEAST_STEPS: f64 = 32.0;

/// The first mesh over that of the deck, in nodes.
const FIRST_MESH: f64 = 0.5;

/// How much finer a mesh may become from round to round, and how little is worth a round.
const MESH_GROWS: [f64; 2] = [1.5, 4.0];

/// How often a step may be halved from round to round.
const MOST_HALVINGS: i32 = 3;

/// Rounds, and nodes, at most.
const MOST_ROUNDS: usize = 16;
const MOST_NODES: usize = 200_000;

/// The tolerance of Newton's method over the wanted accuracy, at most.
const NEWTON: f64 = 1e-3;

/// What a search found.
pub struct Found {
    /// The variant of the deck
    pub point: Point,
    /// What makes it of the deck
    pub settings: Vec<String>,
    /// Whether the estimate is what was wanted
    pub reached: bool,
    /// The names of all outputs
    pub columns: Vec<String>,
    /// The estimated error of each, over the largest value of its kind; NaN where there is nothing to compare
    pub estimates: Vec<f64>,
    /// The largest estimate over what is wanted of its output
    pub ratio: f64,
    /// Variants that were run
    pub runs: usize,
}

impl Found {
    /// The output whose estimate is largest, and the estimate.
    pub fn worst(&self, wanted: &Accuracy) -> (&str, f64) {
        let over = |k: &usize| self.estimates[*k] / wanted.of(&self.columns[*k]);
        let known = (0..self.columns.len()).filter(|k| over(k).is_finite());
        known.max_by(|a, b| over(a).total_cmp(&over(b))).map_or(("", 0.0), |k| (&self.columns[k], self.estimates[k]))
    }
}

/// Finds a variant of the deck `text` whose estimated errors are what is wanted. Where the budget is over before, or it would take too many
/// nodes, the best one that was found.
pub fn reach(text: &str, deck: &Deck, scene: &Scene, wanted: &Accuracy, options: Options) -> Result<Found, Refusal> {
    let pace = first_pace(deck);
    let sampler = Sampler::of_histories(deck, scene, outputs(wanted, scene)?, coarser(pace));
    let interpolation = |word| Family { order: None, interpolation: word, scheme: None };
    let relative = Point {
        family: interpolation(Some(InterpolationWord::Relative)),
        elements: deck.beams.iter().map(|beam| beam.elements.value.clone()).collect(),
        pace: Pace::Timeless,
        newton: 1.0,
    };
    // Some supports take hold of rotation vectors.
    let word =
        trial::makes_sense(text, &relative.settings(deck, text), &sampler).then_some(InterpolationWord::Relative);
    let order = if wanted.least() < CUBIC { 3 } else { 2 };
    let family = Family { order: (!deck.beams.is_empty()).then_some(order), ..interpolation(word) };
    let makes_sense = |order: Option<usize>, elements: &[Vec<usize>]| {
        let family = Family { order, ..interpolation(word) };
        let point = Point { family, elements: elements.to_vec(), pace: Pace::Timeless, newton: 1.0 };
        trial::makes_sense(text, &point.settings(deck, text), &sampler)
    };
    let mesher = Mesher { deck, makes_sense: &makes_sense };
    let tolerance = deck.stages.iter().map(|stage| stage.tolerance).fold(0.0, f64::max);
    let newton = (NEWTON * wanted.least() / tolerance).min(1.0);
    let mut search = Search {
        text,
        deck,
        wanted,
        sampler: &sampler,
        mesher,
        family,
        newton,
        mesh: FIRST_MESH,
        pace,
        ratio: 1.0,
        in_space: Knob::default(),
        in_time: Knob::default(),
    };
    search.run(Crew::new(text, deck, &sampler, options))
}

struct Search<'a> {
    text: &'a str,
    deck: &'a Deck,
    wanted: &'a Accuracy,
    sampler: &'a Sampler,
    mesher: Mesher<'a>,
    family: Family,
    newton: f64,
    /// Factor of the nodes of the deck
    mesh: f64,
    pace: Pace,
    /// How many times as wide elements of the coarser mesh of a round are
    ratio: f64,
    in_space: Knob,
    in_time: Knob,
}

/// What is known of how an error falls.
#[derive(Default)]
struct Knob {
    /// Of the round before: a width, and the largest difference over what is wanted
    before: Option<(f64, f64)>,
    /// The order of the last round
    order: Option<f64>,
}

impl Knob {
    /// The order that an error falls with: the assumed one, or that from round to round where it is lower. Waves with fronts, for one, have a
    /// low one.
    fn order(&mut self, assumed: f64, now: (f64, f64)) -> f64 {
        let order = self.before.map_or(assumed, |before| order_seen(assumed, before, now));
        (self.before, self.order) = (Some(now), Some(order));
        order
    }
}

/// The difference of each column to a finer run.
fn differences(sampler: &Sampler, coarse: &Samples, fine: &Samples) -> Vec<f64> {
    sampler.differences(coarse, fine, &sampler.scales(fine))
}

/// The largest over what is wanted; infinite where nothing can be compared: columns that are always zero cannot.
fn largest(sampler: &Sampler, wanted: &Accuracy, differences: &[f64]) -> f64 {
    let over = |&k: &usize| differences[k] / wanted.of(&sampler.columns[k]);
    let largest = sampler.outputs.iter().map(over).fold(f64::NAN, f64::max);
    if largest.is_nan() { f64::INFINITY } else { largest }
}

/// Estimated errors of a round, over what is wanted: the largest of all outputs. Infinite where a run failed.
struct Estimate {
    mesh: f64,
    step: f64,
    columns: Vec<f64>,
}

impl Search<'_> {
    fn run(&mut self, mut crew: Crew) -> Result<Found, Refusal> {
        let mut best: Option<Found> = None;
        let mut runs = 0;
        let mut ended = String::from(" within the budget");
        for _ in 0..MOST_ROUNDS {
            let points = self.round();
            if points[0].count() * self.family.order.unwrap_or(1) > MOST_NODES {
                break;
            }
            crew.expect(points.len());
            let trials = crew.run(&points)?;
            let Some(trials) = trials.into_iter().collect::<Option<Vec<Trial>>>() else { break };
            runs += trials.len();
            ended = format!("; the last of {runs} ended with `{}`", trials[0].status);
            if ["singular", "deck"].contains(&trials[0].status.as_str()) {
                break; // No mesh mends that.
            }
            let estimate = self.estimate(&points, &trials);
            let ratio = estimate.mesh + estimate.step;
            let found = Found {
                settings: points[0].settings(self.deck, self.text),
                reached: ratio <= 1.0,
                columns: self.sampler.columns.clone(),
                estimates: estimate.columns.clone(),
                ratio,
                runs,
                point: points[0].clone(),
            };
            if found.reached {
                return Ok(found);
            }
            if ratio.is_finite() && best.as_ref().is_none_or(|best| ratio < best.ratio) {
                best = Some(found);
            }
            self.refine(&estimate);
        }
        best.map(|best| Found { runs, ..best }).ok_or_else(|| {
            let message = format!("no run came to its end whose error could be estimated{ended}");
            Refusal::Failure(Failure::Limit(message))
        })
    }

    /// The variant of a round, and those that its error is estimated with.
    fn round(&mut self) -> Vec<Point> {
        let order = self.family.order;
        let fine = self.mesher.elements(order, self.mesh);
        let point = |elements: &Vec<Vec<usize>>, pace| Point {
            family: self.family.clone(),
            elements: elements.clone(),
            pace,
            newton: self.newton,
        };
        let mut points = vec![point(&fine, self.pace)];
        self.ratio = 1.0;
        if order.is_some() {
            let (other, ratio) = self.mesher.companion(order, &fine);
            // Where some piece has but one element, the finer mesh stands for the variant.
            points.insert(if ratio > 1.0 { 1 } else { 0 }, point(&other, self.pace));
            self.ratio = ratio.max(1.0 / ratio);
        }
        if matches!(self.pace, Pace::Steps(_)) {
            let elements = points[0].elements.clone();
            points.push(point(&elements, coarser(self.pace)));
        }
        points
    }

    fn estimate(&mut self, points: &[Point], trials: &[Trial]) -> Estimate {
        let mut columns = vec![self.left_by_newton(); self.sampler.columns.len()];
        let mut estimate = Estimate { mesh: 0.0, step: 0.0, columns: Vec::new() };
        if !trials[0].finished() {
            return Estimate { mesh: f64::INFINITY, step: f64::INFINITY, columns };
        }
        let step = |point: &Point| point.step(self.deck).unwrap_or(1.0);
        let own = step(&points[0]);
        for (point, trial) in points.iter().zip(trials).skip(1) {
            let in_space = point.pace == points[0].pace;
            let (width, ratio, order) = match in_space {
                true => (1.0 / self.mesh, self.ratio, order_in_space(point.family.order.unwrap_or(1))),
                false => (own, step(point) / own, ORDER_IN_TIME),
            };
            let knob = if in_space { &mut self.in_space } else { &mut self.in_time };
            let share = match trial.finished() && ratio > 1.0 {
                true => {
                    let differences = differences(self.sampler, &trial.samples, &trials[0].samples);
                    let largest = largest(self.sampler, self.wanted, &differences);
                    let divisor = divisor(ratio, knob.order(order, (width, largest)));
                    columns.iter_mut().zip(&differences).for_each(|(sum, d)| *sum += d / divisor);
                    largest / divisor
                }
                // Nothing is known of what a run that failed would tell, or one that is the same.
                false => f64::INFINITY,
            };
            *(if in_space { &mut estimate.mesh } else { &mut estimate.step }) = share;
        }
        Estimate { columns, ..estimate }
    }

    /// What Newton's method leaves, about: its last iteration does better than it must.
    fn left_by_newton(&self) -> f64 {
        let tolerance = self.deck.stages.iter().map(|stage| stage.tolerance).fold(0.0, f64::max);
        LEFT_BY_NEWTON * self.newton * tolerance
    }

    /// Makes finer what the error comes from, by as much as its order tells: half of what is wanted is for each.
    fn refine(&mut self, estimate: &Estimate) {
        let steps = matches!(self.pace, Pace::Steps(_));
        let share = if steps && self.family.order.is_some() { 0.5 } else { 1.0 };
        if estimate.mesh > share {
            let order = self.in_space.order.unwrap_or(1.0);
            let factor = if estimate.mesh.is_finite() { (estimate.mesh / share).powf(1.0 / order) } else { 2.0 };
            self.mesh *= factor.clamp(MESH_GROWS[0], MESH_GROWS[1]);
        }
        if let Pace::Steps(factor) = self.pace
            && estimate.step > share
        {
            let halvings = if estimate.step.is_finite() {
                (estimate.step / share).log2() / self.in_time.order.unwrap_or(1.0)
            } else {
                1.0
            };
            self.pace = Pace::Steps(factor * 0.5_f64.powi((halvings.ceil() as i32).clamp(1, MOST_HALVINGS)));
        }
    }
}

fn coarser(pace: Pace) -> Pace {
    match pace {
        Pace::Steps(factor) => Pace::Steps(2.0 * factor),
        other => other,
    }
}

/// Steps as long as leave a stage enough of them.
fn first_pace(deck: &Deck) -> Pace {
    let mut start = 0.0;
    let mut fewest = f64::INFINITY;
    for stage in &deck.stages {
        if let StageBody::Dynamic { end, step, .. } = stage.body {
            fewest = fewest.min((end - start) / step);
            start = end;
        }
    }
    if fewest.is_infinite() {
        return Pace::Timeless;
    }
    let factor = (fewest / LEAST_STEPS).log2().floor().exp2();
    Pace::Steps(factor.min(FIRST_STEP))
}

/// Numbers of the columns of which an accuracy is wanted.
fn outputs(wanted: &Accuracy, scene: &Scene) -> Result<Vec<usize>, Refusal> {
    let columns = super::outcome::columns(scene);
    if let Some(unknown) = wanted.columns().find(|name| !columns.contains(name)) {
        let message = format!("`accuracy` names `{unknown}`, which is no column of the history");
        return Err(Refusal::Deck(Diagnostic::whole(message)));
    }
    Ok((0..columns.len()).filter(|&k| wanted.of(&columns[k]).is_finite()).collect())
}
