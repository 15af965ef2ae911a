//! The signs of the eigenvalues of a tangent: of a symmetric one, how many directions have lost
//! their stiffness; of any, the sign of its determinant.

use super::linear::LinearSolver;
use super::pivots::{Pivots, is_symmetric};
use super::tangent::Tangent;
use crate::system::System;

/// The signs of the eigenvalues of a tangent, on the space that constraints leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signature {
    /// It is symmetric, and so many are negative.
    Negative(usize),
    /// It is not symmetric, and the number of those that are real and negative is odd, or even: the
    /// sign of the determinant.
    Parity {
        /// The number is odd.
        is_odd: bool,
    },
}

impl Signature {
    /// The number of negative eigenvalues, where it is known.
    pub fn negative(self) -> Option<usize> {
        match self {
            Self::Negative(count) => Some(count),
            Self::Parity { .. } => None,
        }
    }

    /// True if an odd number of eigenvalues is real and negative: then one of them is.
    pub fn is_odd(self) -> bool {
        match self {
            Self::Negative(count) => count % 2 == 1,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// True if at least one eigenvalue is real and negative for sure.
    pub fn tells_unstable(self) -> bool {
        match self {
            Self::Negative(count) => count > 0,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// The number of eigenvalues whose sign has changed, at least, from this tangent to another.
    pub fn changes_to(self, other: Self) -> usize {
        match (self, other) {
            (Self::Negative(before), Self::Negative(after)) => before.abs_diff(after),
            (Self::Negative(_) | Self::Parity { .. }, Self::Parity { .. })
            | (Self::Parity { .. }, Self::Negative(_)) => usize::from(self.is_odd() != other.is_odd()),
        }
    }
}

impl LinearSolver {
    /// The number of negative eigenvalues of a tangent or the sign of its determinant, see
    /// [`LinearSolver::negative_pivots`].
    pub fn signature(&mut self, tangent: &mut Tangent) -> Option<Signature> {
        if let Some(negative) = self.negative_pivots(tangent) {
            return Some(Signature::Negative(negative));
        }
        let done = self.factorise_by_own(tangent);
        let is_odd = self.has_negative_determinant().filter(|_| done)?;
        Some(Signature::Parity { is_odd })
    }

    /// How many eigenvalues of the tangent are negative on the space that constraints leave; `None`
    /// where it is not symmetric, or a pivot is lost. Where this solver's own factorisation tells,
    /// the tangent is what it has factorised last, and may be used up by that.
    pub fn negative_pivots(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.is_symmetric() {
            return self.negative_of_own(tangent);
        }
        self.negative_beside(tangent.look())
    }

    /// The number of negative eigenvalues of a system that this solver need not have factorised;
    /// its own last factorisation stays.
    pub(super) fn negative_beside(&mut self, system: &System) -> Option<usize> {
        if !is_symmetric(&system.pattern, &system.values) {
            return None;
        }
        if self.pivots.is_none() {
            self.pivots = Pivots::beside(self.blocks(), &self.multipliers, system);
        }
        self.pivots.as_mut()?.negative(system)
    }
}
