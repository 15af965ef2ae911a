//! The search for a variant of a deck that is accurate enough.

use super::estimate::{Fall, Share, Source, left_by_newton};
use super::{CUBIC, Found, coarser, is_offer, scaled};
use crate::deck::{Accuracy, StageBody};
use crate::drive::Failure;
use crate::study::cost::{Crew, Family, Mesher, Pace, Point, Refusal, Trial};

/// The first mesh over that of the deck, in nodes; and where steps cost nothing and a loose accuracy is wanted.
const FIRST_MESH: f64 = 0.5;
const COARSE_MESH: f64 = 0.35;

/// How much finer a mesh may become from round to round, and how little is worth a round; and how much coarser.
const MESH_GROWS: [f64; 2] = [1.3, 4.0];
const MESH_SHRINKS: [f64; 2] = [0.8, 0.25];

/// How often a step may be halved from round to round.
const MOST_HALVINGS: f64 = 3.0;

/// The order that steps are planned with. A step that turns out too long costs little: the next round needs it to compare with.
const PLANNED_ORDER: f64 = 2.0;

/// What is aimed at, of what is allowed.
const AIM: f64 = 0.9;

/// The lesser share of the error may stay as it is up to this.
const MOST_OF_THE_LESSER: f64 = 0.7;

/// A share of the error below this part of what is wanted is not looked at again when only the other changes, by no more than so many
/// halvings.
const SMALL: f64 = 0.7;
const NEAR: f64 = 2.0;

/// A mesh whose share is smaller becomes coarser where the other share calls for other runs anyway; a larger one leaves too little to
/// the steps, which cost more. A share below this holds whatever the other does.
const FINE_ENOUGH: f64 = 0.1;

/// A share of the coarsest mesh below this part of what it may be calls for elements of a lower order.
const LOWER_ORDER: f64 = 1e-2;

/// Rounds, nodes, and steps to the end of the run, at most.
const MOST_ROUNDS: usize = 24;
const MOST_NODES: usize = 200_000;
const MOST_STEPS: f64 = 2e6;

/// What one share of the error may be beside the other, over what is wanted: what the other leaves of it, or half.
fn allowed(share: f64, other: f64) -> f64 {
    match (share < other, share < MOST_OF_THE_LESSER, other < MOST_OF_THE_LESSER) {
        // The larger one makes room for it.
        (true, true, _) => MOST_OF_THE_LESSER,
        (false, _, true) => AIM * (1.0 - other),
        _ => AIM * 0.5,
    }
}

pub struct Search<'a> {
    wanted: &'a Accuracy,
    mesher: Mesher<'a>,
    family: Family,
    newton: f64,
    /// Factor of the nodes of the deck
    mesh: f64,
    pace: Pace,
    longest: Pace,
    in_space: Axis<(Option<usize>, Vec<Vec<usize>>)>,
    in_time: Axis<Pace>,
}

/// What is known of one of both shares.
struct Axis<T> {
    fall: Fall,
    /// The meshes, or paces, of the last round with their shares
    last: Vec<(T, Share)>,
    /// The width of what the other axis had when these were found
    beside: f64,
}

impl<T: PartialEq> Axis<T> {
    fn new() -> Self {
        Self { fall: Fall::default(), last: Vec::new(), beside: 1.0 }
    }

    /// The share of a mesh, or pace, where it is known well enough beside the other axis.
    fn known(&self, of: &T, beside: f64) -> Option<Share> {
        let near = (beside / self.beside).log2().abs() <= NEAR;
        let largest = if near { SMALL } else { FINE_ENOUGH };
        let small = self.last.iter().find(|(last, share)| last == of && share.largest < largest);
        small.map(|(_, share)| share.clone())
    }
}

/// The variants of a round: one, and those that tell the shares of its error, with ratios of widths.
struct Round {
    own: Point,
    on_coarser_mesh: Option<(Point, f64)>,
    with_longer_step: Option<(Point, f64)>,
}

impl Round {
    fn points(&self) -> Vec<Point> {
        let others = [&self.on_coarser_mesh, &self.with_longer_step].into_iter().flatten();
        std::iter::once(&self.own).chain(others.map(|(point, _)| point)).cloned().collect()
    }
}

