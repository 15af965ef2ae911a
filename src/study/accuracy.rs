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

/// By what the difference to a run with other elements is divided to be the error: `ratio` is that of the widths of the other elements and
/// the own.
pub(super) fn divisor_in_space(ratio: f64, order: usize) -> f64 {
    (ratio.powf(order_in_space(order)) - 1.0).abs()
}

/// And to a run with twice the step.
pub(super) fn divisor_in_time() -> f64 {
    2.0_f64.powf(ORDER_IN_TIME) - 1.0
}

/// The first step over the deck's, at most; and how many steps a stage must have then.
const FIRST_STEP: f64 = 4.0;
const LEAST_STEPS: f64 = 32.0;

/// The first mesh over that of the deck, in nodes.
const FIRST_MESH: f64 = 0.5;

/// How much finer a mesh may become from round to round, and how little is worth a round.
const MESH_GROWS: [f64; 2] = [1.5, 4.0];

/// How often elements are doubled until there are more of them.
const MOST_DOUBLINGS: u32 = 6;

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
    let sampler = Sampler::of_rows(deck, scene, outputs(wanted, scene)?, coarser(pace));
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
    let mut search = Search { text, deck, wanted, sampler: &sampler, mesher, family, newton, mesh: FIRST_MESH, pace };
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
        for _ in 0..MOST_ROUNDS {
            let points = self.round();
            if points[0].count() * self.family.order.unwrap_or(1) > MOST_NODES {
                break;
            }
            crew.expect(points.len());
            let trials = crew.run(&points)?;
            let Some(trials) = trials.into_iter().collect::<Option<Vec<Trial>>>() else { break };
            runs += trials.len();
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
            Refusal::Failure(Failure::Limit("no run whose error could be estimated came to its end in time".into()))
        })
    }

    /// The variant of a round, and those that its error is estimated with.
    fn round(&self) -> Vec<Point> {
        let order = self.family.order;
        let fine = self.mesher.elements(order, self.mesh);
        let point = |elements: &Vec<Vec<usize>>, pace| Point {
            family: self.family.clone(),
            elements: elements.clone(),
            pace,
            newton: self.newton,
        };
        let mut points = vec![point(&fine, self.pace)];
        if order.is_some() {
            let coarse = self.mesher.elements(order, 0.5 * self.mesh);
            if coarse == fine {
                // One element has no half: a finer mesh stands for the variant then.
                let finer = (1..MOST_DOUBLINGS).map(|k| self.mesher.elements(order, self.mesh * f64::from(1 << k)));
                let finer = finer.into_iter().find(|finer| *finer != fine).unwrap_or(fine);
                points.insert(0, point(&finer, self.pace));
            } else {
                points.push(point(&coarse, self.pace));
            }
        }
        if matches!(self.pace, Pace::Steps(_)) {
            let elements = points[0].elements.clone();
            points.push(point(&elements, coarser(self.pace)));
        }
        points
    }

    fn estimate(&self, points: &[Point], trials: &[Trial]) -> Estimate {
        let infinite = Estimate { mesh: f64::INFINITY, step: f64::INFINITY, columns: Vec::new() };
        if !trials[0].finished() {
            return infinite;
        }
        let fine: &Samples = &trials[0].samples;
        let scales = self.sampler.scales(fine);
        let mut columns = vec![0.0; self.sampler.columns.len()];
        let mut share = |other: usize, divisor: f64| {
            if !trials[other].finished() {
                return f64::INFINITY;
            }
            let differences = self.sampler.differences(&trials[other].samples, fine, &scales);
            let errors: Vec<f64> = differences.iter().map(|d| d / divisor).collect();
            columns.iter_mut().zip(&errors).for_each(|(sum, e)| *sum += e);
            let over = |&k: &usize| errors[k] / self.wanted.of(&self.sampler.columns[k]);
            // Columns that are always zero cannot be compared; where none can, nothing is known.
            let largest = self.sampler.outputs.iter().map(over).fold(f64::NAN, f64::max);
            if largest.is_nan() { f64::INFINITY } else { largest }
        };
        let mut estimate = Estimate { mesh: 0.0, step: 0.0, columns: Vec::new() };
        for (k, point) in points.iter().enumerate().skip(1) {
            if point.pace == points[0].pace {
                let ratio = point.width() / points[0].width();
                estimate.mesh = share(k, divisor_in_space(ratio, point.family.order.unwrap_or(1)));
            } else {
                estimate.step = share(k, divisor_in_time());
            }
        }
        Estimate { columns, ..estimate }
    }

    /// Makes finer what the error comes from, by as much as its order tells: half of what is wanted is for each.
    fn refine(&mut self, estimate: &Estimate) {
        let steps = matches!(self.pace, Pace::Steps(_));
        let share = if steps && self.family.order.is_some() { 0.5 } else { 1.0 };
        if estimate.mesh > share {
            let order = order_in_space(self.family.order.unwrap_or(1));
            let factor = if estimate.mesh.is_finite() { (estimate.mesh / share).powf(1.0 / order) } else { 2.0 };
            self.mesh *= factor.clamp(MESH_GROWS[0], MESH_GROWS[1]);
        }
        if let Pace::Steps(factor) = self.pace
            && estimate.step > share
        {
            let halvings = if estimate.step.is_finite() { (estimate.step / share).log2() / 2.0 } else { 1.0 };
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
