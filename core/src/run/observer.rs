//! Observers of a run: rows of converged states, results of analyses, warnings, progress,
//! checkpoints.

use super::checkpoint::Checkpoint;
use super::failure::{Failure, Moment};
use super::findings::Warning;
use super::results::StageResult;
use super::snapshot::Snapshot;

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

    /// True if the run is to show a checkpoint now; asked between rows.
    fn wants_checkpoint(&mut self) -> bool {
        false
    }

    /// What it takes to go on from here, see [`Run::resume`](super::Run::resume).
    fn checkpoint(&mut self, _checkpoint: &Checkpoint) -> Result<(), Failure> {
        Ok(())
    }

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