/// The error of a variant.
struct Estimate {
    mesh: Share,
    step: Share,
}

impl Estimate {
    /// The largest of all outputs, over what is wanted of it
    fn ratio(&self) -> f64 {
        self.mesh.largest + self.step.largest
    }
}

impl<'a> Search<'a> {
    pub fn new(wanted: &'a Accuracy, mesher: Mesher<'a>, family: Family, pace: Pace, newton: f64) -> Self {
        let (in_space, in_time) = (Axis::new(), Axis::new());
        let coarse = pace == Pace::Timeless && wanted.least() >= CUBIC;
        let mesh = if coarse { COARSE_MESH } else { FIRST_MESH };
        Self { wanted, mesher, family, newton, mesh, pace, longest: pace, in_space, in_time }
    }

    pub fn run(&mut self, mut crew: Crew) -> Result<Found, Refusal> {
        let mut best: Option<Found> = None;
        let mut runs = 0;
        let mut ended = String::from(" within the budget");
        for _ in 0..MOST_ROUNDS {
            let round = self.round();
            if self.is_too_large(&round.own) {
                ended = format!(" with fewer than {MOST_NODES} nodes and {MOST_STEPS:e} steps");
                break;
            }
            let points = round.points();
            let trials = match (run_round(&mut crew, &points), best.take()) {
                (Err(Refusal::Failure(stopped)), Some(found)) => {
                    return Ok(Found { runs, stopped: Some(stopped), ..found });
                }
                (trials, found) => {
                    best = found;
                    trials?
                }
            };
            let Some(trials) = trials.into_iter().collect::<Option<Vec<Trial>>>() else { break };
            runs += trials.len();
            ended = format!("; the last of {runs} ended with `{}`", trials[0].status);
            match trials[0].status.as_str() {
                // No mesh mends that.
                "singular" if best.is_none() => {
                    let again = || Failure::Limit("the first run of the search ended with `singular`".into());
                    return Err(Refusal::Failure(crew.own_failure().unwrap_or_else(again)));
                }
                "finished" => {
                    let scales = self.mesher.sampler.scales(&trials[0].samples);
                    self.mesher.sampler.refuse_nothing(&scales).map_err(Refusal::Deck)?;
                }
                "singular" | "deck" => break,
                // The longer step is no easier: two halvings leave one to compare with.
                "limit" if is_offer(&round.own) => {
                    self.pace = scaled(self.pace, 0.25);
                    self.longest = self.pace;
                    continue;
                }
                _ => {}
            }
            if round.with_longer_step.is_some() && trials.last().is_some_and(|longer| longer.status == "limit") {
                // A pace needs one twice as long to compare with.
                self.longest = scaled(self.pace, 0.5);
            }
            let estimate = self.estimate(&round, &trials);
            let found = self.cheapest(round, &estimate, runs);
            if found.reached {
                return Ok(found);
            }
            if found.ratio.is_finite() && best.as_ref().is_none_or(|best| found.ratio < best.ratio) {
                best = Some(found);
            }
            self.refine(&estimate);
        }
        best.map(|best| Found { runs, ..best }).ok_or_else(|| {
            let message = format!("no run came to its end whose error could be estimated{ended}");
            Refusal::Failure(Failure::Limit(message))
        })
    }

    fn is_too_large(&self, point: &Point) -> bool {
        let ends = self.mesher.deck.stages.iter().filter_map(|stage| match stage.body {
            StageBody::Dynamic { end, .. } => Some(end),
            _ => None,
        });
        let steps = point.step(self.mesher.deck).map_or(0.0, |step| ends.fold(0.0, f64::max) / step);
        point.count() * self.family.order.unwrap_or(1) > MOST_NODES || steps > MOST_STEPS
    }

    /// The steps over the deck's.
    fn stretch(&self) -> f64 {
        match self.pace {
            Pace::Steps(factor) => factor,
            _ => 1.0,
        }
    }

