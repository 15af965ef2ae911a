//! Negative pivots of symmetric tangents, counted by L D L^T without pivoting (Sylvester's law of
//! inertia).

use super::block::BlockSolver;
use super::constraints::Constraints;
use crate::system::{Pattern, Slot, Symmetry, System};

/// A factorisation L D L^T for counting negative pivots, beside a solver whose own factorisation
/// does not tell them.
pub(super) struct Pivots {
    blocks: BlockSolver,
    constraints: Option<Constraints>,
}

/// Largest difference of mirrored entries of a symmetric tangent, relative to the roots of the two
/// diagonal entries in their row and column, so that stiff directions do not hide soft ones.
const SYMMETRY_TOLERANCE: f64 = 1e-9;

impl Pivots {
    /// Factorisation for tangents of the pattern of a system, in the order of elimination of the
    /// block `solver`, if there is one. `None` if memory is not available.
    pub fn beside(solver: Option<&BlockSolver>, multipliers: &[Slot], system: &System) -> Option<Self> {
        let constraints = Constraints::new(&system.pattern, multipliers);
        let late = constraints.as_ref().map_or(&[][..], Constraints::node_blocks);
        let blocks = match solver {
            Some(blocks) => blocks.symmetric_beside(&system.pattern)?,
            None => BlockSolver::symmetric(&system.pattern, late)?,
        };
        Some(Self { blocks, constraints })
    }

    /// Number of negative eigenvalues on the space that satisfies the constraints; `None` if the
    /// factorisation fails.
    pub fn negative(&mut self, system: &System) -> Option<usize> {
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

/// True if each entry equals its mirror image. Tiles stored only once count as symmetric.
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
                let c = k / width;
                let r = k % width;
                let difference = entry(tile, r, c) - entry(mirror, c, r);
                difference.abs() <= SYMMETRY_TOLERANCE * roots[column][c] * roots[row][r]
            }),
            // Every off-diagonal tile has a mirrored one.
            (None, _) | (_, None) => false,
        })
    })
}
