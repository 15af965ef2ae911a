//! Findings of a run beside its rows: points on the way, the stability of ends, warnings.

use super::failure::Moment;
use super::results::Event;
use crate::integrate::Largest;
use crate::warning::{About, WarningKind};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A warning about a deck or a run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Warning {
    /// Its kind, which has a name
    pub kind: WarningKind,
    /// When it was given; `None`: before the run
    pub at: Option<Moment>,
    /// The words for the user
    pub message: String,
}

impl Warning {
    /// True if it puts an answer in doubt.
    pub fn is_doubt(&self) -> bool {
        self.kind.about() != About::Deck
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "warning[{}]: {}", self.kind.name(), self.message)
    }
}

/// The stability of an equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum StabilityVerdict {
    /// No small motion leads away from it.
    Stable,
    /// Some small motion does.
    Unstable,
    /// It was not found out.
    Unknown,
}

impl StabilityVerdict {
    /// Its name in run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
            Self::Unknown => "unknown",
        }
    }
}

/// The stability of the equilibrium in which a static stage ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct StageStability {
    /// Stage, from 1
    pub stage: usize,
    /// The verdict
    pub verdict: StabilityVerdict,
    /// The number of negative pivots of the tangent in space, where it is known
    pub negative: Option<usize>,
}

impl StageStability {
    /// As the numbers of negative pivots tell: those of the stage as it is treated, and for one in
    /// a plane those `aside` of it.
    pub(super) fn of_pivots(stage: usize, treated: Option<usize>, aside: Option<usize>) -> Self {
        let negative = treated.zip(aside).map(|(treated, aside)| treated + aside);
        let verdict = match negative.or(treated.filter(|&treated| treated > 0)) {
            None => StabilityVerdict::Unknown,
            Some(0) => StabilityVerdict::Stable,
            Some(_) => StabilityVerdict::Unstable,
        };
        Self { stage, verdict, negative }
    }
}

/// The estimated errors of the fixed time steps of a dynamic stage.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct StageTimeError {
    /// Stage, from 1
    pub stage: usize,
    /// The largest errors, and the largest motion since the stage began
    pub largest: Largest,
}

/// Findings of a run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Findings {
    /// Limit, turning and branch points of static paths
    pub events: Vec<Event>,
    /// The stability of each static stage that came to its end
    pub stability: Vec<StageStability>,
    /// The errors of each dynamic stage of fixed steps, as far as it came
    pub time_errors: Vec<StageTimeError>,
    /// In the order in which they were given
    pub warnings: Vec<Warning>,
}
