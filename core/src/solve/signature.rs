//! Signs of the eigenvalues of a tangent: for a symmetric one the number of negative eigenvalues,
//! for any the sign of its determinant.

use super::linear::LinearSolver;
use super::pivots::{Pivots, unsymmetric_column};
use super::tangent::Tangent;
use crate::system::System;
use serde::{Deserialize, Serialize};

/// Signs of the eigenvalues of a tangent on the space that satisfies the constraints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum Signature {
    /// Number of negative eigenvalues of a symmetric tangent
    Negative(usize),
    /// Parity of the number of negative real eigenvalues of an unsymmetric tangent, the sign of its
    /// determinant
    Parity {
        /// True if the number is odd
        is_odd: bool,
    },
}

impl Signature {
    /// Number of negative eigenvalues, if it is known.
    pub fn negative(self) -> Option<usize> {
        match self {
            Self::Negative(count) => Some(count),
            Self::Parity { .. } => None,
        }
    }

    /// True if the number of negative real eigenvalues is odd, so that there is at least one.
    pub fn is_odd(self) -> bool {
        match self {
            Self::Negative(count) => count % 2 == 1,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// True if at least one eigenvalue is certainly real and negative.
    pub fn tells_unstable(self) -> bool {
        match self {
            Self::Negative(count) => count > 0,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// Least number of eigenvalues that change their sign from this tangent to another.
    pub fn changes_to(self, other: Self) -> usize {
        match (self, other) {
            (Self::Negative(before), Self::Negative(after)) => before.abs_diff(after),
            (Self::Negative(_) | Self::Parity { .. }, Self::Parity { .. })
            | (Self::Parity { .. }, Self::Negative(_)) => usize::from(self.is_odd() != other.is_odd()),
        }
    }
}

impl LinearSolver {
    /// Number of negative eigenvalues of a tangent, or the sign of its determinant, see
    /// [`LinearSolver::negative_pivots`]. `None` if the factorisation fails.
    pub fn signature(&mut self, tangent: &mut Tangent) -> Option<Signature> {
        if let Some(negative) = self.negative_pivots(tangent) {
            return Some(Signature::Negative(negative));
        }
        let done = self.factorise_by_own(tangent);
        let is_odd = self.has_negative_determinant().filter(|_| done)?;
        Some(Signature::Parity { is_odd })
    }

    /// Signature of the tangent of a system that stays, factorised last; see
    /// [`LinearSolver::signature`].
    pub fn signature_of_last(&mut self, system: &System) -> Option<Signature> {
        let negative = if self.is_symmetric() { self.negative_of_last() } else { self.negative_beside(system) };
        let parity = || self.has_negative_determinant().map(|is_odd| Signature::Parity { is_odd });
        negative.map(Signature::Negative).or_else(parity)
    }

    /// Number of negative eigenvalues of the tangent on the space that satisfies the constraints;
    /// `None` if it is unsymmetric, or the factorisation fails. If this solver's own factorisation
    /// tells it, the tangent is factorised by it and may be overwritten.
    pub fn negative_pivots(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.is_symmetric() {
            return self.negative_of_own(tangent);
        }
        self.negative_beside(tangent.look())
    }

    /// Number of negative eigenvalues of the tangent of a system, by a separate factorisation that
    /// leaves this solver's last one unchanged. `None` if the tangent is unsymmetric, or the
    /// factorisation fails.
    pub(super) fn negative_beside(&mut self, system: &System) -> Option<usize> {
        if let Some(column) = unsymmetric_column(&system.pattern, &system.values, self.unsymmetric_column) {
            self.unsymmetric_column = column;
            return None;
        }
        if self.pivots.is_none() {
            self.pivots = Pivots::beside(self.blocks(), self.constraints().cloned(), system);
        }
        self.pivots.as_mut()?.negative(system)
    }
}
