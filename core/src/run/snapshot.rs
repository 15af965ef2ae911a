//! A converged state as an observer sees it, with the work that it took.

use super::energy::Ledger;
use super::failure::Moment;
use super::findings::Findings;
use crate::effect::ForceJump;
use crate::model::Model;
use crate::solve::Work;
use crate::system::{State, System};
use serde::{Deserialize, Deserializer, Serialize};

/// A converged state as an observer sees it.
pub struct Snapshot<'a> {
    /// Stage, from 1
    pub stage: usize,
    /// The state
    pub state: &'a State,
    /// The state about which the stage is linear; `None` in other stages
    pub origin: Option<&'a State>,
    /// Its forces
    pub system: &'a System,
    /// The scene
    pub model: &'a Model,
    /// The energy account, where it is kept
    pub ledger: Ledger,
    /// Work so far
    pub counters: &'a Counters,
}

impl Snapshot<'_> {
    /// When it is.
    pub fn moment(&self) -> Moment {
        Moment { stage: self.stage, time: self.state.time, load: self.state.load }
    }
}

/// Work done in a run, and what it found out.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Counters {
    /// Converged levels and time steps
    pub steps: u64,
    /// Attempts that were taken back: a level or step whose Newton failed, or whose error was too
    /// large
    pub cutbacks: u64,
    /// Mixed elements, summed over converged states
    pub mixed_elements: u64,
    /// What has jumped within time steps, where cables became slack or taut
    pub jump: Option<ForceJump>,
    /// Augmentations and changes of contacts
    pub contacts: ContactCounters,
    /// Events, stability, warnings
    pub findings: Findings,
    /// Iterations, factorisations, chart switches, seconds
    pub work: Work,
    /// Evaluations of instances by effect
    #[serde(deserialize_with = "counted_names")]
    pub evaluations: Vec<(&'static str, u64)>,
    /// The linear solvers that were used
    #[serde(deserialize_with = "names")]
    pub linear_solvers: Vec<&'static str>,
}

/// Work that contacts made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct ContactCounters {
    /// Augmentations of multipliers in load levels
    pub augmentations: u64,
    /// Levels that were tried again with a softer contact
    pub softenings: u64,
    /// Levels and steps in which contacts have come or gone, or begun to slide or to stick
    pub changes: u64,
    /// Levels that were tried again with a stiffer contact, since beams would have crossed
    pub stiffenings: u64,
    /// Lists of beam elements near each other for which the tangent was set up anew
    pub lists: u64,
}

/// Names of a checkpoint, which live as long as the program: a handful each time a run is resumed.
fn names<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<&'static str>, D::Error> {
    let names: Vec<String> = Vec::deserialize(from)?;
    Ok(names.into_iter().map(|name| &*name.leak()).collect())
}

/// Names with counts, see [`names`].
fn counted_names<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<(&'static str, u64)>, D::Error> {
    let counted: Vec<(String, u64)> = Vec::deserialize(from)?;
    Ok(counted.into_iter().map(|(name, count)| (&*name.leak(), count)).collect())
}
