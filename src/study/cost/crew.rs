//! Runs variants, several at a time, and times those that matter alone.

use super::frontier;
use super::grid::Point;
use super::sample::Sampler;
use super::trial::{self, Patience, Seconds, Trial};
use super::{Options, Refusal, Run, Timing};
use crate::deck::Deck;
use crate::study::crowd::side_by_side;
use crate::study::outcome::Outcome;
use beamsim_core::run::{Failure, Moment};
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// A run alone is repeated until it has taken so many seconds in all.
const TIMED: f64 = 0.3;
/// How often it is repeated, at least and at most.
const REPEATS: [usize; 2] = [3, 25];
/// Rounds of choosing runs that may be on the frontier; a run that turns out faster alone changes little after the first.
const ROUNDS: usize = 4;
/// Runs that were slower than the fastest of their accuracy by less than this may be it.
const NEAR: f64 = 1.5;

/// The most numbers of an outcome that is kept, with what a row takes beside its own: 64 MB.
const KEPT: usize = 1 << 23;

/// The moment after which no run is begun, and running ones are given up.
#[derive(Clone, Copy)]
struct Deadline(Option<Instant>);

impl Deadline {
    /// From now on.
    fn after(budget: Option<Duration>) -> Self {
        Self(budget.map(|budget| Instant::now() + budget))
    }

    fn is_over(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }
}

/// What runs variants of one deck.
pub(in crate::study) struct Crew<'a, 'o> {
    text: &'a str,
    deck: &'a Deck,
    sampler: &'a Sampler,
    options: Options<'o>,
    patience: fn(&Point) -> Patience,
    deadline: Deadline,
    done: usize,
    expected: usize,
    /// All outputs of some runs, by their settings; `None` where nobody asks for them
    outcomes: Option<HashMap<String, Outcome>>,
}

impl<'a, 'o> Crew<'a, 'o> {
    pub fn new(text: &'a str, deck: &'a Deck, sampler: &'a Sampler, options: Options<'o>) -> Self {
        let deadline = Deadline::after(options.budget);
        Self {
            text,
            deck,
            sampler,
            options,
            patience: |_| Patience::LONG,
            deadline,
            done: 0,
            expected: 0,
            outcomes: None,
        }
    }

    /// With its patience for each run.
    pub fn with_patience(self, patience: fn(&Point) -> Patience) -> Self {
        Self { patience, ..self }
    }

    /// Keeping all outputs of the last runs.
    pub fn with_outcomes(self) -> Self {
        Self { outcomes: Some(HashMap::new()), ..self }
    }

    /// Forgets the outputs of runs other than these.
    pub fn forget_all_but(&mut self, points: &[Point]) {
        let keys: Vec<String> = points.iter().map(|point| self.key(point)).collect();
        self.outcomes.iter_mut().for_each(|outcomes| outcomes.retain(|key, _| keys.contains(key)));
    }

    /// All outputs of a variant, if it was among the last runs.
    pub fn take_outcome(&mut self, point: &Point) -> Option<Outcome> {
        let key = self.key(point);
        self.outcomes.as_mut()?.remove(&key)
    }

    fn key(&self, point: &Point) -> String {
        point.settings(self.deck, self.text).join(" ")
    }

    /// Tells how many runs there will be, for those who wait.
    pub fn expect(&mut self, count: usize) {
        self.expected += count;
        (self.options.tell)(self.done, self.expected);
    }

    /// Runs what everything else needs: a budget that does not suffice for it leaves trials that were interrupted.
    pub fn run_needed(&mut self, points: &[Point]) -> Result<Vec<Trial>, Refusal> {
        let lost = || Trial::ended("interrupted");
        Ok(self.run(points)?.into_iter().map(|trial| trial.unwrap_or_else(lost)).collect())
    }

