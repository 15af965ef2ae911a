//! What the signs of pivots tell: of a symmetric tangent, how many directions have lost their stiffness; of any, the sign of its
//! determinant.

use super::block::BlockSolver;
use super::constraints::Constraints;
use super::linear::LinearSolver;
use super::tangent::Tangent;
use crate::system::{Pattern, Symmetry, System};

/// L D L^T without pivoting, whose D tells the inertia (Sylvester), for a solver whose own factorisation does not.
pub(super) struct Pivots {
    blocks: BlockSolver,
    constraints: Option<Constraints>,
}

/// A tangent whose entries differ from their mirror images by more than this is not symmetric: relative to the roots of the
/// diagonal entries that they stand between, so that stiff directions do not hide soft ones.
const SYMMETRY: f64 = 1e-9;

/// What is known of the signs of the eigenvalues of a tangent, on the space that constraints leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signature {
    /// It is symmetric, and so many are negative.
    Negative(usize),
    /// It is not symmetric, and the number of those that are real and negative is odd, or even: the sign of the determinant.
    Parity {
        /// Whether it is odd
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

    /// Whether an odd number of eigenvalues is real and negative: then one of them is.
    pub fn is_odd(self) -> bool {
        match self {
            Self::Negative(count) => count % 2 == 1,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// Whether at least one eigenvalue is real and negative for sure.
    pub fn tells_unstable(self) -> bool {
        match self {
            Self::Negative(count) => count > 0,
            Self::Parity { is_odd } => is_odd,
        }
    }

    /// Of how many eigenvalues the sign has changed at least, from this tangent to another.
    pub fn changes_to(self, other: Self) -> usize {
        match (self, other) {
            (Self::Negative(before), Self::Negative(after)) => before.abs_diff(after),
            (Self::Negative(_) | Self::Parity { .. }, Self::Parity { .. })
            | (Self::Parity { .. }, Self::Negative(_)) => usize::from(self.is_odd() != other.is_odd()),
        }
    }
}

impl LinearSolver {
    /// The number of negative eigenvalues of a tangent or the sign of its determinant, see [`LinearSolver::negative_pivots`].
    pub fn signature(&mut self, tangent: &mut Tangent) -> Option<Signature> {
        if let Some(negative) = self.negative_pivots(tangent) {
            return Some(Signature::Negative(negative));
        }
        let done = self.factorise_by_own(tangent);
        let is_odd = self.has_negative_determinant().filter(|_| done)?;
        Some(Signature::Parity { is_odd })
    }

    /// How many eigenvalues of the tangent are negative on the space that constraints leave; `None` where it is not symmetric, or a
    /// pivot is lost. Where this solver's own factorisation tells, the tangent is what it has factorised last,
    /// and may be used up by that.
    pub fn negative_pivots(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.is_symmetric() {
            return self.negative_of_own(tangent);
        }
        self.negative_beside(tangent.look())
    }

    /// The same of a system that this solver need not have factorised; its own last factorisation stays.
    pub(super) fn negative_beside(&mut self, system: &System) -> Option<usize> {
        if !is_symmetric(&system.pattern, &system.values) {
            return None;
        }
        if self.pivots.is_none() {
            self.pivots = Pivots::beside(self, system);
        }
        self.pivots.as_mut()?.negative(system)
    }
}

impl Pivots {
    /// Its order of elimination serves for both where the solver has one. `None` where memory cannot be had.
    fn beside(solver: &LinearSolver, system: &System) -> Option<Self> {
        let constraints = Constraints::new(&system.pattern, &solver.multipliers);
        let late = constraints.as_ref().map_or(&[][..], Constraints::node_blocks);
        let blocks = match solver.blocks() {
            Some(blocks) => blocks.symmetric_beside(&system.pattern)?,
            None => BlockSolver::symmetric(&system.pattern, late)?,
        };
        Some(Self { blocks, constraints })
    }

    fn negative(&mut self, system: &System) -> Option<usize> {
        let done = match &mut self.constraints {
            Some(constraints) => {
                constraints.take(system);
                self.blocks.factorise(constraints.matrix(&system.pattern))
            }
            None => self.blocks.factorise(system.matrix()),
        };
        let of_multipliers = self.constraints.as_ref().map_or(0, Constraints::count);
        self.blocks.negative().filter(|_| done)?.checked_sub(of_multipliers)
    }
}

/// Whether each entry is what its mirror image is. Of tiles of which one is kept nothing is to be told.
pub fn is_symmetric(pattern: &Pattern, values: &[f64]) -> bool {
    if pattern.symmetry == Symmetry::Whole {
        return true;
    }
    let width = pattern.width();
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let entry = |tile: usize, r: usize, c: usize| values[pattern.storage.entry(tile, r, c)];
    let root = |k: usize| match pattern.tile(k / width, k / width).map_or(0.0, |tile| entry(tile, k % width, k % width))
    {
        0.0 => largest.sqrt(),
        diagonal => diagonal.abs().sqrt(),
    };
    let roots: Vec<f64> = (0..width * pattern.node_blocks.count()).map(root).collect();
    let roots: Vec<&[f64]> = roots.chunks_exact(width).collect();
    (0..pattern.node_blocks.count()).all(|column| {
        let beside = pattern.rows_of(column).iter().map(|&row| row as usize);
        let beside = beside.filter(|&row| row > column && !pattern.symmetry.halves());
        let rows = std::iter::once(column).chain(beside);
        let mut pairs = rows.map(|row| (row, pattern.tile(row, column), pattern.tile(column, row)));
        pairs.all(|(row, tile, mirror)| match (tile, mirror) {
            (Some(tile), Some(mirror)) => (0..width * width).all(|k| {
                let (c, r) = (k / width, k % width);
                let difference = entry(tile, r, c) - entry(mirror, c, r);
                difference.abs() <= SYMMETRY * roots[column][c] * roots[row][r]
            }),
            // Whom a node meets meets it.
            _ => false,
        })
    })
}
