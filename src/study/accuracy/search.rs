//! The search for a variant of a deck that is accurate enough.

use super::candidates::{Candidate, Estimate, Estimates};
use super::estimate::{Fall, Share, Source, left_by_newton};
use super::round::{Round, Trials};
use super::{CUBIC, Found, coarser, is_offer, scaled};
use crate::deck::{Accuracy, StageBody};
use crate::study::cost::{Crew, Family, Mesher, Pace, Point, Refusal, Sampler, Trial};
use beamsim_core::run::Failure;

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
const LOWER_ORDER: f64 = 0.1;

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

/// What comes after the first look at a round.
enum Next {
    /// Its errors are estimated.
    Estimates,
    /// Another round, from which this one has told enough
    Another,
    /// No other round would tell more.
    Nothing,
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
            let mut round = self.round();
            if self.is_too_large(&round.own) {
                ended = format!(" with fewer than {MOST_NODES} nodes and {MOST_STEPS:e} steps");
                break;
            }
            let trials = match (round.run(&mut crew), best.take()) {
                (Err(Refusal::Failure(stopped)), Some(found)) => {
                    return Ok(Found { runs, stopped: Some(stopped), ..found });
                }
                (trials, found) => {
                    best = found;
                    trials?
                }
            };
            let Some(trials) = trials else { break };
            runs += trials.runs;
            ended = format!("; the last of {runs} ended with `{}`", trials.own.status);
            match self.look_at(&round, &trials.own, best.is_none(), &crew)? {
                Next::Estimates => {}
                Next::Another => continue,
                Next::Nothing => break,
            }
            if trials.longer.as_ref().is_some_and(|longer| longer.status == "limit") {
                // A pace needs one twice as long to compare with.
                self.longest = scaled(self.pace, 0.5);
            }
            let estimates = self.estimates(&round, &trials);
            let chosen = self.choose(estimates.accurate_enough(&round), &mut crew, &mut runs);
            let found = self.found(round.own, &estimates.own, runs);
            match chosen {
                Err(Refusal::Failure(stopped)) => {
                    return Ok(Found { reached: false, stopped: Some(stopped), ..found });
                }
                chosen => {
                    if let Some(chosen) = chosen? {
                        return Ok(chosen);
                    }
                }
            }
            if found.ratio.is_finite() && best.as_ref().is_none_or(|best| found.ratio < best.ratio) {
                best = Some(found);
            }
            self.refine(&estimates.own);
        }
        best.map(|best| Found { runs, ..best }).ok_or_else(|| {
            let message = format!("no run came to its end whose error could be estimated{ended}");
            Refusal::Failure(Failure::Limit(message))
        })
    }

    /// How the variant of a round has ended; `first` where no round before told an error.
    fn look_at(&mut self, round: &Round, own: &Trial, first: bool, crew: &Crew) -> Result<Next, Refusal> {
        match own.status.as_str() {
            // No mesh mends that.
            "singular" if first => {
                let again = || Failure::Limit("the first run of the search ended with `singular`".into());
                Err(Refusal::Failure(crew.own_failure().unwrap_or_else(again)))
            }
            "singular" | "deck" => Ok(Next::Nothing),
            "finished" => {
                let scales = self.mesher.sampler.scales(&own.samples);
                self.mesher.sampler.refuse_nothing(&scales).map_err(Refusal::Deck)?;
                Ok(Next::Estimates)
            }
            // The longer step is no easier: two halvings leave one to compare with.
            "limit" if is_offer(&round.own) => {
                self.pace = scaled(self.pace, 0.25);
                self.longest = self.pace;
                Ok(Next::Another)
            }
            _ => Ok(Next::Estimates),
        }
    }

    /// The first of these that runs; one that the round has not run does so now, if the budget allows it.
    fn choose(&self, candidates: Vec<Candidate>, crew: &mut Crew, runs: &mut usize) -> Result<Option<Found>, Refusal> {
        for Candidate { point, estimate, has_run } in candidates {
            if !has_run {
                crew.expect(1);
                let Some(trial) = crew.run(std::slice::from_ref(&point))?.remove(0) else { continue };
                *runs += 1;
                if !trial.finished() {
                    continue;
                }
            }
            let outcome = crew.take_outcome(&point);
            return Ok(Some(Found { outcome, ..self.found(point, &estimate, *runs) }));
        }
        Ok(None)
    }

    fn is_too_large(&self, point: &Point) -> bool {
        let ends = self.mesher.deck.stages.iter().filter_map(|stage| match stage.body {
            StageBody::Dynamic { end, .. } => Some(end),
            _ => None,
        });
        let steps = point.step(self.mesher.deck).map_or(0.0, |step| ends.fold(0.0, f64::max) / step);
        point.count() * self.family.order.unwrap_or(1) > MOST_NODES || steps > MOST_STEPS
    }

    fn round(&self) -> Round {
        let order = self.family.order;
        let point = |elements: &Vec<Vec<usize>>, pace| Point {
            newton: self.newton,
            ..Point::new(self.family.clone(), elements.clone(), pace)
        };
        let own = point(&self.mesher.elements(order, self.mesh), self.pace);
        let step = |point: &Point| point.step(self.mesher.deck).unwrap_or(1.0);
        let longer = matches!(self.pace, Pace::Steps(_)) && self.in_time.known(&self.pace, own.width()).is_none();
        let longer = longer.then(|| point(&own.elements, coarser(self.pace)));
        let longer = longer.map(|longer| (longer.clone(), step(&longer) / step(&own)));
        let known = self.in_space.known(&(order, own.elements.clone()), stretch(self.pace)).is_some();
        // The first step may be too long for meshes to differ by what they differ by elsewhere.
        let is_first = self.in_time.last.is_empty();
        let pace = longer.as_ref().filter(|_| !is_first).map_or(self.pace, |(longer, _)| longer.pace);
        let remeshed = order.filter(|_| !known).map(|_| {
            let (other, ratio) = self.mesher.companion(order, &own.elements);
            (point(&other, pace), ratio)
        });
        Round { own, longer, remeshed }
    }

    fn estimates(&mut self, round: &Round, trials: &Trials) -> Estimates {
        if !trials.own.finished() {
            let unknown = || Share::unknown(self.mesher.sampler.columns.len());
            self.in_space.last = vec![((self.family.order, round.own.elements.clone()), unknown())];
            self.in_time.last = vec![(self.pace, unknown())];
            return Estimates { own: Estimate { mesh: unknown(), step: unknown() }, remeshed: None };
        }
        let step = self.share_of_steps(round, trials);
        let (mesh, remeshed) = self.shares_of_meshes(round, trials);
        Estimates { own: Estimate { mesh, step }, remeshed }
    }

    fn share_of_steps(&mut self, round: &Round, trials: &Trials) -> Share {
        let (own, width) = (&trials.own, round.own.step(self.mesher.deck).unwrap_or(1.0));
        let share = match (&round.longer, &trials.longer) {
            (Some((_, ratio)), longer) => {
                let pair = longer.as_ref().map(|longer| (own, longer));
                self.in_time.beside = round.own.width();
                let none = vec![false; self.mesher.sampler.columns.len()];
                let told = (self.mesher.sampler, self.wanted, &none[..]);
                share(&mut self.in_time.fall, Source::Steps, (width, *ratio), pair, told)
            }
            (None, _) => self.in_time.known(&self.pace, round.own.width()).unwrap_or_else(|| self.none()),
        };
        self.in_time.last = vec![(self.pace, share.clone())];
        share
    }

    /// Of the variant and of the other mesh.
    fn shares_of_meshes(&mut self, round: &Round, trials: &Trials) -> (Share, Option<Share>) {
        let mesh = |point: &Point| (self.family.order, point.elements.clone());
        let Some((other, ratio)) = &round.remeshed else {
            let known = self.in_space.known(&mesh(&round.own), stretch(self.pace)).unwrap_or_else(|| self.none());
            self.in_space.last = vec![(mesh(&round.own), known.clone())];
            return (known, None);
        };
        let own = if other.pace == round.own.pace { Some(&trials.own) } else { trials.longer.as_ref() };
        let pair = own.zip(trials.remeshed.as_ref());
        let source = Source::Mesh(self.family.order.unwrap_or(1));
        let is_finer = *ratio < 1.0;
        let (finer, ratio) = if is_finer { (other, 1.0 / ratio) } else { (&round.own, *ratio) };
        let pair = if is_finer { pair.map(|(own, other)| (other, own)) } else { pair };
        let between = self.mesher.between(self.family.order, &finer.elements);
        let told = (self.mesher.sampler, self.wanted, &between[..]);
        let of_finer = share(&mut self.in_space.fall, source, (finer.width(), ratio), pair, told);
        let of_wider = of_finer.of_coarser();
        let (of_own, of_other) = if is_finer { (of_wider, of_finer) } else { (of_finer, of_wider) };
        self.in_space.last = vec![(mesh(&round.own), of_own.clone()), (mesh(other), of_other.clone())];
        self.in_space.beside = stretch(other.pace);
        (of_own, Some(of_other))
    }

    fn none(&self) -> Share {
        Share::none(self.mesher.sampler.columns.len())
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
            outcome: None,
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

    /// Until another mesh comes of it than that of the last round: counts are rounded.
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

/// The steps over the deck's.
fn stretch(pace: Pace) -> f64 {
    match pace {
        Pace::Steps(factor) => factor,
        _ => 1.0,
    }
}

/// What a run and a coarser one tell of its error. Nothing is known of what a run that failed would tell, or one that is the same.
fn share(
    fall: &mut Fall,
    source: Source,
    (width, ratio): (f64, f64),
    pair: Option<(&Trial, &Trial)>,
    (sampler, wanted, between): (&Sampler, &Accuracy, &[bool]),
) -> Share {
    match pair {
        Some((own, coarser)) if own.finished() && coarser.finished() && ratio > 1.0 => {
            fall.share(source, (width, ratio), (&own.samples, &coarser.samples), (sampler, wanted, between))
        }
        _ => Share::unknown(sampler.columns.len()),
    }
}
