//! A wanted accuracy instead of elements and steps: the deck is run on finer meshes and with smaller steps until the estimated error of all
//! outputs is below what is wanted.
//!
//! Each round runs up to three variants: the last of the search so far, one with twice its step, and one with half its elements and, after the
//! first round, that longer step too. The differences tell the errors of mesh and step: with a ratio r of widths and an order q,
//!
//! ```text
//! e = |U - U_coarse| / (r^q - 1)
//! ```
//!
//! where q is half an order less than smooth scenes have at the least, 2 for steps, the order of elements for resultants and one more for all else, or half way from
//! there to what is seen from round to round: so estimates are above errors. The error of the coarser run is r^q times that, so the cheapest
//! that is accurate enough is what is found.

mod candidates;
mod estimate;
mod round;
mod search;

use estimate::largest_tolerance;
pub(super) use estimate::{divisor_in_time, divisors_in_space, left_by_newton};

use super::cost::{Crew, Family, Mesher, Options, Pace, Patience, Point, Refusal, Sampler};
use crate::deck::{Accuracy, Deck, InterpolationWord, StageBody};
use crate::scene::Scene;
use crate::study::Outcome;
use beamsim_core::run::Failure;
use search::Search;

/// From this accuracy on, cubic elements are cheaper than quadratic ones.
const CUBIC: f64 = 3e-3;

/// The first step over the deck's, at most; and how many steps a stage must have then.
const FIRST_STEP: f64 = 2.0;
const LEAST_STEPS: f64 = 32.0;

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
    /// What stopped the search before it came to its end
    pub stopped: Option<Failure>,
    /// Variants that were run
    pub runs: usize,
    /// All outputs of the variant, where they were kept: it need not run again
    pub outcome: Option<Outcome>,
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
    let own: Vec<Vec<usize>> = deck.beams.iter().map(|beam| beam.elements.value.clone()).collect();
    let mut mesher =
        Mesher { text, deck, sampler: &sampler, interpolation: Some(InterpolationWord::Relative), keeps_places: true };
    if !mesher.makes_sense(None, &own) {
        // Some supports take hold of rotation vectors.
        mesher.interpolation = None;
    }
    let order = if wanted.least() < CUBIC { 3 } else { 2 };
    let bent = !deck.beams.is_empty();
    let family = Family {
        order: bent.then_some(order),
        interpolation: mesher.interpolation.filter(|_| bent),
        ..Family::default()
    };
    let newton = (NEWTON * wanted.least() / largest_tolerance(deck)).min(1.0);
    let crew = Crew::new(text, deck, &sampler, options)
        .with_patience(|point| if is_offer(point) { Patience::SHORT } else { Patience::LONG })
        .with_outcomes();
    Search::new(wanted, mesher, family, pace, newton).run(crew)
}

/// Whether its steps are longer than the deck's own: an offer, no more.
fn is_offer(point: &Point) -> bool {
    matches!(point.pace, Pace::Steps(factor) if factor > 1.0)
}

/// With twice the step.
fn coarser(pace: Pace) -> Pace {
    scaled(pace, 2.0)
}

/// With steps longer by this factor.
fn scaled(pace: Pace, by: f64) -> Pace {
    match pace {
        Pace::Steps(factor) => Pace::Steps(by * factor),
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
    for name in wanted.columns() {
        super::outcome::find_column(&columns, name).map_err(Refusal::Deck)?;
    }
    Ok((0..columns.len()).filter(|&k| wanted.of(&columns[k]).is_finite()).collect())
}