    fn round(&self) -> Round {
        let order = self.family.order;
        let point = |elements: &Vec<Vec<usize>>, pace| Point {
            newton: self.newton,
            ..Point::new(self.family.clone(), elements.clone(), pace)
        };
        let mesh = self.mesher.elements(order, self.mesh);
        let known = self.in_space.known(&(order, mesh.clone()), self.stretch()).is_some();
        let (own, coarse) = match order.filter(|_| !known).map(|_| self.mesher.companion(order, &mesh)) {
            None => (mesh, None),
            Some((other, ratio)) if ratio > 1.0 => (mesh, Some((other, ratio))),
            // Where some piece has but one element, the finer mesh stands for the variant.
            Some((other, ratio)) => (other, Some((mesh, 1.0 / ratio))),
        };
        let on_coarser_mesh = coarse.map(|(coarse, ratio)| (point(&coarse, self.pace), ratio));
        let own = point(&own, self.pace);
        let step = |point: &Point| point.step(self.mesher.deck).unwrap_or(1.0);
        let longer = matches!(self.pace, Pace::Steps(_)) && self.in_time.known(&self.pace, own.width()).is_none();
        let longer = longer.then(|| point(&own.elements, coarser(self.pace)));
        let with_longer_step = longer.map(|longer| (longer.clone(), step(&longer) / step(&own)));
        Round { own, on_coarser_mesh, with_longer_step }
    }

    fn estimate(&mut self, round: &Round, trials: &[Trial]) -> Estimate {
        let (sampler, wanted) = (self.mesher.sampler, self.wanted);
        let unknown = || Share::unknown(sampler.columns.len());
        let none = || Share::none(sampler.columns.len());
        let mut others = trials[1..].iter();
        let mut share = |fall: &mut Fall, source, width, ratio: f64| match others.next() {
            Some(other) if other.finished() && trials[0].finished() && ratio > 1.0 => {
                let samples = (&trials[0].samples, &other.samples);
                fall.share(source, (width, ratio), samples, (sampler, wanted))
            }
            // Nothing is known of what a run that failed would tell, or one that is the same.
            _ => unknown(),
        };
        let mesh = (self.family.order, round.own.elements.clone());
        let of_mesh = match (&round.on_coarser_mesh, self.in_space.known(&mesh, self.stretch())) {
            (Some((_, ratio)), _) => {
                let source = Source::Mesh(self.family.order.unwrap_or(1));
                share(&mut self.in_space.fall, source, round.own.width(), *ratio)
            }
            (None, known) => known.unwrap_or_else(none),
        };
        let of_step = match (&round.with_longer_step, self.in_time.known(&self.pace, round.own.width())) {
            (Some((_, ratio)), _) => {
                let width = round.own.step(self.mesher.deck).unwrap_or(1.0);
                share(&mut self.in_time.fall, Source::Steps, width, *ratio)
            }
            (None, known) => known.unwrap_or_else(none),
        };
        let failed = !trials[0].finished();
        let coarser_mesh = round.on_coarser_mesh.as_ref().map(|(point, _)| (self.family.order, point.elements.clone()));
        self.in_space.last = vec![(mesh, of_mesh.clone())];
        self.in_space.last.extend(coarser_mesh.map(|mesh| (mesh, of_mesh.of_coarser())));
        self.in_time.last = vec![(self.pace, of_step.clone())];
        if round.on_coarser_mesh.is_some() {
            self.in_space.beside = self.stretch();
        }
        if round.with_longer_step.is_some() {
            self.in_time.beside = round.own.width();
        }
        if failed { Estimate { mesh: unknown(), step: unknown() } } else { Estimate { mesh: of_mesh, step: of_step } }
    }

    /// The cheapest variant of a round that is accurate enough, or its own.
    fn cheapest(&self, round: Round, own: &Estimate, runs: usize) -> Found {
        let mesh = |(point, _)| (point, Estimate { mesh: own.mesh.of_coarser(), step: own.step.clone() });
        let step = |(point, _)| (point, Estimate { mesh: own.mesh.clone(), step: own.step.of_coarser() });
        let others = round.on_coarser_mesh.map(mesh).into_iter().chain(round.with_longer_step.map(step));
        let enough = others.filter(|(_, estimate)| estimate.ratio() <= 1.0);
        let cheapest = enough.min_by(|(a, _), (b, _)| a.work().total_cmp(&b.work()));
        match cheapest {
            Some((point, estimate)) => self.found(point, &estimate, runs),
            None => self.found(round.own, own, runs),
        }
    }

