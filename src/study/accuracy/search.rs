//! The search for a variant of a deck that is accurate enough.

use super::candidates::{Candidate, Estimate, Estimates};
use super::estimate::{ErrorShare, Fall, Outputs, Pair, Source, jump_order, left_by_newton};
use super::indicator::{self, PlacedMesh};
use super::round::{Compared, Round, Trials};
use super::{CUBIC, Found, Meshes, coarser, has_long_steps, scaled};
use crate::deck::{Accuracy, Beam, SchemeName, Stage, StageBody};
use crate::study::StudyError;
use crate::study::cost::{Companion, Family, Mesher, Pace, Placement, Pool, Trial, Variant, order_in_time};
use beamsim_core::effect::ForceJump;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::Failure;
use std::sync::Arc;

/// The nodes of the first mesh over those of the deck.
const FIRST_MESH: f64 = 0.5;
/// The nodes of the first mesh over those of the deck, without dynamic stages and for a loose
/// accuracy.
const COARSE_MESH: f64 = 0.35;

/// The smallest and the largest factor of the nodes from round to round.
const MESH_GROWS: [f64; 2] = [1.3, 4.0];
/// The largest and the smallest factor of the nodes where a mesh becomes coarser.
const MESH_SHRINKS: [f64; 2] = [0.8, 0.25];

/// The largest number of halvings of a step from round to round.
const MOST_HALVINGS: f64 = 3.0;

/// The lowest order of a scheme with which steps are planned. A step that is too long costs little,
/// since the next round compares with it.
const LOWEST_ORDER: f64 = 2.0;

/// The error of steps over the allowed one from which on Lobatto's scheme with the same step is
/// tried: shorter steps of second order would be six times as many, and one of its steps takes as
/// long as three.
const WORTH_LOBATTO: f64 = 40.0;

/// The planned error over the allowed one.
const AIM: f64 = 0.9;

/// The smaller share of the error is not reduced below this part of the wanted error.
const MOST_OF_THE_LESSER: f64 = 0.7;

/// A share of the error below this part of the wanted error is not estimated again when only the
/// other source changes.
const SMALL: f64 = 0.7;
/// The largest change of the other source for that, in halvings.
const NEAR: f64 = 2.0;

/// A mesh whose share is below this part of the wanted error becomes coarser where the steps change
/// anyway; a larger share would leave too little to the steps, which cost more. A share below this
/// is kept however the other source changes.
const FINE_ENOUGH: f64 = 0.1;

/// On the coarsest mesh, a share below this part of the allowed one leads to elements of a lower
/// order.
const LOWER_ORDER: f64 = 0.1;

/// The largest number of rounds.
const MOST_ROUNDS: usize = 24;
/// The largest number of rounds with placed elements.
const MOST_PLACED_ROUNDS: usize = 4;

/// The smallest number of equal elements for each piece with which placing is tried.
const LEAST_PLACED: usize = 3;
/// The largest number of placed elements over that of equal ones with which placing is tried, as
/// predicted.
const WORTH_PLACING: f64 = 0.8;
/// The largest number of nodes.
const MOST_NODES: usize = 200_000;
/// The largest number of steps to the end of the run.
const MOST_STEPS: f64 = 2e6;

/// The allowed share of one source of errors beside the share of the other, both over the wanted
/// error.
fn allowed(share: f64, other: f64) -> f64 {
    if share < other && share < MOST_OF_THE_LESSER {
        // The larger share is reduced instead.
        MOST_OF_THE_LESSER
    } else if share >= other && other < MOST_OF_THE_LESSER {
        AIM * (1.0 - other)
    } else {
        AIM * 0.5
    }
}

/// A search in progress.
pub struct Search<'a> {
    wanted: &'a Accuracy,
    mesher: Mesher<'a>,
    family: Family,
    newton: f64,
    /// Factor of the nodes of the deck
    mesh: f64,
    pace: Pace,
    longest: Pace,
    /// True if Lobatto's scheme may be tried, and has not been
    may_take_lobatto: bool,
    /// What has jumped within steps of a run
    jump: Option<ForceJump>,
    in_space: KnownShares<Mesh>,
    in_time: KnownShares<Pace>,
    /// A variant with more work is not tried.
    most_work: f64,
}

/// A mesh: the order of its elements, and their numbers.
#[derive(Clone, PartialEq)]
struct Mesh {
    order: Option<usize>,
    elements: Vec<Vec<usize>>,
}

