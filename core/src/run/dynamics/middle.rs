//! The middle of time steps, where that is a stage.

use crate::integrate::{Predictor, Scheme, Stages};
use crate::model::Model;
use crate::system::State;

/// The middle of steps.
pub(super) struct Middle {
    /// The state in the middle of the last step, in the charts of the step
    pub(super) state: State,
    pub(super) predictor: Predictor,
}

impl Middle {
    /// The middle of the steps of a scheme, if that is a stage.
    pub fn of(scheme: Scheme, model: &Model, state: &State) -> Option<Box<Self>> {
        match scheme.stages {
            Stages::End => None,
            Stages::MiddleAndEnd => Some(Box::new(Self { state: state.kept(), predictor: Predictor::new(model) })),
        }
    }
}