    fn found(&self, point: Point, estimate: &Estimate, runs: usize) -> Found {
        let left = self.newton * left_by_newton(self.mesher.deck);
        let shares = estimate.mesh.columns.iter().zip(&estimate.step.columns);
        Found {
            settings: point.settings(self.mesher.deck, self.mesher.text),
            reached: estimate.ratio() <= 1.0,
            columns: self.mesher.sampler.columns.clone(),
            estimates: shares.map(|(mesh, step)| left + mesh + step).collect(),
            ratio: estimate.ratio(),
            stopped: None,
            runs,
            point,
        }
    }

    /// Makes finer what the error comes from, by as much as its order tells, and coarser what is finer than it must be.
    fn refine(&mut self, estimate: &Estimate) {
        let (mesh, step) = (estimate.mesh.largest, estimate.step.largest);
        let (of_mesh, of_step) = (allowed(mesh, step), allowed(step, mesh));
        self.change_mesh(mesh, mesh / of_mesh, step > of_step);
        self.change_step(step / of_step, mesh > of_mesh);
    }

    /// `over` is the `share` of the mesh over what it may be.
    fn change_mesh(&mut self, share: f64, over: f64, other_changes: bool) {
        let Some(order) = self.family.order else { return };
        if over > 1.0 {
            let order = self.in_space.fall.low_order().unwrap_or(self.in_space.fall.planned_orders(order).0);
            let factor = if over.is_finite() { over.powf(1.0 / order) } else { 2.0 };
            self.mesh *= factor.clamp(MESH_GROWS[0], MESH_GROWS[1]);
            self.grow_past_the_last();
        } else if other_changes && over < LOWER_ORDER && order > 1 && self.is_coarsest() {
            self.family.order = Some(order - 1);
            self.in_space.fall = Fall::default();
        } else if other_changes && !self.is_coarsest() {
            let over = over.max(share / FINE_ENOUGH);
            let factor = over.powf(1.0 / self.in_space.fall.planned_orders(order).1);
            if factor < MESH_SHRINKS[0] {
                self.mesh *= factor.max(MESH_SHRINKS[1]);
            }
        }
    }

    /// Until another mesh comes of it than that of the last round, which was finer than it should be where pieces had but one element.
    fn grow_past_the_last(&mut self) {
        let Some((_, last)) = self.in_space.last.first().map(|(mesh, _)| mesh.clone()) else { return };
        let count = |elements: &[Vec<usize>]| elements.iter().flatten().sum::<usize>();
        while count(&self.mesher.elements(self.family.order, self.mesh)) <= count(&last) && count(&last) < MOST_NODES {
            self.mesh *= MESH_GROWS[0];
        }
    }

    /// Whether every piece has one element.
    fn is_coarsest(&self) -> bool {
        self.mesher.elements(self.family.order, self.mesh).iter().flatten().all(|&count| count == 1)
    }

    fn change_step(&mut self, over: f64, other_changes: bool) {
        let Pace::Steps(factor) = self.pace else { return };
        if over > 1.0 {
            let order = self.in_time.fall.low_order().unwrap_or(PLANNED_ORDER);
            let halvings = if over.is_finite() { over.log2() / order } else { 1.0 };
            self.pace = Pace::Steps(factor * 0.5_f64.powf(halvings.round().clamp(1.0, MOST_HALVINGS)));
        } else if other_changes
            && over.is_finite()
            && over * 2.0_f64.powf(2.0 * PLANNED_ORDER) < 1.0
            && self.pace != self.longest
        {
            self.pace = coarser(self.pace);
        }
    }
}

/// Runs the variants of a round, `None` for those that the budget left out. A step on offer is tried alone: where it is too long for the
/// first one, nothing is compared with it.
fn run_round(crew: &mut Crew, points: &[Point]) -> Result<Vec<Option<Trial>>, Refusal> {
    let alone = if is_offer(&points[0]) { 1 } else { points.len() };
    crew.expect(alone);
    let mut trials = crew.run(&points[..alone])?;
    let is_lost = trials[0].as_ref().is_none_or(|trial| trial.status == "limit");
    if !is_lost && alone < points.len() {
        crew.expect(points.len() - alone);
        trials.extend(crew.run(&points[alone..])?);
    }
    Ok(trials)
}
