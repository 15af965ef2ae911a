//! Prediction of the stress that the next tangent is formed with (mixed-integration-point method),
//! from the state before a correction, computed only if a tangent is formed.

use crate::model::{Assembly, charts};
use crate::system::State;
use crate::tensor::Vec3;

/// Prediction of stress for the next tangent.
#[derive(Default)]
pub(super) struct StressPredictor {
    is_pending: bool,
}

impl StressPredictor {
    /// Makes the next tangent use the stress of the state itself.
    pub fn forget(&mut self, assembly: &mut Assembly) {
        assembly.forget();
        self.is_pending = false;
    }

    /// Makes the next tangent use the stress predicted from the state before the coming correction.
    pub fn remember(&mut self) {
        self.is_pending = true;
    }

    /// Predicts the stress, before a tangent is formed at `state`, which has been corrected by `dq`
    /// (by slot, global components) since and has kept its charts. The state is moved back and
    /// forth, which leaves round-off in the correction: copying all unknowns would take as long as
    /// all corrections.
    pub fn foresee(&mut self, assembly: &mut Assembly, state: &mut State, dq: &[Vec3]) {
        if !std::mem::take(&mut self.is_pending) || !assembly.foresees() {
            return;
        }
        charts::there_and_back(state, dq, |before| assembly.extrapolate(before, dq));
    }
}