    /// Runs variants side by side; `None` for those that the budget left out.
    pub fn run(&mut self, points: &[Point]) -> Result<Vec<Option<Trial>>, Refusal> {
        let settings: Vec<Vec<String>> = points.iter().map(|point| point.settings(self.deck, self.text)).collect();
        let keys: Vec<String> = settings.iter().map(|list| list.join(" ")).collect();
        let mut trials: Vec<Option<Trial>> = keys.iter().map(|key| self.options.journal.find(key)).collect();
        let mut open: Vec<usize> = (0..points.len()).filter(|&k| trials[k].is_none()).collect();
        // The last run to end should be a short one; within a budget, cheap runs are worth more.
        open.sort_by(|&a, &b| points[b].work().total_cmp(&points[a].work()));
        if self.deadline.0.is_none() {
            open.reverse();
        }
        self.done += points.len() - open.len();
        let (text, sampler, patience, deadline) = (self.text, self.sampler, self.patience, self.deadline);
        let signals = self.options.interrupted;
        let stopped = || signals().or_else(|| deadline.is_over().then_some(0));
        let keeps = self.outcomes.is_some();
        let run = |k: usize| {
            let (trial, outcome) = trial::run(text, &settings[k], sampler, patience(&points[k]), &stopped);
            let outcome = outcome.filter(|outcome| keeps && trial.finished() && outcome.size() < KEPT);
            (trial.status != "interrupted").then_some((trial, outcome))
        };
        let broken = |_| (Trial::ended("broke off"), None);
        side_by_side(self.options.threads, open, &|| stopped().is_some(), &run, &broken, |k, (trial, outcome)| {
            self.done += 1;
            if let (Some(outcomes), Some(outcome)) = (&mut self.outcomes, outcome) {
                outcomes.insert(keys[k].clone(), outcome);
            }
            (self.options.tell)(self.done, self.expected);
            self.options.journal.keep(&keys[k], &trial);
            trials[k] = Some(trial);
        });
        match signals() {
            Some(signal) => Err(Refusal::Failure(interrupted(signal))),
            None => Ok(trials),
        }
    }

    /// What the deck itself ends with, where a variant of it ended as `singular`: a mechanism is one on every mesh, and named by
    /// a node of the deck's own.
    pub fn own_failure(&self) -> Option<Failure> {
        let outcome = trial::simulate(self.text, &[], self.sampler, Patience::LONG, &self.options.interrupted);
        outcome.ok()?.ended.err()
    }

    /// Runs those that are, or may be, on the frontier again, one at a time and in turns, for their time.
    pub fn time_alone(&mut self, runs: &mut [Run], least_told: f64) -> Result<(), Refusal> {
        for _ in 0..ROUNDS {
            let near = frontier::near(runs, least_told, NEAR);
            let chosen: Vec<usize> = near.into_iter().filter(|&k| runs[k].timing.alone == 0).collect();
            if chosen.is_empty() || self.deadline.is_over() {
                break;
            }
            self.time(runs, &chosen)?;
        }
        Ok(())
    }

    fn time(&mut self, runs: &mut [Run], chosen: &[usize]) -> Result<(), Refusal> {
        let mut times: Vec<Vec<Seconds>> = vec![Vec::new(); chosen.len()];
        self.expected += chosen.len();
        for round in 0..REPEATS[1] {
            for (&k, times) in chosen.iter().zip(&mut times) {
                let spent: f64 = times.iter().map(|t| t.wall).sum();
                if self.deadline.is_over() || (round >= REPEATS[0] && spent > TIMED) {
                    continue;
                }
                let (trial, _) =
                    trial::run(self.text, &runs[k].settings, self.sampler, Patience::LONG, &self.options.interrupted);
                if let Some(signal) = (self.options.interrupted)() {
                    return Err(Refusal::Failure(interrupted(signal)));
                }
                times.push(trial.seconds);
                if round == 0 {
                    self.done += 1;
                    (self.options.tell)(self.done, self.expected);
                }
            }
        }
        for (&k, times) in chosen.iter().zip(&times).filter(|(_, times)| !times.is_empty()) {
            runs[k].timing = Timing::of(times);
        }
        Ok(())
    }
}

impl Timing {
    fn of(times: &[Seconds]) -> Self {
        let sorted = |pick: fn(&Seconds) -> f64| {
            let mut all: Vec<f64> = times.iter().map(pick).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let (cpu, wall) = (sorted(|t| t.cpu), sorted(|t| t.wall));
        let median = |all: &[f64]| all[all.len() / 2];
        let spread = (cpu[cpu.len() - 1] - cpu[0]) / median(&cpu);
        Self { seconds: Seconds { cpu: median(&cpu), wall: median(&wall) }, spread, alone: times.len() }
    }
}

fn interrupted(signal: i32) -> Failure {
    Failure::Interrupted { at: Moment { stage: 0, time: 0.0, load: 0.0 }, signal }
}
