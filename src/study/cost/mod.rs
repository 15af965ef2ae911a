//! The cost of accuracy: a scene is run on several meshes, with several orders and steps. Errors
//! are measured against a reference that the study computes itself, and the cheapest run for each
//! accuracy is found.

mod frontier;
mod grid;
mod journal;
mod limits;
mod mesher;
mod order;
mod placement;
mod places;
mod pool;
mod reference;
mod run;
mod sample;
mod table;
pub(in crate::study) mod trial;
mod variant;

pub use journal::Journal;
pub use order::{Expected, Order};
pub use reference::Reference;
pub use run::{CostRun, Limit, StudyOptions, Timing};
pub use trial::{Patience, Seconds, Trial};
pub use variant::{Family, Pace, Variant};

pub(in crate::study) use mesher::{Companion, Mesher};
pub(in crate::study) use placement::{PlacedPiece, Placement};
pub(in crate::study) use pool::Pool;
pub(in crate::study) use sample::{Sampler, Samples};
pub(in crate::study) use variant::{Original, dynamic_stages, may_take_lobatto, order_in_time};

use crate::deck::{Deck, Diagnostic, InterpolationWord, NormWord, StageBody};
use crate::output::HistoryReader;
use crate::scene::Scene;
use crate::study::StudyError;
use crate::study::outcome::{Outcome, StageClock, columns};
use crate::study::outputs;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::Failure;
use grid::Grid;
use run::Errors;

/// The largest number of outputs without a reference that are named one by one.
const LISTED: usize = 4;

/// The reference that errors are measured against.
pub enum Against {
    /// Runs finer than all others
    Finest,
    /// A stored history
    Table(HistoryReader),
    /// The values of `[[expect]]`
    Expectations,
}

/// Orders of convergence of a family.
pub struct Orders {
    /// The family
    pub family: Family,
    /// Over the width of the elements
    pub space: Option<Order>,
    /// Over the step
    pub time: Option<Order>,
}

/// The study of a scene.
pub struct CostStudy {
    /// The names of all outputs
    pub(crate) columns: Vec<String>,
    /// Numbers of those whose error counts
    pub outputs: Vec<usize>,
    /// How errors are measured
    pub(crate) norm: NormWord,
    /// True if only the ends of stages have been compared, because runs have no other instants in
    /// common
    pub ends_only: bool,
    /// The reference of the errors
    pub reference: Reference,
    /// All runs, by family, mesh and pace
    pub runs: Vec<CostRun>,
    /// Orders of convergence
    pub orders: Vec<Orders>,
}

/// Studies a deck, whose text is `text`.
pub fn study(
    text: &str,
    deck: &Deck,
    scene: &Scene,
    against: &Against,
    options: StudyOptions,
) -> Result<CostStudy, StudyError> {
    let original = Original { text, deck };
    let grid = Grid::of(deck, scene);
    let (sampler, given) = sampler(deck, scene, &grid, against)?;
    let mut pool = Pool::new(original, &sampler, options);

    let mesher = Mesher { original, sampler: &sampler, interpolation: None, keeps_places: false, placement: None };
    let variants = grid.variants(&mesher);
    pool.expect(variants.len());
    let reference = match given {
        Some(reference) => reference,
        None => finest(&mesher, &grid, &sampler, &mut pool)?,
    };
    let trials = pool.run(&variants)?;
    let scales = sampler.scales(&reference.samples);
    sampler.refuse_nothing(&scales)?;

    let mut runs: Vec<CostRun> = Vec::new();
    for (variant, trial) in variants.into_iter().zip(trials) {
        let errors = errors(&sampler, trial.as_ref(), &reference.samples, &scales);
        runs.push(CostRun::new(original, variant, trial, errors));
    }
    pool.time_alone(&mut runs, reference.resolution())?;
    frontier::mark(&mut runs, reference.resolution());
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, &scales);
    limits::find(&mut runs, &mut pool, &distance)?;
    let orders = orders(deck, &grid, &sampler, &runs, &distance);
    Ok(CostStudy {
        ends_only: sampler.compares_ends_only(deck, grid.paces[0]),
        outputs: sampler.outputs.clone(),
        norm: sampler.norm,
        columns: sampler.columns.clone(),
        reference,
        runs,
        orders,
    })
}

/// The errors of a trial; NaN where it did not finish.
fn errors(sampler: &Sampler, trial: Option<&Trial>, reference: &Samples, scales: &[f64]) -> Errors {
    let of_outputs = match trial.filter(|trial| trial.finished()) {
        Some(trial) => sampler.differences(&trial.samples, reference, scales),
        None => vec![f64::NAN; sampler.columns.len()],
    };
    Errors { worst: sampler.worst(&of_outputs), of_outputs }
}

/// The reference that the study makes itself.
fn finest(mesher: &Mesher, grid: &Grid, sampler: &Sampler, pool: &mut Pool) -> Result<Reference, StudyError> {
    let variants = reference::variants(mesher, grid);
    pool.expect(variants.len());
    let trials = pool.run_needed(&variants)?;
    if let Some(failed) = trials.iter().find(|trial| !trial.finished()) {
        let own = if failed.failed_as(FailureKind::Singular) { pool.own_failure() } else { None };
        return Err(StudyError::Failure(own.unwrap_or(Failure::Limit(no_reference(&failed.status)))));
    }
    Ok(reference::establish(sampler, &variants, &trials))
}

fn no_reference(status: &str) -> String {
    if FailureKind::of(status) == Some(FailureKind::Interrupted) {
        return "the budget is too small for the reference run".into();
    }
    format!("the reference run, which is finer than all others, ended with `{status}`")
}

