//! Observers of a run: rows of converged states, results of analyses, warnings, progress.

use super::energy::Ledger;
use super::failure::{Failure, Moment};
use super::findings::{Findings, Warning};
use super::results::StageResult;
use crate::model::Model;
use crate::solve::Work;
use crate::system::{State, System};

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

/// Watches a run. It cannot change it, only end it.
pub trait Observer {
    /// A converged state: the start, a load level, a time step.
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure>;

    /// The result of an analysis in stage number `stage` (from 1), beside its rows.
    fn found(&mut self, _stage: usize, _result: &StageResult) -> Result<(), Failure> {
        Ok(())
    }

    /// Something that is not a failure.
    fn warn(&mut self, _warning: &Warning) {}

    /// How far the run has come, from 0 to 1; called at each attempt. It may end the run.
    fn progress(&mut self, _at: Moment, _done: f64) -> Result<(), Failure> {
        Ok(())
    }
}

/// A function sees the rows.
impl<F: FnMut(&Snapshot) -> Result<(), Failure>> Observer for F {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self(snapshot)
    }
}

/// Work done in a run, and what it found out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counters {
    /// Converged levels and time steps
    pub steps: u64,
    /// Attempts that were taken back: a level or step whose Newton failed, or whose error was too
    /// large
    pub cutbacks: u64,
    /// Mixed elements, summed over converged states
    pub mixed_elements: u64,
    /// Events, stability, warnings
    pub findings: Findings,
    /// Iterations, factorisations, chart switches, seconds
    pub work: Work,
    /// Evaluations of instances by effect
    pub evaluations: Vec<(&'static str, u64)>,
    /// The linear solvers that were used
    pub linear_solvers: Vec<&'static str>,
}
