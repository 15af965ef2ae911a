//! The stress that the next tangent is formed with (the mixed-integration-point method): foreseen
//! from the state before a correction, where it turns out that a tangent is formed at all.

use crate::model::{Assembly, charts};
use crate::system::State;
use crate::tensor::Vec3;

/// True if there is something that stress can be foreseen from.
#[derive(Default)]
pub(super) struct StressPredictor {
    is_pending: bool,
}

impl StressPredictor {
    /// The next tangent is that of the state itself.
    pub fn forget(&mut self, assembly: &mut Assembly) {
        assembly.forget();
        self.is_pending = false;
    }

    /// The state is going to be corrected: what stress that leads to is looked at when a tangent is
    /// formed with it.
    pub fn remember(&mut self) {
        self.is_pending = true;
    }

    /// A tangent is going to be formed at `state`, which has been corrected by `dq` since, in the
    /// charts that it still has. It goes back and forth, which leaves round-off of what was
    /// corrected: a copy of all unknowns would take as long as all corrections.
    pub fn foresee(&mut self, assembly: &mut Assembly, state: &mut State, dq: &[Vec3]) {
        if !std::mem::take(&mut self.is_pending) || !assembly.foresees() {
            return;
        }
        charts::there_and_back(state, dq, |before| assembly.extrapolate(before, dq));
    }
}