/// The compared outputs, and the reference where one is given.
fn sampler(
    deck: &Deck,
    scene: &Scene,
    grid: &Grid,
    against: &Against,
) -> Result<(Sampler, Option<Reference>), Diagnostic> {
    let outputs = outputs_of(deck, scene)?;
    let (mut sampler, samples, made) = match against {
        Against::Finest => return Ok((Sampler::of_rows(deck, scene, outputs, grid.paces[0]), None)),
        Against::Table(table) => {
            let stored = Outcome::of_table(scene, table);
            reaches_the_end(deck, &stored)?;
            let sampler = Sampler::of_table(deck, scene, outputs, stored.clocks().collect());
            let samples = sampler.of(&stored);
            (sampler, samples, "the given history")
        }
        Against::Expectations => {
            let (sampler, samples) = Sampler::of_expectations(deck, scene);
            (sampler, samples, "the values of [[expect]]")
        }
    };
    let scales = sampler.scales(&samples);
    let compared = sampler.differences(&samples, &samples, &scales);
    let (known, lacking): (Vec<usize>, Vec<usize>) = sampler.outputs.iter().partition(|&&k| !compared[k].is_nan());
    if known.is_empty() {
        return Err(Diagnostic::whole(format!("{made} contains none of the outputs of the deck")));
    }
    let lacking: Vec<&str> = lacking.iter().map(|&k| sampler.columns[k].as_str()).collect();
    let made = match lacking.len() {
        0 => made.to_string(),
        1..=LISTED => format!("{made} (without values of {})", lacking.join(", ")),
        more => format!("{made} (without values of {more} outputs: {}, …)", lacking[..LISTED].join(", ")),
    };
    sampler.outputs = known;
    Ok((sampler, Some(Reference { samples, uncertainty: 0.0, made })))
}

/// Refuses a history that ends before the deck does.
fn reaches_the_end(deck: &Deck, stored: &Outcome) -> Result<(), Diagnostic> {
    let Some((k, last)) = deck.stages.iter().enumerate().rev().find(|(_, stage)| stage.body.kind().advances_state())
    else {
        return Ok(());
    };
    let start = StageClock { stage: 1, clock: 0.0 };
    let StageClock { stage, clock } = stored.clocks().last().unwrap_or(start);
    let ends_early = if let StageBody::Dynamic { end, .. } = last.body {
        last.until.is_none() && clock < end * (1.0 - 1e-9)
    } else {
        false
    };
    if stage < k + 1 || (stage == k + 1 && ends_early) {
        let message = format!("the given history ends at {clock:.6} of stage {stage}, before the deck does");
        let mut diagnostic = Diagnostic::error(message, last.span.clone());
        diagnostic.help = Some("use a history of the whole run, or shorten the run by --set".into());
        return Err(diagnostic);
    }
    Ok(())
}

/// The numbers of the columns whose error counts: all that have one, if none are named.
fn outputs_of(deck: &Deck, scene: &Scene) -> Result<Vec<usize>, Diagnostic> {
    let columns = columns(scene);
    match &deck.cost.outputs {
        Some(names) => outputs::named(&columns, names),
        None => outputs::all(&columns),
    }
}

/// Refuses a deck whose `[cost]` names outputs that have no error.
pub fn refuse_outputs(deck: &Deck, scene: &Scene) -> Result<(), Diagnostic> {
    let is_named = deck.cost.outputs.is_some();
    if is_named { outputs_of(deck, scene).map(|_| ()) } else { Ok(()) }
}

/// Orders of all families: in space with the finest pace, in time on the finest mesh.
fn orders(
    deck: &Deck,
    grid: &Grid,
    sampler: &Sampler,
    runs: &[CostRun],
    distance: &dyn Fn(&Samples, &Samples) -> f64,
) -> Vec<Orders> {
    let observed = |row: Vec<&CostRun>, width: &dyn Fn(&CostRun) -> f64| {
        let known: Vec<(f64, &Samples)> = row.iter().filter_map(|run| Some((width(run), run.samples()?))).collect();
        let widths: Vec<f64> = known.iter().map(|(width, _)| *width).collect();
        let distances: Vec<f64> = known.windows(2).map(|pair| distance(pair[0].1, pair[1].1)).collect();
        order::observed(&widths, &distances)
    };
    let finest_pace = grid.paces[grid.paces.len() - 1];
    let of_family = |family: &Family| {
        let own = || runs.iter().filter(|run| run.variant.family == *family);
        // The runs of a family are sorted by their meshes.
        let finest = own().next_back().map(|run| run.variant.elements.clone()).unwrap_or_default();
        let in_space = family.order.map(|order| Order {
            observed: observed(own().filter(|run| run.variant.pace == finest_pace).collect(), &|run| {
                run.variant.width()
            }),
            expected: sampler.order_in_space(order, family.interpolation == Some(InterpolationWord::Relative)),
        });
        let factor = |run: &CostRun| match run.variant.pace {
            Pace::Steps(factor) => factor,
            Pace::Adapts(_) | Pace::Timeless => f64::NAN,
        };
        let in_time = matches!(finest_pace, Pace::Steps(_)).then(|| Order {
            observed: observed(own().filter(|run| run.variant.elements == finest).collect(), &factor),
            expected: variant::order_in_time(deck, family),
        });
        Orders { family: family.clone(), space: in_space, time: in_time }
    };
    grid.families.iter().map(of_family).collect()
}
