//! One run of a variant.

use super::sample::{Sampler, Samples};
use super::variant::{Original, Variant, equal_part};
use crate::deck::{Deck, StageBody};
use crate::study::StudyError;
use crate::study::built::BuiltDeck;
use crate::study::change::Change;
use crate::study::outcome::Outcome;
use crate::study::strains::StrainRecord;
use beamsim_core::effect::ForceJump;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::{Failure, Warning};
use beamsim_core::warning::WarningKind;
use cpu_time::ThreadTime;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The limit of attempts of a run: factors of its steps and levels, and a constant.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    per_step: f64,
    per_level: f64,
    more: f64,
}

impl Patience {
    /// A run with more attempts would take longer than any user waits.
    pub const LONG: Self = Self { per_step: 50.0, per_level: 50.0, more: 1000.0 };
    /// For runs that are worth little if many of their steps fail: one in forty, halved once each,
    /// uses this up.
    pub const SHORT: Self = Self { per_step: 1.05, per_level: 50.0, more: 10.0 };
}

/// Additional steps that a stage with adaptive steps may take.
const MOST_ADAPTED: f64 = 1e5;

/// The result of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// `finished`, or a failure's name
    pub status: String,
    /// The numbers that are compared; empty where the run failed
    #[serde(with = "crate::output::json::exact")]
    pub(crate) samples: Samples,
    /// Converged levels and steps
    pub steps: u64,
    /// Newton iterations
    pub iterations: u64,
    /// Factorisations
    pub factorisations: u64,
    /// True if elements do not resolve bending that tension makes decay
    #[serde(default)]
    pub(crate) has_coarse_layers: bool,
    /// What has jumped within steps
    #[serde(default)]
    pub(crate) jump: Option<ForceJump>,
    /// The time it took
    pub(super) seconds: Seconds,
}

/// The time of a run, from the deck to its last row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// CPU seconds of its thread
    pub(crate) cpu: f64,
    /// Wall-clock seconds
    pub(super) wall: f64,
}

impl Trial {
    /// The result of a run that did not finish.
    pub(super) fn ended(status: &str) -> Self {
        let seconds = Seconds { cpu: f64::NAN, wall: f64::NAN };
        Self {
            status: status.into(),
            samples: Vec::new(),
            steps: 0,
            iterations: 0,
            factorisations: 0,
            has_coarse_layers: false,
            jump: None,
            seconds,
        }
    }

    /// True if the run finished: then there are numbers to compare.
    pub fn finished(&self) -> bool {
        self.status == "finished"
    }

    /// True if the run ended with a failure of a kind.
    pub fn failed_as(&self, kind: FailureKind) -> bool {
        FailureKind::of(&self.status) == Some(kind)
    }
}

/// Numbers that a run keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// Outputs
    Outputs,
    /// Outputs, and strains along beams
    OutputsAndStrains,
}

/// Runs a deck with changes. Gives the trial, and all numbers to keep where there is such a scene.
/// `interrupted` gives the signal that was caught.
pub fn run(
    deck: &Deck,
    changes: &[Change],
    sampler: &Sampler,
    patience: Patience,
    kept: Kept,
    interrupted: &dyn Fn() -> Option<i32>,
) -> (Trial, Option<Outcome>) {
    let cpu = ThreadTime::try_now().ok();
    let wall = Instant::now();
    let outcome = simulate_with(deck, changes, sampler, patience, kept, interrupted);
    let wall = wall.elapsed().as_secs_f64();
    // Systems without CPU times of threads have the wall-clock time instead.
    let cpu = cpu.and_then(|start| start.try_elapsed().ok()).map_or(wall, |time| time.as_secs_f64());
    let seconds = Seconds { cpu, wall };
    let trial = match &outcome {
        Ok(outcome) => {
            let failure = outcome.ended.as_ref().err();
            Trial {
                status: failure.map_or("finished", Failure::name).into(),
                samples: if failure.is_none() { sampler.of(outcome) } else { Vec::new() },
                steps: outcome.counters.steps,
                iterations: outcome.counters.work.iterations,
                factorisations: outcome.counters.work.factorisations,
                has_coarse_layers: outcome.counters.findings.warnings.iter().any(is_coarse_layer),
                jump: outcome.counters.jump,
                seconds,
            }
        }
        Err(_) => Trial { seconds, ..Trial::ended("deck") },
    };
    (trial, outcome.ok())
}

fn is_coarse_layer(warning: &Warning) -> bool {
    warning.kind == WarningKind::CoarseLayer
}

/// True if a variant describes a scene that has the compared outputs.
pub fn makes_sense(original: Original, variant: &Variant, sampler: &Sampler) -> bool {
    build(original.deck, &variant.changes(original), sampler).is_ok()
}

/// Runs a deck with changes; `Err` where there is no such scene.
pub fn simulate(
    deck: &Deck,
    changes: &[Change],
    sampler: &Sampler,
    patience: Patience,
    interrupted: &dyn Fn() -> Option<i32>,
) -> Result<Outcome, StudyError> {
    simulate_with(deck, changes, sampler, patience, Kept::Outputs, interrupted)
}

fn simulate_with(
    deck: &Deck,
    changes: &[Change],
    sampler: &Sampler,
    patience: Patience,
    kept: Kept,
    interrupted: &dyn Fn() -> Option<i32>,
) -> Result<Outcome, StudyError> {
    let built = build(deck, changes, sampler)?;
    let strains = match kept {
        Kept::Outputs => None,
        Kept::OutputsAndStrains => StrainRecord::of(&built),
    };
    let BuiltDeck { deck, scene } = &built;
    Ok(Outcome::with_strains(scene, sampler.recorder(scene), strains, attempts(deck, patience), interrupted))
}

fn build(deck: &Deck, changes: &[Change], sampler: &Sampler) -> Result<BuiltDeck, StudyError> {
    let built = BuiltDeck::changed(deck, changes)?;
    // A point of an arc may be a node of some meshes only.
    if !sampler.suits(&built.scene) {
        return Err(StudyError::OtherOutputs);
    }
    Ok(built)
}

/// The limit of attempts of a run, steps and levels together.
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
