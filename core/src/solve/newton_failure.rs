//! The failures of Newton's iteration.

use super::convergence::Residual;
use super::softest::NullVector;
use crate::model::Assembly;
use crate::system::State;

/// Why an iteration did not end in balance.
#[derive(Clone, Debug, PartialEq)]
pub enum NewtonFailure {
    /// Too many iterations, or corrections that run away
    NotConverged {
        /// The worst residual of the last iterate
        residual: Residual,
        /// The largest residual of each iterate, over what is allowed
        history: Vec<f64>,
    },
    /// A prescribed rotation goes too far at once.
    TurnsTooFar {
        /// The slot
        slot: usize,
        /// Radians
        angle: f64,
    },
    /// Neighbouring nodes turn past pi against each other at once.
    LeapsTooFar {
        /// The element
        element: usize,
        /// Their relative rotation, in radians
        angle: f64,
    },
    /// The error of the smallest step is above what it may be.
    StepTooSmall {
        /// The slot
        slot: usize,
        /// Relative to the scene's length, or in radians
        error: f64,
        /// The error that is allowed
        share: f64,
    },
    /// The tangent cannot be solved with.
    Singular(Option<NullVector>),
    /// A force is not finite.
    NotFinite {
        /// The effect that gave it, if one did
        effect: Option<&'static str>,
        /// Where
        slot: usize,
    },
}

impl NewtonFailure {
    /// Names the effect whose forces are not finite; of a sum that overflows nobody alone is to
    /// blame.
    pub fn not_finite(assembly: &mut Assembly, state: &State) -> Self {
        match assembly.culprit(state) {
            Some((effect, slot)) => Self::NotFinite { effect: Some(effect), slot },
            None => Self::NotFinite { effect: None, slot: 0 },
        }
    }
}
