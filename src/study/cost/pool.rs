//! The pool that runs variants, several at a time, and times the best of them alone.

use super::frontier;
use super::run::{CostRun, StudyOptions, Timing};
use super::sample::Sampler;
use super::trial::{self, Kept, Patience, Seconds, Trial};
use super::variant::{Original, Variant};
use crate::study::StudyError;
use crate::study::change::Change;
use crate::study::outcome::Outcome;
use crate::study::parallel::in_parallel;
use crate::study::strains::StrainRecord;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::{Failure, Moment};
use beamsim_core::sorting::{sort_by, sort_numbers};
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Total time of a run that is timed alone, in seconds: it is repeated until then.
const TIMED_SECONDS: f64 = 0.3;
/// The smallest and the largest number of repetitions.
const REPEATS: [usize; 2] = [3, 25];
/// Rounds of choosing runs that may be on the frontier. Times measured alone change little after
/// the first round.
const ROUNDS: usize = 4;
/// Runs may be on the frontier if they took less than this times the time of the fastest run of
/// their accuracy.
const NEAR: f64 = 1.5;

/// The largest outcome that is kept in memory, in numbers: 64 MB.
const KEPT_NUMBERS: usize = 1 << 23;

/// The moment after which no run starts, and running ones are stopped.
#[derive(Clone, Copy)]
struct Deadline(Option<Instant>);

impl Deadline {
    /// The deadline of a budget that starts now.
    fn after(budget: Option<Duration>) -> Self {
        Self(budget.map(|budget| Instant::now() + budget))
    }

    fn is_over(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }
}

/// Runs variants of one deck.
pub(in crate::study) struct Pool<'a, 'o> {
    original: Original<'a>,
    sampler: &'a Sampler,
    options: StudyOptions<'o>,
    patience: fn(&Variant) -> Patience,
    deadline: Deadline,
    done: usize,
    expected: usize,
    /// All outputs of the last runs, by their settings; `None` where they are not kept
    outcomes: Option<HashMap<String, Outcome>>,
}

impl<'a, 'o> Pool<'a, 'o> {
    /// A pool without runs.
    pub fn new(original: Original<'a>, sampler: &'a Sampler, options: StudyOptions<'o>) -> Self {
        let deadline = Deadline::after(options.budget);
        Self {
            original,
            sampler,
            options,
            patience: |_| Patience::LONG,
            deadline,
            done: 0,
            expected: 0,
            outcomes: None,
        }
    }

    /// Sets the limit of attempts of each variant.
    pub fn with_patience(self, patience: fn(&Variant) -> Patience) -> Self {
        Self { patience, ..self }
    }

    /// Keeps all outputs of the last runs, with strains along beams.
    pub fn with_outcomes(self) -> Self {
        Self { outcomes: Some(HashMap::new()), ..self }
    }

    /// Forgets the outputs of other variants than these.
    pub fn forget_all_but(&mut self, variants: &[Variant]) {
        let keys: Vec<String> = variants.iter().map(|variant| self.key(variant)).collect();
        self.outcomes.iter_mut().for_each(|outcomes| outcomes.retain(|key, _| keys.contains(key)));
    }

    /// All outputs of a variant, if it was among the last runs.
    pub fn take_outcome(&mut self, variant: &Variant) -> Option<Outcome> {
        let key = self.key(variant);
        self.outcomes.as_mut()?.remove(&key)
    }

    /// CPU seconds of a variant that has run; NaN for others.
    pub fn seconds(&self, variant: &Variant) -> f64 {
        self.options.journal.find(&self.key(variant)).map_or(f64::NAN, |trial| trial.seconds.cpu)
    }

    /// Strains of a variant, from another run of it; `None` where it does not finish.
    pub fn strains(&self, variant: &Variant) -> Result<Option<StrainRecord>, StudyError> {
        let changes = variant.changes(self.original);
        let signals = self.options.interrupted;
        let patience = (self.patience)(variant);
        let (_, outcome) =
            trial::run(self.original.deck, &changes, self.sampler, patience, Kept::OutputsAndStrains, &signals);
        match signals() {
            Some(signal) => Err(StudyError::Failure(interrupted(signal))),
            None => Ok(outcome.filter(|outcome| outcome.ended.is_ok()).and_then(|outcome| outcome.strains)),
        }
    }

    /// True if no run starts any more.
    pub fn is_over(&self) -> bool {
        self.deadline.is_over()
    }

    fn key(&self, variant: &Variant) -> String {
        key(&variant.changes(self.original))
    }

    /// Adds runs to the expected number, which progress shows.
    pub fn expect(&mut self, count: usize) {
        self.expected += count;
        (self.options.progress)(self.done, self.expected);
    }

    /// Runs variants that the study needs; those that the budget skips are `interrupted`.
    pub fn run_needed(&mut self, variants: &[Variant]) -> Result<Vec<Trial>, StudyError> {
        let lost = || Trial::ended(FailureKind::Interrupted.name());
        Ok(self.run(variants)?.into_iter().map(|trial| trial.unwrap_or_else(lost)).collect())
    }

