//! Interface of block factorisations.

use super::elimination::Elimination;
use crate::system::{Matrix, System};

/// Values of a block factorisation.
pub trait Factor: Send {
    /// Name of the method.
    fn name(&self) -> &'static str;

    /// Factorises a matrix; `false` if a pivot is zero or not finite, or memory is not available.
    fn factorise(&mut self, elimination: &Elimination, matrix: Matrix) -> bool;

    /// See [`super::BlockSolver::can_stay_within`].
    fn can_stay_within(&self, elimination: &Elimination, system: &System) -> bool;

    /// See [`super::BlockSolver::factorise_within`].
    fn factorise_within(&mut self, elimination: &Elimination, system: &mut System) -> bool;

    /// See [`super::BlockSolver::negative`].
    fn negative(&self) -> Option<usize>;

    /// See [`super::BlockSolver::has_negative_determinant`].
    fn has_negative_determinant(&self) -> Option<bool>;

    /// See [`super::BlockSolver::is_sure`].
    fn is_sure(&self) -> bool;

    /// See [`super::BlockSolver::is_symmetric`].
    fn is_symmetric(&self) -> bool;

    /// Solves with the last factorisation, which is that of `matrix`; `x` is in the order of
    /// elimination, a tile width of numbers per row.
    fn solve(&self, elimination: &Elimination, matrix: Matrix, x: &mut [f64]);
}