/// The known shares of one source of errors: the meshes, or the paces.
struct KnownShares<T> {
    fall: Fall,
    /// The shares of the last round
    last: Vec<(T, ErrorShare)>,
    /// The width of the other source in that round
    beside: f64,
}

impl<T: PartialEq> KnownShares<T> {
    fn new() -> Self {
        Self { fall: Fall::default(), last: Vec::new(), beside: 1.0 }
    }

    /// The share of a mesh, or pace, where it is known well enough for the present width of the
    /// other source.
    fn known(&self, of: &T, beside: f64) -> Option<ErrorShare> {
        let near = (beside / self.beside).log2().abs() <= NEAR;
        let largest = if near { SMALL } else { FINE_ENOUGH };
        let small = self.last.iter().find(|(last, share)| last == of && share.largest < largest);
        small.map(|(_, share)| share.clone())
    }
}

/// The next action of a search after the own run of a round.
enum Next {
    /// Estimate the errors of the round
    Estimates,
    /// Begin another round at once
    Another,
    /// End the search: no other round would give more
    Nothing,
}

impl<'a> Search<'a> {
    /// A search that begins with this family and pace.
    pub fn new(wanted: &'a Accuracy, mesher: Mesher<'a>, family: Family, pace: Pace, newton: f64) -> Self {
        let in_space = KnownShares::new();
        let in_time = KnownShares::new();
        let coarse = pace == Pace::Timeless && wanted.least() >= CUBIC;
        let mesh = if coarse { COARSE_MESH } else { FIRST_MESH };
        let most_work = f64::INFINITY;
        let may_take_lobatto = false;
        Self {
            wanted,
            mesher,
            family,
            newton,
            mesh,
            pace,
            longest: pace,
            may_take_lobatto,
            jump: None,
            in_space,
            in_time,
            most_work,
        }
    }

    /// The search with Lobatto's scheme among its means if `allowed`.
    pub fn with_lobatto(self, allowed: bool) -> Self {
        Self { may_take_lobatto: allowed, ..self }
    }

    /// Runs rounds until the wanted accuracy is reached, with equal elements (or the shape of the
    /// deck's mesh), then with placed ones if these promise to be fewer.
    pub fn run(&mut self, mut pool: Pool) -> Result<Found, StudyError> {
        let found = self.rounds(&mut pool, MOST_ROUNDS)?;
        if !found.reached || found.stopped.is_some() || pool.is_over() {
            return Ok(found);
        }
        self.with_placed_elements(found, &mut pool)
    }

    /// Runs rounds with placed elements, and gives the cheaper of both variants.
    fn with_placed_elements(&mut self, found: Found, pool: &mut Pool) -> Result<Found, StudyError> {
        let deck = self.mesher.original.deck;
        let elements = found.variant.elements_of_all(deck);
        let pieces: usize = deck.beams.iter().map(Beam::pieces).sum();
        if elements < LEAST_PLACED * pieces.max(1) {
            return Ok(found);
        }
        // A search that was stopped and goes on, or has too much to store, has no outcome.
        let strains = match found.outcome.as_ref().map(|outcome| outcome.strains.clone()) {
            Some(strains) => Ok(strains),
            None => pool.strains(&found.variant),
        };
        let strains = match strains {
            Ok(strains) => strains,
            Err(StudyError::Failure(stopped)) => return Ok(Found { reached: false, stopped: Some(stopped), ..found }),
            Err(other) => return Err(other),
        };
        let runs = found.runs;
        let Some(PlacedMesh { placement, ratio }) =
            strains.as_ref().and_then(|strains| indicator::place(&strains.beams))
        else {
            return Ok(found);
        };
        let equal = found.mesh_found(self.wanted, elements);
        let meshes = Meshes { equal, placed: None, predicted: ratio, is_placed: false };
        if ratio > WORTH_PLACING {
            return Ok(Found { runs, meshes: Some(meshes), ..found });
        }
        let work = found.variant.work_with(elements);
        self.place(placement, &found.variant, elements as f64 * ratio, work);
        match self.rounds(pool, MOST_PLACED_ROUNDS) {
            Ok(placed) if placed.stopped.is_some() => {
                Ok(Found { reached: false, stopped: placed.stopped, runs: runs + placed.runs, ..found })
            }
            Ok(placed) => {
                let mesh = placed.mesh_found(self.wanted, placed.variant.count());
                let is_placed = placed.reached && placed.variant.work() < work;
                let runs = runs + placed.runs;
                let meshes = Some(Meshes { placed: Some(mesh), is_placed, ..meshes });
                Ok(if is_placed { Found { runs, meshes, ..placed } } else { Found { runs, meshes, ..found } })
            }
            Err(StudyError::Failure(stopped @ Failure::Interrupted { .. })) => {
                Ok(Found { reached: false, stopped: Some(stopped), runs, ..found })
            }
            // No placed mesh gave an estimate.
            Err(_) => Ok(Found { runs, meshes: Some(meshes), ..found }),
        }
    }

