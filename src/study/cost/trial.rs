//! One run of a variant.

use super::grid::equal_part;
use super::sample::{Sampler, Samples};
use crate::deck::{Deck, StageBody};
use crate::scene::Scene;
use crate::study::outcome::Outcome;
use crate::study::variant::Variant;
use beamsim_core::run::Failure;
use cpu_time::ThreadTime;
use std::time::Instant;

/// How often a run may try: so many times its steps and levels, and some.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    per_step: f64,
    per_level: f64,
    more: f64,
}

impl Patience {
    /// What takes more attempts than that would not end in any time that a user waits.
    pub const LONG: Self = Self { per_step: 50.0, per_level: 50.0, more: 1000.0 };
    /// Steps that fail cost as much as many that do not, and tell no error: one in forty, halved once each, uses this up.
    pub const SHORT: Self = Self { per_step: 1.05, per_level: 50.0, more: 10.0 };
}

/// Steps of a stage whose steps adapt.
const MOST_ADAPTED: f64 = 1e5;

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// `finished`, or a failure's name
    pub status: String,
    /// What is compared; empty where it failed
    pub samples: Samples,
    /// Converged levels and steps
    pub steps: u64,
    /// Newton iterations
    pub iterations: u64,
    /// Factorisations
    pub factorisations: u64,
    /// What it took
    pub seconds: Seconds,
}

/// What a run took, from the text of the deck to its last row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds {
    /// Of its thread
    pub cpu: f64,
    /// On the wall
    pub wall: f64,
}

impl Trial {
    /// One that did not come to its end.
    pub(super) fn ended(status: &str) -> Self {
        let seconds = Seconds { cpu: f64::NAN, wall: f64::NAN };
        Self { status: status.into(), samples: Vec::new(), steps: 0, iterations: 0, factorisations: 0, seconds }
    }

    /// Whether there is something to compare.
    pub fn finished(&self) -> bool {
        self.status == "finished"
    }
}

/// Runs the deck `text` with settings; beside what came of it all its outputs, where there is such a scene. `interrupted` tells of signals.
pub fn run(
    text: &str,
    settings: &[String],
    sampler: &Sampler,
    patience: Patience,
    interrupted: &dyn Fn() -> Option<i32>,
) -> (Trial, Option<Outcome>) {
    let (cpu, wall) = (ThreadTime::try_now().ok(), Instant::now());
    let outcome = simulate(text, settings, sampler, patience, interrupted);
    let wall = wall.elapsed().as_secs_f64();
    // A system that does not tell the time of threads has that on the wall.
    let cpu = cpu.and_then(|start| start.try_elapsed().ok()).map_or(wall, |time| time.as_secs_f64());
    let seconds = Seconds { cpu, wall };
    let trial = match &outcome {
        Ok(outcome) => {
            let failure = outcome.ended.as_ref().err().map(Failure::name);
            Trial {
                status: failure.unwrap_or("finished").into(),
                samples: if failure.is_none() { sampler.of(outcome) } else { Vec::new() },
                steps: outcome.counters.steps,
                iterations: outcome.counters.work.iterations,
                factorisations: outcome.counters.work.factorisations,
                seconds,
            }
        }
        Err(_) => Trial { seconds, ..Trial::ended("deck") },
    };
    (trial, outcome.ok())
}

/// Whether the deck `text` with settings makes sense and has the outputs that are looked at.
pub fn makes_sense(text: &str, settings: &[String], sampler: &Sampler) -> bool {
    read(text, settings, sampler).is_ok()
}

/// Runs the deck `text` with settings; `Err` where there is no such scene.
pub fn simulate(
    text: &str,
    settings: &[String],
    sampler: &Sampler,
    patience: Patience,
    interrupted: &dyn Fn() -> Option<i32>,
) -> Result<Outcome, String> {
    let (deck, scene) = read(text, settings, sampler)?;
    Ok(Outcome::of(&scene, sampler.recorder(&scene), attempts(&deck, patience), interrupted))
}

fn read(text: &str, settings: &[String], sampler: &Sampler) -> Result<(Deck, Scene), String> {
    let Variant { deck, scene, .. } = Variant::read(text, settings)?;
    // A point of an arc may be a node of some meshes only.
    if !sampler.suits(&scene) {
        return Err("it has other outputs".into());
    }
    Ok((deck, scene))
}

/// How often a run of a deck may try, steps and levels together.
fn attempts(deck: &Deck, patience: Patience) -> u64 {
    let mut start = 0.0;
    let mut most = patience.more;
    for stage in &deck.stages {
        most += if let StageBody::Dynamic { end, step, step_tolerance, .. } = stage.body {
            let count = (end - start) / equal_part(deck, step) + 1.0;
            start = end;
            patience.per_step * if step_tolerance.is_some() { count + MOST_ADAPTED } else { count }
        } else {
            // An analysis without increments has the patience of one level.
            patience.per_level * stage.body.increments().unwrap_or(1) as f64
        };
    }
    most as u64
}
