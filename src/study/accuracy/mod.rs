//! Elements and steps for a wanted accuracy: the deck is run on finer meshes and with smaller steps
//! until the estimated error of all outputs is below the wanted one.
//!
//! Each round runs up to three variants: the latest one of the search, one with twice its step, and
//! one with half its elements, which after the first round has the longer step too. The differences
//! give the errors of mesh and step. With a ratio r of widths and an order q,
//!
//! ```text
//! e = |U - U_coarse| / (r^q - 1)
//! ```
//!
//! For smooth solutions the order is at least 2 for steps, the order of the elements for
//! resultants, and one more for other columns. The estimate uses q half an order below that, or
//! half way from there to the order that is observed from round to round, so that estimates are
//! above errors. The error of the coarser run is r^q times that of the finer one, so that the
//! search can return the cheapest variant that is accurate enough.

mod candidates;
mod estimate;
mod indicator;
mod round;
mod search;

use estimate::largest_tolerance;
pub(super) use estimate::{divisor_in_time, divisors_in_space, left_by_newton};

use super::StudyError;
use super::change::Change;
use super::cost::{Family, Mesher, Original, Pace, Patience, Pool, Sampler, StudyOptions, Variant, may_take_lobatto};
use super::outputs;
use crate::deck::{Accuracy, Beam, Deck, Diagnostic, HistoryUse, InterpolationWord, StageBody};
use crate::scene::Scene;
use crate::study::Outcome;
use beamsim_core::effect::ForceJump;
use beamsim_core::run::{Failure, JumpKind, Plan, StageWork, rehearse};
use search::Search;

/// For a smaller wanted error than this, cubic elements are cheaper than quadratic ones.
const CUBIC: f64 = 3e-3;

/// The largest first step over that of the deck.
const FIRST_STEP: f64 = 2.0;
/// The smallest number of first steps in a stage.
const LEAST_STEPS: f64 = 32.0;

/// The smallest number of first steps in an interval of a smooth motion: one or two see nothing of its accelerations.
const LEAST_IN_MOTION: f64 = 4.0;
/// The smallest first step for such intervals, over that of the deck.
const SHORTEST_FIRST_STEP: f64 = 1.0 / 64.0;

/// The largest tolerance of Newton's method over the wanted error.
const NEWTON: f64 = 1e-3;

/// The result of a search.
pub struct Found {
    /// The variant of the deck
    pub variant: Variant,
    /// The changes that make it of the deck
    changes: Vec<Change>,
    /// True if all estimates are at most the wanted errors
    pub reached: bool,
    /// The names of all outputs
    pub(crate) columns: Vec<String>,
    /// The estimated error of each, over the largest value of its kind; NaN where there is nothing
    /// to compare
    pub(crate) estimates: Vec<f64>,
    /// The largest ratio of an estimate to the wanted error
    pub ratio: f64,
    /// The failure that stopped the search early
    pub stopped: Option<Failure>,
    /// What jumped within steps
    pub(crate) jump: Option<ForceJump>,
    /// The number of runs
    pub runs: usize,
    /// All outputs of the variant, where they were kept, so that it need not run again
    pub(crate) outcome: Option<Outcome>,
    /// CPU seconds of its run; NaN where it was not chosen
    seconds: f64,
    /// Equal and placed elements, where both were looked at
    pub meshes: Option<Meshes>,
}

/// Equal elements, and elements placed where the solution varies fast.
#[derive(Clone)]
pub struct Meshes {
    /// The best mesh of equal elements
    pub equal: MeshFound,
    /// The best mesh of placed elements; `None` where none gave an estimate with less work, or none was
    /// tried
    pub placed: Option<MeshFound>,
    /// The number of placed elements over that of equal ones with the same error, as predicted
    pub predicted: f64,
    /// True if the placed elements were taken
    pub is_placed: bool,
}

/// A mesh that was found.
#[derive(Clone)]
pub struct MeshFound {
    /// The number of elements of all beams
    pub elements: usize,
    /// True if all estimates are at most the wanted errors
    pub(crate) is_reached: bool,
    /// The output with the largest ratio of estimate to wanted error
    pub(crate) column: String,
    /// Its estimated error
    pub(crate) estimate: f64,
    /// CPU seconds of the run
    pub(crate) seconds: f64,
}

impl Found {
    /// The settings (`KEY=VALUE`) that make the variant.
    pub fn settings(&self) -> Vec<String> {
        self.changes.iter().map(ToString::to_string).collect()
    }

    /// Its mesh, with so many elements.
    fn mesh_found(&self, wanted: &Accuracy, elements: usize) -> MeshFound {
        let (column, estimate) = self.worst(wanted);
        MeshFound { elements, is_reached: self.reached, column: column.into(), estimate, seconds: self.seconds }
    }

    /// The output with the largest ratio of estimate to wanted error, and its estimate.
    pub fn worst(&self, wanted: &Accuracy) -> (&str, f64) {
        let over = |k: &usize| self.estimates[*k] / wanted.of(&self.columns[*k]);
        let known = (0..self.columns.len()).filter(|k| over(k).is_finite());
        known.max_by(|a, b| over(a).total_cmp(&over(b))).map_or(("", 0.0), |k| (&self.columns[k], self.estimates[k]))
    }
}

