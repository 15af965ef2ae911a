//! The stress that the next tangent is formed with (the mixed-integration-point method): foreseen from the state before a correction, where
//! it turns out that a tangent is formed at all.

use crate::kernel::seam::Conversion;
use crate::model::Assembly;
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;

/// What stress is foreseen from.
#[derive(Default)]
pub(super) struct Foresight {
    q: Vec<Vec3>,
    mixed: Vec<Conversion>,
    is_pending: bool,
}

impl Foresight {
    /// The next tangent is that of the state itself.
    pub fn forget(&mut self, assembly: &mut Assembly) {
        assembly.forget();
        self.is_pending = false;
    }

    /// The state is going to be corrected: what stress it leads to is looked at when a tangent is formed with it.
    pub fn remember(&mut self, state: &State) {
        threads::copy(&mut self.q, &state.q);
        self.mixed.clone_from(&state.mixed);
        self.is_pending = true;
    }

    /// A tangent is going to be formed at `state`, which has been corrected by `dq` since.
    pub fn foresee(&mut self, assembly: &mut Assembly, state: &mut State, dq: &[Vec3]) {
        if !std::mem::take(&mut self.is_pending) {
            return;
        }
        self.swap(state);
        assembly.extrapolate(state, dq);
        self.swap(state);
    }

    fn swap(&mut self, state: &mut State) {
        std::mem::swap(&mut self.q, &mut state.q);
        std::mem::swap(&mut self.mixed, &mut state.mixed);
    }
}
