//! A run between two of its rows, as plain data: what it takes to go on from there as if it had
//! never stopped, with the same results to the last bit.
//!
//! A checkpoint contains what changes in a run: state, courses of loads, accounts, counters, and
//! where its stage is. What follows from the plan (effects, patterns, factors) is made again, and
//! the counters are those of before.

use super::dynamics::checkpoint::DynamicsCheckpoint;
use super::earlier_stages::EarlierStages;
use super::energy::Bookkeeper;
use super::issued::IssuedWarnings;
use super::snapshot::Counters;
use super::statics::checkpoint::{ArcLengthCheckpoint, LevelsCheckpoint};
use crate::kernel::Weights;
use crate::model::{Model, Schedule};
use crate::solve::NewtonMemory;
use crate::system::State;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// All of a run that changes.
#[derive(Clone, Deserialize, Serialize)]
pub(super) struct RunState {
    /// The courses of loads and motions
    pub(super) schedule: Schedule,
    pub(super) state: State,
    /// The last converged state
    pub(super) good: State,
    pub(super) counters: Counters,
    pub(super) issued: IssuedWarnings,
    pub(super) bookkeeper: Bookkeeper,
    pub(super) past: EarlierStages,
}

impl RunState {
    /// A run of a scene at its start.
    pub fn new(model: &Model) -> Self {
        let state = model.rest();
        Self {
            schedule: Schedule::new(model),
            good: state.clone(),
            state,
            counters: Counters::default(),
            issued: IssuedWarnings::default(),
            bookkeeper: Bookkeeper::default(),
            past: EarlierStages::default(),
        }
    }
}

/// A run between two rows.
#[derive(Deserialize, Serialize)]
pub struct Checkpoint {
    /// The stage, from 0
    pub(super) number: usize,
    pub(super) run: RunState,
    /// Where the stage is; `None` before its start
    pub(super) stage: Option<StageCheckpoint>,
}

impl Checkpoint {
    /// The stage, from 0.
    pub fn stage(&self) -> usize {
        self.number
    }

    /// The time that the run has come to.
    pub fn time(&self) -> f64 {
        self.run.state.time
    }

    /// The number of steps and levels that lie behind.
    pub fn steps(&self) -> u64 {
        self.run.counters.steps
    }
}

/// A stage between two rows.
#[derive(Deserialize, Serialize)]
pub(super) struct StageCheckpoint {
    /// The stage is treated in the plane of the scene.
    pub(super) is_planar: bool,
    /// Loads act for the first time in it.
    pub(super) fresh: bool,
    /// Round-off takes the stiffness of the softest motion.
    pub(super) soft: bool,
    /// Attempts that earlier stages have taken back
    pub(super) cutbacks_before: u64,
    /// Increments of prescribed directions, see [`StageRun`](super::stage_run::StageRun)
    pub(super) prescribed_increment: Vec<Vec3>,
    /// The numbers of evaluated instances, by effect
    pub(super) evaluations: Vec<u64>,
    pub(super) linear: Option<LinearCheckpoint>,
    pub(super) newton: NewtonMemory,
    pub(super) analysis: AnalysisCheckpoint,
}

/// A linear stage between two rows.
#[derive(Deserialize, Serialize)]
pub(super) struct LinearCheckpoint {
    /// The state of linearisation, with the clock and the loads of the start of the stage
    pub(super) origin: State,
    /// The weights of the tangent that is factorised
    pub(super) factorised: Option<Weights>,
}

/// An analysis between two rows.
#[derive(Deserialize, Serialize)]
pub(super) enum AnalysisCheckpoint {
    Levels(LevelsCheckpoint),
    ArcLength(ArcLengthCheckpoint),
    Dynamics(DynamicsCheckpoint),
}
