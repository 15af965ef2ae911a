//! Negative pivots of symmetric tangents, counted by L D L^T without pivoting (Sylvester's law of
//! inertia).

use super::block::BlockSolver;
use super::constraints::Constraints;
use crate::kernel::WIDTH;
use crate::system::{Pattern, Symmetry, System, Tile};
use std::cell::OnceCell;

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
    pub fn beside(solver: Option<&BlockSolver>, constraints: Option<Constraints>, system: &System) -> Option<Self> {
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
    unsymmetric_column(pattern, values, 0).is_none()
}

/// The first column of tiles with an entry that differs from its mirror image, from column `first`
/// on and then from the beginning. `None` if the tangent is symmetric.
pub(super) fn unsymmetric_column(pattern: &Pattern, values: &[f64], first: usize) -> Option<usize> {
    match pattern.symmetry {
        Symmetry::Whole => None,
        Symmetry::BetweenNodeBlocks | Symmetry::None if pattern.width() == WIDTH => {
            unsymmetric_column_in::<WIDTH>(pattern, values, first)
        }
        Symmetry::BetweenNodeBlocks | Symmetry::None => unsymmetric_column_in::<3>(pattern, values, first),
    }
}

/// See [`unsymmetric_column`], for tiles of the width W.
fn unsymmetric_column_in<const W: usize>(pattern: &Pattern, values: &[f64], first: usize) -> Option<usize> {
    let entry = |tile: usize, r: usize, c: usize| values[pattern.storage.entry(tile, r, c)];
    let largest = OnceCell::new();
    let diagonal = |column: usize, k: usize| pattern.tile(column, column).map_or(0.0, |tile| entry(tile, k, k));
    let root = |column: usize, k: usize| match diagonal(column, k) {
        0.0 => largest.get_or_init(|| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()))).sqrt(),
        diagonal => diagonal.abs().sqrt(),
    };
    let tile_at = |place: usize| -> &Tile<W> { &values[place..].as_chunks::<W>().0.as_chunks::<W>().0[0] };
    let is_unsymmetric = |column: usize| {
        let below = pattern.rows_of(column).iter().map(|&row| row as usize);
        let below = below.filter(|&row| row > column && !pattern.symmetry.halves());
        std::iter::once(column).chain(below).any(|row| {
            let (Some(tile), Some(mirror)) = (pattern.tile(row, column), pattern.tile(column, row)) else {
                // Every off-diagonal tile has a mirrored one.
                return true;
            };
            let [tile, mirror] = [tile, mirror].map(tile_at);
            // Most tiles are symmetric to the last bit.
            if is_mirrored(tile, mirror) {
                return false;
            }
            let mut pairs = (0..W).flat_map(|c| (0..W).map(move |r| (r, c)));
            pairs.any(|(r, c)| {
                let difference = (tile[c][r] - mirror[r][c]).abs();
                let allowed = || SYMMETRY_TOLERANCE * root(column, c) * root(row, r);
                difference.is_nan() || (difference > 0.0 && difference > allowed())
            })
        })
    };
    let count = pattern.node_blocks.count();
    let first = first.min(count);
    (first..count).chain(0..first).find(|&column| is_unsymmetric(column))
}

/// True if a tile equals the transpose of another; NaN equals nothing.
fn is_mirrored<const W: usize>(tile: &Tile<W>, mirror: &Tile<W>) -> bool {
    let mut equal = true;
    for (c, line) in tile.iter().enumerate() {
        for (r, entry) in line.iter().enumerate() {
            equal &= *entry == mirror[r][c];
        }
    }
    equal
}
