//! Runs of a study of cost, and how they are made.

use super::journal::Journal;
use super::sample::Samples;
use super::trial::{Seconds, Trial};
use super::variant::{Original, Variant};
use crate::study::change::Change;
use std::time::Duration;

/// Options of a study.
pub struct StudyOptions<'a> {
    /// Number of simultaneous runs
    pub threads: usize,
    /// Time after which no run starts
    pub budget: Option<Duration>,
    /// The signal that was caught, if there was one
    pub interrupted: &'a (dyn Fn() -> Option<i32> + Sync),
    /// Takes the number of finished runs, and that of all
    pub progress: &'a mut dyn FnMut(usize, usize),
    /// Saves runs as they end, so that a stopped study can continue
    pub journal: &'a mut Journal,
}

/// A run of a study of cost.
pub struct CostRun {
    /// The variant
    pub variant: Variant,
    /// The changes that make the variant of the deck
    pub(super) changes: Vec<Change>,
    /// The result; `None` where the budget skipped the run
    pub trial: Option<Trial>,
    /// The error of each output; NaN where it cannot be compared
    pub errors: Vec<f64>,
    /// The largest of those that count; NaN where the run failed
    pub error: f64,
    /// The time it takes
    pub(crate) timing: Timing,
    /// True if no other run is both faster and at least as accurate
    pub frontier: bool,
    /// The main source of its error, for runs of the frontier
    pub limit: Option<Limit>,
}

/// The time of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// The median times
    pub(crate) seconds: Seconds,
    /// The largest CPU time less the smallest, over the median
    pub(crate) spread: f64,
    /// How often it ran alone; 0 for a run that was timed once, beside others
    pub(crate) alone: usize,
}

/// The main source of the error of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The number of elements, or their order
    Mesh,
    /// The step, or its tolerance
    Step,
    /// The tolerance of Newton's method
    Newton,
}

impl Limit {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Step => "step",
            Self::Newton => "tolerance",
        }
    }
}

impl CostRun {
    /// A run that has not been timed alone.
    pub(super) fn new(original: Original, variant: Variant, trial: Option<Trial>, errors: Errors) -> Self {
        let seconds = trial.as_ref().map_or(Seconds { cpu: f64::NAN, wall: f64::NAN }, |trial| trial.seconds);
        Self {
            changes: variant.changes(original),
            variant,
            trial,
            errors: errors.of_outputs,
            error: errors.worst,
            timing: Timing { seconds, spread: f64::NAN, alone: 0 },
            frontier: false,
            limit: None,
        }
    }

    /// The settings (`KEY=VALUE`) that make the variant.
    pub fn settings(&self) -> Vec<String> {
        self.changes.iter().map(ToString::to_string).collect()
    }

    /// The numbers that are compared, where the run finished.
    pub(super) fn samples(&self) -> Option<&Samples> {
        self.trial.as_ref().filter(|trial| trial.finished()).map(|trial| &trial.samples)
    }
}

/// The errors of a run against the reference.
pub(super) struct Errors {
    /// The error of each output; NaN where it cannot be compared
    pub(super) of_outputs: Vec<f64>,
    /// The largest error of the outputs that count
    pub(super) worst: f64,
}