/// Finds a variant of the deck `text` whose estimated errors are at most the wanted ones; the best
/// variant so far if the budget ends before, or the mesh would have too many nodes.
pub fn reach(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    wanted: &Accuracy,
    options: StudyOptions,
) -> Result<Found, StudyError> {
    let original = Original { text, deck };
    let pace = first_pace(deck, &scene.plan);
    let sampler = Sampler::of_histories(deck, scene, outputs_of(wanted, scene)?, coarser(pace));
    let own: Vec<Vec<usize>> = deck.beams.iter().map(Beam::element_counts).collect();
    let mut mesher = Mesher {
        original,
        sampler: &sampler,
        interpolation: Some(InterpolationWord::Relative),
        keeps_places: true,
        placement: None,
    };
    if !mesher.makes_sense(None, &own) {
        // Supports of single rotation components need the total interpolation.
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
    let pool = Pool::new(original, &sampler, options)
        .with_patience(|variant| if has_long_steps(variant) { Patience::SHORT } else { Patience::LONG })
        .with_outcomes();
    Search::new(wanted, mesher, family, pace, newton).with_lobatto(may_take_lobatto(deck, scene)).run(pool)
}

/// True if the steps are longer than those of the deck. Such a variant may fail without harm: the
/// search goes on with shorter steps.
fn has_long_steps(variant: &Variant) -> bool {
    matches!(variant.pace, Pace::Steps(factor) if factor > 1.0)
}

/// The pace with twice the step.
fn coarser(pace: Pace) -> Pace {
    scaled(pace, 2.0)
}

/// The pace with steps multiplied by a factor.
fn scaled(pace: Pace, by: f64) -> Pace {
    match pace {
        Pace::Steps(factor) => Pace::Steps(by * factor),
        Pace::Timeless | Pace::Adapts(_) => pace,
    }
}

/// The first pace: the longest steps that leave each stage enough of them.
fn first_pace(deck: &Deck, plan: &Plan) -> Pace {
    let mut start = 0.0;
    let (mut fewest, mut longest) = (f64::INFINITY, 0.0_f64);
    for stage in &deck.stages {
        if let StageBody::Dynamic { end, step, .. } = stage.body {
            fewest = fewest.min((end - start) / step);
            longest = longest.max(step);
            start = end;
        }
    }
    if fewest.is_infinite() {
        return Pace::Timeless;
    }
    let in_motion = shortest_motion(deck) / (LEAST_IN_MOTION * longest);
    let factor = (fewest / LEAST_STEPS).min(in_motion.max(SHORTEST_FIRST_STEP)).log2().floor().exp2();
    let factor = factor.min(FIRST_STEP);
    let shorter = std::iter::successors(Some(factor), |factor| Some(0.5 * factor));
    let mut shorter = shorter.take_while(|&factor| factor >= SHORTEST_FIRST_STEP);
    // Where no step sees all loads, the run warns of it.
    Pace::Steps(shorter.find(|&factor| !misses_a_load(plan, factor)).unwrap_or(factor))
}

/// True if time steps multiplied by a factor do not see what drives the scene: all variants would agree without it.
fn misses_a_load(plan: &Plan, factor: f64) -> bool {
    let mut plan = plan.clone();
    for stage in &mut plan.stages {
        if let StageWork::Dynamic(steps) = &mut stage.work {
            steps.step *= factor;
            steps.adaptive = None;
        }
    }
    rehearse(&plan).jumps.iter().any(|jump| matches!(jump.how, JumpKind::BetweenSteps { .. }))
}

/// The shortest interval in which a smooth table moves a motion or a motor; infinite without any.
fn shortest_motion(deck: &Deck) -> f64 {
    let motors = deck.joints.iter().filter_map(|joint| joint.motor.as_ref()?.history.as_ref());
    let drives = deck.motions.iter().filter_map(|motion| motion.history.as_ref()).chain(motors);
    let of_drive = |drive: &HistoryUse| {
        let history = deck.histories.iter().find(|history| history.name.value == drive.name.value)?;
        history.body.shortest_smooth_step()
    };
    drives.filter_map(of_drive).fold(f64::INFINITY, f64::min)
}

/// Refuses a deck whose `accuracy` names columns that have no error, or has no outputs with one.
pub fn refuse_outputs(deck: &Deck, scene: &Scene) -> Result<(), Diagnostic> {
    deck.accuracy.as_ref().map_or(Ok(()), |wanted| outputs_of(wanted, scene).map(|_| ()))
}

/// The numbers of the columns of which an accuracy is wanted: all that have an error, if none are
/// named.
fn outputs_of(wanted: &Accuracy, scene: &Scene) -> Result<Vec<usize>, Diagnostic> {
    let columns = super::outcome::columns(scene);
    match wanted {
        Accuracy::All(_) => outputs::all(&columns),
        Accuracy::Columns(_) => {
            outputs::named(&columns, wanted.columns())?;
            // A name may stand for the columns of several stages.
            Ok((0..columns.len()).filter(|&k| wanted.of(&columns[k]).is_finite()).collect())
        }
    }
}