    /// Goes on with placed elements, about so many in the whole scene.
    fn place(&mut self, placement: Placement, variant: &Variant, elements: f64, most_work: f64) {
        self.mesher.placement = Some(Arc::new(placement));
        let order = self.family.order;
        let one = self.mesher.original.deck.beams.iter().map(|beam| {
            let ratio = beam.order as f64 / order.unwrap_or(beam.order) as f64;
            ratio * (0..beam.pieces()).map(|piece| beam.elements_of(piece).count()).sum::<usize>() as f64
        });
        self.mesh = elements / one.sum::<f64>();
        self.pace = variant.pace;
        self.in_space = KnownShares::new();
        self.most_work = most_work;
    }

    /// Runs rounds until the wanted accuracy is reached.
    fn rounds(&mut self, pool: &mut Pool, most: usize) -> Result<Found, StudyError> {
        let mut best: Option<Found> = None;
        let mut runs = 0;
        let mut ended = String::from(" within the budget");
        for _ in 0..most {
            let mut round = self.round();
            if self.is_too_large(&round.own) {
                ended = format!(" with fewer than {MOST_NODES} nodes and {MOST_STEPS:e} steps");
                break;
            }
            if round.own.work() >= self.most_work {
                break;
            }
            let trials = match (round.run(pool), best.take()) {
                (Err(StudyError::Failure(stopped)), Some(found)) => {
                    return Ok(Found { runs, stopped: Some(stopped), ..found });
                }
                (trials, found) => {
                    best = found;
                    trials?
                }
            };
            let Some(trials) = trials else { break };
            runs += trials.runs;
            ended = format!("; the last of {runs} runs ended with `{}`", trials.own.status);
            match self.after_own_run(&round, &trials.own, best.is_none(), pool)? {
                Next::Estimates => {}
                Next::Another => continue,
                Next::Nothing => break,
            }
            if trials.longer.as_ref().is_some_and(|longer| longer.failed_as(FailureKind::Limit)) {
                // Estimates need a pace with twice the step.
                self.longest = scaled(self.pace, 0.5);
            }
            let estimates = self.estimates(&round, &trials);
            let chosen = self.choose(estimates.accurate_enough(&round), pool, &mut runs);
            let found = self.found(round.own, &estimates.own, runs);
            match chosen {
                Err(StudyError::Failure(stopped)) => {
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
            let message = format!("no finished run allowed an error estimate{ended}");
            StudyError::Failure(Failure::Limit(message))
        })
    }

    /// Decides by the end of the own run of a round; `first` is true while no error is known.
    fn after_own_run(&mut self, round: &Round, own: &Trial, first: bool, pool: &Pool) -> Result<Next, StudyError> {
        use FailureKind::{ContactStart, Deck, Limit, Singular};
        let failed = FailureKind::of(&own.status);
        if self.family.scheme.is_some() && matches!(failed, Some(Singular | Deck | ContactStart | Limit)) {
            self.leave_lobatto();
            return Ok(Next::Another);
        }
        match failed {
            // This fails on every mesh.
            Some(FailureKind::Singular) if first => {
                let again = || Failure::Limit("the first run of the search ended with `singular`".into());
                Err(StudyError::Failure(pool.own_failure().unwrap_or_else(again)))
            }
            Some(FailureKind::Singular | FailureKind::Deck | FailureKind::ContactStart) => Ok(Next::Nothing),
            None if own.finished() => {
                let scales = self.mesher.sampler.scales(&own.samples);
                self.mesher.sampler.refuse_nothing(&scales)?;
                Ok(Next::Estimates)
            }
            // The longer step would fail too. After two halvings there is one to compare with.
            Some(FailureKind::Limit) if has_long_steps(&round.own) => {
                self.pace = scaled(self.pace, 0.25);
                self.longest = self.pace;
                Ok(Next::Another)
            }
            Some(
                FailureKind::MeshTooCoarse
                | FailureKind::NotConverged
                | FailureKind::ContactPassed
                | FailureKind::SliderEnd
                | FailureKind::NonFinite
                | FailureKind::EnergyGrowth
                | FailureKind::Limit
                | FailureKind::Io
                | FailureKind::Interrupted,
            )
            | None => Ok(Next::Estimates),
        }
    }

    /// The first candidate that finishes. A candidate that the round has not run is run now, if the
    /// budget allows it.
    fn choose(
        &self,
        candidates: Vec<Candidate>,
        pool: &mut Pool,
        runs: &mut usize,
    ) -> Result<Option<Found>, StudyError> {
        for Candidate { variant, estimate, has_run } in candidates {
            if !has_run {
                pool.expect(1);
                let Some(trial) = pool.run(std::slice::from_ref(&variant))?.remove(0) else { continue };
                *runs += 1;
                if !trial.finished() {
                    continue;
                }
            }
            let outcome = pool.take_outcome(&variant);
            let seconds = pool.seconds(&variant);
            return Ok(Some(Found { outcome, seconds, ..self.found(variant, &estimate, *runs) }));
        }
        Ok(None)
    }

    fn is_too_large(&self, variant: &Variant) -> bool {
        let end = |stage: &Stage| if let StageBody::Dynamic { end, .. } = stage.body { Some(end) } else { None };
        let ends = self.mesher.original.deck.stages.iter().filter_map(end);
        let steps = variant.step(self.mesher.original.deck).map_or(0.0, |step| ends.fold(0.0, f64::max) / step);
        variant.count() * self.family.order.unwrap_or(1) > MOST_NODES || steps > MOST_STEPS
    }

    fn round(&self) -> Round {
        let order = self.family.order;
        let variant = |elements: &Vec<Vec<usize>>, pace| Variant {
            newton: self.newton,
            placement: self.mesher.placement.clone(),
            ..Variant::new(self.family.clone(), elements.clone(), pace)
        };
        let own = variant(&self.mesher.elements(order, self.mesh), self.pace);
        let step = |variant: &Variant| variant.step(self.mesher.original.deck).unwrap_or(1.0);
        let longer = matches!(self.pace, Pace::Steps(_)) && self.in_time.known(&self.pace, own.width()).is_none();
        let longer = longer.then(|| variant(&own.elements, coarser(self.pace)));
        let longer = longer.map(|longer| Compared { ratio: step(&longer) / step(&own), variant: longer });
        let known = self.in_space.known(&self.mesh_of(&own), stretch(self.pace)).is_some();
        // With a first step that is too long, meshes may differ by other amounts than later.
        let is_first = self.in_time.last.is_empty();
        let pace = longer.as_ref().filter(|_| !is_first).map_or(self.pace, |longer| longer.variant.pace);
        let remeshed = order.filter(|_| !known).map(|_| {
            let Companion { elements, ratio } = self.mesher.companion(order, &own.elements);
            Compared { variant: variant(&elements, pace), ratio }
        });
        Round { own, longer, remeshed }
    }

    fn mesh_of(&self, variant: &Variant) -> Mesh {
        Mesh { order: self.family.order, elements: variant.elements.clone() }
    }

    fn estimates(&mut self, round: &Round, trials: &Trials) -> Estimates {
        if !trials.own.finished() {
            self.leave_lobatto();
            let unknown = || ErrorShare::unknown(self.mesher.sampler.columns.len());
            self.in_space.last = vec![(self.mesh_of(&round.own), unknown())];
            self.in_time.last = vec![(self.pace, unknown())];
            return Estimates { own: Estimate { mesh: unknown(), step: unknown() }, remeshed: None };
        }
        let step = self.share_of_steps(round, trials);
        let (mut mesh, mut remeshed) = self.shares_of_meshes(round, trials);
        let order = self.family.order.unwrap_or(1);
        if trials.own.has_coarse_layers {
            mesh.raise_unresolved(order);
        }
        if let Some(share) =
            remeshed.as_mut().filter(|_| trials.remeshed.as_ref().is_some_and(|run| run.has_coarse_layers))
        {
            share.raise_unresolved(order);
        }
        Estimates { own: Estimate { mesh, step }, remeshed }
    }

    fn share_of_steps(&mut self, round: &Round, trials: &Trials) -> ErrorShare {
        let own = &trials.own;
        let order = self.order_in_time();
        let width = round.own.step(self.mesher.original.deck).unwrap_or(1.0);
        let share = match &round.longer {
            Some(Compared { ratio, .. }) => {
                let longer = trials.longer.as_ref();
                self.in_time.beside = round.own.width();
                let none = vec![false; self.mesher.sampler.columns.len()];
                let outputs = Outputs { sampler: self.mesher.sampler, wanted: self.wanted, between: &none };
                let pair = longer.and_then(|longer| pair(own, longer, width, *ratio));
                self.jump = self.jump.max(own.jump).max(longer.and_then(|longer| longer.jump));
                let source = self.jump.map_or(Source::Steps(order), Source::StepsWithJumps);
                share(&mut self.in_time.fall, source, pair, &outputs)
            }
            None => self.in_time.known(&self.pace, round.own.width()).unwrap_or_else(|| self.none()),
        };
        self.in_time.last = vec![(self.pace, share.clone())];
        share
    }

    /// The mesh errors of the variant and of that on the other mesh.
    fn shares_of_meshes(&mut self, round: &Round, trials: &Trials) -> (ErrorShare, Option<ErrorShare>) {
        let own_mesh = self.mesh_of(&round.own);
        let Some(Compared { variant: other, ratio }) = &round.remeshed else {
            let known = self.in_space.known(&own_mesh, stretch(self.pace)).unwrap_or_else(|| self.none());
            self.in_space.last = vec![(own_mesh, known.clone())];
            return (known, None);
        };
        let own = if other.pace == round.own.pace { Some(&trials.own) } else { trials.longer.as_ref() };
        let runs = own.zip(trials.remeshed.as_ref());
        let source = Source::Mesh(self.family.order.unwrap_or(1));
        let is_finer = *ratio < 1.0;
        let finer = if is_finer { other } else { &round.own };
        let ratio = if is_finer { 1.0 / ratio } else { *ratio };
        let pair = runs.and_then(|(own, other)| {
            if is_finer { pair(other, own, finer.width(), ratio) } else { pair(own, other, finer.width(), ratio) }
        });
        let between = self.mesher.between(self.family.order, &finer.elements);
        let outputs = Outputs { sampler: self.mesher.sampler, wanted: self.wanted, between: &between };
        let of_finer = share(&mut self.in_space.fall, source, pair, &outputs);
        let of_wider = of_finer.of_coarser();
        let (of_own, of_other) = if is_finer { (of_wider, of_finer) } else { (of_finer, of_wider) };
        self.in_space.last = vec![(own_mesh, of_own.clone()), (self.mesh_of(other), of_other.clone())];
        self.in_space.beside = stretch(other.pace);
        (of_own, Some(of_other))
    }

    fn none(&self) -> ErrorShare {
        ErrorShare::none(self.mesher.sampler.columns.len())
    }

    fn found(&self, variant: Variant, estimate: &Estimate, runs: usize) -> Found {
        let left = self.newton * left_by_newton(self.mesher.original.deck);
        let shares = estimate.mesh.columns.iter().zip(&estimate.step.columns);
        Found {
            changes: variant.changes(self.mesher.original),
            reached: estimate.ratio() <= 1.0,
            columns: self.mesher.sampler.columns.clone(),
            estimates: shares.map(|(mesh, step)| left + mesh + step).collect(),
            ratio: estimate.ratio(),
            stopped: None,
            jump: self.jump,
            runs,
            variant,
            outcome: None,
            seconds: f64::NAN,
            meshes: None,
        }
    }

    /// Refines the mesh or the steps, whichever causes the error, by as much as the order requires,
    /// and coarsens the one that is finer than necessary.
    fn refine(&mut self, estimate: &Estimate) {
        let mesh = estimate.mesh.largest;
        let step = estimate.step.largest;
        let of_mesh = allowed(mesh, step);
        let of_step = allowed(step, mesh);
        self.change_mesh(mesh, mesh / of_mesh, step > of_step);
        self.change_step(step / of_step, mesh > of_mesh);
    }

    /// Changes the mesh; `over` is its `share` over the allowed share.
    fn change_mesh(&mut self, share: f64, over: f64, other_changes: bool) {
        let Some(order) = self.family.order else { return };
        if over > 1.0 {
            let order = self.in_space.fall.low_order().unwrap_or(self.in_space.fall.planned_orders(order).assumed);
            let factor = if over.is_finite() { over.powf(1.0 / order) } else { 2.0 };
            self.mesh *= factor.clamp(MESH_GROWS[0], MESH_GROWS[1]);
            self.grow_past_the_last();
        } else if other_changes && over < LOWER_ORDER && order > 1 && self.is_coarsest() {
            self.family.order = Some(order - 1);
            self.in_space.fall = Fall::default();
        } else if other_changes && !self.is_coarsest() {
            let over = over.max(share / FINE_ENOUGH);
            let factor = over.powf(1.0 / self.in_space.fall.planned_orders(order).smooth);
            if factor < MESH_SHRINKS[0] {
                self.mesh *= factor.max(MESH_SHRINKS[1]);
            }
        }
    }

    /// Refines until the rounded numbers of elements differ from those of the last round.
    fn grow_past_the_last(&mut self) {
        let Some(last) = self.in_space.last.first().map(|(mesh, _)| mesh.clone()) else { return };
        let count = |elements: &[Vec<usize>]| elements.iter().flatten().sum::<usize>();
        let last = count(&last.elements);
        while count(&self.mesher.elements(self.family.order, self.mesh)) <= last && last < MOST_NODES {
            self.mesh *= MESH_GROWS[0];
        }
    }

    /// True if every piece has one element.
    fn is_coarsest(&self) -> bool {
        self.mesher.elements(self.family.order, self.mesh).iter().flatten().all(|&count| count == 1)
    }

    fn change_step(&mut self, over: f64, other_changes: bool) {
        let Pace::Steps(factor) = self.pace else { return };
        if over > WORTH_LOBATTO && over.is_finite() && self.may_take_lobatto && self.jump.is_none() {
            self.may_take_lobatto = false;
            self.set_scheme(Some(SchemeName::Lobatto));
        } else if over > 1.0 {
            let order = self.in_time.fall.low_order().unwrap_or(self.order_in_time());
            let halvings = if over.is_finite() { over.log2() / order } else { 1.0 };
            self.pace = Pace::Steps(factor * 0.5_f64.powf(halvings.round().clamp(1.0, MOST_HALVINGS)));
        } else if other_changes
            && over.is_finite()
            && over * 2.0_f64.powf(2.0 * self.order_in_time()) < 1.0
            && self.pace != self.longest
        {
            self.pace = coarser(self.pace);
        }
    }

    /// The order of the errors of steps, for smooth solutions if nothing jumps.
    fn order_in_time(&self) -> f64 {
        if let Some(jump) = self.jump {
            return jump_order(jump);
        }
        let expected = order_in_time(self.mesher.original.deck, &self.family);
        expected.map_or(LOWEST_ORDER, |expected| expected.order.max(LOWEST_ORDER))
    }

    /// Goes back to the scheme of the deck, where a run with Lobatto's has failed.
    fn leave_lobatto(&mut self) {
        if self.family.scheme.is_some() {
            self.set_scheme(None);
        }
    }

    fn set_scheme(&mut self, scheme: Option<SchemeName>) {
        self.family.scheme = scheme;
        self.in_time = KnownShares::new();
    }
}

/// The steps over those of the deck.
fn stretch(pace: Pace) -> f64 {
    match pace {
        Pace::Steps(factor) => factor,
        Pace::Timeless | Pace::Adapts(_) => 1.0,
    }
}

/// A finished run and a finished coarser one; `None` where they cannot be compared.
fn pair<'a>(own: &'a Trial, coarser: &'a Trial, width: f64, ratio: f64) -> Option<Pair<'a>> {
    let is_known = own.finished() && coarser.finished() && ratio > 1.0;
    is_known.then_some(Pair { own: &own.samples, coarser: &coarser.samples, width, ratio })
}

/// The error of the finer run of a pair; unknown without one.
fn share(fall: &mut Fall, source: Source, pair: Option<Pair>, outputs: &Outputs) -> ErrorShare {
    match pair {
        Some(pair) => fall.share(source, &pair, outputs),
        None => ErrorShare::unknown(outputs.sampler.columns.len()),
    }
}
