//! A dynamic stage as part of a checkpoint.

use super::adaptive::Control;
use super::friction_impulses::FrictionImpulses;
use crate::integrate::Predictor;
use crate::run::energy::EnergyGuard;
use crate::run::ringing::Ringing;
use serde::{Deserialize, Serialize};

/// A dynamic stage between two rows.
#[derive(Deserialize, Serialize)]
pub(in crate::run) struct DynamicsCheckpoint {
    /// The length of the last step
    pub(super) last_length: f64,
    pub(super) predictor: Predictor,
    /// The predictor of the middle of steps, where that is a stage
    pub(super) of_middle: Option<Predictor>,
    pub(super) massive: Vec<bool>,
    pub(super) rateless: Vec<usize>,
    pub(super) guard: Option<EnergyGuard>,
    /// The friction of fixed steps
    pub(super) friction: FrictionImpulses,
    /// Columns that depend on accelerations
    pub(super) ringing: Ringing,
    pub(super) steps: StepsCheckpoint,
}

/// Where the steps of a dynamic stage are.
#[derive(Deserialize, Serialize)]
pub(in crate::run) enum StepsCheckpoint {
    /// Fixed steps: the start of the present grid, and the number of its steps that are taken
    Fixed { start: f64, taken: u64 },
    /// Steps that adapt to their local error
    Adaptive(Control),
}
