//! What accuracy costs in time: a scene is run on several meshes, with several orders and steps; errors are held against a reference
//! that the study makes itself, and the cheapest run for each accuracy is found.

mod crew;
mod frontier;
mod grid;
mod journal;
mod order;
mod places;
mod reference;
mod sample;
mod table;
pub(in crate::study) mod trial;

pub use frontier::Knob;
pub use grid::{Family, Pace, Point};
pub use journal::Journal;
pub use order::{Expected, Order};
pub use reference::Reference;
pub use trial::{Patience, Seconds, Trial};

pub(in crate::study) use crew::Crew;
pub(in crate::study) use grid::{Mesher, dynamic_stages};
pub(in crate::study) use sample::{Sampler, Samples};

use crate::deck::{Deck, Diagnostic, InterpolationWord, NormWord, StageBody};
use crate::output::HistoryReader;
use crate::scene::Scene;
use crate::study::outcome::{Outcome, columns, find_column};
use beamsim_core::run::Failure;
use grid::Grid;
use std::time::Duration;

/// Outputs that a reference lacks, named one by one.
const LISTED: usize = 4;

/// What errors are held against.
pub enum Against {
    /// Runs finer than all others
    Finest,
    /// A stored history
    Table(HistoryReader),
    /// What the deck expects
    Expectations,
}

/// How a study is done.
pub struct Options<'a> {
    /// Runs at a time
    pub threads: usize,
    /// Runs are begun no later than this
    pub budget: Option<Duration>,
    /// Tells of signals
    pub interrupted: &'a (dyn Fn() -> Option<i32> + Sync),
    /// Runs that are done, of how many
    pub tell: &'a mut dyn FnMut(usize, usize),
    /// Where runs are kept as they end, so that a study goes on where it stopped
    pub journal: &'a mut Journal,
}

/// A run of the study.
pub struct Run {
    /// The variant
    pub point: Point,
    /// What makes it of the deck
    pub settings: Vec<String>,
    /// What came; `None` where the budget left it out
    pub trial: Option<Trial>,
    /// The error of each output; NaN where it cannot be compared
    pub errors: Vec<f64>,
    /// The largest of those that count; NaN where the run failed
    pub error: f64,
    /// What it takes
    pub timing: Timing,
    /// Whether no other run is both faster and at least as accurate
    pub frontier: bool,
    /// What its error comes from, for runs of the frontier
    pub limit: Option<Knob>,
}

/// The time of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Medians
    pub seconds: Seconds,
    /// The largest CPU time less the smallest, over the median
    pub spread: f64,
    /// How often it ran alone; none: it ran once, beside others
    pub alone: usize,
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
pub struct Study {
    /// The names of all outputs
    pub columns: Vec<String>,
    /// Numbers of those whose error counts
    pub outputs: Vec<usize>,
    /// How errors are measured
    pub norm: NormWord,
    /// Whether only the ends of runs have been compared, for want of other instants in common
    pub ends_only: bool,
    /// What errors are measured against
    pub reference: Reference,
    /// All runs, by family, mesh and pace
    pub runs: Vec<Run>,
    /// Orders of convergence
    pub orders: Vec<Orders>,
}

/// Why there is no study.
pub enum Refusal {
    /// Something in the deck
    Deck(Diagnostic),
    /// A run could not be made
    Failure(Failure),
}

/// Studies a deck, whose text is `text`.
pub fn study(text: &str, deck: &Deck, scene: &Scene, against: &Against, options: Options) -> Result<Study, Refusal> {
    let grid = Grid::of(deck);
    let (sampler, given) = sampler(deck, scene, &grid, against).map_err(Refusal::Deck)?;
    let mut crew = Crew::new(text, deck, &sampler, options);

    let mesher = Mesher { text, deck, sampler: &sampler, interpolation: None, keeps_places: false };
    let points = grid.points(&mesher);
    crew.expect(points.len());
    let reference = match given {
        Some(reference) => reference,
        None => finest(&mesher, &grid, &sampler, &mut crew)?,
    };
    let trials = crew.run(&points)?;
    let scales = sampler.scales(&reference.samples);
    sampler.refuse_nothing(&scales).map_err(Refusal::Deck)?;

    let mut runs: Vec<Run> = points
        .into_iter()
        .zip(trials)
        .map(|(point, trial)| Run::new(deck, text, &sampler, &reference.samples, &scales, point, trial))
        .collect();
    crew.time_alone(&mut runs, reference.least_told())?;
    frontier::mark(&mut runs, reference.least_told());
    let distance = |a: &Samples, b: &Samples| sampler.distance(a, b, &scales);
    frontier::find_limits(&mut runs, &mut crew, &distance)?;
    let orders = orders(deck, &grid, &sampler, &runs, &distance);
    Ok(Study {
        ends_only: sampler.looks_at_ends_only(deck, grid.paces[0]),
        outputs: sampler.outputs.clone(),
        norm: sampler.norm,
        columns: sampler.columns.clone(),
        reference,
        runs,
        orders,
    })
}

/// The reference that the study makes itself.
fn finest(mesher: &Mesher, grid: &Grid, sampler: &Sampler, crew: &mut Crew) -> Result<Reference, Refusal> {
    let points = reference::points(mesher, grid);
    crew.expect(points.len());
    let trials = crew.run_needed(&points)?;
    reference::establish(sampler, &points, &trials).map_err(|status| {
        let own = (status == "singular").then(|| crew.own_failure()).flatten();
        Refusal::Failure(own.unwrap_or(Failure::Limit(no_reference(&status))))
    })
}

