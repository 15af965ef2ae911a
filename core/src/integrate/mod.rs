//! Time integration as coefficients: how a correction of the unknowns changes velocities and
//! accelerations, and with which weights stiffness, damping and mass enter the tangent.

mod alpha;
mod carried_error;
mod increments;
mod predictor;
mod time_error;

pub use alpha::{Rotations, Scheme, Step};
pub use increments::Increments;
pub use predictor::Predictor;
pub use time_error::{Largest, TimeError};

use crate::kernel::Weights;
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;

/// What Newton needs to know of a step.
pub trait Method {
    /// The weights of the tangent of a step.
    fn weights(&self) -> Weights;

    /// Adds a correction of the unknowns.
    fn correct(&self, state: &mut State, dq: &[Vec3]);

    /// Whether nodes change their charts while the step is iterated; else between steps.
    fn changes_charts(&self) -> bool {
        false
    }
}

/// Statics: the unknowns alone.
#[derive(Clone, Copy, Debug)]
pub struct Equilibrium;

impl Method for Equilibrium {
    fn weights(&self) -> Weights {
        Weights::STIFFNESS
    }

    fn correct(&self, state: &mut State, dq: &[Vec3]) {
        threads::each_part(&mut state.q, |start, q| q.iter_mut().zip(&dq[start..]).for_each(|(q, &dq)| *q += dq));
    }

    fn changes_charts(&self) -> bool {
        true
    }
}
