//! Time integration as coefficients: the changes of velocities and accelerations with a correction
//! of the unknowns, and the weights of stiffness, damping and mass in the tangent.

mod alpha;
mod carried_error;
mod increments;
mod lobatto;
mod predictor;
mod time_error;

pub use alpha::{Rotations, Scheme, Stages, Step};
pub use increments::{Accelerations, AtLag, Increments};
pub use lobatto::{Lobatto, MIDDLE, Stage};
pub use predictor::Predictor;
pub use time_error::{Largest, StepEnds, TimeError};

use crate::kernel::Weights;
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;

/// The interface of a step to Newton's method.
pub trait Method {
    /// The weights of stiffness, damping and mass in the tangent of the step.
    fn weights(&self) -> Weights;

    /// Adds a correction of the unknowns, and the changes of their rates that follow from it.
    fn correct(&self, state: &mut State, dq: &[Vec3]);

    /// True if nodes change their charts during the iteration; otherwise they do between steps.
    fn changes_charts(&self) -> bool {
        false
    }
}

/// Statics: a correction changes the unknowns alone.
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