fn no_reference(status: &str) -> String {
    match status {
        "interrupted" => "the budget is too small for the run that errors are measured against".into(),
        status => format!(
            "the run that errors are measured against ended with `{status}`: nothing finer can be compared with"
        ),
    }
}

/// What is looked at, and the reference where one is given.
fn sampler(
    deck: &Deck,
    scene: &Scene,
    grid: &Grid,
    against: &Against,
) -> Result<(Sampler, Option<Reference>), Diagnostic> {
    let outputs = outputs(deck, scene)?;
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
            (sampler, samples, "what the deck expects")
        }
    };
    let scales = sampler.scales(&samples);
    let compared = sampler.differences(&samples, &samples, &scales);
    let (known, lacking): (Vec<usize>, Vec<usize>) = sampler.outputs.iter().partition(|&&k| !compared[k].is_nan());
    if known.is_empty() {
        return Err(Diagnostic::whole(format!("{made} has no number for any output of the deck")));
    }
    let lacking: Vec<&str> = lacking.iter().map(|&k| sampler.columns[k].as_str()).collect();
    let made = match lacking.len() {
        0 => made.to_string(),
        1..=LISTED => format!("{made} (which says nothing of {})", lacking.join(", ")),
        more => format!("{made} (which says nothing of {more} outputs: {}, …)", lacking[..LISTED].join(", ")),
    };
    sampler.outputs = known;
    Ok((sampler, Some(Reference { samples, uncertainty: 0.0, made })))
}

/// Refuses a history that ends before the deck does: nothing is known of what follows.
fn reaches_the_end(deck: &Deck, stored: &Outcome) -> Result<(), Diagnostic> {
    let Some((k, last)) = deck.stages.iter().enumerate().rev().find(|(_, stage)| stage.body.writes_rows()) else {
        return Ok(());
    };
    let (stage, clock) = stored.clocks().last().unwrap_or((1, 0.0));
    let early = match last.body {
        StageBody::Dynamic { end, .. } if stage == k + 1 => last.until.is_none() && clock < end * (1.0 - 1e-9),
        _ => stage < k + 1,
    };
    if early {
        let message = format!("the given history ends at {clock:.6} of stage {stage}, before the deck does");
        let mut diagnostic = Diagnostic::error(message, last.span.clone());
        diagnostic.help = Some("give one of the whole deck, or shorten the deck by --set".into());
        return Err(diagnostic);
    }
    Ok(())
}

/// Numbers of the columns whose error counts.
fn outputs(deck: &Deck, scene: &Scene) -> Result<Vec<usize>, Diagnostic> {
    let columns = columns(scene);
    let Some(names) = &deck.cost.outputs else { return Ok((0..columns.len()).collect()) };
    names.iter().map(|name| find_column(&columns, name)).collect()
}

impl Run {
    fn new(
        deck: &Deck,
        text: &str,
        sampler: &Sampler,
        reference: &Samples,
        scales: &[f64],
        point: Point,
        trial: Option<Trial>,
    ) -> Self {
        let finished = trial.as_ref().filter(|trial| trial.finished());
        let errors = match finished {
            Some(trial) => sampler.differences(&trial.samples, reference, scales),
            None => vec![f64::NAN; sampler.columns.len()],
        };
        let seconds = trial.as_ref().map_or(Seconds { cpu: f64::NAN, wall: f64::NAN }, |trial| trial.seconds);
        Self {
            settings: point.settings(deck, text),
            error: sampler.worst(&errors),
            errors,
            timing: Timing { seconds, spread: f64::NAN, alone: 0 },
            frontier: false,
            limit: None,
            point,
            trial,
        }
    }

    /// What is compared, where the run came to its end.
    fn samples(&self) -> Option<&Samples> {
        self.trial.as_ref().filter(|trial| trial.finished()).map(|trial| &trial.samples)
    }
}

/// Orders of all families: in space with the finest pace, in time on the finest mesh.
fn orders(
    deck: &Deck,
    grid: &Grid,
    sampler: &Sampler,
    runs: &[Run],
    distance: &dyn Fn(&Samples, &Samples) -> f64,
) -> Vec<Orders> {
    let observed = |row: Vec<&Run>, width: &dyn Fn(&Run) -> f64| {
        let known: Vec<(f64, &Samples)> = row.iter().filter_map(|run| Some((width(run), run.samples()?))).collect();
        let widths: Vec<f64> = known.iter().map(|(width, _)| *width).collect();
        let distances: Vec<f64> = known.windows(2).map(|pair| distance(pair[0].1, pair[1].1)).collect();
        order::observed(&widths, &distances)
    };
    let finest_pace = grid.paces[grid.paces.len() - 1];
    let of_family = |family: &Family| {
        let own = || runs.iter().filter(|run| run.point.family == *family);
        // Runs of a family are in the order of their meshes.
        let finest = own().next_back().map(|run| run.point.elements.clone()).unwrap_or_default();
        let in_space = family.order.map(|order| Order {
            observed: observed(own().filter(|run| run.point.pace == finest_pace).collect(), &|run| run.point.width()),
            expected: sampler.order_in_space(order, family.interpolation == Some(InterpolationWord::Relative)),
        });
        let factor = |run: &Run| match run.point.pace {
            Pace::Steps(factor) => factor,
            Pace::Adapts(_) | Pace::Timeless => f64::NAN,
        };
        let in_time = matches!(finest_pace, Pace::Steps(_)).then(|| Order {
            observed: observed(own().filter(|run| run.point.elements == finest).collect(), &factor),
            expected: grid::order_in_time(deck, family),
        });
        Orders { family: family.clone(), space: in_space, time: in_time }
    };
    grid.families.iter().map(of_family).collect()
}