    /// Runs variants in parallel; `None` for those that the budget skips.
    pub fn run(&mut self, variants: &[Variant]) -> Result<Vec<Option<Trial>>, StudyError> {
        let changes: Vec<Vec<Change>> = variants.iter().map(|variant| variant.changes(self.original)).collect();
        let keys: Vec<String> = changes.iter().map(|changes| key(changes)).collect();
        let mut trials: Vec<Option<Trial>> = keys.iter().map(|key| self.options.journal.find(key)).collect();
        let mut open: Vec<usize> = (0..variants.len()).filter(|&k| trials[k].is_none()).collect();
        // The queue is emptied from its end: long runs first, but short ones first within a budget.
        sort_by(&mut open, |&a, &b| variants[b].work().total_cmp(&variants[a].work()));
        if self.deadline.0.is_none() {
            open.reverse();
        }
        self.done += variants.len() - open.len();
        let deck = self.original.deck;
        let sampler = self.sampler;
        let patience = self.patience;
        let deadline = self.deadline;
        let signals = self.options.interrupted;
        let stopped = || signals().or_else(|| deadline.is_over().then_some(0));
        let keeps = self.outcomes.is_some();
        let kept = if keeps { Kept::OutputsAndStrains } else { Kept::Outputs };
        let run = |k: usize| {
            let (trial, outcome) = trial::run(deck, &changes[k], sampler, patience(&variants[k]), kept, &stopped);
            let outcome = outcome.filter(|outcome| keeps && trial.finished() && outcome.size() < KEPT_NUMBERS);
            (!trial.failed_as(FailureKind::Interrupted)).then_some((trial, outcome))
        };
        let broken = |_| (Trial::ended("broke off"), None);
        in_parallel(self.options.threads, open, &|| stopped().is_some(), &run, &broken, |k, (trial, outcome)| {
            self.done += 1;
            if let (Some(outcomes), Some(outcome)) = (&mut self.outcomes, outcome) {
                outcomes.insert(keys[k].clone(), outcome);
            }
            (self.options.progress)(self.done, self.expected);
            self.options.journal.keep(&keys[k], &trial);
            trials[k] = Some(trial);
        });
        match signals() {
            Some(signal) => Err(StudyError::Failure(interrupted(signal))),
            None => Ok(trials),
        }
    }

    /// The failure of the deck itself, for a variant that ended as `singular`: a mechanism is one
    /// on every mesh, and the message should name a node of the deck.
    pub fn own_failure(&self) -> Option<Failure> {
        let deck = self.original.deck;
        let outcome = trial::simulate(deck, &[], self.sampler, Patience::LONG, &self.options.interrupted);
        outcome.ok()?.ended.err()
    }

    /// Times the runs that are, or may be, on the frontier: one at a time and in turns.
    pub fn time_alone(&mut self, runs: &mut [CostRun], resolution: f64) -> Result<(), StudyError> {
        for _ in 0..ROUNDS {
            let near = frontier::near(runs, resolution, NEAR);
            let chosen: Vec<usize> = near.into_iter().filter(|&k| runs[k].timing.alone == 0).collect();
            if chosen.is_empty() || self.deadline.is_over() {
                break;
            }
            self.time(runs, &chosen)?;
        }
        Ok(())
    }

    fn time(&mut self, runs: &mut [CostRun], chosen: &[usize]) -> Result<(), StudyError> {
        let deck = self.original.deck;
        let mut times: Vec<Vec<Seconds>> = vec![Vec::new(); chosen.len()];
        self.expected += chosen.len();
        for round in 0..REPEATS[1] {
            for (&k, times) in chosen.iter().zip(&mut times) {
                let spent: f64 = times.iter().map(|t| t.wall).sum();
                if self.deadline.is_over() || (round >= REPEATS[0] && spent > TIMED_SECONDS) {
                    continue;
                }
                let signals = self.options.interrupted;
                let (trial, _) =
                    trial::run(deck, &runs[k].changes, self.sampler, Patience::LONG, Kept::Outputs, &signals);
                if let Some(signal) = (self.options.interrupted)() {
                    return Err(StudyError::Failure(interrupted(signal)));
                }
                times.push(trial.seconds);
                if round == 0 {
                    self.done += 1;
                    (self.options.progress)(self.done, self.expected);
                }
            }
        }
        for (&k, times) in chosen.iter().zip(&times).filter(|(_, times)| !times.is_empty()) {
            runs[k].timing = Timing::of(times);
        }
        Ok(())
    }
}

/// The text under which a run is known: the settings that make it.
fn key(changes: &[Change]) -> String {
    changes.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

impl Timing {
    fn of(times: &[Seconds]) -> Self {
        let sorted = |pick: fn(&Seconds) -> f64| {
            let mut all: Vec<f64> = times.iter().map(pick).collect();
            sort_numbers(&mut all);
            all
        };
        let cpu = sorted(|t| t.cpu);
        let wall = sorted(|t| t.wall);
        let median = |all: &[f64]| all[all.len() / 2];
        let spread = (cpu[cpu.len() - 1] - cpu[0]) / median(&cpu);
        Self { seconds: Seconds { cpu: median(&cpu), wall: median(&wall) }, spread, alone: times.len() }
    }
}

fn interrupted(signal: i32) -> Failure {
    Failure::Interrupted { at: Moment { stage: 0, time: 0.0, load: 0.0 }, signal }
}
