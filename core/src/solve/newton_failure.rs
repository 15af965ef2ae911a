//! Failures of Newton's iteration and of the step around it.

use super::convergence::Residual;
use super::softest::NullVector;
use crate::interrupt;
use crate::model::{Assembly, TooFar};
use crate::system::State;

/// Reason why a step or level has no solution.
#[derive(Clone, Debug, PartialEq)]
pub enum NewtonFailure {
    /// The iteration has reached its limit, or corrections diverge.
    NotConverged {
        /// Largest residual of the last iterate
        residual: Residual,
        /// Largest residual of each iterate, relative to its tolerance
        history: Vec<f64>,
    },
    /// A prescribed rotation is too large for one increment.
    TurnsTooFar {
        /// Slot of the rotation
        slot: usize,
        /// Angle of the increment in rad
        angle: f64,
    },
    /// A prescribed rotation turns a surface too far for the contacts at it in one increment.
    SurfaceTurnsTooFar {
        /// Its name
        surface: String,
        /// Angle of the increment in rad
        angle: f64,
    },
    /// Neighbouring nodes rotate by more than pi relative to each other in one increment.
    LeapsTooFar {
        /// Index of the element
        element: usize,
        /// Relative rotation of its nodes in rad
        angle: f64,
    },
    /// The error of the smallest time step exceeds its tolerance.
    StepTooSmall {
        /// Slot of the largest error
        slot: usize,
        /// Error relative to the length of the scene, or in radians
        error: f64,
        /// Tolerance of the error, in the same unit
        share: f64,
    },
    /// The tangent is singular, with the null vector if it was found.
    Singular(Option<NullVector>),
    /// A contact penetrates too deeply after the largest number of augmentations.
    Penetrates {
        /// Slot of a node at the contact
        slot: usize,
        /// Depth of the penetration
        depth: f64,
    },
    /// A node may have passed through a surface.
    Passes {
        /// Slot of the node
        slot: usize,
    },
    /// A node has slid beyond the end of a beam.
    Leaves {
        /// Slot of the node
        slot: usize,
    },
    /// A force is not finite.
    NotFinite {
        /// Effect that computed the force; `None` if only a sum overflows
        effect: Option<&'static str>,
        /// Slot of the force
        slot: usize,
    },
    /// Asked to stop by a signal, by its number
    Interrupted(i32),
}

impl NewtonFailure {
    /// `Err` if work is asked to stop.
    pub fn unless_interrupted() -> Result<(), Self> {
        interrupt::requested().map_or(Ok(()), |signal| Err(Self::Interrupted(signal)))
    }

    /// Failure by a force that is not finite, with the effect that computed it. A sum that
    /// overflows belongs to no single effect.
    pub fn not_finite(assembly: &mut Assembly, state: &State) -> Self {
        match assembly.culprit(state) {
            Some((effect, slot)) => Self::NotFinite { effect: Some(effect), slot },
            None => Self::NotFinite { effect: None, slot: 0 },
        }
    }
}

impl From<TooFar> for NewtonFailure {
    fn from(too_far: TooFar) -> Self {
        match too_far {
            TooFar::Node(slot, angle) => Self::TurnsTooFar { slot: slot as usize, angle },
            TooFar::Surface(surface, angle) => Self::SurfaceTurnsTooFar { surface, angle },
        }
    }
}
